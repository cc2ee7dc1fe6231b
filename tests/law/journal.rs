//! The events that the board's own log tells.

use quadrant::admission::StageView;
use quadrant::app::{Journal, MOST_NEWS, Meters, News, Vitals};
use quadrant::axes::AxisName;
use quadrant::axes::PerAxis;
use quadrant::motion::MotionMode;

/// A machine that somebody else changes between looks.
#[derive(Default)]
struct Machine {
    journal: Journal,
    tick: u32,
    view: StageView,
    vitals: Vitals,
    meters: Meters,
}

impl Machine {
    fn look(&mut self) -> Vec<News> {
        let news = self
            .journal
            .look(self.tick, &self.view, self.vitals, self.meters);
        news.to_vec()
    }
}

#[test]
fn a_machine_at_rest_is_no_news() {
    let mut machine = Machine::default();
    assert_eq!(machine.look(), []);
    machine.tick = 1_000_000;
    assert_eq!(machine.look(), [], "a host that never came is not missed");
}

#[test]
fn homing_is_told_from_its_beginning_to_its_end() {
    let mut machine = Machine::default();
    machine.view.modes[1] = MotionMode::Home;
    assert_eq!(machine.look(), [News::Began(AxisName::Y, MotionMode::Home)]);
    assert_eq!(machine.look(), []);
    machine.view.modes[1] = MotionMode::Hold;
    machine.view.homed[1] = true;
    assert_eq!(machine.look(), [News::Homed(AxisName::Y)]);
}

#[test]
fn homing_that_finds_nothing_is_told_too() {
    let mut machine = Machine::default();
    machine.view.modes[2] = MotionMode::Home;
    machine.look();
    machine.view.modes[2] = MotionMode::Stopping;
    assert_eq!(
        machine.look(),
        [
            News::NotHomed(AxisName::Z),
            News::Began(AxisName::Z, MotionMode::Stopping)
        ]
    );
    machine.view.modes[2] = MotionMode::Hold;
    assert_eq!(
        machine.look(),
        [News::Ended(AxisName::Z, MotionMode::Stopping)]
    );
}

#[test]
fn a_host_is_told_when_it_comes_falls_silent_and_comes_back() {
    let mut machine = Machine {
        tick: 50_000,
        ..Machine::default()
    };
    machine.vitals.greeted = true;
    machine.vitals.heard_tick = 50_000;
    assert_eq!(machine.look(), [News::Greeted]);
    machine.tick = 80_000;
    assert_eq!(machine.look(), []);
    machine.tick = 80_001;
    assert_eq!(machine.look(), [News::Silent]);
    machine.tick = 200_000;
    assert_eq!(machine.look(), [], "silence is told once");
    machine.vitals.heard_tick = 200_000;
    assert_eq!(machine.look(), [News::Back]);
}

#[test]
fn losses_are_told_by_how_much_they_grew() {
    let mut machine = Machine::default();
    machine.vitals.bad_frames = 3;
    machine.vitals.dropped_samples = 10;
    machine.vitals.dropped_events = 1;
    machine.meters.overruns = 2;
    assert_eq!(
        machine.look(),
        [
            News::BadFrames(3),
            News::SamplesLost(10),
            News::EventsLost(1),
            News::LateTicks(2)
        ]
    );
    machine.vitals.bad_frames = 4;
    machine.vitals.dropped_samples = 0;
    assert_eq!(
        machine.look(),
        [News::BadFrames(1)],
        "another selection counts from zero"
    );
}

#[test]
fn settings_and_captures_are_told_once() {
    let mut machine = Machine::default();
    machine.vitals.applied = 1;
    machine.vitals.stored = 1;
    machine.vitals.captures = 7;
    assert_eq!(
        machine.look(),
        [News::Applied, News::Stored, News::Captured(7)]
    );
    assert_eq!(machine.look(), []);
}

#[test]
fn all_at_once_finds_room() {
    let mut machine = Machine::default();
    machine.view.modes = PerAxis::splat(MotionMode::Home);
    machine.look();
    machine.view.modes = PerAxis::splat(MotionMode::Stopping);
    machine.vitals = Vitals {
        greeted: true,
        heard_tick: 0,
        bad_frames: 1,
        dropped_samples: 1,
        dropped_events: 1,
        applied: 1,
        stored: 1,
        captures: 1,
    };
    machine.meters.overruns = 1;
    assert_eq!(machine.look().len(), MOST_NEWS);
}
