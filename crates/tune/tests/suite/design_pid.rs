//! PIDs designed on the x axis' model and on its response.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::presets::X_PLANT;
use quadrant_settings::response::LinearResponse;
use quadrant_sim::margins::MarginError;
use quadrant_tune::design::measured::{MeasuredError, MeasuredResponse};
use quadrant_tune::design::step_response::{StepRequest, step_response};
use quadrant_tune::design::{
    DesignError, Form, INTEGRAL_SHARE, PidDesign, PidRequest, Process, ShapingError, Target,
    design_pid,
};
use quadrant_tune::identify::response::{FrequencyResponse, ResponsePoint};

use crate::printed_margins::PrintedMargins;

const SAMPLED: Form = Form::Sampled {
    sample_time_s: 1e-4,
    computation_delay_s: 0.0,
};

const MARGINS: Target = Target::Margins {
    gain_margin_db: 9.9,
    phase_margin_deg: 54.2,
    crossover_hz: None,
};

fn design(process: &Process, target: Target, form: Form) -> Result<PidDesign, DesignError> {
    let request = PidRequest {
        target,
        form,
        derivative_filter_s: 52e-6,
        ki_v_per_mm_s: None,
    };
    design_pid(process, &request)
}

/// The model's own response from 4 to 400 Hz, as a measurement without noise.
fn response(coherence: impl Fn(f64) -> f64) -> FrequencyResponse {
    let points = (2..=200).map(|line| {
        let frequency_hz = 2.0 * f64::from(line);
        ResponsePoint {
            frequency_hz,
            response: X_PLANT.response(TAU * frequency_hz),
            coherence: coherence(frequency_hz),
            relative_deviation: 1e-3,
        }
    });
    FrequencyResponse {
        points: points.collect(),
    }
}

fn measured() -> Process {
    Process::Measured {
        response: MeasuredResponse::new(&response(|_| 1.0), 0.9).unwrap(),
        filters: Vec::new(),
    }
}

#[test]
fn the_thesis_targets_give_the_thesis_margins_to_the_printed_digits() {
    let target = Target::Margins {
        gain_margin_db: 9.9,
        phase_margin_deg: 54.2,
        crossover_hz: Some(64.9),
    };
    let found = design(&Process::Model(X_PLANT), target, Form::Continuous).unwrap();
    assert!(
        PrintedMargins::THESIS_X.read(&found.margins),
        "{:?}",
        found.margins
    );
    assert!(found.gains.ki_v_per_mm_s > 0.0);
}

#[test]
fn margins_that_have_another_crossover_say_which() {
    let target = Target::Margins {
        gain_margin_db: 9.9,
        phase_margin_deg: 54.2,
        crossover_hz: Some(80.0),
    };
    let error = design(&Process::Model(X_PLANT), target, Form::Continuous).unwrap_err();
    let DesignError::Crossover { found_hz, .. } = error else {
        panic!("{error}");
    };
    assert!((found_hz - 64.9).abs() < 0.1);
}

#[test]
fn a_measured_response_gives_the_gains_that_its_model_does() {
    for form in [Form::Continuous, SAMPLED] {
        let by_model = design(&Process::Model(X_PLANT), MARGINS, form).unwrap();
        let by_response = design(&measured(), MARGINS, form).unwrap();
        let ratio = by_response.gains.kp_v_per_mm / by_model.gains.kp_v_per_mm;
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
        let ratio = by_response.gains.kd_v_s_per_mm / by_model.gains.kd_v_s_per_mm;
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
        let apart_hz = by_response.margins.gain_crossover_hz - by_model.margins.gain_crossover_hz;
        assert!(apart_hz.abs() < 0.1, "{apart_hz}");
    }
}

#[test]
fn a_crossover_and_a_phase_margin_come_out_as_asked_for() {
    let target = Target::Crossover {
        crossover_hz: 50.0,
        phase_margin_deg: 60.0,
        least_gain_margin_db: 6.0,
    };
    for process in [Process::Model(X_PLANT), measured()] {
        let found = design(&process, target, SAMPLED).unwrap();
        assert!((found.margins.phase_margin_deg - 60.0).abs() < 0.06);
        // Integral action moves the crossover a little.
        assert!((found.margins.gain_crossover_hz / 50.0 - 1.0).abs() < 0.02);
        assert!(found.margins.gain_margin_db > 6.0);
    }
}

#[test]
fn a_crossover_too_high_for_its_margins_is_refused_with_what_is_possible() {
    let at = |crossover_hz: f64, phase_margin_deg: f64| Target::Crossover {
        crossover_hz,
        phase_margin_deg,
        least_gain_margin_db: 6.0,
    };
    let process = Process::Model(X_PLANT);
    let error = design(&process, at(150.0, 80.0), Form::Continuous).unwrap_err();
    assert!(
        matches!(
            error,
            DesignError::Shaping(ShapingError::CrossoverOutOfReach { .. })
        ),
        "{error}"
    );
    let error = design(&process, at(120.0, 30.0), Form::Continuous).unwrap_err();
    assert!(
        matches!(error, DesignError::GainMargin { found_db, .. } if found_db < 6.0),
        "{error}"
    );
}

