//! The motion modes of the axes: stops, single moves and streams through the whole tick.

use quadrant_law::admission::Refusal;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{
    HarmonicSettings, MotionSettings, PointToPointSettings, ReferenceSample, Segment, Velocity,
};
use quadrant_law::safety::{FaultCode, Reaction, SafetyState};
use quadrant_law::supervisor::{Event, Supervisor};
use quadrant_law::units::Position;
use quadrant_settings::stream_planner::{AxisPoint, SetPoint, StreamLimits, StreamPlanner};
use quadrant_settings::{LossReaction, PlanSettings, StageSettings};

use quadrant_test_support::Rig;

/// Ticks in which the axes follow their references to the count.
fn follow(rig: &mut Rig<f32>, ticks: u32) {
    for _ in 0..ticks {
        for index in 0..3 {
            let reference = rig.state.axes()[index].telemetry().reference;
            rig.inputs.readings[index].count = (reference.0 >> 16) as u32;
        }
        rig.tick();
    }
}

fn enabled(settings: &StageSettings, plan: &PlanSettings) -> Rig<f32> {
    let mut rig = Rig::new(settings, plan);
    rig.tick();
    rig.command(Command::Enable);
    rig
}

fn sines() -> PlanSettings {
    let sine = HarmonicSettings::with_velocity(5.0, 50.0, 20.0, 0.2);
    PlanSettings {
        motions: [MotionSettings::Harmonic(sine); 3],
    }
}

/// The largest change of velocity and of acceleration from tick to tick over so many ticks, mm/s and mm/s^2, of x.
fn roughness(rig: &mut Rig<f32>, ticks: u32) -> (f64, f64) {
    let mut positions = vec![];
    for _ in 0..ticks {
        follow(rig, 1);
        positions.push(rig.state.axes()[0].reference().to_mm(5e-4) * 1e4);
    }
    let differences =
        |values: &[f64]| -> Vec<f64> { values.windows(2).map(|pair| pair[1] - pair[0]).collect() };
    let largest = |values: &[f64]| {
        values
            .iter()
            .fold(0.0, |most: f64, value| most.max(value.abs()))
    };
    let velocity_changes = differences(&differences(&positions));
    let jolts = differences(&velocity_changes);
    (largest(&velocity_changes), largest(&jolts) * 1e4)
}

#[test]
fn a_stop_brakes_a_motion_in_flight_without_a_jolt_and_holds() {
    for after in [400, 2_345, 3_777, 5_000] {
        let mut rig = enabled(&StageSettings::simulated(), &sines());
        rig.command(Command::Run);
        follow(&mut rig, after);
        rig.inputs.command = Some(Command::Stop);
        let (velocity_change, jolt) = roughness(&mut rig, 1_000);
        // 4000 mm/s^2 and 1e6 mm/s^3: per tick 0.4 mm/s and 100 mm/s^2. Where the stop begins, an acceleration that speeds
        // the axis up ends at once: of this motion at most 500 mm/s^2.
        assert!(velocity_change <= 0.4 + 0.001, "{velocity_change}");
        assert!(jolt <= 500.0 + 100.0 + 10.0, "{jolt} after {after}");
        assert!(!rig.state.is_running());
        assert!(rig.state.safety().is_enabled());
        let rest = rig.state.axes()[0].reference();
        follow(&mut rig, 100);
        assert_eq!(rig.state.axes()[0].reference(), rest);
    }
}

#[test]
fn one_axis_moves_alone_while_another_jogs() {
    let mut plan = PlanSettings::default();
    plan.motions[1] = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: 3.0,
        max_velocity_mm_s: 50.0,
        max_acceleration_mm_s2: 1000.0,
        max_jerk_mm_s3: 1e5,
    });
    let mut rig = enabled(&StageSettings::simulated(), &plan);
    let slow = Velocity::from_mm_s(1.0, StageSettings::simulated().motion_scale(0));
    rig.command(Command::Jog(AxisName::X, slow));
    rig.command(Command::StartMove(AxisName::Y));
    follow(&mut rig, 3_000);
    let [x, y, z] = &**rig.state.axes();
    assert_eq!(x.mode(), MotionMode::Jog);
    assert_eq!(
        (y.mode(), y.reference()),
        (MotionMode::Hold, Position::from_mm(3.0, 5e-4))
    );
    assert_eq!(
        (z.mode(), z.reference()),
        (MotionMode::Hold, Position::ZERO)
    );
}

