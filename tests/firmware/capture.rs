//! The triggered capture against a list of what it should have kept.

use proptest::prelude::*;
use quadrant::app::capture::{Capture, CaptureError};
use quadrant::app::glitch_monitor::GlitchReadings;
use quadrant::app::telemetry::{Observation, Selection};
use quadrant_law::command::Command;
use quadrant_link::message::{
    CaptureCause, CapturePhase, Channel, Edge, Level, MAX_CHANNELS, Trigger,
};
use quadrant_settings::StageSettings;

use quadrant_test_support::{Rig, repeatable, sine_on_x};

fn channel(name: &str) -> Channel {
    name.parse().expect("a channel")
}

fn ticks_and_errors(decimation: u16) -> Selection {
    Selection::new(&[channel("stage.tick"), channel("x.error")], decimation).expect("two")
}

/// A stage and the capture that watches it.
struct Watched<'a> {
    rig: Rig<f32>,
    capture: Capture<'a>,
}

impl<'a> Watched<'a> {
    fn new(words: &'a mut [u32]) -> Self {
        Self {
            rig: Rig::new(&StageSettings::simulated(), &sine_on_x(30.0, 10.0)),
            capture: Capture::new(words),
        }
    }

    /// One tick; says whether it froze the ring.
    fn tick(&mut self) -> bool {
        let commanded = self.rig.inputs.command.is_some();
        self.rig.tick();
        self.capture.step(&Observation {
            stage: &self.rig.state,
            glitches: &GlitchReadings::default(),
            elapsed_cycles: 0,
            commanded,
        })
    }

    fn command(&mut self, command: Command) -> bool {
        self.rig.inputs.command = Some(command);
        self.tick()
    }

    fn run(&mut self, ticks: u32) -> u32 {
        (0..ticks).map(|_| u32::from(self.tick())).sum()
    }

    /// Ticks until the ring is frozen.
    fn until_frozen(&mut self) -> u32 {
        (1..100_000).find(|_| self.tick()).expect("freezes")
    }

    fn words(&self) -> Vec<u32> {
        self.capture.words::<f32>(0).collect()
    }

    fn ticks(&self) -> Vec<u32> {
        self.words().chunks(2).map(|sample| sample[0]).collect()
    }
}

#[test]
fn a_capture_keeps_its_share_from_before_the_trigger() {
    let mut room = [0; 200];
    let mut watched = Watched::new(&mut room);
    let armed = watched
        .capture
        .arm(ticks_and_errors(1), 30, Trigger::Command);
    assert_eq!(armed, Ok(()));
    assert_eq!(watched.run(500), 0);
    assert_eq!(watched.capture.phase(), CapturePhase::Armed);
    assert!(!watched.command(Command::Enable));
    assert_eq!(watched.capture.phase(), CapturePhase::Triggered);
    assert_eq!(watched.capture.record(), None, "not while it records");
    assert!(watched.words().is_empty());
    assert_eq!(
        watched.until_frozen(),
        69,
        "70 of 100 samples, the trigger's the first"
    );
    let record = watched.capture.record().expect("frozen");
    assert_eq!((record.samples, record.trigger_sample), (100, 30));
    assert_eq!((record.first_tick, record.trigger_tick), (470, 500));
    assert_eq!(record.cause, CaptureCause::Command);
    assert!(watched.ticks().into_iter().eq(470..570));
    assert_eq!(watched.run(1000), 0, "it stays as it is");
    assert!(watched.ticks().into_iter().eq(470..570));
    // Pages join without a seam, and there is nothing behind the end.
    let pages = [0, 60, 120, 180].map(|offset| watched.capture.words::<f32>(offset).take(60));
    assert!(pages.into_iter().flatten().eq(watched.words()));
    assert_eq!(watched.capture.words::<f32>(200).len(), 0);
    assert_eq!(watched.capture.words::<f32>(usize::MAX).len(), 0);
}

