//! Checks of settings: each field's range, and what fields must hold together.

use super::{AxisSettings, PlanSettings, Reason, SettingsError, StageSettings};
use crate::axis::MAX_PREVIEW_TICKS;
use crate::control::popov::sector_bound;
use crate::friction::stribeck::StaticFriction;
use crate::reference::MotionSettings;
use crate::safety::AxisName;

/// Where a check stands.
#[derive(Clone, Copy)]
struct Place {
    axis: Option<AxisName>,
}

impl Place {
    fn refuse(self, field: &'static str, value: f64, reason: Reason) -> Result<(), SettingsError> {
        Err(SettingsError {
            axis: self.axis,
            field,
            value,
            reason,
        })
    }

    fn within(
        self,
        field: &'static str,
        value: f64,
        least: f64,
        most: f64,
    ) -> Result<(), SettingsError> {
        if !value.is_finite() {
            self.refuse(field, value, Reason::NotFinite)
        } else if value < least || value > most {
            self.refuse(field, value, Reason::OutOfRange { least, most })
        } else {
            Ok(())
        }
    }
}

/// The largest product of control period and pre-sliding resonance, rad.
const RESOLVED_RESONANCE: f64 = 0.5;
/// The fastest reference, in counts per tick: what the formats of the moves' velocity and of the displacement hold.
const MOST_COUNTS_PER_TICK: f64 = 4096.0;
/// The largest acceleration of a reference, in counts per tick squared: what the format of the moves' holds.
const MOST_COUNTS_PER_TICK_SQUARED: f64 = 256.0;
/// The largest limit of the tracking error, in counts: half of where the error saturates.
const MOST_ERROR_COUNTS: f64 = 8_388_608.0;
/// The longest travel of a motion, in counts: what the references' products hold.
const MOST_TRAVEL_COUNTS: f64 = 1_073_741_824.0;
/// The longest motion that ends, in ticks: half of what the tick counter holds.
const MOST_TICKS: f64 = 2e9;
/// The tables' largest error over the breakaway level.
const TABLE_TOLERANCE: f64 = 1e-3;

impl StageSettings {
    /// Checks every field and what they must hold together. `elements` is the room for GMS elements.
    ///
    /// # Errors
    /// The first field that is refused.
    pub fn validate(&self, elements: usize) -> Result<(), SettingsError> {
        Place { axis: None }.within("rate_hz", self.rate_hz, 1e3, 1e5)?;
        for (name, axis) in AxisName::ALL.into_iter().zip(&self.axes) {
            axis.validate(Place { axis: Some(name) }, 1.0 / self.rate_hz, elements)?;
        }
        Ok(())
    }
}

impl AxisSettings {
    fn validate(&self, at: Place, period_s: f64, elements: usize) -> Result<(), SettingsError> {
        self.validate_edges(at)?;
        self.validate_limits(at, period_s)?;
        self.validate_plant(at)?;
        self.validate_feedback(at, period_s)?;
        self.validate_feedforward(at, period_s)?;
        self.validate_friction(at, period_s, elements)
    }

    fn validate_edges(&self, at: Place) -> Result<(), SettingsError> {
        let encoder = &self.encoder;
        at.within("encoder.resolution_mm", encoder.resolution_mm, 1e-6, 1.0)?;
        at.within(
            "encoder.counter_bits",
            encoder.counter_bits.into(),
            8.0,
            32.0,
        )?;
        let amplifier = &self.amplifier;
        let full = amplifier.full_scale_v;
        at.within("amplifier.full_scale_v", full, 0.1, 20.0)?;
        at.within(
            "amplifier.output_limit_v",
            amplifier.output_limit_v,
            1e-3 * full,
            full,
        )?;
        at.within(
            "amplifier.offset_v",
            amplifier.offset_v,
            -0.1 * full,
            0.1 * full,
        )
    }

    fn validate_limits(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let limits = &self.limits;
        let resolution = self.encoder.resolution_mm;
        // The encoder may move twice as far, within half of its counter's range, or its direction is lost.
        let half_range = libm::scalbn(0.5, self.encoder.counter_bits.into());
        let fastest = (0.5 * half_range).min(MOST_COUNTS_PER_TICK) * resolution / period_s;
        let most_acceleration = MOST_COUNTS_PER_TICK_SQUARED * resolution / (period_s * period_s);
        at.within(
            "limits.max_velocity_mm_s",
            limits.max_velocity_mm_s,
            1e-3,
            fastest.min(1e3),
        )?;
        at.within(
            "limits.max_acceleration_mm_s2",
            limits.max_acceleration_mm_s2,
            1e-3,
            most_acceleration.min(3e4),
        )?;
        at.within(
            "limits.following_error_mm",
            limits.following_error_mm,
            resolution,
            (MOST_ERROR_COUNTS * resolution).min(20.0),
        )
    }

    fn validate_plant(&self, at: Place) -> Result<(), SettingsError> {
        let Some(plant) = &self.plant else {
            return Ok(());
        };
        at.within("plant.gain_mm_per_v_s2", plant.gain_mm_per_v_s2, 1e-3, 1e9)?;
        at.within("plant.damping_per_s", plant.damping_per_s, 0.0, 1e6)?;
        at.within("plant.stiffness_per_s2", plant.stiffness_per_s2, 0.0, 1e9)?;
        at.within("plant.delay_s", plant.delay_s, 0.0, 0.1)
    }

