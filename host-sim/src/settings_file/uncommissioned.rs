//! An axis before it is commissioned.

use quadrant_settings::AxisSettings;

use super::sparse::defaults_at;

/// Gives an axis the default law in place of its own: no gain, no friction, no feedforward, no model. Encoder, amplifier, limits,
/// homing and pulses stay.
pub fn without_law(axis: &mut AxisSettings, rate_hz: f64) {
    let [default, ..] = defaults_at(rate_hz).axes;
    let integral_limit_v = default.feedback.integral_limit_v;
    *axis = AxisSettings {
        encoder: axis.encoder,
        amplifier: axis.amplifier,
        limits: axis.limits,
        homing: axis.homing,
        pulses: axis.pulses,
        ..default
    };
    axis.feedback.integral_limit_v = integral_limit_v.min(axis.amplifier.full_scale_v);
}
