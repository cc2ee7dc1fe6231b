//! Requests to inject a voltage, checked against the settings. For the slow half.

use super::error::{Reason, SettingsError};
use super::leaves::limits::LONGEST_TRAVEL_MM;
use super::stage::StageSettings;
use quadrant_law::axes::AxisName;
use quadrant_law::injection::{Coupling, Injection};
use quadrant_law::scalar::Scalar;
use quadrant_law::units::{DacCode, Position};

/// A request to inject a voltage, and the bounds that end it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InjectionSettings {
    /// Axis whose output it is added to.
    pub axis: AxisName,
    /// True if the values alone drive the amplifier; the other axes hold.
    pub open_loop: bool,
    /// True if the plan's motions start with it; in closed loop only.
    pub with_plan: bool,
    /// Largest magnitude of a value, V; above zero, at most `amplifier.output_limit_v`.
    pub limit_v: f64,
    /// Largest distance from the position at the start, either way, mm; above zero, at most 10 000.
    pub travel_mm: f64,
    /// Largest velocity, mm/s; above zero, at most `limits.max_velocity_mm_s`.
    pub max_velocity_mm_s: f64,
}

impl StageSettings {
    /// Builds an injection, and says which magnitude of a word its limit is.
    ///
    /// # Errors
    /// The first of its numbers that is out of range.
    pub fn injection<S: Scalar>(
        &self,
        request: &InjectionSettings,
    ) -> Result<(Injection<S>, u16), SettingsError> {
        let axis = self.axis(request.axis);
        let within = |field, value: f64, most: f64| {
            // So written, what is not a number is refused.
            if value > 0.0 && value <= most {
                return Ok(());
            }
            Err(SettingsError {
                axis: Some(request.axis),
                field,
                value,
                reason: Reason::OutOfRange { least: 0.0, most },
            })
        };
        within("limit_v", request.limit_v, axis.amplifier.output_limit_v)?;
        within("travel_mm", request.travel_mm, LONGEST_TRAVEL_MM)?;
        within(
            "max_velocity_mm_s",
            request.max_velocity_mm_s,
            axis.limits.max_velocity_mm_s,
        )?;
        let volts_per_word = axis.amplifier.full_scale_v / DacCode::FULL_SCALE;
        let resolution_mm = axis.encoder.resolution_mm;
        let counts_per_tick = request.max_velocity_mm_s / (resolution_mm * self.rate_hz);
        let coupling = match (request.open_loop, request.with_plan) {
            (true, _) => Coupling::OpenLoop,
            (false, true) => Coupling::WithPlan,
            (false, false) => Coupling::Added,
        };
        let injection = Injection::new(
            request.axis,
            coupling,
            volts_per_word,
            Position::from_mm(request.travel_mm, resolution_mm),
            counts_per_tick,
        );
        let most = libm::round(request.limit_v / volts_per_word) as u16;
        Ok((injection, most))
    }
}