    fn validate_feedback(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
        let feedback = &self.feedback;
        let pid = &feedback.pid;
        at.within("feedback.pid.kp_v_per_mm", pid.kp_v_per_mm, 0.0, 1e4)?;
        at.within("feedback.pid.ki_v_per_mm_s", pid.ki_v_per_mm_s, 0.0, 1e6)?;
        at.within("feedback.pid.kd_v_s_per_mm", pid.kd_v_s_per_mm, 0.0, 1e2)?;
        at.within(
            "feedback.pid.derivative_filter_s",
            pid.derivative_filter_s,
            0.5 * period_s,
            1.0,
        )?;
        at.within(
            "feedback.integral_limit_v",
            feedback.integral_limit_v,
            1e-6,
            self.amplifier.output_limit_v,
        )?;
        at.within("feedback.transfer_s", feedback.transfer_s, 1e-3, 10.0)?;
        let Some(nonlinear) = &feedback.nonlinear else {
            return Ok(());
        };
        at.within(
            "feedback.nonlinear.range_mm",
            nonlinear.range_mm,
            1e-3,
            10.0,
        )?;
        // cosh(3.4) is 15: within the fixed-point format, and far beyond any Popov bound met in practice.
        at.within(
            "feedback.nonlinear.rate_per_mm",
            nonlinear.rate_per_mm,
            0.0,
            3.4 / nonlinear.range_mm,
        )?;
        if let Some(plant) = &self.plant {
            let bound = sector_bound(plant, pid, period_s);
            if nonlinear.largest() > bound {
                let reason = Reason::BeyondPopov { bound };
                return at.refuse(
                    "feedback.nonlinear.rate_per_mm",
                    nonlinear.rate_per_mm,
                    reason,
                );
            }
        }
        Ok(())
    }

    fn validate_feedforward(&self, at: Place, period_s: f64) -> Result<(), SettingsError> {
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

    fn validate_friction(
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
        if let Some(plant) = &self.plant {
            let resonance = RESOLVED_RESONANCE / period_s;
            let most = resonance * resonance / plant.gain_mm_per_v_s2;
            if stiffness > most {
                return at.refuse(
                    "friction.gms.elements.stiffness_v_per_mm",
                    stiffness,
                    Reason::TooStiffForRate { most },
                );
            }
        }
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

impl PlanSettings {
    /// Checks every motion against its axis' limits.
    ///
    /// # Errors
    /// The first field that is refused.
    pub fn validate(&self, stage: &StageSettings) -> Result<(), SettingsError> {
        for ((name, axis), motion) in AxisName::ALL
            .into_iter()
            .zip(&stage.axes)
            .zip(&self.motions)
        {
            validate_motion(Place { axis: Some(name) }, motion, axis, stage.rate_hz)?;
        }
        Ok(())
    }
}

/// The longest travel that a motion may ask for, mm.
const LONGEST_TRAVEL_MM: f64 = 1e4;

fn validate_motion(
    at: Place,
    motion: &MotionSettings,
    axis: &AxisSettings,
    rate_hz: f64,
) -> Result<(), SettingsError> {
    let limits = &axis.limits;
    let longest = (MOST_TRAVEL_COUNTS * axis.encoder.resolution_mm).min(LONGEST_TRAVEL_MM);
    match motion {
        MotionSettings::Hold => return Ok(()),
        MotionSettings::Harmonic(sine) => {
            at.within("motion.amplitude_mm", sine.amplitude_mm, 1e-6, longest)?;
            at.within(
                "motion.frequency_hz",
                sine.frequency_hz,
                1e-6,
                rate_hz / 20.0,
            )?;
            at.within("motion.phase_rad", sine.phase_rad, -100.0, 100.0)?;
            if let Some(cycles) = sine.cycles {
                let most = MOST_TICKS / rate_hz * sine.frequency_hz;
                at.within("motion.cycles", cycles, 0.0, most)?;
            }
            at.within("motion.lead_s", sine.lead_s, 1.0 / rate_hz, 100.0)?;
        }
        MotionSettings::PointToPoint(to) => {
            at.within("motion.distance_mm", to.distance_mm, -longest, longest)?;
            at.within("motion.max_jerk_mm_s3", to.max_jerk_mm_s3, 1e-3, 1e9)?;
            at.within("motion.max_velocity_mm_s", to.max_velocity_mm_s, 1e-6, 1e3)?;
            at.within(
                "motion.max_acceleration_mm_s2",
                to.max_acceleration_mm_s2,
                1e-3,
                3e4,
            )?;
            let most = MOST_TICKS / rate_hz;
            at.within("motion (duration, s)", to.duration_s(), 0.0, most)?;
        }
    }
    let (velocity, acceleration) = motion.peaks();
    at.within(
        "motion (peak velocity, mm/s)",
        velocity,
        0.0,
        limits.max_velocity_mm_s,
    )?;
    at.within(
        "motion (peak acceleration, mm/s^2)",
        acceleration,
        0.0,
        limits.max_acceleration_mm_s2,
    )
}
