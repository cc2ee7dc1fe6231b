//! Integral action of a design: the most that leaves its margins standing.
//!
//! Integral action is there against slow disturbances; loop shaping decides everything else. The criterion takes the
//! largest Ki that a stated set of margins does not notice, rounded down to two significant digits, so that it can be
//! written down and found again.

use quadrant_law::control::{pid::PidGains, plant_model::PlantModel};
use quadrant_sim::margins::Margins;

use super::form::Form;
use super::process::Process;

/// Most halvings between a gain that is acceptable and one that is not.
const HALVINGS: usize = 80;

/// A figure as a publication prints it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Printed {
    pub value: f64,
    /// Digits after the decimal point.
    pub decimals: usize,
}

impl Printed {
    /// Returns true if an exact value would be printed the same.
    pub fn reads(&self, exact: f64) -> bool {
        format!("{:.*}", self.decimals, exact) == format!("{:.*}", self.decimals, self.value)
    }
}

/// The four margins of a loop as a publication prints them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrintedMargins {
    /// Gain margin, dB.
    pub gain_margin_db: Printed,
    /// Its frequency, Hz.
    pub phase_crossover_hz: Printed,
    /// Phase margin, deg.
    pub phase_margin_deg: Printed,
    /// Its frequency, Hz.
    pub gain_crossover_hz: Printed,
}

impl PrintedMargins {
    /// The open loop of the x axis with the PID (thesis, Fig 4.2): 9.9 dB at 194 Hz, 54.2 deg at 64.9 Hz.
    pub const THESIS_X: Self = Self {
        gain_margin_db: Printed {
            value: 9.9,
            decimals: 1,
        },
        phase_crossover_hz: Printed {
            value: 194.0,
            decimals: 0,
        },
        phase_margin_deg: Printed {
            value: 54.2,
            decimals: 1,
        },
        gain_crossover_hz: Printed {
            value: 64.9,
            decimals: 1,
        },
    };

    /// Returns true if exact margins would be printed the same.
    pub fn read(&self, exact: &Margins) -> bool {
        self.gain_margin_db.reads(exact.gain_margin_db)
            && self.phase_crossover_hz.reads(exact.phase_crossover_hz)
            && self.phase_margin_deg.reads(exact.phase_margin_deg)
            && self.gain_crossover_hz.reads(exact.gain_crossover_hz)
    }
}

/// The largest Ki, V/(mm s), rounded down to two significant digits, with which the continuous loop's margins still
/// read as printed; nothing when they do not even without integral action.
///
/// Kp in V/mm, Kd in V s/mm, and the derivative filter's time constant in s are given.
pub fn largest_integral_gain(
    plant: &PlantModel,
    kp_v_per_mm: f64,
    kd_v_s_per_mm: f64,
    derivative_filter_s: f64,
    targets: &PrintedMargins,
) -> Option<f64> {
    let gains = PidGains {
        kp_v_per_mm,
        ki_v_per_mm_s: 0.0,
        kd_v_s_per_mm,
        derivative_filter_s,
    };
    let process = Process::Model(*plant);
    largest_integral_gain_where(&process, Form::Continuous, &gains, |margins| {
        targets.read(margins)
    })
}

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
    use crate::design::fixtures::{FILTER_S, X_GAINS, X_PLANT};
    use quadrant_sim::loop_shape::ContinuousLoop;
    use quadrant_sim::margins::margins;

    fn margins_with(ki_v_per_mm_s: f64) -> Margins {
        let gains = PidGains {
            ki_v_per_mm_s,
            ..X_GAINS
        };
        margins(&ContinuousLoop {
            plant: X_PLANT,
            gains,
        })
        .unwrap()
    }

    #[test]
    fn x_axis_keeps_its_printed_margins_up_to_the_integral_gain_found() {
        let (kp, kd) = (X_GAINS.kp_v_per_mm, X_GAINS.kd_v_s_per_mm);
        let printed = PrintedMargins::THESIS_X;
        let ki = largest_integral_gain(&X_PLANT, kp, kd, FILTER_S, &printed).unwrap();
        assert_eq!(ki, 0.74);
        assert!(printed.read(&margins_with(ki)));
        assert!(!printed.read(&margins_with(ki + 0.01)));
    }

    #[test]
    fn what_limits_the_integral_gain_is_the_printed_crossover_frequency() {
        let printed = PrintedMargins::THESIS_X;
        let beyond = margins_with(0.75);
        assert!(!printed.gain_crossover_hz.reads(beyond.gain_crossover_hz));
        assert!(printed.gain_margin_db.reads(beyond.gain_margin_db));
        assert!(printed.phase_crossover_hz.reads(beyond.phase_crossover_hz));
        assert!(printed.phase_margin_deg.reads(beyond.phase_margin_deg));
    }

    #[test]
    fn margins_missed_without_integral_action_have_no_integral_gain() {
        let printed = PrintedMargins::THESIS_X;
        assert_eq!(
            largest_integral_gain(&X_PLANT, 2.0, 0.0055, FILTER_S, &printed),
            None
        );
    }

    #[test]
    fn rounding_goes_down_and_keeps_exact_values() {
        assert_eq!(round_down_to_two_digits(0.7459), 0.74);
        assert_eq!(round_down_to_two_digits(12.999), 12.0);
        assert_eq!(round_down_to_two_digits(9.99), 9.9);
        assert_eq!(round_down_to_two_digits(0.0), 0.0);
    }
}