#[test]
fn the_stiffest_loop_reaches_its_bounds_and_no_stiffer_one_does() {
    let (sensitivity_peak, complementary_peak) = (1.7, 1.3);
    let target = Target::Bandwidth {
        sensitivity_peak,
        complementary_peak,
        integral_share: INTEGRAL_SHARE,
    };
    let process = Process::Model(X_PLANT);
    let found = design(&process, target, SAMPLED).unwrap();
    let margins = found.margins;
    assert!(margins.sensitivity_peak <= sensitivity_peak);
    assert!(margins.complementary_peak <= complementary_peak);
    let used = (margins.sensitivity_peak / sensitivity_peak)
        .max(margins.complementary_peak / complementary_peak);
    assert!(used > 0.99, "{margins:?}");
    // Over a grid of gains around it, none that keeps the bounds is stiffer by a hundredth.
    for kp in [1.01, 1.05, 1.2] {
        for kd in [0.5, 0.7, 0.8, 0.9, 0.95, 1.0, 1.05, 1.1, 1.2, 1.5] {
            let mut gains = found.gains;
            gains.kp_v_per_mm *= kp;
            gains.kd_v_s_per_mm *= kd;
            gains.ki_v_per_mm_s = 0.0;
            let keeps = process.margins(&gains, SAMPLED).is_ok_and(|m| {
                m.sensitivity_peak <= 0.98 * sensitivity_peak
                    && m.complementary_peak <= 0.98 * complementary_peak
            });
            assert!(!keeps, "Kp times {kp}, Kd times {kd}");
        }
    }
}

#[test]
fn bounds_that_no_loop_keeps_say_by_how_much_they_are_missed() {
    let target = Target::Bandwidth {
        sensitivity_peak: 1.05,
        complementary_peak: 1.01,
        integral_share: INTEGRAL_SHARE,
    };
    let error = design(&Process::Model(X_PLANT), target, Form::Continuous).unwrap_err();
    assert!(
        matches!(error, DesignError::Bounds { percent, .. } if percent > 0.0),
        "{error}"
    );
}

#[test]
fn a_response_that_ends_too_early_carries_no_design() {
    let cut = FrequencyResponse {
        points: response(|_| 1.0)
            .points
            .into_iter()
            .filter(|point| point.frequency_hz < 70.0)
            .collect(),
    };
    let process = Process::Measured {
        response: MeasuredResponse::new(&cut, 0.9).unwrap(),
        filters: Vec::new(),
    };
    let gains = design(&Process::Model(X_PLANT), MARGINS, SAMPLED)
        .unwrap()
        .gains;
    assert_eq!(
        process.margins(&gains, SAMPLED),
        Err(MarginError::BandTooNarrow)
    );
    assert!(design(&process, MARGINS, SAMPLED).is_err());
}

#[test]
fn an_incoherent_response_or_one_with_a_gap_carries_no_design() {
    let incoherent = MeasuredResponse::new(&response(|_| 0.5), 0.9).unwrap_err();
    assert!(matches!(
        incoherent,
        MeasuredError::Incoherent { lines: 0, .. }
    ));
    let hole = |hz: f64| f64::from(!(100.0..250.0).contains(&hz));
    let gap = MeasuredResponse::new(&response(hole), 0.9).unwrap_err();
    assert!(
        matches!(gap, MeasuredError::Gap { from_hz, .. } if from_hz == 98.0),
        "{gap}"
    );
}

#[test]
fn a_model_without_delay_is_refused() {
    let prompt = PlantModel {
        delay_s: 0.0,
        ..X_PLANT
    };
    let error = design(&Process::Model(prompt), MARGINS, Form::Continuous).unwrap_err();
    assert_eq!(error, DesignError::Shaping(ShapingError::NoHalfTurn));
}

#[test]
fn the_step_response_is_that_of_the_closed_loop() {
    let design = design(&Process::Model(X_PLANT), MARGINS, SAMPLED).unwrap();
    let request = StepRequest {
        duration_s: 3.2768,
        ..StepRequest::default()
    };
    let response = step_response(&X_PLANT, &design.gains, None, &request);
    // The differences of a step response are the impulse response, whose transform is T.
    let process = Process::Model(X_PLANT);
    let open_loop = process.open_loop(&design.gains, SAMPLED);
    for frequency_hz in [5.0, 40.0, 65.0, 150.0] {
        let omega = TAU * frequency_hz;
        let mut previous = 0.0;
        let mut transform = Complex64::default();
        for (sample, &position) in response.position_mm.iter().enumerate() {
            let share = (position - previous) / request.height_mm;
            previous = position;
            transform += Complex64::cis(-omega * sample as f64 * 1e-4) * share;
        }
        let l = quadrant_sim::loop_shape::OpenLoop::response(&open_loop, omega);
        let expected = l / (l + 1.0);
        assert!(
            (transform - expected).norm() < 2e-3,
            "{frequency_hz} Hz: {transform}, {expected}"
        );
    }
    let found = response.properties();
    assert!((0.0..30.0).contains(&found.overshoot_percent));
    assert!(found.rise_time_s < found.settling_time_s);
    assert!(found.largest_voltage_v < 10.0);
}
