//! Changes of state that the board's own log reports.

use quadrant::app::{
    ChangeDetector, MAX_STATE_CHANGES, ServerStatistics, StateChange, TimingStatistics,
};
use quadrant_law::admission::StageView;
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::motion::MotionMode;

/// A machine that somebody else changes between looks.
#[derive(Default)]
struct Machine {
    changes: ChangeDetector,
    tick: u32,
    view: StageView,
    server: ServerStatistics,
    timing: TimingStatistics,
}

impl Machine {
    fn compare(&mut self) -> Vec<StateChange> {
        let news = self
            .changes
            .compare(self.tick, &self.view, self.server, self.timing);
        news.to_vec()
    }
}

#[test]
fn a_machine_at_rest_is_no_news() {
    let mut machine = Machine::default();
    assert_eq!(machine.compare(), []);
    machine.tick = 1_000_000;
    assert_eq!(
        machine.compare(),
        [],
        "a host that never came is not missed"
    );
}

#[test]
fn homing_is_reported_from_its_beginning_to_its_end() {
    let mut machine = Machine::default();
    machine.view.modes[1] = MotionMode::Home;
    assert_eq!(
        machine.compare(),
        [StateChange::Began(AxisName::Y, MotionMode::Home)]
    );
    assert_eq!(machine.compare(), []);
    machine.view.modes[1] = MotionMode::Hold;
    machine.view.homed[1] = true;
    assert_eq!(machine.compare(), [StateChange::Homed(AxisName::Y)]);
}

#[test]
fn homing_that_finds_nothing_is_reported_too() {
    let mut machine = Machine::default();
    machine.view.modes[2] = MotionMode::Home;
    machine.compare();
    machine.view.modes[2] = MotionMode::Stopping;
    assert_eq!(
        machine.compare(),
        [
            StateChange::NotHomed(AxisName::Z),
            StateChange::Began(AxisName::Z, MotionMode::Stopping)
        ]
    );
    machine.view.modes[2] = MotionMode::Hold;
    assert_eq!(
        machine.compare(),
        [StateChange::Ended(AxisName::Z, MotionMode::Stopping)]
    );
}

#[test]
fn a_host_is_reported_when_it_comes_falls_silent_and_comes_back() {
    let mut machine = Machine {
        tick: 50_000,
        ..Machine::default()
    };
    machine.server.greeted = true;
    machine.server.request_tick = 50_000;
    assert_eq!(machine.compare(), [StateChange::Greeted]);
    machine.tick = 80_000;
    assert_eq!(machine.compare(), []);
    machine.tick = 80_001;
    assert_eq!(machine.compare(), [StateChange::Silent]);
    machine.tick = 200_000;
    assert_eq!(machine.compare(), [], "silence is reported once");
    machine.server.request_tick = 200_000;
    assert_eq!(machine.compare(), [StateChange::Back]);
}

#[test]
fn losses_are_reported_by_how_much_they_grew() {
    let mut machine = Machine::default();
    machine.server.bad_frames = 3;
    machine.server.dropped_samples = 10;
    machine.server.dropped_events = 1;
    machine.timing.overruns = 2;
    assert_eq!(
        machine.compare(),
        [
            StateChange::BadFrames(3),
            StateChange::SamplesLost(10),
            StateChange::EventsLost(1),
            StateChange::LateTicks(2)
        ]
    );
    machine.server.bad_frames = 4;
    machine.server.dropped_samples = 0;
    assert_eq!(
        machine.compare(),
        [StateChange::BadFrames(1)],
        "another selection counts from zero"
    );
    machine.server.dropped_samples = 5;
    machine.compare();
    machine.server.bad_frames = 9;
    machine.server.dropped_samples = 7;
    machine.server.dropped_events = 4;
    machine.timing.overruns = 6;
    assert_eq!(
        machine.compare(),
        [
            StateChange::BadFrames(5),
            StateChange::SamplesLost(2),
            StateChange::EventsLost(3),
            StateChange::LateTicks(4)
        ]
    );
}

#[test]
fn settings_and_captures_are_reported_once() {
    let mut machine = Machine::default();
    machine.server.applied = 1;
    machine.server.stored = 1;
    machine.server.captures = 7;
    assert_eq!(
        machine.compare(),
        [
            StateChange::Applied,
            StateChange::Stored,
            StateChange::Captured(7)
        ]
    );
    assert_eq!(machine.compare(), []);
}

#[test]
fn all_at_once_finds_room() {
    let mut machine = Machine::default();
    machine.view.modes = PerAxis::splat(MotionMode::Home);
    machine.compare();
    machine.view.modes = PerAxis::splat(MotionMode::Stopping);
    machine.server = ServerStatistics {
        greeted: true,
        request_tick: 0,
        bad_frames: 1,
        dropped_samples: 1,
        dropped_events: 1,
        applied: 1,
        stored: 1,
        captures: 1,
    };
    machine.timing.overruns = 1;
    assert_eq!(machine.compare().len(), MAX_STATE_CHANGES);
}
