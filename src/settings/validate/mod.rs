//! Checks of settings: each field's range, and what fields must hold together.

mod feedback;
mod friction;
mod homing;
mod limits;
mod motion;

use super::{AxisSettings, Reason, SettingsError, StageSettings};
use crate::law::axes::AxisName;
use crate::law::rounding;

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

    #[inline(never)]
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

/// The longest travel of an axis and of a motion, mm.
const LONGEST_TRAVEL_MM: f64 = 1e4;

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
        self.validate_homing(at)?;
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
        if let Some(counts) = encoder.counts_per_index {
            let field = "encoder.counts_per_index";
            at.within(field, counts.into(), 16.0, 1e9)?;
            let field = "encoder.index_tolerance_counts";
            let most = rounding::floor(f64::from(counts) / 4.0);
            at.within(field, encoder.index_tolerance_counts.into(), 0.0, most)?;
        }
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
