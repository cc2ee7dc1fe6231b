//! Checks of settings: each field's range, and what fields must hold together.

mod feedback;
mod friction;
mod motion;

use super::{AxisSettings, Reason, SettingsError, StageSettings};
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

/// The fastest reference, in counts per tick: what the formats of the moves' velocity and of the displacement hold.
const MOST_COUNTS_PER_TICK: f64 = 4096.0;
/// The largest acceleration of a reference, in counts per tick squared: what the format of the moves' holds.
const MOST_COUNTS_PER_TICK_SQUARED: f64 = 256.0;
/// The largest limit of the tracking error, in counts: half of where the error saturates.
const MOST_ERROR_COUNTS: f64 = 8_388_608.0;
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
}
