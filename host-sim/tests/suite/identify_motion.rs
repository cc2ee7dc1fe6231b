//! Inertia and friction from ordinary motion: of a real axis whose parameters are published, and of the simulated stage.

use std::path::{Path, PathBuf};

use quadrant_sim::identify::motion::{
    Candidate, CascadeLoop, MotionFitError, MotionFitSettings, MotionModel, fit_motion,
    recommended, replay_closed_loop, replay_open_loop, shuttle,
};
use quadrant_sim::identify::setting::SettingError;
use quadrant_sim::machine::SimulatedTestAxis;
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_sim::record::Recording;

/// Of the EMPS drive (see the record's own description).
const FORCE_N_PER_V: f64 = 35.150_651_882_485_47;
const EMPS_LOOP: CascadeLoop = CascadeLoop {
    position_gain_per_s: 160.18,
    velocity_gain_v_s_per_mm: 0.243_45,
    limit_v: 10.0,
};

/// The record, or `None`, with a word on it, where it was not laid beside the project.
fn emps() -> Option<Recording> {
    let path: PathBuf =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/emps/emps.csv");
    if path.exists() {
        return Some(Recording::read_csv(&path).unwrap());
    }
    println!(
        "SKIPPED: the EMPS recording is not at ../shared/data/emps/emps.csv beside the project"
    );
    None
}

fn fitted(recording: &Recording, settings: &MotionFitSettings) -> Vec<Candidate> {
    fit_motion(recording, settings, &|_| {}).unwrap()
}

fn validation(candidate: &Candidate) -> f64 {
    candidate.validation_error.unwrap()
}

#[test]
fn four_parameters_of_emps_are_the_published_ones() {
    let Some(record) = emps() else { return };
    let four = &fitted(&record, &MotionFitSettings::default())[0];
    let MotionModel {
        inertia_v_s2_per_mm,
        friction,
        offset_v,
        ..
    } = &four.model;
    let mass_kg = 1e3 * FORCE_N_PER_V * inertia_v_s2_per_mm;
    let viscous_n_s_per_m = 1e3 * FORCE_N_PER_V * friction.positive.viscous_v_s_per_mm;
    let coulomb_n = FORCE_N_PER_V * friction.positive.curve.coulomb_v;
    for (name, found, published) in [
        ("M", mass_kg, 95.1089),
        ("Fv", viscous_n_s_per_m, 203.5034),
        ("Fc", coulomb_n, 20.3935),
        ("offset", FORCE_N_PER_V * offset_v, -3.1648),
    ] {
        let error = found / published - 1.0;
        assert!(error.abs() < 5e-3, "{name}: {found}, published {published}");
    }
    assert!((four.model.relative_error - 0.0404).abs() < 5e-4);
}

#[test]
fn our_friction_explains_more_of_emps_also_where_it_was_not_fitted() {
    let Some(record) = emps() else { return };
    let candidates = fitted(&record, &MotionFitSettings::default());
    let best = recommended(&candidates).unwrap();
    assert!(best.model.relative_error < 0.028);
    assert!(validation(best) < 0.028);
    assert!(validation(best) < 1.02 * best.model.relative_error);
    assert!(best.model.structure.presliding && best.model.is_stribeck());
}

#[test]
fn the_models_of_emps_move_as_the_machine_did() {
    let Some(record) = emps() else { return };
    let candidates = fitted(&record, &MotionFitSettings::default());
    let (four, best) = (
        &candidates[0].model,
        &recommended(&candidates).unwrap().model,
    );
    // The published model, simulated elsewhere: 1.75 um and 5.2 %.
    let closed = replay_closed_loop(four, &record, &EMPS_LOOP);
    assert!((1e3 * closed.position_rms_mm - 1.75).abs() < 0.05);
    assert!((closed.voltage_error - 0.052).abs() < 1e-3);
    let better = replay_closed_loop(best, &record, &EMPS_LOOP);
    assert!(better.position_rms_mm < 0.9 * closed.position_rms_mm);
    assert!(better.voltage_error < 0.95 * closed.voltage_error);
    // Elsewhere 5.28 mm. An open loop drifts on the smallest difference at standstill.
    let open = replay_open_loop(four, &record).position_rms_mm;
    assert!((4.0..8.0).contains(&open), "{open}");
    assert!(replay_open_loop(best, &record).position_rms_mm < 0.5 * open);
}

/// An ordinary motion of an axis of the simulated stage.
fn simulated(index: usize, truth: &AxisParameters) -> Recording {
    let mut test_axis = SimulatedTestAxis::new(index, truth.clone(), 1);
    shuttle(&mut test_axis, 2, &mut |_| {}).unwrap()
}

