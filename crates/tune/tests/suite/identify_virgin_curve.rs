//! The virgin curve and the GMS model, judged against the truth of the simulated stage.

use std::f64::consts::TAU;

use quadrant_law::friction::gms::{Gms, GmsParameters, GmsState, MAX_ELEMENTS};
use quadrant_law::friction::stribeck::{SlidingTable, StaticFriction};
use quadrant_law::friction::{Direction, PerDirection};
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::commission::bootstrap::low_bandwidth_settings;
use quadrant_tune::identify::virgin_curve::{
    Knots, VirginCurveError, VirginCurveSettings, identify, measure,
};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{SimulatedTestAxis, TestAxis};

/// An axis under the quiet controller, and the amplitude that a commissioning chooses, mm.
fn quiet_rig(index: usize, seed: u64) -> (SimulatedTestAxis, f64) {
    let truth = StageParameters::real().axes[index].clone();
    let breakaway_v = truth.friction.positive.curve.breakaway_v;
    let mut test_axis = SimulatedTestAxis::new(index, truth, seed);
    let plant = test_axis.settings().plant.unwrap();
    let quiet = low_bandwidth_settings(test_axis.settings(), &plant, test_axis.info().rate_hz);
    test_axis.apply(&quiet).unwrap();
    let usual = VirginCurveSettings::outrunning(quiet.feedback.pid.kp_v_per_mm, breakaway_v);
    (test_axis, usual.amplitude_mm)
}

fn sine(amplitude_mm: f64) -> VirginCurveSettings {
    VirginCurveSettings {
        amplitude_mm,
        ..VirginCurveSettings::default()
    }
}

fn recorded(index: usize, seed: u64) -> Recording {
    let (mut test_axis, amplitude_mm) = quiet_rig(index, seed);
    measure(&mut test_axis, &sine(amplitude_mm), &mut |_| {}).unwrap()
}

fn refusal(recording: &Recording, knots: &Knots) -> VirginCurveError {
    match identify(recording, None, knots) {
        Ok(found) => panic!("identified: {:?}", found.knots_mm),
        Err(error) => error,
    }
}

/// The true friction as the amplifier's input sees it: each level without what the offset pushes.
fn sliding(truth: &AxisParameters) -> PerDirection<StaticFriction> {
    let offset_v = truth.imperfections.offset_v;
    let pushed = |model: StaticFriction, by: f64| {
        let mut model = model;
        model.curve.coulomb_v -= by;
        model.curve.breakaway_v -= by;
        model
    };
    PerDirection {
        positive: pushed(truth.friction.positive, offset_v),
        negative: pushed(truth.friction.negative, -offset_v),
    }
}

#[test]
fn every_axis_shows_its_presliding_friction() {
    for (index, truth) in StageParameters::real().axes.iter().enumerate() {
        let recording = recorded(index, 1);
        let found = identify(&recording, Some(&sliding(truth)), &Knots::Automatic(4)).unwrap();
        let error = found.prediction.relative_error;
        let level_v = 0.5
            * (truth.friction.positive.curve.breakaway_v
                + truth.friction.negative.curve.breakaway_v);
        let worst = (1..=60).fold(0.0, |worst, step| {
            let displacement_mm = 5e-4 * f64::from(step);
            let apart = found.gms.virgin_curve_v(displacement_mm, level_v)
                - truth.gms.virgin_curve_v(displacement_mm, level_v);
            f64::max(worst, apart.abs() / level_v)
        });
        assert!(error < 0.03, "axis {index}: {error}");
        assert!(worst < 0.05, "axis {index}: {worst}");
    }
}

#[test]
fn without_the_static_friction_the_record_s_own_plateau_stands_for_it() {
    let recording = recorded(0, 2);
    let found = identify(&recording, None, &Knots::Automatic(4)).unwrap();
    assert!(found.prediction.relative_error < 0.05);
}

#[test]
fn too_small_an_amplitude_is_refused_with_one_that_suffices() {
    for index in 0..3 {
        // The thesis' 10 um, which the quiet controller does not turn into enough voltage.
        let (mut test_axis, _) = quiet_rig(index, 3);
        let record = measure(&mut test_axis, &VirginCurveSettings::default(), &mut |_| {}).unwrap();
        let error = refusal(&record, &Knots::Automatic(4));
        let VirginCurveError::NoPlateau { needed_um, .. } = error else {
            panic!("{error}");
        };
        let larger = measure(&mut test_axis, &sine(1e-3 * needed_um), &mut |_| {}).unwrap();
        let found = identify(&larger, None, &Knots::Automatic(4)).unwrap();
        assert!(found.prediction.relative_error < 0.06);
    }
}

