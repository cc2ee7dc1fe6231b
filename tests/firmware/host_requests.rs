//! Requests of a host on their whole way: from the link through server and queues to the tick, and back.

use quadrant_fault_bench::tasks::Tasks;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::{AxisSwitches, FaultCode, HostNeeded, Switches};
use quadrant_link::message::{
    AxisName, AxisPoint, AxisSet, AxisSignal, Body, CapturePhase, CaptureRequest, CaptureStatus,
    Channel, Inputs, Reply, SetPoint, StreamRequest, TelemetryRequest, Trigger,
};

use crate::preemption::{LINK_TIMEOUT_TICKS, safety, settings};

fn enabled(tasks: &mut Tasks) {
    tasks.ask(Body::Enable).expect("enables");
    tasks.run(40);
    assert!(tasks.upper.borrow().outputs.enabled);
}

/// A stream along x to this distance, in segments of 0.1 s that are all sent at once.
fn stream(tasks: &mut Tasks, points: u32, distance_mm: f64) {
    let share = |number: u32| f64::from(number + 1) / f64::from(points);
    tasks
        .ask(Body::Stream(StreamRequest::Open { period_ticks: 1000 }))
        .expect("opens");
    for first in (0..points).step_by(4) {
        let end = (first + 4).min(points);
        let points = (first..end)
            .map(|number| {
                let at_end = number + 1 == points;
                let mut axes = [AxisPoint::default(); 3];
                axes[0] = AxisPoint {
                    position_mm: distance_mm * share(number),
                    velocity_mm_s: if at_end {
                        0.0
                    } else {
                        (distance_mm / f64::from(points) / 0.1) as f32
                    },
                    acceleration_mm_s2: 0.0,
                };
                SetPoint { axes }
            })
            .collect();
        tasks
            .ask(Body::Stream(StreamRequest::Points {
                sequence: first,
                points,
                last: share(end - 1) >= 1.0,
            }))
            .expect("takes the points");
    }
}

#[test]
fn a_stream_moves_the_axis_to_its_last_point() {
    let mut tasks = Tasks::new(&settings(), 1);
    enabled(&mut tasks);
    stream(&mut tasks, 4, 1.0);
    tasks.run(4500);
    let upper = tasks.upper.borrow();
    assert!(!upper.state().is_running());
    assert_eq!(upper.snapshot().axes[0].measured.0, 2000);
}

/// A set point of x at rest.
fn at_rest(position_mm: f64) -> SetPoint {
    let mut point = SetPoint::default();
    point.axes[0].position_mm = position_mm;
    point
}

/// Set points of x at rest, as a request.
fn points(sequence: u32, positions_mm: &[f64], last: bool) -> Body {
    Body::Stream(StreamRequest::Points {
        sequence,
        points: positions_mm.iter().copied().map(at_rest).collect(),
        last,
    })
}

fn open() -> Body {
    Body::Stream(StreamRequest::Open { period_ticks: 1000 })
}

/// Runs until the axes rest; returns the least and the largest measured count of x.
fn span_of_x(tasks: &mut Tasks) -> (i64, i64) {
    let mut span = (0, 0);
    for _ in 0..6000 {
        tasks.step();
        let x = tasks.upper.borrow().snapshot().axes[0].measured.0;
        span = (span.0.min(x), span.1.max(x));
    }
    assert!(!tasks.upper.borrow().state().is_running());
    span
}

#[test]
fn a_stream_takes_the_place_of_one_that_never_began() {
    let mut tasks = Tasks::new(&settings(), 1);
    enabled(&mut tasks);
    tasks.ask(open()).expect("opens");
    tasks
        .ask(points(0, &[0.5, 1.0, 1.5], false))
        .expect("takes the points");
    // Set points that are refused end nothing, and the client begins again.
    assert!(tasks.ask(points(3, &[900.0], false)).is_err());
    tasks.ask(open()).expect("opens");
    tasks
        .ask(points(0, &[-0.5, -1.0], true))
        .expect("takes the points");
    assert_eq!(span_of_x(&mut tasks), (-2000, 0));
}

#[test]
fn a_stream_that_was_closed_leaves_nothing_to_one_that_follows_at_once() {
    for close in [Body::Stream(StreamRequest::Close), Body::Stop] {
        let mut tasks = Tasks::new(&settings(), 1);
        enabled(&mut tasks);
        tasks.ask(open()).expect("opens");
        tasks
            .ask(points(0, &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], false))
            .expect("takes the points");
        let first = tasks.send(&[
            close,
            open(),
            points(0, &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], false),
            open(),
            points(0, &[-0.5, -1.0], true),
        ]);
        let span = span_of_x(&mut tasks);
        for id in first..first + 5 {
            assert!(
                matches!(tasks.answers.get(&id), Some(Ok(_))),
                "{id}: {:?}",
                tasks.answers.get(&id)
            );
        }
        assert_eq!(span, (-2000, 0));
    }
}

#[test]
fn a_stream_needs_its_host_whatever_the_settings_say() {
    let mut settings = settings();
    settings.operation.host_needed = HostNeeded::EndlessMotion;
    let mut tasks = Tasks::new(&settings, 1);
    enabled(&mut tasks);
    // 1.2 s of it are with the board when the host falls silent.
    stream(&mut tasks, 12, 3.0);
    tasks.run(LINK_TIMEOUT_TICKS + 3000);
    let fault = safety(&tasks).fault().expect("latched");
    assert_eq!(fault.code, FaultCode::LinkLost);
}