/// A stream of x and y from rest to rest, `count` set points of 1 ms; the axes' segments.
fn stream(count: u32) -> Vec<[Segment; 3]> {
    let settings = StageSettings::simulated();
    let limits = core::array::from_fn(|index| StreamLimits {
        scale: settings.motion_scale(index),
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 2000.0,
        travel: None,
        has_law: true,
    });
    let mut planner = StreamPlanner::new(limits, 10, [Position::ZERO; 3]);
    (1..=count)
        .map(|number| {
            let share = f64::from(number) / f64::from(count);
            let seconds = f64::from(count) * 1e-3;
            // 10 mm by the smoothest polynomial of fifth degree.
            let position = 10.0 * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share.powi(2));
            let velocity = 300.0 * (share * (1.0 - share)).powi(2) / seconds;
            let acceleration =
                600.0 * share * (1.0 - share) * (1.0 - 2.0 * share) / seconds.powi(2);
            let point = |index: usize, sign: f64| {
                AxisPoint::new(
                    ReferenceSample {
                        position: Position::from_mm(sign * position, 5e-4),
                        velocity: sign * velocity,
                        acceleration: sign * acceleration,
                    },
                    settings.motion_scale(index),
                )
            };
            let last = number == count;
            let axes = [point(0, 1.0), point(1, -1.0), AxisPoint::default()];
            planner
                .plan(&SetPoint { number, axes, last })
                .expect("within limits")
        })
        .collect()
}

/// Gives the axes the segments they want, as the control task does from its queue.
struct Feed {
    segments: Vec<[Segment; 3]>,
    next: [usize; 3],
}

impl Feed {
    fn new(segments: Vec<[Segment; 3]>) -> Self {
        Self {
            segments,
            next: [0; 3],
        }
    }

    fn serve(&mut self, rig: &mut Rig<f32>) {
        for (index, name) in AxisName::ALL.into_iter().enumerate() {
            if rig.state.axes()[index].wants_segment()
                && let Some(segments) = self.segments.get(self.next[index])
            {
                rig.state.offer_segment(name, &segments[index]);
                self.next[index] += 1;
            }
        }
    }
}

#[test]
fn a_stream_ends_where_its_last_set_point_is_on_all_axes() {
    let mut rig = enabled(&StageSettings::simulated(), &PlanSettings::default());
    let mut feed = Feed::new(stream(500));
    feed.serve(&mut rig);
    rig.command(Command::StartStream);
    assert!(rig.state.is_running());
    for _ in 0..5_100 {
        feed.serve(&mut rig);
        follow(&mut rig, 1);
    }
    assert!(rig.state.safety().is_enabled(), "{:?}", rig.state.safety());
    assert!(!rig.state.is_running());
    let [x, y, z] = rig.state.axes().each_ref().map(|axis| axis.reference());
    let ten = Position::from_mm(10.0, 5e-4);
    assert_eq!([x, y, z], [ten, -ten, Position::ZERO]);
}

#[test]
fn an_underrun_brakes_and_latches_a_fault_or_holds_as_the_settings_say() {
    for (underrun, reaction) in [
        (LossReaction::Stop, Reaction::Stop),
        (LossReaction::Hold, Reaction::Hold),
    ] {
        let mut settings = StageSettings::simulated();
        settings.streaming.underrun = underrun;
        let mut rig = enabled(&settings, &PlanSettings::default());
        let mut segments = stream(500);
        segments.truncate(250);
        let mut feed = Feed::new(segments);
        feed.serve(&mut rig);
        rig.command(Command::StartStream);
        let mut found = None;
        let (mut position, mut displacement) = (Position::ZERO, Position::ZERO);
        for tick in 0..4_000 {
            feed.serve(&mut rig);
            follow(&mut rig, 1);
            let x = rig.state.axes()[0].reference();
            let change = (x - position - displacement).to_mm(5e-4) * 1e4;
            // 4000 mm/s^2: no jump where the stream ends and the braking begins.
            assert!(change.abs() <= 0.4 + 0.001, "{change} at {tick}");
            (position, displacement) = (x, x - position);
            let fault = rig.state.safety().fault().or(rig.state.held());
            if let (None, Some(fault)) = (found, fault) {
                assert_eq!(fault.code, FaultCode::StreamUnderrun);
                found = Some(tick);
            }
        }
        // 250 segments of 10 ticks; the axis with the longest preview starts at once.
        assert_eq!(found, Some(2_500 - 1));
        assert!(!rig.state.is_running());
        match reaction {
            Reaction::Hold => assert!(rig.state.safety().is_enabled()),
            _ => assert!(matches!(rig.state.safety(), SafetyState::Faulted(_))),
        }
    }
}

#[test]
fn a_stop_forgets_a_stream_that_has_not_begun() {
    let mut rig = enabled(&StageSettings::simulated(), &PlanSettings::default());
    Feed::new(stream(500)).serve(&mut rig);
    assert!(rig.stage.as_ref().view(&rig.plan, &rig.state).stream_ready);
    rig.command(Command::Stop);
    assert!(!rig.stage.as_ref().view(&rig.plan, &rig.state).stream_ready);
    assert!(rig.state.axes().iter().all(|axis| axis.wants_segment()));
}