#[test]
fn an_axis_that_hardly_moves_is_refused() {
    let (mut test_axis, usual_mm) = quiet_rig(0, 4);
    let short = VirginCurveSettings {
        cycles: 1.0,
        ..sine(usual_mm)
    };
    let record = measure(&mut test_axis, &short, &mut |_| {}).unwrap();
    let error = refusal(&record, &Knots::Automatic(4));
    assert!(
        matches!(error, VirginCurveError::TooFewReversals { reversals, .. } if reversals < 4),
        "{error}"
    );
}

#[test]
fn knots_can_be_given() {
    let recording = recorded(0, 1);
    let knots = vec![0.001, 0.004, 0.010, 0.022];
    let found = identify(&recording, None, &Knots::At(knots.clone())).unwrap();
    for (found, given) in found.knots_mm.iter().zip(&knots) {
        assert!((found / given - 1.0).abs() < 1e-4, "{found} for {given}");
    }
    assert_eq!(found.gms.elements.len(), 4);
    for knots in [vec![], vec![0.004, 0.001], vec![-0.001, 0.004]] {
        let error = refusal(&recording, &Knots::At(knots));
        assert!(
            matches!(error, VirginCurveError::Elements { .. }),
            "{error}"
        );
    }
    let error = refusal(&recording, &Knots::Automatic(MAX_ELEMENTS + 1));
    assert!(
        matches!(error, VirginCurveError::Elements { .. }),
        "{error}"
    );
}

/// Friction of one level, as the library's own model makes it along a sine of 50 um.
fn ideal(truth: &GmsParameters, level_v: f64, step_s: f64) -> Recording {
    let mut flat = StageParameters::real().axes[0].friction.positive.curve;
    flat.coulomb_v = level_v;
    flat.breakaway_v = level_v;
    let curves = PerDirection {
        positive: flat,
        negative: flat,
    };
    let surface = SlidingTable::<f64>::build(&curves, truth.attraction_v_s, step_s);
    let model = Gms::<f64, MAX_ELEMENTS>::build(&truth.elements);
    let mut state = GmsState::default();
    let mut recording = Recording {
        sample_time_s: step_s,
        ..Recording::default()
    };
    let mut last_mm = 0.0;
    for index in 0..(50.0 / step_s) as u32 {
        let position_mm = 0.05 * (TAU * 0.1 * f64::from(index) * step_s).sin();
        let moved = position_mm - last_mm;
        last_mm = position_mm;
        let direction = if moved < 0.0 {
            Direction::Negative
        } else {
            Direction::Positive
        };
        let velocity = moved.abs() / step_s;
        let friction = model.step(&mut state, moved, surface.at(velocity, direction));
        recording.position_mm.push(position_mm);
        recording.reference_mm.push(position_mm);
        recording.voltage_v.push(friction);
        recording.injection_v.push(0.0);
    }
    recording
}

#[test]
fn every_branch_seen_from_its_reversal_is_the_virgin_curve_doubled() {
    let truth = &StageParameters::real().axes[0].gms;
    let level_v = 0.15;
    let record = ideal(truth, level_v, 1e-3);
    let found = identify(&record, None, &Knots::Automatic(4)).unwrap();
    assert!(found.curve.branches >= 7, "{}", found.curve.branches);
    let worst = found.curve.points.iter().fold(0.0, |worst, point| {
        let exact = truth.virgin_curve_v(point.displacement_mm, level_v);
        f64::max(worst, (point.force_v - exact).abs() / level_v)
    });
    assert!(worst < 0.002, "{worst}");
    // What remains is that a few straight pieces are not ten.
    let finer = identify(&record, None, &Knots::Automatic(7)).unwrap();
    let [coarse, fine] = [&found, &finer].map(|found| found.prediction.relative_error);
    assert!(coarse < 0.015 && fine < 0.007, "{coarse}, {fine}");
}

#[test]
fn a_recording_at_another_rate_gives_the_same_model() {
    let truth = &StageParameters::real().axes[0].gms;
    let [usual, fast, slow] = [1e-3, 1e-4, 2e-3].map(|step_s| {
        let record = ideal(truth, 0.15, step_s);
        identify(&record, None, &Knots::Automatic(3)).unwrap()
    });
    for other in [fast, slow] {
        let worst = (1..=60).fold(0.0, |worst, step| {
            let displacement_mm = 5e-4 * f64::from(step);
            let [one, two] =
                [&other, &usual].map(|found| found.gms.virgin_curve_v(displacement_mm, 0.15));
            f64::max(worst, (one - two).abs() / 0.15)
        });
        let samples = other.prediction.position_mm.len();
        assert!(worst < 0.02 && samples <= 50_000, "{worst}, {samples}");
    }
}