#[test]
fn telemetry_comes_without_gaps_and_shows_the_motion() {
    let mut tasks = Tasks::new(&settings(), 1);
    enabled(&mut tasks);
    let channels = [
        Channel::Axis(AxisName::Z, AxisSignal::Reference),
        Channel::Axis(AxisName::X, AxisSignal::Glitch),
    ];
    tasks
        .ask(Body::Telemetry(TelemetryRequest::Select {
            channels: channels.into_iter().collect(),
            decimation: 5,
        }))
        .expect("selects");
    let jog = Body::Jog {
        axis: AxisName::Z,
        velocity_mm_s: 2.0,
    };
    tasks.ask(jog).expect("jogs");
    tasks.run(3000);
    let samples: Vec<(u32, Vec<u32>)> = tasks
        .blocks
        .iter()
        .flat_map(|block| {
            block
                .samples()
                .map(|(number, words)| (number, words.collect()))
        })
        .collect();
    assert!(samples.len() > 500, "{}", samples.len());
    for (expected, (number, words)) in samples.iter().enumerate() {
        assert_eq!((*number, words.len()), (expected as u32, 2));
    }
    let first = samples[0].1[0] as i32;
    let last = samples[samples.len() - 1].1[0] as i32;
    assert!(last > first + 200, "{first} to {last} counts");
}

fn capture(tasks: &mut Tasks, request: CaptureRequest) -> CaptureStatus {
    match tasks.ask(Body::Capture(request)) {
        Ok(Reply::Capture(status)) => status,
        other => panic!("{other:?}"),
    }
}

fn arm(tasks: &mut Tasks, trigger: Trigger) -> CaptureStatus {
    let disarmed = capture(tasks, CaptureRequest::Disarm);
    tasks.run(20);
    let request = CaptureRequest::Arm {
        channels: [Channel::Axis(AxisName::Y, AxisSignal::Output)]
            .into_iter()
            .collect(),
        decimation: 1,
        pre_trigger_percent: 0,
        trigger,
    };
    assert_ne!(disarmed.phase, CapturePhase::Triggered);
    capture(tasks, request);
    tasks.run(20);
    capture(tasks, CaptureRequest::State)
}

#[test]
fn a_capture_is_armed_waits_for_its_trigger_fills_and_comes_back() {
    let mut tasks = Tasks::new(&settings(), 1);
    enabled(&mut tasks);
    tasks.run(100);
    let armed = arm(&mut tasks, Trigger::Command);
    assert_eq!(armed.record, None);
    tasks.run(1000);
    let waiting = capture(&mut tasks, CaptureRequest::State);
    assert_ne!(waiting.phase, CapturePhase::Frozen);
    tasks.upper.borrow_mut().operate(Command::Stop);
    tasks.run(1000);
    let full = capture(&mut tasks, CaptureRequest::State);
    assert_eq!(full.phase, CapturePhase::Frozen);
    let record = full.record.expect("recorded");
    assert!(record.samples > 30, "{record:?}");
    // What is broken off comes back, too, with what it has.
    arm(&mut tasks, Trigger::Fault);
    tasks.run(100);
    capture(&mut tasks, CaptureRequest::Disarm);
    tasks.run(40);
    let stopped = capture(&mut tasks, CaptureRequest::State);
    assert_eq!(stopped.phase, CapturePhase::Frozen);
    assert_ne!(stopped.number, full.number);
}

#[test]
fn the_inputs_are_shown_as_they_are() {
    let mut tasks = Tasks::new(&settings(), 1);
    let pressed = Switches::NONE
        .with_axis(quadrant_law::axes::AxisName::Y, AxisSwitches::HOME)
        .with_axis(
            quadrant_law::axes::AxisName::X,
            AxisSwitches::POSITIVE_LIMIT,
        );
    tasks.upper.borrow_mut().inputs.switches = pressed;
    tasks.run(40);
    let Ok(Reply::Inputs(Inputs {
        switches, indexed, ..
    })) = tasks.ask(Body::Inputs)
    else {
        panic!("shows them");
    };
    assert_eq!((switches, indexed), (pressed.bits(), AxisSet::NONE));
}

#[test]
fn a_glitch_that_was_found_is_shown_as_telemetry() {
    let mut tasks = Tasks::new(&settings(), 1);
    enabled(&mut tasks);
    let seen = |tasks: &mut Tasks| {
        tasks.blocks.clear();
        tasks
            .ask(Body::Telemetry(TelemetryRequest::Select {
                channels: [Channel::Axis(AxisName::X, AxisSignal::Glitch)]
                    .into_iter()
                    .collect(),
                decimation: 10,
            }))
            .expect("selects");
        tasks.run(2000);
        let block = tasks.blocks.last().expect("sends").clone();
        let (_, mut words) = block.samples().last().expect("has one");
        f32::from_bits(words.next().expect("a channel"))
    };
    assert_eq!(seen(&mut tasks), 0.0);
    // The axis is held back by 20 counts for a moment after its reversal.
    for velocity_mm_s in [2.0, -2.0] {
        tasks
            .ask(Body::Jog {
                axis: AxisName::X,
                velocity_mm_s,
            })
            .expect("jogs");
        tasks.upper.borrow_mut().pushed = if velocity_mm_s < 0.0 { 20 } else { 0 };
        tasks.run(2000);
    }
    assert_eq!(
        tasks.upper.borrow().state().axes()[0].mode(),
        MotionMode::Jog
    );
    tasks.upper.borrow_mut().pushed = 0;
    tasks.run(4000);
    let height = seen(&mut tasks);
    assert!(height > 5.0, "{height} um");
}
