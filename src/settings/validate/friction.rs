//! Checks of friction and its feedforward.

use super::Place;
use crate::law::axis::MAX_PREVIEW_TICKS;
use crate::law::feedforward::FeedforwardKind;
use crate::law::friction::stribeck::StaticFriction;
use crate::settings::{AxisSettings, Reason, SettingsError};

/// The largest product of control period and pre-sliding resonance, rad.
const RESOLVED_RESONANCE: f64 = 0.5;

/// The tables' largest error over the breakaway level.
const TABLE_TOLERANCE: f64 = 1e-3;

impl AxisSettings {
    pub(super) fn validate_feedforward(
        &self,
        at: Place,
        period_s: f64,
    ) -> Result<(), SettingsError> {
        let feedforward = &self.feedforward;
        let gains = &feedforward.gains;
        at.within("feedforward.gains.level", gains.level, 0.0, 2.0)?;
        at.within("feedforward.gains.viscous", gains.viscous, 0.0, 2.0)?;
        at.within("feedforward.gains.gms", gains.gms, 0.0, 2.0)?;
        at.within(
            "feedforward.gains.inertia_v_s2_per_mm",
            gains.inertia_v_s2_per_mm,
            0.0,
            1.0,
        )?;
        let longest = MAX_PREVIEW_TICKS as f64 * period_s;
        at.within("feedforward.preview_s", feedforward.preview_s, 0.0, longest)
    }

    pub(super) fn validate_friction(
        &self,
        at: Place,
        period_s: f64,
        room: usize,
    ) -> Result<(), SettingsError> {
        validate_sliding(at, &self.friction.sliding.positive, POSITIVE)?;
        validate_sliding(at, &self.friction.sliding.negative, NEGATIVE)?;
        let gms = &self.friction.gms;
        let count = gms.elements.len() as f64;
        if gms.elements.len() > room {
            return at.refuse(
                "friction.gms.elements",
                count,
                Reason::TooManyElements { room },
            );
        }
        at.within("friction.gms.elements", count, 1.0, room as f64)?;
        let mut weights = 0.0;
        let mut stiffness = 0.0;
        for element in &gms.elements {
            at.within(
                "friction.gms.elements.stiffness_v_per_mm",
                element.stiffness_v_per_mm,
                1e-6,
                1e5,
            )?;
            at.within("friction.gms.elements.weight", element.weight, 0.0, 1.0)?;
            weights += element.weight;
            stiffness += element.stiffness_v_per_mm;
        }
        if libm::fabs(weights - 1.0) > 1e-6 {
            return at.refuse("friction.gms.elements.weight", weights, Reason::WeightsSum);
        }
        self.validate_resolved(
            at,
            "friction.gms.elements.stiffness_v_per_mm",
            stiffness,
            period_s,
        )?;
        at.within("friction.gms.attraction_v_s", gms.attraction_v_s, 0.0, 1e6)?;
        let sliding = &self.friction.sliding;
        let lowest = sliding
            .positive
            .curve
            .coulomb_v
            .min(sliding.negative.curve.coulomb_v);
        let most = lowest / period_s;
        if gms.attraction_v_s > most {
            let reason = Reason::TooFastForRate { most };
            return at.refuse("friction.gms.attraction_v_s", gms.attraction_v_s, reason);
        }
        let width = self.friction.smoothed_gms.width;
        at.within("friction.smoothed_gms.width", width, 1e-3, 1.0)?;
        self.validate_bristles(at, period_s)
    }

    /// The models with a single state.
    fn validate_bristles(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let kind = self.feedforward.kind;
        if let Some(dahl) = &self.friction.dahl {
            let field = "friction.dahl.stiffness_v_per_mm";
            at.within(field, dahl.stiffness_v_per_mm, 1e-6, 1e5)?;
            self.validate_resolved(at, field, dahl.stiffness_v_per_mm, period_s)?;
            at.within("friction.dahl.exponent", dahl.exponent, 1.0, 3.0)?;
        } else if kind == FeedforwardKind::Dahl {
            return at.refuse("friction.dahl", 0.0, Reason::Missing);
        }
        if let Some(lugre) = &self.friction.lugre {
            let field = "friction.lugre.stiffness_v_per_mm";
            at.within(field, lugre.stiffness_v_per_mm, 1e-6, 1e5)?;
            self.validate_resolved(at, field, lugre.stiffness_v_per_mm, period_s)?;
            let damping = lugre.damping_v_s_per_mm;
            at.within("friction.lugre.damping_v_s_per_mm", damping, 0.0, 1.0)?;
        } else if kind == FeedforwardKind::Lugre {
            return at.refuse("friction.lugre", 0.0, Reason::Missing);
        }
        Ok(())
    }

    /// Refuses a spring that swings the plant's inertia too fast for the control rate.
    fn validate_resolved(
        &self,
        at: Place,
        field: &'static str,
        stiffness_v_per_mm: f64,
        period_s: f64,
    ) -> Result<(), SettingsError> {
        let Some(plant) = &self.plant else {
            return Ok(());
        };
        let resonance = RESOLVED_RESONANCE / period_s;
        let most = resonance * resonance / plant.gain_mm_per_v_s2;
        if stiffness_v_per_mm > most {
            return at.refuse(field, stiffness_v_per_mm, Reason::TooStiffForRate { most });
        }
        Ok(())
    }
}

/// Paths of one sense of motion's fields: Fc, Fs, Vs, delta, sigma.
type SlidingFields = [&'static str; 5];

const POSITIVE: SlidingFields = [
    "friction.sliding.positive.curve.coulomb_v",
    "friction.sliding.positive.curve.breakaway_v",
    "friction.sliding.positive.curve.stribeck_velocity_mm_s",
    "friction.sliding.positive.curve.exponent",
    "friction.sliding.positive.viscous_v_s_per_mm",
];
const NEGATIVE: SlidingFields = [
    "friction.sliding.negative.curve.coulomb_v",
    "friction.sliding.negative.curve.breakaway_v",
    "friction.sliding.negative.curve.stribeck_velocity_mm_s",
    "friction.sliding.negative.curve.exponent",
    "friction.sliding.negative.viscous_v_s_per_mm",
];

fn validate_sliding(
    at: Place,
    friction: &StaticFriction,
    [coulomb, breakaway, stribeck, exponent, viscous]: SlidingFields,
) -> Result<(), SettingsError> {
    let curve = &friction.curve;
    at.within(coulomb, curve.coulomb_v, 1e-6, 10.0)?;
    at.within(breakaway, curve.breakaway_v, curve.coulomb_v, 10.0)?;
    at.within(stribeck, curve.stribeck_velocity_mm_s, 1e-3, 1e2)?;
    at.within(exponent, curve.exponent, 0.3, 4.0)?;
    at.within(viscous, friction.viscous_v_s_per_mm, 0.0, 1.0)?;
    if curve.table_error_v() > TABLE_TOLERANCE * curve.breakaway_v {
        return at.refuse(exponent, curve.exponent, Reason::TableError);
    }
    Ok(())
}