#[test]
fn with_the_dead_time_known_the_simulated_axes_are_found() {
    for (index, truth) in StageParameters::real().axes.iter().enumerate() {
        let settings = MotionFitSettings {
            // The hold of 10 kHz included.
            dead_time_s: Some(truth.delay_s + 0.5e-4),
            ..MotionFitSettings::default()
        };
        let candidates = fitted(&simulated(index, truth), &settings);
        let model = &recommended(&candidates).unwrap().model;
        let inertia = model.inertia_v_s2_per_mm * truth.gain_mm_per_v_s2;
        assert!((inertia - 1.0).abs() < 0.03, "axis {index}: M' {inertia}");
        for (found, exact) in [
            (&model.friction.positive, &truth.friction.positive),
            (&model.friction.negative, &truth.friction.negative),
        ] {
            let viscous = exact.viscous_v_s_per_mm + truth.damping_per_s / truth.gain_mm_per_v_s2;
            let ratio = found.viscous_v_s_per_mm / viscous;
            assert!((ratio - 1.0).abs() < 5e-3, "axis {index}: viscous {ratio}");
        }
        // What differs between the directions is in the offset.
        let mean = 0.5
            * (truth.friction.positive.curve.coulomb_v + truth.friction.negative.curve.coulomb_v);
        let level = model.friction.positive.curve.coulomb_v / mean;
        assert!((level - 1.0).abs() < 0.03, "axis {index}: Fc {level}");
        let most_mm = model.elements.last().unwrap().0;
        assert!((0.01..0.05).contains(&most_mm), "axis {index}: {most_mm}");
    }
}

#[test]
fn without_it_inertia_and_dead_time_are_hardly_told_apart_but_their_sum_is() {
    let truth = &StageParameters::real().axes[0];
    let candidates = fitted(&simulated(0, truth), &MotionFitSettings::default());
    let model = &recommended(&candidates).unwrap().model;
    let sum = |inertia: f64, viscous: f64, dead_time_s: f64| inertia + viscous * dead_time_s;
    let viscous =
        truth.friction.positive.viscous_v_s_per_mm + truth.damping_per_s / truth.gain_mm_per_v_s2;
    let exact = sum(
        1.0 / truth.gain_mm_per_v_s2,
        viscous,
        truth.delay_s + 0.5e-4,
    );
    let found = sum(
        model.inertia_v_s2_per_mm,
        model.friction.positive.viscous_v_s_per_mm,
        model.dead_time_s,
    );
    assert!((found / exact - 1.0).abs() < 0.04, "{found}, {exact}");
}

#[test]
fn the_friction_of_a_record_makes_settings_that_the_firmware_takes() {
    let truth = &StageParameters::real().axes[0];
    let candidates = fitted(&simulated(0, truth), &MotionFitSettings::default());
    let model = &recommended(&candidates).unwrap().model;
    let mut stage = quadrant::settings::StageSettings::simulated();
    stage.axes[0].friction = model.friction_settings();
    stage
        .validate(quadrant::friction::gms::FIRMWARE_ELEMENTS)
        .unwrap();
}

#[test]
fn records_that_tell_too_little_are_refused_with_what_they_lack() {
    let truth = &StageParameters::real().axes[0];
    let whole = simulated(0, truth);
    let settings = MotionFitSettings::default();
    let refusal = |record: &Recording, settings: &MotionFitSettings| {
        fit_motion(record, settings, &|_| {}).unwrap_err()
    };
    let short = whole.slice(0..10_000);
    assert!(matches!(
        refusal(&short, &settings),
        MotionFitError::TooShort { rows: 90 }
    ));
    // Only the outward part of one slow move.
    let mut one_way = whole.slice(0..20_000);
    for (index, position) in one_way.position_mm.iter_mut().enumerate() {
        *position = 1e-3 * index as f64;
    }
    let finer = MotionFitSettings {
        row_rate_hz: 200.0,
        ..settings.clone()
    };
    assert!(matches!(
        refusal(&one_way, &finer),
        MotionFitError::OneWay { percent } if percent == 0.0
    ));
    // A voltage of the wrong sign.
    let mut reversed = whole.clone();
    reversed
        .voltage_v
        .iter_mut()
        .for_each(|volts| *volts = -*volts);
    assert!(matches!(
        refusal(&reversed, &settings),
        MotionFitError::Unphysical { .. } | MotionFitError::Dependent { .. }
    ));
    let coarse = MotionFitSettings {
        cutoff_hz: 6e3,
        ..settings.clone()
    };
    assert!(matches!(
        refusal(&whole, &coarse),
        MotionFitError::Setting(SettingError {
            field: "cut-off",
            ..
        })
    ));
}
