//! Proportional and derivative gain from a gain margin and a phase margin, or from a crossover and a phase margin.

use std::f64::consts::{PI, TAU};
use std::fmt;

use num_complex::Complex64;
use quadrant_law::control::pid::PidGains;
use quadrant_sim::loop_shape::OpenLoop;
use quadrant_sim::margins::{LoopGains, MarginError, bisect};

use super::form::Form;
use super::process::Process;

/// Reasons for which no gains have the margins asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ShapingError {
    /// The phase of the process never reaches -180 degrees, so that no gain margin is finite.
    NoHalfTurn,
    /// With the gain margin asked for, no derivative gain has the phase margin: they lie between these.
    OutOfReach {
        /// The smallest phase margin found, deg.
        smallest_deg: f64,
        /// The largest phase margin found, deg.
        largest_deg: f64,
    },
    /// At the crossover asked for, no ratio of the gains has the phase margin: they lie between these.
    CrossoverOutOfReach {
        crossover_hz: f64,
        /// Phase margin with proportional gain alone, deg.
        proportional_deg: f64,
        /// Phase margin with derivative gain alone, deg.
        derivative_deg: f64,
    },
}

impl fmt::Display for ShapingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoHalfTurn => f.write_str(
                "the phase of the axis does not reach -180 deg: a model without delay, or a response measured to too low a frequency, \
                 has no finite gain margin to shape",
            ),
            Self::OutOfReach {
                smallest_deg,
                largest_deg,
            } => write!(
                f,
                "with this gain margin the phase margin can only lie between {smallest_deg:.1} and {largest_deg:.1} deg"
            ),
            Self::CrossoverOutOfReach {
                crossover_hz,
                proportional_deg,
                derivative_deg,
            } => write!(
                f,
                "with a crossover at {crossover_hz} Hz the phase margin can only lie between {proportional_deg:.1} deg, without \
                 derivative, and {derivative_deg:.1} deg, with nothing else"
            ),
        }
    }
}

impl std::error::Error for ShapingError {}

/// The ratio Kd/Kp, over the time in which the process alone turns by a radian at its half turn, at which the search
/// starts: the derivative acts above all frequencies of interest.
pub(super) const SMALLEST_RATIO: f64 = 0.01;
/// And at which it ends: the derivative dominates the loop.
pub(super) const LARGEST_RATIO: f64 = 100.0;
/// Points of the search, even on a log scale.
const RATIOS: usize = 60;

/// Gains without integral action.
pub(super) fn proportional_derivative(
    kp_v_per_mm: f64,
    kd_v_s_per_mm: f64,
    filter_s: f64,
) -> PidGains {
    PidGains {
        kp_v_per_mm,
        ki_v_per_mm_s: 0.0,
        kd_v_s_per_mm,
        derivative_filter_s: filter_s,
    }
}

/// The PD gains with which the loop has both margins, at the frequencies that result; Ki is zero.
///
/// The two equations are solved as one: at a given ratio Kd/Kp the frequency of the gain margin is fixed and Kp follows
/// from it, so that the phase margin is a function of the ratio alone. Where several ratios fit, the largest is taken,
/// on the branch where more derivative means more phase margin.
///
/// `derivative_filter_s` is the time constant of the derivative's filter, s; `gain_margin_db` in dB and
/// `phase_margin_deg` in deg are above zero.
///
/// # Errors
/// A process without a half turn of phase, or margins that exclude each other.
pub fn shape_to_margins(
    process: &Process,
    form: Form,
    derivative_filter_s: f64,
    gain_margin_db: f64,
    phase_margin_deg: f64,
) -> Result<PidGains, ShapingError> {
    let half_turn_hz = process.half_turn_hz().ok_or(ShapingError::NoHalfTurn)?;
    let gains_at = |ratio_s: f64| {
        let unit = proportional_derivative(1.0, ratio_s, derivative_filter_s);
        scale_to_gain_margin(process, form, &unit, gain_margin_db)
    };
    let phase_margin_at = |ratio_s: f64| -> Result<f64, MarginError> {
        Ok(process.margins(&gains_at(ratio_s)?, form)?.phase_margin_deg)
    };
    // A ratio without margins counts as one without phase margin.
    let falls_short = |ratio_s: f64| phase_margin_at(ratio_s).unwrap_or(0.0) < phase_margin_deg;

    let span = LARGEST_RATIO / SMALLEST_RATIO;
    let smallest_s = SMALLEST_RATIO / (TAU * half_turn_hz);
    let ratios: Vec<f64> = (0..RATIOS)
        .map(|i| smallest_s * span.powf(i as f64 / (RATIOS - 1) as f64))
        .collect();
    let bracket = ratios
        .windows(2)
        .rev()
        .find(|pair| falls_short(pair[0]) && !falls_short(pair[1]));
    let out_of_reach = || {
        let found: Vec<f64> = ratios
            .iter()
            .filter_map(|&ratio| phase_margin_at(ratio).ok())
            .collect();
        ShapingError::OutOfReach {
            smallest_deg: found.iter().copied().fold(180.0, f64::min),
            largest_deg: found.iter().copied().fold(0.0, f64::max),
        }
    };
    let bracket = bracket.ok_or_else(out_of_reach)?;
    let ratio_s = bisect(bracket[0], bracket[1], falls_short);
    gains_at(ratio_s).map_err(|_| out_of_reach())
}

