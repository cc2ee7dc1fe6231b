//! Samples, captures, streams and experiments.

use std::time::Duration;

use quadrant_gcode::{Limits, Program, Trajectory};
use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_link::message::AxisName;
use quadrant_link::message::Trigger;
use quadrant_link::message::{AxisSignal, Channel, StageSignal};
use quadrant_link::message::{Body, SetPoint};
use quadrant_tune::record::{AxisLimits, Record};
use quadrant_tune::test_axis::{Drive, Experiment, TestAxis};

use super::connected;
use crate::client::samples::{Samples, TelemetryRecorder, arm, least_decimation, read_capture};
use crate::client::set_points::{set_points, stream};
use crate::client::test_axis::ConnectedAxis;
use crate::client::{ClientError, columns};

const POSITION: Channel = Channel::Axis(AxisName::X, AxisSignal::Position);
const REFERENCE: Channel = Channel::Axis(AxisName::X, AxisSignal::Reference);
const ERROR: Channel = Channel::Axis(AxisName::X, AxisSignal::Error);
const OUTPUT: Channel = Channel::Axis(AxisName::X, AxisSignal::Output);
const TICK: Channel = Channel::Stage(StageSignal::Tick);

fn move_x(client: &mut crate::client::Client, target_mm: f64) {
    client.order(Body::Enable).unwrap();
    client
        .order(Body::Move {
            axis: AxisName::X,
            target_mm,
            velocity_mm_s: 10.0,
        })
        .unwrap();
}

#[test]
fn a_recording_has_every_sample_at_its_tick() {
    let (mut client, _) = connected();
    let mut recording = TelemetryRecorder::start(&mut client, &[TICK, ERROR], 5).unwrap();
    for _ in 0..10 {
        recording
            .gather(&mut client, Duration::from_millis(20))
            .unwrap();
    }
    let samples = recording.finish(&mut client).unwrap();
    // 400 but for a block that was not full.
    assert!((345..=400).contains(&samples.len()), "{}", samples.len());
    assert_eq!(samples.lost(), 0);
    let ticks = samples.values(0);
    assert_eq!(ticks[0], f64::from(samples.first_tick));
    assert!(ticks.windows(2).all(|pair| pair[1] - pair[0] == 5.0));
    assert!((samples.time_s()[100] - 0.05).abs() < 1e-12);
}

#[test]
fn lost_samples_are_counted_and_leave_a_gap_in_time() {
    let (mut client, bench) = connected();
    bench.borrow_mut().lose_every = Some(50);
    let mut recording = TelemetryRecorder::start(&mut client, &[TICK], 10).unwrap();
    recording
        .gather(&mut client, Duration::from_millis(200))
        .unwrap();
    let samples = recording.finish(&mut client).unwrap();
    assert_eq!(samples.lost(), 2);
    let (time, ticks) = (samples.time_s(), samples.values(0));
    for (time, tick) in time.iter().zip(&ticks) {
        assert!((time - (tick - ticks[0]) * 1e-4).abs() < 1e-9);
    }
}

#[test]
fn counters_go_on_where_they_wrap() {
    let samples = Samples {
        channels: vec![REFERENCE],
        sample_time_s: 1e-4,
        decimation: 1,
        first_tick: 0,
        numbers: vec![0, 1, 2, 3],
        words: vec![vec![
            i32::MAX as u32 - 1,
            i32::MAX as u32,
            i32::MIN as u32,
            i32::MIN as u32 + 1,
        ]],
    };
    let values = samples.values(0);
    assert!(
        values.windows(2).all(|pair| pair[1] - pair[0] == 1.0),
        "{values:?}"
    );
}

