//! Experiments on the simulated stage's axes.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::pid::PidGains;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_law::units::DacCode;
use quadrant_settings::presets::x_axis;
use quadrant_sim::plant::StageParameters;
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{
    Drive, Experiment, ExperimentError, SimulatedTestAxis, TestAxis, approach, approach_mm_s,
};

fn test_axis(seed: u64) -> SimulatedTestAxis {
    SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), seed)
}

fn experiment(drive: Drive, injection_v: Vec<f64>) -> Experiment {
    Experiment {
        name: "test".to_owned(),
        drive,
        injection_v,
        decimation: 1,
        time_limit_s: 30.0,
    }
}

fn moving(distance_mm: f64) -> Drive {
    Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm,
        max_velocity_mm_s: 20.0,
        max_acceleration_mm_s2: 500.0,
        max_jerk_mm_s3: 1e4,
    }))
}

fn perform(
    test_axis: &mut SimulatedTestAxis,
    experiment: &Experiment,
) -> Result<Recording, ExperimentError> {
    test_axis.perform(experiment, &mut |_| {})
}

#[test]
fn a_motion_is_recorded_from_its_start_to_its_end() {
    let mut test_axis = test_axis(1);
    let recording = perform(&mut test_axis, &experiment(moving(5.0), Vec::new())).unwrap();
    let (first, last) = (recording.reference_mm[0], recording.reference_mm.last());
    assert!((last.unwrap() - first - 5.0).abs() < 1e-3);
    let tracking = recording.reference_mm.iter().zip(&recording.position_mm);
    assert!(tracking.into_iter().all(|(r, y)| (r - y).abs() < 0.5));
    assert!(recording.injection_v.iter().all(|v| *v == 0.0));
}

#[test]
fn an_experiment_goes_on_with_what_the_law_held_unless_the_outputs_were_switched_off() {
    let begins_at_v = |between: fn(&mut SimulatedTestAxis)| {
        let mut test_axis = test_axis(1);
        // Two seconds, in which the integral comes to rest.
        let first = perform(&mut test_axis, &experiment(moving(5.0), vec![0.0; 20_000])).unwrap();
        between(&mut test_axis);
        let rest = experiment(Drive::ClosedLoop(MotionSettings::Hold), vec![0.0; 10]);
        let second = perform(&mut test_axis, &rest).unwrap();
        let ended_mm = first.reference_mm.last().unwrap();
        let moved_um = 1e3 * (second.reference_mm[0] - ended_mm).abs();
        let ended_v = first.voltage_v.last().unwrap();
        (second.voltage_v[0] / ended_v, moved_um)
    };
    let (share, moved_um) = begins_at_v(|_| {});
    println!("{share} of the voltage, {moved_um} um");
    assert!((share - 1.0).abs() < 0.2 && moved_um < 0.01);
    let (share, _) = begins_at_v(|axis| axis.switch_off().unwrap());
    assert!(share.abs() < 0.2, "{share}");
    let (share, _) = begins_at_v(|axis| {
        let mut settings = axis.settings().clone();
        settings.feedback.pid.kp_v_per_mm *= 0.99;
        axis.apply(&settings).unwrap();
    });
    assert!(share.abs() < 0.2, "other settings: {share}");
}

#[test]
fn the_axis_stays_where_an_experiment_left_it() {
    let mut test_axis = test_axis(1);
    perform(&mut test_axis, &experiment(moving(5.0), Vec::new())).unwrap();
    let back = perform(&mut test_axis, &experiment(moving(-5.0), Vec::new())).unwrap();
    assert!((back.position_mm[0] - 5.0).abs() < 0.2);
    assert!(back.position_mm.last().unwrap().abs() < 0.2);
}

#[test]
fn an_open_loop_gets_the_injection_and_nothing_else() {
    let mut test_axis = test_axis(1);
    let injection: Vec<f64> = (0..500).map(|k| if k < 250 { 0.5 } else { -0.5 }).collect();
    let recording = perform(
        &mut test_axis,
        &experiment(Drive::OpenLoop, injection.clone()),
    )
    .unwrap();
    assert_eq!(recording.len(), 500);
    // Half a step of the converter.
    let worst = injection
        .iter()
        .zip(&recording.voltage_v)
        .fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
    assert!(worst <= 0.5 * DacCode(1).to_volts(10.0) + 1e-12);
    assert!(recording.position_mm.iter().any(|y| *y > 0.1));
}

#[test]
fn feedback_fights_an_injected_voltage() {
    let mut test_axis = test_axis(1);
    let held = Drive::ClosedLoop(MotionSettings::Hold);
    let recording = perform(&mut test_axis, &experiment(held, vec![1.0; 5000])).unwrap();
    let end = recording.len() - 1;
    // The friction takes a part; the feedback the rest, less what holds the axis off its reference.
    assert!(recording.voltage_v[end] < 0.25);
    assert_eq!(recording.injection_v[end], 1.0);
}

#[test]
fn decimation_averages_the_voltage_and_drops_an_incomplete_sample() {
    let ramp: Vec<f64> = (0..1005).map(|k| 1e-5 * f64::from(k)).collect();
    let mut coarse = experiment(Drive::OpenLoop, ramp);
    coarse.decimation = 10;
    let recording = perform(&mut test_axis(1), &coarse).unwrap();
    assert_eq!(recording.len(), 100);
    assert_eq!(recording.position_mm.len(), recording.voltage_v.len());
    assert!((recording.sample_time_s - 1e-3).abs() < 1e-12);
    assert!((recording.injection_v[50] - 1e-5 * 504.5).abs() < 1e-12);
}

