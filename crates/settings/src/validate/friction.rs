//! Cross-checks of friction: the table of the curve is exact enough, the control rate resolves the pre-sliding springs, and
//! the kind of feedforward has its model.

use super::Place;
use crate::axis::AxisSettings;
use crate::error::{Reason, SettingsError};
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_law::learning::MAX_DELAY_TICKS;

/// The tables' largest error over the breakaway level.
const TABLE_TOLERANCE: f64 = 1e-3;

const ELEMENTS: &str = "friction.gms.elements";
const STIFFNESS: &str = "friction.gms.elements.stiffness_v_per_mm";
const WEIGHT: &str = "friction.gms.elements.weight";
const ATTRACTION: &str = "friction.gms.attraction_v_s";

impl AxisSettings {
    pub(super) fn validate_friction(
        &self,
        at: Place,
        period_s: f64,
        room: usize,
    ) -> Result<(), SettingsError> {
        let sliding = &self.friction.sliding;
        at.validate_curve(
            &sliding.positive,
            "friction.sliding.positive.curve.exponent",
        )?;
        at.validate_curve(
            &sliding.negative,
            "friction.sliding.negative.curve.exponent",
        )?;
        self.validate_gms(at, period_s, room)?;
        self.validate_bristles(at, period_s)?;
        self.validate_learning(at, period_s)?;
        self.validate_cancelling(at)
    }

    /// Learning needs a plant that its model has room for, and a law that is a PID at small errors.
    fn validate_learning(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        if self.feedforward.learning.is_none() {
            return Ok(());
        }
        let Some(plant) = &self.plant else {
            return at.refuse("plant", f64::NAN, Reason::Missing);
        };
        let longest_s = MAX_DELAY_TICKS as f64 * period_s;
        at.within("plant.delay_s", plant.delay_s, 0.0, longest_s)?;
        self.validate_is_pid(at, "feedforward.learning")
    }

    /// Cancelling needs the phase of the loop: a plant, and a law that is a PID at small errors.
    fn validate_cancelling(&self, at: Place) -> Result<(), SettingsError> {
        if self.feedforward.cancelling.is_none() {
            return Ok(());
        }
        if self.plant.is_none() {
            return at.refuse("plant", f64::NAN, Reason::Missing);
        }
        self.validate_is_pid(at, "feedforward.cancelling")
    }

    /// Refuses a part of the feedforward that works only with a law that is a PID at small errors.
    fn validate_is_pid(&self, at: Place, part: &'static str) -> Result<(), SettingsError> {
        match self.feedback.law {
            LawKind::Pd | LawKind::Pid | LawKind::NPid => Ok(()),
            LawKind::Scheduled | LawKind::Cascade | LawKind::SlidingMode | LawKind::Nctf => {
                at.refuse(part, f64::NAN, Reason::NeedsPid)
            }
        }
    }

    fn validate_gms(&self, at: Place, period_s: f64, room: usize) -> Result<(), SettingsError> {
        let gms = &self.friction.gms;
        let count = gms.elements.len() as f64;
        if gms.elements.len() > room {
            return at.refuse(ELEMENTS, count, Reason::TooManyElements { room });
        }
        at.within(ELEMENTS, count, 1.0, room as f64)?;
        let mut weights = 0.0;
        let mut stiffness = 0.0;
        for element in &gms.elements {
            weights += element.weight;
            stiffness += element.stiffness_v_per_mm;
        }
        if libm::fabs(weights - 1.0) > 1e-6 {
            return at.refuse(WEIGHT, weights, Reason::WeightsSum);
        }
        self.validate_resolved(at, STIFFNESS, stiffness, period_s)?;
        let sliding = &self.friction.sliding;
        let lowest = [&sliding.positive, &sliding.negative]
            .map(|model| model.curve.coulomb_v.min(model.curve.breakaway_v))
            .into_iter()
            .fold(f64::MAX, f64::min);
        let most = lowest / period_s;
        if gms.attraction_v_s > most {
            let reason = Reason::TooFastForRate { most };
            return at.refuse(ATTRACTION, gms.attraction_v_s, reason);
        }
        Ok(())
    }

    /// The models with a single state.
    fn validate_bristles(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let friction = &self.friction;
        let dahl = friction.dahl.as_ref().map(|dahl| dahl.stiffness_v_per_mm);
        let lugre = friction
            .lugre
            .as_ref()
            .map(|lugre| lugre.stiffness_v_per_mm);
        for (kind, part, field, stiffness_v_per_mm) in [
            (
                FeedforwardKind::Dahl,
                "friction.dahl",
                "friction.dahl.stiffness_v_per_mm",
                dahl,
            ),
            (
                FeedforwardKind::Lugre,
                "friction.lugre",
                "friction.lugre.stiffness_v_per_mm",
                lugre,
            ),
        ] {
            match stiffness_v_per_mm {
                Some(stiffness) => self.validate_resolved(at, field, stiffness, period_s)?,
                None if self.feedforward.kind == kind => {
                    return at.refuse(part, 0.0, Reason::Missing);
                }
                None => {}
            }
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
        let (range, stiffest) = (self.feedforward.range, plant.stiffest_v_per_mm(period_s));
        let most = range * stiffest;
        if stiffness_v_per_mm > most {
            // Over its own range it would be resolved.
            if range < 1.0 && stiffness_v_per_mm <= stiffest {
                let least = stiffness_v_per_mm / stiffest;
                return at.refuse(
                    "feedforward.range",
                    range,
                    Reason::TooShortForRate { least },
                );
            }
            return at.refuse(field, stiffness_v_per_mm, Reason::TooStiffForRate { most });
        }
        Ok(())
    }
}

impl Place {
    fn validate_curve(
        self,
        friction: &StaticFriction,
        exponent: &'static str,
    ) -> Result<(), SettingsError> {
        let curve = &friction.curve;
        if curve.table_error_v() > TABLE_TOLERANCE * curve.breakaway_v {
            return self.refuse(exponent, curve.exponent, Reason::TableError);
        }
        Ok(())
    }
}
