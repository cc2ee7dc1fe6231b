//! The best PID under bounds on sensitivity: the baseline that everything else is compared with.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::pid::PidGains;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::loop_shape::OpenLoop;

use super::form::Form;
use super::pid::{DesignError, PidDesign, PidRequest, Target, design_pid};
use super::process::Process;
use super::search::{BOUND_RESERVES, Search};
pub use super::search::{COMPLEMENTARY_PEAK, Peaks, SENSITIVITY_PEAK};

/// Band over which a disturbance counts, Hz.
const BAND_HZ: (f64, f64) = (0.1, 2000.0);
/// Number of frequencies in it.
const FREQUENCIES: usize = 400;

/// The best time constant of the derivative's filter at a control rate, s: the shortest that settings allow, and a little. Any longer one
/// leaves a larger error within the same bounds: one of a control period 7 % at 10 kHz and 30 % at 1 kHz on the simulated x axis.
pub fn best_filter_s(rate_hz: f64) -> f64 {
    FILTER_PERIODS / rate_hz
}

/// That time constant over the control period.
const FILTER_PERIODS: f64 = 0.52;

/// The PID with the least error after a step of the load, squared and summed over time, among those whose `|S|` and `|T|`
/// stay within [`SENSITIVITY_PEAK`] and [`COMPLEMENTARY_PEAK`]. A reversal of Coulomb friction is such a step.
///
/// # Errors
/// As [`design_pid`]: a process that allows no such loop.
pub fn best_pid(process: &Process, form: Form, filter_s: f64) -> Result<PidDesign, DesignError> {
    best_pid_within(process, form, filter_s, Peaks::default())
}

/// [`best_pid`] under other bounds on `|S|` and `|T|`.
///
/// # Errors
/// As there.
pub fn best_pid_within(
    process: &Process,
    form: Form,
    filter_s: f64,
    peaks: Peaks,
) -> Result<PidDesign, DesignError> {
    let kept = |tighter: f64| {
        let processes = [(process.clone(), 1.0 - tighter, Vec::new())];
        let search = Search::new(&processes, form, filter_s).within(peaks);
        search.kept(process, form)
    };
    let best = BOUND_RESERVES.into_iter().find_map(kept);
    // The stiffest loop says what stands in the way.
    best.map_or_else(|| stiffest(process, form, filter_s, peaks), Ok)
}

/// The stiffest loop within the bounds, with a tenth of them for integral action.
fn stiffest(
    process: &Process,
    form: Form,
    filter_s: f64,
    peaks: Peaks,
) -> Result<PidDesign, DesignError> {
    let request = PidRequest {
        target: Target::Bandwidth {
            sensitivity_peak: peaks.sensitivity,
            complementary_peak: peaks.complementary,
            integral_share: 0.1,
        },
        form,
        derivative_filter_s: filter_s,
        ki_v_per_mm_s: None,
    };
    design_pid(process, &request)
}

/// The stage with the best PID on each axis whose model is known; no nonlinear gain.
///
/// # Errors
/// A model that no PID keeps the bounds on.
pub fn with_best_pid(stage: &StageSettings) -> Result<StageSettings, DesignError> {
    let mut stage = stage.clone();
    for axis in &mut stage.axes {
        set_best_pid(axis, stage.rate_hz)?;
    }
    Ok(stage)
}

/// Gives an axis the best PID on its model, if that is known.
///
/// # Errors
/// A model that no PID keeps the bounds on.
pub fn set_best_pid(axis: &mut AxisSettings, rate_hz: f64) -> Result<(), DesignError> {
    let Some(plant) = axis.plant else {
        return Ok(());
    };
    let form = Form::Sampled {
        sample_time_s: 1.0 / rate_hz,
        computation_delay_s: 0.0,
    };
    let filter_s = axis.feedback.pid.derivative_filter_s;
    let filters = axis.feedback.filters.as_deref().unwrap_or_default();
    axis.feedback.pid = best_pid(&Process::filtered(plant, filters), form, filter_s)?.gains;
    axis.feedback.nonlinear = None;
    axis.feedback.law = LawKind::Pid;
    Ok(())
}

/// Square root of the integral over time of the squared error after a load step of 1 V, mm sqrt(s), by Parseval's theorem.
pub fn load_step_error(process: &Process, gains: &PidGains, form: Form) -> f64 {
    let open_loop = process.open_loop(gains, form);
    let (lowest, highest) = open_loop.band_rad_s();
    let (first, last) = (
        (TAU * BAND_HZ.0).max(lowest).ln(),
        (TAU * BAND_HZ.1).min(highest).ln(),
    );
    let spacing = (last - first) / (FREQUENCIES - 1) as f64;
    let sum: f64 = (0..FREQUENCIES)
        .map(|index| {
            let omega = (first + spacing * index as f64).exp();
            let open = open_loop.response(omega);
            let compliance =
                open / process.controller(gains, form, omega) / (Complex64::new(1.0, 0.0) + open);
            // d omega = omega d ln(omega), and the step's spectrum is 1 / omega.
            compliance.norm_sqr() / omega
        })
        .sum();
    (sum * spacing / std::f64::consts::PI).sqrt()
}