/// Scales a controller so that the loop has a gain margin.
fn scale_to_gain_margin(
    process: &Process,
    form: Form,
    gains: &PidGains,
    gain_margin_db: f64,
) -> Result<PidGains, MarginError> {
    let open_loop = process.open_loop(gains, form);
    let crossover = LoopGains::new(&open_loop)?.falling_phase_crossover()?;
    let factor = 10.0_f64.powf(-gain_margin_db / 20.0) / open_loop.response(crossover).norm();
    Ok(PidGains {
        kp_v_per_mm: gains.kp_v_per_mm * factor,
        ki_v_per_mm_s: gains.ki_v_per_mm_s * factor,
        kd_v_s_per_mm: gains.kd_v_s_per_mm * factor,
        ..*gains
    })
}

/// The PD gains with which the loop's gain is one at `crossover_hz`, Hz, and its phase `phase_margin_deg` above
/// -180 deg there; Ki is zero. The loop is linear in the gains, so that two real equations give both.
///
/// # Errors
/// A phase margin that takes a gain below zero.
pub fn shape_to_crossover(
    process: &Process,
    form: Form,
    derivative_filter_s: f64,
    crossover_hz: f64,
    phase_margin_deg: f64,
) -> Result<PidGains, ShapingError> {
    let omega = TAU * crossover_hz;
    let alone = |kp: f64, kd: f64| {
        let gains = proportional_derivative(kp, kd, derivative_filter_s);
        process.open_loop(&gains, form).response(omega)
    };
    // Of the order of each other at the crossover, so that neither is lost to rounding.
    let (proportional, derivative) = (alone(1.0, 0.0), alone(1.0, 1.0 / omega) - alone(1.0, 0.0));
    let target = Complex64::cis(phase_margin_deg.to_radians() - PI);
    let determinant = proportional.re * derivative.im - proportional.im * derivative.re;
    let kp = (target.re * derivative.im - target.im * derivative.re) / determinant;
    let kd = (proportional.re * target.im - proportional.im * target.re) / determinant / omega;
    if kp > 0.0 && kd >= 0.0 {
        return Ok(proportional_derivative(kp, kd, derivative_filter_s));
    }
    let margin_deg = |response: Complex64| (-response).arg().to_degrees();
    Err(ShapingError::CrossoverOutOfReach {
        crossover_hz,
        proportional_deg: margin_deg(proportional),
        derivative_deg: margin_deg(derivative),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::fixtures::{FILTER_S, X_GAINS, X_PLANT, Y_PLANT, Z_PLANT};
    use quadrant_law::control::plant_model::PlantModel;
    use quadrant_sim::loop_shape::ContinuousLoop;
    use quadrant_sim::margins::margins;

    #[test]
    fn x_axis_gains_come_out_of_their_own_margins() {
        let open_loop = ContinuousLoop {
            plant: X_PLANT,
            gains: X_GAINS,
        };
        let margins = margins(&open_loop).unwrap();
        let shaped = shape_to_margins(
            &Process::Model(X_PLANT),
            Form::Continuous,
            FILTER_S,
            margins.gain_margin_db,
            margins.phase_margin_deg,
        )
        .unwrap();
        assert!((shaped.kp_v_per_mm / X_GAINS.kp_v_per_mm - 1.0).abs() < 1e-9);
        assert!((shaped.kd_v_s_per_mm / X_GAINS.kd_v_s_per_mm - 1.0).abs() < 1e-9);
    }

    #[test]
    fn y_and_z_axes_are_shaped_to_the_margins_of_x() {
        for (plant, kp, kd) in [(Y_PLANT, 1.310, 0.006275), (Z_PLANT, 1.669, 0.007301)] {
            let gains = shape_to_margins(
                &Process::Model(plant),
                Form::Continuous,
                FILTER_S,
                9.9,
                54.2,
            )
            .unwrap();
            let margins = margins(&ContinuousLoop { plant, gains }).unwrap();
            assert!((margins.gain_margin_db - 9.9).abs() < 1e-9);
            assert!((margins.phase_margin_deg - 54.2).abs() < 1e-9);
            assert!((gains.kp_v_per_mm / kp - 1.0).abs() < 5e-4);
            assert!((gains.kd_v_s_per_mm / kd - 1.0).abs() < 5e-4);
        }
    }

    #[test]
    fn margins_that_exclude_each_other_name_what_is_possible() {
        for impossible_deg in [10.0, 100.0] {
            let error = shape_to_margins(
                &Process::Model(X_PLANT),
                Form::Continuous,
                FILTER_S,
                9.9,
                impossible_deg,
            )
            .unwrap_err();
            let ShapingError::OutOfReach {
                smallest_deg,
                largest_deg,
            } = error
            else {
                panic!("{error}");
            };
            assert!((18.0..20.0).contains(&smallest_deg), "{smallest_deg}");
            assert!((78.0..80.0).contains(&largest_deg), "{largest_deg}");
        }
    }

    #[test]
    fn a_plant_without_delay_is_refused() {
        let plant = PlantModel {
            delay_s: 0.0,
            ..X_PLANT
        };
        let error = shape_to_margins(
            &Process::Model(plant),
            Form::Continuous,
            FILTER_S,
            9.9,
            54.2,
        )
        .unwrap_err();
        assert_eq!(error, ShapingError::NoHalfTurn);
    }
}