#[test]
fn a_request_that_cannot_be_followed_is_refused_with_its_reason() {
    let mut rig = enabled(&StageSettings::simulated(), &sines());
    let refused = |rig: &Rig<f32>, command| {
        let decision = Supervisor::default().step(
            rig.stage.as_ref().view(&rig.plan, &rig.state),
            Some(command),
        );
        decision
            .events
            .into_iter()
            .flatten()
            .find_map(|event| match event {
                Event::Refused(_, refusal) => Some(refusal),
                _ => None,
            })
    };
    let jog = Command::Jog(AxisName::X, Velocity::ZERO);
    assert_eq!(refused(&rig, Command::StartStream), Some(Refusal::NoStream));
    assert_eq!(refused(&rig, jog), None);
    assert_eq!(refused(&rig, Command::Home(AxisName::X)), None);
    rig.command(Command::Run);
    let busy = Some(Refusal::AxisBusy(AxisName::X));
    assert_eq!(refused(&rig, jog), busy);
    assert_eq!(refused(&rig, Command::Home(AxisName::X)), busy);
    assert_eq!(refused(&rig, Command::StartMove(AxisName::X)), busy);
    assert_eq!(
        refused(&rig, Command::StartStream),
        Some(Refusal::AlreadyRunning)
    );
    assert_eq!(refused(&rig, Command::Stop), None);
    assert!(
        Refusal::AxisBusy(AxisName::X)
            .to_string()
            .starts_with("x: ")
    );
    rig.command(Command::Disable);
    for command in [
        jog,
        Command::Home(AxisName::X),
        Command::StartMove(AxisName::X),
        Command::StartStream,
    ] {
        assert_eq!(refused(&rig, command), Some(Refusal::NotEnabled));
    }
}

#[test]
fn a_stream_that_meets_another_one_ends_both_without_a_jump() {
    let mut rig = enabled(&StageSettings::simulated(), &PlanSettings::default());
    let mut segments = stream(500);
    segments.truncate(250);
    segments.extend(stream(500));
    let mut feed = Feed::new(segments);
    feed.serve(&mut rig);
    rig.command(Command::StartStream);
    let mut displacement = Position::ZERO;
    let mut position = Position::ZERO;
    for tick in 0..4_000 {
        feed.serve(&mut rig);
        follow(&mut rig, 1);
        let x = rig.state.axes()[0].reference();
        let change = (x - position - displacement).to_mm(5e-4) * 1e4;
        assert!(change.abs() <= 0.4 + 0.001, "{change} at {tick}");
        (position, displacement) = (x, x - position);
    }
    let fault = rig.state.safety().fault().expect("latched");
    assert_eq!(fault.code, FaultCode::StreamUnderrun);
}

/// Ticks from a jog's start to the first motion of the reference of x, which waits for a longer preview.
fn ticks_until_a_jog_moves(before: impl FnOnce(&mut Rig<f32>)) -> u32 {
    let mut settings = StageSettings::simulated();
    let [x, y, _] = &mut settings.axes;
    (x.feedforward.preview_s, y.feedforward.preview_s) = (0.0, 3e-3);
    let mut rig = enabled(&settings, &PlanSettings::default());
    before(&mut rig);
    let rest = rig.state.axes()[0].reference();
    let fast = Velocity::from_mm_s(50.0, settings.motion_scale(0));
    rig.inputs.command = Some(Command::Jog(AxisName::X, fast));
    let mut ticks = 0;
    while rig.state.axes()[0].reference() == rest {
        follow(&mut rig, 1);
        ticks += 1;
    }
    ticks
}

#[test]
fn a_jog_begins_at_once_whatever_the_axis_waited_for_before() {
    let usual = ticks_until_a_jog_moves(|_| {});
    assert!(usual < 3, "{usual}");
    let after_a_plan = ticks_until_a_jog_moves(|rig| {
        // x has nothing to do in it.
        rig.command(Command::Run);
        follow(rig, 3);
        assert!(!rig.state.is_running());
    });
    assert_eq!(after_a_plan, usual);
    let after_a_stop = ticks_until_a_jog_moves(|rig| {
        let mut feed = Feed::new(stream(500));
        feed.serve(rig);
        rig.command(Command::StartStream);
        rig.command(Command::Stop);
        for _ in 0..1000 {
            follow(rig, 1);
            if !rig.state.is_running() {
                break;
            }
        }
    });
    assert_eq!(after_a_stop, usual);
}