#[test]
fn a_trigger_soon_after_arming_keeps_what_there_is() {
    let mut room = [0; 201];
    let mut watched = Watched::new(&mut room);
    watched.run(10);
    let armed = watched
        .capture
        .arm(ticks_and_errors(1), 90, Trigger::Command);
    assert_eq!(armed, Ok(()));
    watched.run(3);
    watched.command(Command::Enable);
    assert_eq!(watched.until_frozen(), 9);
    let record = watched.capture.record().expect("frozen");
    assert_eq!(
        (record.samples, record.trigger_sample, record.first_tick),
        (13, 3, 10)
    );
    assert!(watched.ticks().into_iter().eq(10..23));
}

#[test]
fn every_fault_leaves_its_trace_whatever_the_capture_waits_for() {
    for trigger in [Trigger::Fault, Trigger::MotionStart, Trigger::Command] {
        let mut room = [0; 80];
        let mut watched = Watched::new(&mut room);
        watched.command(Command::Enable);
        let armed = watched.capture.arm(ticks_and_errors(1), 50, trigger);
        assert_eq!(armed, Ok(()));
        watched.run(100);
        watched.rig.inputs.set_counts([1 << 30, 0, 0]);
        watched.tick();
        assert_eq!(watched.until_frozen(), 19);
        let record = watched.capture.record().expect("frozen");
        assert_eq!(
            (record.cause, record.trigger_tick),
            (CaptureCause::Fault, 101)
        );
        assert!(watched.ticks().into_iter().eq(81..121));
        // Armed again, the fault that is still latched is no news.
        let armed = watched.capture.arm(ticks_and_errors(1), 50, trigger);
        assert_eq!(armed, Ok(()));
        watched.run(300);
        assert_eq!(watched.capture.phase(), CapturePhase::Armed);
    }
}

#[test]
fn now_records_from_the_first_tick_and_fills_the_ring() {
    let mut room = [0; 50];
    let mut watched = Watched::new(&mut room);
    watched.run(5);
    let armed = watched.capture.arm(ticks_and_errors(3), 50, Trigger::Now);
    assert_eq!(armed, Ok(()));
    assert_eq!(watched.until_frozen(), 73, "25 samples, 3 ticks apart");
    let record = watched.capture.record().expect("frozen");
    assert_eq!(
        (record.samples, record.trigger_sample, record.first_tick),
        (25, 0, 5)
    );
    assert!(watched.ticks().into_iter().eq((5..78).step_by(3)));
}

#[test]
fn a_motion_triggers_in_the_tick_that_begins_it() {
    let mut room = [0; 50];
    let mut watched = Watched::new(&mut room);
    let armed = watched
        .capture
        .arm(ticks_and_errors(1), 50, Trigger::MotionStart);
    assert_eq!(armed, Ok(()));
    watched.tick();
    watched.command(Command::Enable);
    watched.run(20);
    assert_eq!(watched.capture.phase(), CapturePhase::Armed);
    watched.command(Command::Run);
    assert_eq!(watched.capture.phase(), CapturePhase::Triggered);
    // Armed while it moves, it waits for the next motion.
    let armed = watched
        .capture
        .arm(ticks_and_errors(1), 50, Trigger::MotionStart);
    assert_eq!(armed, Ok(()));
    watched.run(100);
    assert_eq!(watched.capture.phase(), CapturePhase::Armed);
}

#[test]
fn a_level_triggers_on_the_edge_asked_for() {
    // Pushed from 0 to 20 counts and back, the position rises through 10 and the error falls through -5 um.
    for (name, level, edge, triggered_by) in [
        ("x.position", 10.0, Edge::Rising, "push"),
        ("x.position", 10.0, Edge::Falling, "return"),
        ("x.position", 10.0, Edge::Either, "push"),
        ("x.position", 20.0, Edge::Rising, "push"),
        ("x.position", 20.0, Edge::Falling, "nothing"),
        ("x.position", 21.0, Edge::Either, "nothing"),
        ("x.error", -0.005, Edge::Falling, "push"),
        ("x.error", -0.005, Edge::Rising, "return"),
        ("x.error", -0.005, Edge::Either, "push"),
        ("x.error", -0.02, Edge::Either, "nothing"),
    ] {
        let mut room = [0; 20];
        let mut watched = Watched::new(&mut room);
        watched.command(Command::Enable);
        let trigger = Trigger::Level(Level {
            channel: channel(name),
            edge,
            level,
        });
        assert_eq!(watched.capture.arm(ticks_and_errors(1), 0, trigger), Ok(()));
        watched.run(5);
        let by = [("push", 20), ("return", 0)]
            .into_iter()
            .find(|(_, counts)| {
                watched.rig.inputs.set_counts([*counts, 0, 0]);
                watched.tick();
                watched.capture.phase() == CapturePhase::Triggered
            });
        assert!(watched.rig.state.safety().is_enabled());
        assert_eq!(
            by.map_or("nothing", |(by, _)| by),
            triggered_by,
            "{name} {level} {edge:?}"
        );
    }
}