#[test]
fn an_axis_in_open_loop_is_stopped_where_it_leaves_what_it_may_use_of_its_travel() {
    let mut test_axis = test_axis(1);
    let push = experiment(Drive::OpenLoop, vec![0.5; 100_000]);
    let error = perform(&mut test_axis, &push).unwrap_err();
    let said = error.to_string();
    assert!(matches!(error, ExperimentError::Travel { .. }), "{said}");
    assert!(said.contains("what this may use of its travel"), "{said}");
    let stopped = test_axis.interrupted().unwrap();
    let most = |most: f64, position_mm: &f64| most.max(position_mm.abs());
    let most_mm = stopped.position_mm.iter().fold(0.0, most);
    assert!(most_mm < 0.5 * test_axis.info().travel_mm, "{most_mm}");
}

#[test]
fn an_axis_that_runs_away_is_stopped() {
    let error = perform(
        &mut test_axis(1),
        &experiment(Drive::OpenLoop, vec![5.0; 10_000]),
    )
    .unwrap_err();
    assert!(
        matches!(error, ExperimentError::Overspeed { .. }),
        "{error}"
    );
}

#[test]
fn an_axis_that_slips_is_not_stopped_below_the_speed_at_which_a_machine_would() {
    let mut test_axis = test_axis(1);
    let mut settings = test_axis.settings().clone();
    settings.limits.max_velocity_mm_s = 21.0;
    test_axis.apply(&settings).unwrap();
    // A load throws it beyond the limit, and not beyond a quarter more.
    let loads_v = std::iter::repeat_n(0.0, 5_000).chain(std::iter::repeat_n(0.1, 7));
    test_axis.load(loads_v);
    let recording = perform(&mut test_axis, &experiment(moving(20.0), Vec::new())).unwrap();
    let speeds = recording.position_mm.windows(21);
    let fastest = speeds
        .map(|part| (part[20] - part[0]) * 500.0)
        .fold(0.0, f64::max);
    println!("{fastest} mm/s");
    assert!((21.0..26.0).contains(&fastest), "{fastest}");
}

#[test]
fn an_experiment_that_does_not_end_in_time_says_what_it_waited_for() {
    let mut endless = experiment(moving(50.0), Vec::new());
    endless.time_limit_s = 1.0;
    let error = perform(&mut test_axis(1), &endless).unwrap_err();
    assert_eq!(
        error.to_string(),
        "test: not ended after 1 s: the motion has not ended"
    );
}

#[test]
fn a_fault_of_the_law_ends_the_experiment() {
    let mut test_axis = test_axis(1);
    let held = Drive::ClosedLoop(MotionSettings::Hold);
    let kick: Vec<f64> = vec![8.0; 20_000];
    let error = perform(&mut test_axis, &experiment(held, kick)).unwrap_err();
    assert!(matches!(error, ExperimentError::Fault { .. }), "{error}");
}

#[test]
fn refused_settings_leave_the_old_ones_in_force() {
    let mut test_axis = test_axis(1);
    let before = test_axis.settings().clone();
    let mut bad = x_axis();
    bad.feedback.pid.kp_v_per_mm = -1.0;
    assert!(test_axis.apply(&bad).is_err());
    assert_eq!(test_axis.settings(), &before);
}

#[test]
fn the_same_seed_gives_the_same_recording() {
    let record =
        |seed| perform(&mut test_axis(seed), &experiment(moving(1.0), Vec::new())).unwrap();
    assert_eq!(record(3), record(3));
    assert_ne!(record(3), record(4));
}

/// A PID that friction holds until its integral has grown: at the usual velocity it is left behind by more than the limit.
#[test]
fn an_axis_that_lags_too_far_behind_an_approach_is_moved_more_slowly() {
    let mut test_axis = test_axis(1);
    let mut settings = test_axis.settings().clone();
    settings.feedforward.kind = FeedforwardKind::None;
    settings.feedback.law = LawKind::Pid;
    settings.feedback.pid = PidGains {
        kp_v_per_mm: 0.02,
        ki_v_per_mm_s: 0.1,
        kd_v_s_per_mm: 1e-3,
        ..settings.feedback.pid
    };
    settings.limits.following_error_mm = 2.0;
    settings.limits.following_error_max_mm = 2.0;
    test_axis.apply(&settings).unwrap();
    let at_once = Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: 10.0,
        max_velocity_mm_s: approach_mm_s(&test_axis.info()),
        max_acceleration_mm_s2: 300.0,
        max_jerk_mm_s3: 5e3,
    }));
    let fault = perform(&mut test_axis, &experiment(at_once, Vec::new()));
    assert!(
        matches!(fault, Err(ExperimentError::Fault { .. })),
        "{fault:?}"
    );
    approach(&mut test_axis, 10.0).unwrap();
    let look = experiment(Drive::ClosedLoop(MotionSettings::Hold), vec![0.0; 100]);
    let there = perform(&mut test_axis, &look).unwrap();
    assert!((there.position_mm[0] - 10.0).abs() < 2.0, "{there:?}");
}