#[cfg(test)]
mod tests {
    use quadrant_law::control::plant_model::PlantModel;

    use super::*;
    use crate::design::fixtures::{FILTER_S, X_PLANT, Y_PLANT, Z_PLANT};

    const SAMPLED: Form = Form::Sampled {
        sample_time_s: 1e-4,
        computation_delay_s: 0.0,
    };

    #[test]
    fn a_longer_filter_of_the_derivative_leaves_a_larger_error_within_the_same_bounds() {
        for (rate_hz, least_more) in [(1e4, 0.06), (1e3, 0.25)] {
            let form = Form::Sampled {
                sample_time_s: 1.0 / rate_hz,
                computation_delay_s: 0.0,
            };
            let error = |filter_s: f64| {
                let process = Process::Model(X_PLANT);
                let found = best_pid(&process, form, filter_s).unwrap();
                load_step_error(&process, &found.gains, form)
            };
            let shortest = error(best_filter_s(rate_hz));
            let ratio = error(1.0 / rate_hz) / shortest;
            assert!(
                (least_more..2.0 * least_more).contains(&(ratio - 1.0)),
                "{rate_hz} Hz: {ratio}"
            );
            assert!(error(3.0 / rate_hz) > 1.1 * shortest);
        }
    }

    #[test]
    fn an_axis_without_damping_gets_the_pid_of_one_with_hardly_any() {
        let pid = |damping_per_s: f64| {
            let plant = PlantModel {
                damping_per_s,
                stiffness_per_s2: 0.0,
                ..X_PLANT
            };
            best_pid(&Process::Model(plant), SAMPLED, FILTER_S)
                .unwrap()
                .gains
        };
        let (without, hardly_any) = (pid(0.0), pid(0.01));
        for (one, other) in [
            (without.kp_v_per_mm, hardly_any.kp_v_per_mm),
            (without.ki_v_per_mm_s, hardly_any.ki_v_per_mm_s),
            (without.kd_v_s_per_mm, hardly_any.kd_v_s_per_mm),
        ] {
            assert!((one / other - 1.0).abs() < 0.01, "{one} and {other}");
        }
    }

    #[test]
    fn the_best_pid_keeps_its_bounds_and_beats_the_thesis_criterion_on_every_axis() {
        for plant in [X_PLANT, Y_PLANT, Z_PLANT] {
            let process = Process::Model(plant);
            let best = best_pid(&process, SAMPLED, FILTER_S).unwrap();
            assert!(best.margins.sensitivity_peak <= SENSITIVITY_PEAK);
            assert!(best.margins.complementary_peak <= COMPLEMENTARY_PEAK);
            let thesis = design_pid(
                &process,
                &PidRequest {
                    target: Target::Margins {
                        gain_margin_db: 9.9,
                        phase_margin_deg: 54.2,
                        crossover_hz: None,
                    },
                    form: Form::Continuous,
                    derivative_filter_s: FILTER_S,
                    ki_v_per_mm_s: None,
                },
            )
            .unwrap();
            let error = |gains: &PidGains| load_step_error(&process, gains, SAMPLED);
            let ratio = error(&best.gains) / error(&thesis.gains);
            assert!(ratio < 0.45, "{ratio}: {:?}", best.gains);
        }
    }

    #[test]
    fn the_error_of_a_stiff_spring_under_integral_action_is_that_of_the_formula() {
        // Slow: the plant is its spring, 1/k; with L = Ki/(k s) the error is exp(-Ki t / k) / k.
        let plant = PlantModel {
            gain_mm_per_v_s2: 1e8,
            damping_per_s: 1e4,
            stiffness_per_s2: 1e8,
            delay_s: 0.0,
        };
        let gains = PidGains {
            kp_v_per_mm: 0.0,
            ki_v_per_mm_s: 20.0,
            kd_v_s_per_mm: 0.0,
            derivative_filter_s: FILTER_S,
        };
        let found = load_step_error(&Process::Model(plant), &gains, Form::Continuous);
        let exact = (1.0_f64 / (2.0 * 20.0)).sqrt();
        assert!((found / exact - 1.0).abs() < 0.05, "{found} {exact}");
    }

    #[test]
    fn every_axis_gets_the_best_pid_on_its_model() {
        let stage = StageSettings::simulated();
        let best = with_best_pid(&stage).unwrap();
        for (axis, own) in best.axes.iter().zip(&stage.axes) {
            assert!(axis.feedback.pid.ki_v_per_mm_s > own.feedback.pid.ki_v_per_mm_s);
            assert_eq!(axis.feedback.law, LawKind::Pid);
        }
        let pid = best.axes[0].feedback.pid;
        // Another's search with SciPy within the same bounds.
        let other = PidGains {
            kp_v_per_mm: 1.3445,
            ki_v_per_mm_s: 144.1,
            kd_v_s_per_mm: 0.005461,
            ..pid
        };
        let error = |gains: &PidGains| load_step_error(&Process::Model(X_PLANT), gains, SAMPLED);
        assert!(error(&pid) < 1.003 * error(&other), "{pid:?}");
    }
}
