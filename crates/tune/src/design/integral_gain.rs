//! Integral action of a design: the most that leaves its margins standing.
//!
//! Integral action is there against slow disturbances; loop shaping decides everything else. The criterion takes the
//! largest Ki that a stated set of margins does not notice, rounded down to two significant digits, so that it can be
//! written down and found again.

use quadrant_law::control::pid::PidGains;
use quadrant_sim::margins::Margins;

use super::form::Form;
use super::process::Process;

/// Most halvings between a gain that is acceptable and one that is not.
const HALVINGS: usize = 80;

/// The largest Ki, V/(mm s), rounded down to two significant digits, up to which the loop is stable and its
/// margins are acceptable without interruption; nothing when they are not even without integral action. The Ki in
/// `gains` is not looked at.
///
/// Acceptable to 0.05 dB and 0.05 deg of the loop without integral action, for instance:
///
/// ```
/// # use quadrant_law::control::pid::PidGains;
/// # use quadrant_settings::presets::{X_GAINS, X_PLANT};
/// # use quadrant_tune::design::{Form, Process, largest_integral_gain_where};
/// # let gains = PidGains { ki_v_per_mm_s: 0.0, ..X_GAINS };
/// let process = Process::Model(X_PLANT);
/// let without = process.margins(&gains, Form::Continuous)?;
/// let ki = largest_integral_gain_where(&process, Form::Continuous, &gains, |with| {
///     (with.gain_margin_db - without.gain_margin_db).abs() <= 0.05
///         && (with.phase_margin_deg - without.phase_margin_deg).abs() <= 0.05
/// });
/// assert_eq!(ki, Some(8.0));
/// # Ok::<(), quadrant_sim::margins::MarginError>(())
/// ```
pub fn largest_integral_gain_where(
    process: &Process,
    form: Form,
    gains: &PidGains,
    acceptable: impl Fn(&Margins) -> bool,
) -> Option<f64> {
    let passes = |ki: f64| {
        let gains = PidGains {
            ki_v_per_mm_s: ki,
            ..*gains
        };
        process.margins(&gains, form).is_ok_and(|m| acceptable(&m))
    };
    if !passes(0.0) {
        return None;
    }
    // Upwards in small steps, so that an interruption is not stepped over; every loop is unstable well before the end.
    let first = 1e-3 * gains.kp_v_per_mm;
    let mut high = first;
    while high < 1e9 * first && passes(high) {
        high *= 1.1;
    }
    let mut low = if high > first { high / 1.1 } else { 0.0 };
    // Further halvings would not be seen in two digits.
    for _ in 0..HALVINGS {
        if round_down_to_two_digits(low) == round_down_to_two_digits(high) {
            break;
        }
        let middle = 0.5 * (low + high);
        if passes(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(round_down_to_two_digits(low))
}

/// Two significant digits, never above the value.
fn round_down_to_two_digits(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let unit = value.log10().floor() as i32 - 1;
    let digits = (value / 10.0_f64.powi(unit)).floor();
    // By way of text: the decimal number itself, not a product that misses it by one bit.
    format!("{digits}e{unit}").parse().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::fixtures::{X_GAINS, X_PLANT};

    #[test]
    fn margins_missed_without_integral_action_have_no_integral_gain() {
        let process = Process::Model(X_PLANT);
        let never = |_: &Margins| false;
        let found = largest_integral_gain_where(&process, Form::Continuous, &X_GAINS, never);
        assert_eq!(found, None);
    }

    #[test]
    fn rounding_goes_down_and_keeps_exact_values() {
        assert_eq!(round_down_to_two_digits(0.7459), 0.74);
        assert_eq!(round_down_to_two_digits(12.999), 12.0);
        assert_eq!(round_down_to_two_digits(9.99), 9.9);
        assert_eq!(round_down_to_two_digits(0.0), 0.0);
    }
}