#[test]
fn what_cannot_be_captured_is_refused_and_changes_nothing() {
    let mut room = [0; 3];
    let mut capture = Capture::new(&mut room);
    let level = |level| {
        Trigger::Level(Level {
            channel: channel("x.error"),
            edge: Edge::Rising,
            level,
        })
    };
    let four = Selection::new(&[channel("x.error"); 4], 1).expect("four");
    for (selection, percent, trigger, error) in [
        (
            ticks_and_errors(1),
            101,
            Trigger::Now,
            CaptureError::PreTrigger(101),
        ),
        (ticks_and_errors(1), 0, level(f64::NAN), CaptureError::Level),
        (
            ticks_and_errors(1),
            0,
            level(f64::INFINITY),
            CaptureError::Level,
        ),
        (four, 0, Trigger::Now, CaptureError::Room(3)),
    ] {
        assert_eq!(capture.arm(selection, percent, trigger), Err(error));
        assert_eq!(capture.phase(), CapturePhase::Idle);
        assert!(!error.to_string().is_empty());
    }
    assert_eq!(
        capture.arm(ticks_and_errors(1), 100, Trigger::Fault),
        Ok(())
    );
}

#[test]
fn a_capture_that_is_stopped_can_be_read() {
    let mut room = [0; 40];
    let mut watched = Watched::new(&mut room);
    assert!(!watched.capture.stop(), "it records nothing yet");
    assert_eq!(
        watched.capture.arm(ticks_and_errors(1), 50, Trigger::Fault),
        Ok(())
    );
    watched.run(33);
    assert!(watched.capture.stop() && !watched.capture.stop());
    let record = watched.capture.record().expect("frozen");
    assert_eq!(record.cause, CaptureCause::Stopped);
    assert!(watched.ticks().into_iter().eq(23..33));
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn a_frozen_ring_holds_the_last_samples_in_order(
        room in 1usize..400,
        channels in 1usize..=MAX_CHANNELS,
        decimation in 1u16..20,
        percent in 0u8..=100,
        wait in 0u32..1500,
    ) {
        prop_assume!(room >= channels);
        let mut room = vec![0; room];
        let capacity = (room.len() / channels) as u32;
        let mut watched = Watched::new(&mut room);
        let selection = Selection::new(&[channel("stage.tick"); 8][..channels], decimation);
        let armed = watched.capture.arm(selection.expect("valid"), percent, Trigger::Command);
        prop_assert_eq!(armed, Ok(()));
        watched.run(wait);
        if !watched.command(Command::Enable) {
            watched.until_frozen();
        }
        let record = watched.capture.record().expect("frozen");
        let decimation = u32::from(decimation);
        let pre = (capacity * u32::from(percent) / 100).min(capacity - 1);
        let taken_before = wait.div_ceil(decimation);
        prop_assert_eq!(record.trigger_sample, pre.min(taken_before));
        prop_assert_eq!(record.samples, record.trigger_sample + capacity - pre);
        prop_assert_eq!(record.trigger_tick, wait);
        let words = watched.words();
        prop_assert_eq!(words.len() as u32, record.samples * channels as u32);
        for (number, sample) in (0u32..).zip(words.chunks(channels)) {
            let tick = record.first_tick + number * decimation;
            prop_assert!(sample.iter().all(|&word| word == tick));
            prop_assert_eq!(tick % decimation, 0, "the cadence is kept from the arming on");
            prop_assert_eq!(number >= record.trigger_sample, tick >= record.trigger_tick);
        }
    }
}