#[test]
fn a_recorded_axis_is_what_the_other_commands_read() {
    let (mut client, _) = connected();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.csv");
    let channels = [REFERENCE, POSITION, OUTPUT];
    let mut recording = TelemetryRecorder::start(&mut client, &channels, 2).unwrap();
    move_x(&mut client, 2.0);
    recording
        .gather(&mut client, Duration::from_millis(300))
        .unwrap();
    let samples = recording.finish(&mut client).unwrap();
    let written = columns::write(&samples, &path, &[0.0005; 3]).unwrap();
    assert_eq!(written, std::slice::from_ref(&path));
    let limits = AxisLimits {
        travel_mm: 200.0,
        max_velocity_mm_s: 250.0,
        max_acceleration_mm_s2: 1e9,
        resolution_mm: 0.0005,
    };
    let record = Record::read(&path, &limits).unwrap();
    assert!((record.reference_mm.last().unwrap() - 2.0).abs() < 1e-6);
    assert!((record.position_mm.unwrap().last().unwrap() - 2.0).abs() < 1e-6);
    assert!((record.sample_time_s - 2e-4).abs() < 1e-12);
    assert!(record.voltage_v.is_some());
}

#[test]
fn several_axes_have_a_file_each() {
    let folder = tempfile::tempdir().unwrap();
    let samples = Samples {
        channels: vec![ERROR, Channel::Axis(AxisName::Z, AxisSignal::Error), TICK],
        sample_time_s: 1e-3,
        decimation: 10,
        first_tick: 7,
        numbers: vec![0, 1],
        words: vec![vec![0; 2], vec![0; 2], vec![7, 17]],
    };
    let written = columns::write(&samples, &folder.path().join("a.csv"), &[1.0; 3]).unwrap();
    let names: Vec<_> = written
        .iter()
        .map(|path| path.file_name().unwrap())
        .collect();
    assert_eq!(names, ["a-x.csv", "a-z.csv"]);
    let text = std::fs::read_to_string(&written[1]).unwrap();
    assert_eq!(text, "t_s,error_mm,tick\n0,0,7\n0.001,0,17\n");
}

#[test]
fn the_line_bounds_how_often_channels_are_sampled() {
    assert_eq!(least_decimation(2, 1e4), 1);
    assert_eq!(least_decimation(3, 1e4), 2);
    assert_eq!(least_decimation(8, 1e4), 4);
}

#[test]
fn a_capture_is_read_page_by_page() {
    let (mut client, _) = connected();
    let error = read_capture(&mut client, Duration::from_millis(50))
        .unwrap_err()
        .to_string();
    assert!(error.contains("`capture arm`"), "{error}");
    arm(
        &mut client,
        &[TICK, ERROR, POSITION],
        1,
        50,
        Trigger::Command,
    )
    .unwrap();
    let (samples, record) = read_capture(&mut client, Duration::from_millis(50)).unwrap();
    assert_eq!((samples.len(), record.trigger_sample), (300, 100));
    assert!(samples.values(0).into_iter().eq((0..300).map(f64::from)));
    assert!(
        samples
            .values(1)
            .iter()
            .all(|error| (error - 0.001).abs() < 1e-9)
    );
}

#[test]
fn a_program_arrives_whole_in_order_and_ends_at_rest() {
    let (mut client, bench) = connected();
    client.order(Body::Enable).unwrap();
    let program = Program::parse("G21 G90 G17\nF600\nG1 X5\nG3 X5 Y4 J2\nG1 X0\nM2").unwrap();
    let limits = Limits::of(&quadrant_settings::StageSettings::simulated());
    let trajectory = Trajectory::plan(&program, &limits).unwrap();
    let points = set_points(&trajectory, 1e4, 20, [10.0, 0.0, -1.0]);
    bench.borrow_mut().noise = vec![0, 3, 0];
    bench.borrow_mut().lose_answers = 0;
    let mut reported = 0;
    stream(&mut client, &points, 20, &mut |_, sent| {
        assert!(sent >= reported);
        reported = sent;
        Ok(())
    })
    .unwrap();
    assert_eq!(reported, points.len());
    assert_eq!(bench.borrow().points, points);
    let last = points.last().unwrap();
    let expected = trajectory.point(&trajectory.places(1e4).last().unwrap());
    for axis in 0..3 {
        let end = last.axes[axis];
        assert_eq!((end.velocity_mm_s, end.acceleration_mm_s2), (0.0, 0.0));
        let target = expected[axis] + [10.0, 0.0, -1.0][axis];
        assert!((end.position_mm - target).abs() < 1e-9);
    }
}

