//! The motor constant of the simulated stage's axes, judged against their truth.

use quadrant_sim::plant::{AxisParameters, Backlash, Drive, EncoderSide, StageParameters};
use quadrant_tune::identify::motor_constant::{
    MotorConstant, MotorConstantError, MotorConstantSettings, evaluate, measure, measure_gently,
};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::SimulatedTestAxis;

const RESOLUTION_MM: f64 = 5e-4;

fn test_of(truth: &AxisParameters, index: usize, seed: u64) -> MotorConstant {
    let mut test_axis = SimulatedTestAxis::new(index, truth.clone(), seed);
    measure(
        &mut test_axis,
        &MotorConstantSettings::default(),
        &mut |_| {},
    )
    .unwrap()
}

fn evaluated(recording: Recording) -> Result<MotorConstant, MotorConstantError> {
    evaluate(recording, &MotorConstantSettings::default(), RESOLUTION_MM)
}

#[test]
fn every_axis_shows_its_acceleration_per_volt() {
    for (index, truth) in StageParameters::real().axes.iter().enumerate() {
        for seed in 1..=3 {
            let found = test_of(truth, index, seed);
            let error = found.gain_mm_per_v_s2 / truth.gain_mm_per_v_s2 - 1.0;
            // The ripple of the screw makes it low; a first controller allows a factor of two.
            assert!(error.abs() < 0.1, "axis {index}, seed {seed}: {error}");
        }
    }
}

#[test]
fn without_the_screw_s_ripple_the_gain_is_accurate() {
    let mut truth = StageParameters::real().axes[0].clone();
    truth.imperfections.ripple_v = 0.0;
    let found = test_of(&truth, 0, 1);
    let error = found.gain_mm_per_v_s2 / truth.gain_mm_per_v_s2 - 1.0;
    assert!(error.abs() < 0.01, "{error}");
}

#[test]
fn a_saved_test_gives_what_the_fresh_one_gave() {
    let fresh = test_of(&StageParameters::real().axes[0], 0, 1);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("test.csv");
    fresh.recording.write_csv(&path).unwrap();
    let saved = evaluated(Recording::read_csv(&path).unwrap()).unwrap();
    assert!((saved.gain_mm_per_v_s2 / fresh.gain_mm_per_v_s2 - 1.0).abs() < 1e-9);
    assert!((saved.level_v / fresh.level_v - 1.0).abs() < 1e-9);
}

#[test]
fn a_saved_test_on_a_short_travel_shows_its_own_dwell() {
    let truth = StageParameters::real().axes[0].clone();
    let settings = MotorConstantSettings::default().fitted_to(10.0);
    let mut test_axis = SimulatedTestAxis::new(0, truth, 1).with_travel_mm(10.0);
    let fresh = measure(&mut test_axis, &settings, &mut |_| {}).unwrap();
    let shown = MotorConstantSettings::of(&fresh.recording);
    assert!((shown.dwell_s / settings.dwell_s - 1.0).abs() < 0.02);
    let saved = evaluate(fresh.recording, &shown, RESOLUTION_MM).unwrap();
    assert!((saved.gain_mm_per_v_s2 / fresh.gain_mm_per_v_s2 - 1.0).abs() < 1e-9);
}

#[test]
fn the_moving_mass_turns_it_into_newtons_per_volt() {
    let found = test_of(&StageParameters::real().axes[0], 0, 1);
    // 12 kg at 1 mm/s² take 12 mN.
    let expected = 12e-3 * found.gain_mm_per_v_s2;
    assert!((found.force_n_per_v(12.0) / expected - 1.0).abs() < 1e-12);
}

#[test]
fn an_axis_that_moves_the_wrong_way_is_refused() {
    let mut recording = test_of(&StageParameters::real().axes[0], 0, 1).recording;
    for position in &mut recording.position_mm {
        *position = -*position;
    }
    let error = evaluated(recording).unwrap_err();
    assert!(matches!(error, MotorConstantError::Reversed), "{error}");
}

#[test]
fn an_axis_that_friction_holds_is_refused() {
    let mut test_axis = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let settings = MotorConstantSettings {
        most_level_v: 0.04,
        ..MotorConstantSettings::default()
    };
    let error = measure(&mut test_axis, &settings, &mut |_| {}).unwrap_err();
    assert!(
        matches!(error, MotorConstantError::Still { level_v } if level_v == 0.04),
        "{error}"
    );
}

#[test]
fn a_recording_of_something_else_is_refused() {
    let recording = test_of(&StageParameters::real().axes[0], 0, 1).recording;
    // A single pass has no scatter.
    let pass = recording.slice(0..2500);
    let error = evaluated(pass).unwrap_err();
    assert!(
        matches!(error, MotorConstantError::NoPasses { passes: 1 }),
        "{error}"
    );
    let mut sine = recording;
    for (index, voltage) in sine.voltage_v.iter_mut().enumerate() {
        *voltage = 0.1 * (0.2 * index as f64).sin();
    }
    let error = evaluated(sine).unwrap_err();
    assert!(
        matches!(error, MotorConstantError::NoPasses { passes: 0 }),
        "{error}"
    );
}

/// The x axis at a third of its mass, its motor on a spring, with the encoder on the motor.
fn on_a_soft_spring(frequency_hz: f64) -> AxisParameters {
    let mut truth = StageParameters::real().axes[0].clone().with_mass(0.33);
    let gain = truth.gain_mm_per_v_s2;
    let spring = Backlash::resonating(frequency_hz, 0.03, 0.5, gain, EncoderSide::Motor);
    truth.drive = Drive::RackAndPinion(spring);
    truth
}

#[test]
fn a_motor_on_a_soft_spring_is_pushed_gently_until_its_table_slides() {
    let travel_mm = 20.0;
    let settings = MotorConstantSettings::default().fitted_to(travel_mm);
    for frequency_hz in [45.0, 60.0] {
        let truth = on_a_soft_spring(frequency_hz);
        let mut test_axis = SimulatedTestAxis::new(0, truth.clone(), 1).with_travel_mm(travel_mm);
        let found = measure_gently(&mut test_axis, &settings, &mut |_| {}).unwrap();
        // Between the whole mass and the motor's.
        let share = found.gain_mm_per_v_s2 / truth.gain_mm_per_v_s2;
        assert!((0.8..3.5).contains(&share), "{frequency_hz} Hz: {share}");
        let shown = MotorConstantSettings::of(&found.recording);
        assert!(shown.rise_s > 0.04, "{shown:?}");
        let saved = evaluate(found.recording, &shown, RESOLUTION_MM).unwrap();
        assert!((saved.gain_mm_per_v_s2 / found.gain_mm_per_v_s2 - 1.0).abs() < 0.02);
    }
}

#[test]
fn the_noise_of_the_encoder_is_distinguished_from_a_motor_that_swings_on_its_spring() {
    let mut truth = on_a_soft_spring(60.0);
    for noise_mm in [3e-4, 1e-3, 3e-3] {
        truth.imperfections.encoder_noise_mm = noise_mm;
        let counted_mm = truth.resolution_mm / 12.0_f64.sqrt();
        let expected_mm = noise_mm.hypot(counted_mm);
        let found_mm = test_of(&truth, 0, 1).noise_mm();
        let ratio = found_mm / expected_mm;
        assert!((0.8..1.1).contains(&ratio), "{noise_mm}: {found_mm} mm");
    }
}