#[test]
fn a_stream_that_fails_is_closed_and_one_that_did_not_begin_is_not() {
    let (mut client, bench) = connected();
    let points = [SetPoint::default(); 100];
    // The outputs are off: somebody else's motion is not to be stopped.
    let refused = stream(&mut client, &points, 20, &mut |_, _| Ok(()));
    assert!(refused.is_err());
    let asked = |name| {
        bench
            .borrow()
            .requests
            .iter()
            .filter(|it| **it == name)
            .count()
    };
    assert_eq!(asked("stream"), 1);
    client.order(Body::Enable).unwrap();
    let error = stream(&mut client, &points, 20, &mut |_, sent| {
        assert!(sent < points.len());
        Err(ClientError::Moving)
    });
    assert!(matches!(error, Err(ClientError::Moving)), "{error:?}");
    let status = client.status().unwrap();
    assert!(!status.running, "the stream is open still");
}

#[test]
fn a_set_points_velocity_and_acceleration_are_those_of_its_position() {
    let program = Program::parse("G21 G90 G17\nF600\nG3 X10 Y0 I5\nM2").unwrap();
    let limits = Limits::of(&quadrant_settings::StageSettings::simulated());
    let trajectory = Trajectory::plan(&program, &limits).unwrap();
    let (rate, period) = (1e4, 10);
    let step = f64::from(period) / rate;
    let points = set_points(&trajectory, rate, period, [0.0; 3]);
    for neighbours in points.windows(3) {
        for axis in 0..3 {
            let [before, at, after] = [0, 1, 2].map(|k| neighbours[k].axes[axis]);
            let velocity = (after.position_mm - before.position_mm) / (2.0 * step);
            assert!(
                (velocity - f64::from(at.velocity_mm_s)).abs() < 0.05,
                "{velocity}"
            );
            let acceleration = f64::from(after.velocity_mm_s - before.velocity_mm_s) / (2.0 * step);
            let stated = f64::from(at.acceleration_mm_s2);
            assert!(
                (acceleration - stated).abs() < 25.0,
                "{acceleration} {stated}"
            );
        }
    }
}

#[test]
fn a_connected_axis_runs_experiments_in_closed_loop() {
    let (mut client, bench) = connected();
    let mut test_axis = ConnectedAxis::new(
        &mut client,
        quadrant_law::axes::AxisName::X,
        quadrant_tune::test_axis::Travel::either_way(200.0),
    )
    .unwrap();
    let motion = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: 5.0,
        max_velocity_mm_s: 20.0,
        max_acceleration_mm_s2: 300.0,
        max_jerk_mm_s3: 5e3,
    });
    let mut experiment = Experiment {
        name: "to and fro".to_owned(),
        drive: Drive::ClosedLoop(motion),
        injection_v: Vec::new(),
        decimation: 10,
        time_limit_s: 20.0,
    };
    let recording = test_axis.perform(&experiment, &mut |_| {}).unwrap();
    // The model's plan takes half a second, but its axes stand.
    assert!(
        (0.5..0.7).contains(&recording.duration_s()),
        "{}",
        recording.duration_s()
    );
    assert!((recording.sample_time_s - 1e-3).abs() < 1e-12);
    assert_eq!(recording.reference_mm, recording.position_mm);
    assert_eq!(bench.borrow().plan.unwrap().motions[0], motion);
    // The machine refuses an injection: the experiment says so.
    experiment.injection_v = vec![0.1; 100];
    let error = test_axis
        .perform(&experiment, &mut |_| {})
        .unwrap_err()
        .to_string();
    assert!(error.contains("the model injects nothing"), "{error}");
}
