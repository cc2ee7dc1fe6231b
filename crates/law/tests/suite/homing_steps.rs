//! The homing routine by itself, tick by tick: how long it looks, what it takes for bounce, and where a mark is trusted.

use quadrant_law::friction::Direction;
use quadrant_law::homing::{Homing, HomingEvent, HomingInput, HomingParameters, HomingState};
use quadrant_law::reference::{
    Approach, MotionScale, MotionState, Ramp, RampState, ReferenceSample, Velocity,
};
use quadrant_law::safety::{AxisSwitches, FaultCode};
use quadrant_law::units::Position;

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 1e4,
};
const DEBOUNCE: u32 = 5;
const SETTLE: u32 = 40;

fn millimetres(value: f64) -> Position {
    Position::from_mm(value, SCALE.resolution_mm)
}

fn parameters() -> HomingParameters {
    HomingParameters {
        direction: Direction::Negative,
        switch: AxisSwitches::HOME,
        search_velocity: Velocity::from_mm_s(20.0, SCALE),
        creep_velocity: Velocity::from_mm_s(5.0, SCALE),
        debounce_ticks: DEBOUNCE,
        settle_ticks: SETTLE,
        index_spacing: None,
        home_offset: millimetres(-40.0),
        parking: millimetres(-39.0),
        travel: millimetres(3.0),
    }
}

struct Routine {
    homing: Homing<f32>,
    ramp: Ramp<f32>,
    state: HomingState<f32>,
    moving: RampState,
    parked: MotionState,
    /// Ticks so far.
    ticks: u32,
    sample: ReferenceSample<f32>,
}

impl Routine {
    fn new(parameters: HomingParameters) -> Self {
        Self {
            homing: Homing::new(parameters, Approach::new(20.0, 500.0, 1e5, SCALE)),
            ramp: Ramp::new(500.0, 1e5, SCALE),
            state: HomingState::default(),
            moving: RampState::at_rest(Position::ZERO),
            parked: MotionState::default(),
            ticks: 0,
            sample: ReferenceSample::default(),
        }
    }

    fn tick(&mut self, pressed: bool, index: Option<Position>) -> HomingEvent {
        let input = HomingInput {
            switches: if pressed {
                AxisSwitches::HOME
            } else {
                AxisSwitches::default()
            },
            index,
            measured: self.sample.position,
        };
        let (sample, event) = self.homing.step(
            &self.ramp,
            &mut self.state,
            &mut self.moving,
            &mut self.parked,
            input,
        );
        self.ticks += 1;
        self.sample = sample;
        event
    }

    fn rests(&self) -> bool {
        self.sample.velocity == 0.0 && self.sample.acceleration == 0.0
    }

    /// Ticks until the reference starts to move.
    fn until_it_moves(&mut self, pressed: bool) -> u32 {
        while self.sample.acceleration == 0.0 {
            assert_eq!(self.tick(pressed, None), HomingEvent::None);
            assert!(self.ticks < 1000, "it does not move");
        }
        self.ticks
    }

    /// Ticks until it searches at full speed.
    fn until_it_searches(&mut self) {
        self.until_it_moves(false);
        while self.sample.acceleration != 0.0 {
            self.tick(false, None);
        }
    }

    /// Meets the switch, brakes, and retracts until the switch, let go, is taken for released; returns the position of its
    /// edge.
    fn until_released(&mut self) -> Position {
        self.until_it_searches();
        while !self.rests() {
            assert_eq!(self.tick(true, None), HomingEvent::None);
        }
        for _ in 0..200 {
            self.tick(true, None);
        }
        let edge = self.sample.position;
        for _ in 0..DEBOUNCE {
            assert_eq!(self.tick(false, None), HomingEvent::None);
        }
        edge
    }
}

#[test]
fn the_switch_is_read_as_often_as_it_may_bounce_before_anything_moves() {
    for pressed in [false, true] {
        let mut routine = Routine::new(parameters());
        // The reading that ends the bounce, one more, and the tick that decides.
        assert_eq!(routine.until_it_moves(pressed), DEBOUNCE + 2);
        // Away from the switch if it is pressed.
        assert_eq!(routine.sample.acceleration > 0.0, pressed);
    }
}

#[test]
fn a_press_no_longer_than_bounce_is_none_and_one_reading_more_is() {
    for (readings, is_press) in [(1, false), (DEBOUNCE, false), (DEBOUNCE + 1, true)] {
        let mut routine = Routine::new(parameters());
        routine.until_it_searches();
        for _ in 0..readings {
            routine.tick(true, None);
        }
        let brakes = routine.sample.acceleration > 0.0;
        assert_eq!(brakes, is_press, "{readings} readings");
        // Readings that were interrupted do not add up.
        if !is_press {
            for _ in 0..readings {
                routine.tick(false, None);
                routine.tick(true, None);
            }
            assert_eq!(routine.sample.acceleration, 0.0);
        }
    }
}

#[test]
fn beyond_the_edge_it_comes_to_rest_before_it_turns_round() {
    let mut routine = Routine::new(parameters());
    routine.until_it_searches();
    let mut rested = 0;
    while routine.sample.velocity <= 0.0 {
        routine.tick(true, None);
        rested += u32::from(routine.rests());
        assert!(routine.ticks < 10_000);
    }
    assert!(rested > 0);
}

#[test]
fn a_switch_that_is_not_met_or_does_not_let_go_ends_it_just_beyond_the_travel() {
    let travel = parameters().travel.0;
    let mut routine = Routine::new(parameters());
    routine.until_it_moves(false);
    let mut before = routine.sample.position;
    while routine.tick(false, None) == HomingEvent::None {
        before = routine.sample.position;
        assert!(routine.ticks < 100_000);
    }
    // Judged on the reference before the tick.
    assert!(before.0.abs() > travel, "{before:?}");
    assert!(before.0.abs() < travel + millimetres(0.003).0);

    let mut routine = Routine::new(parameters());
    let event = loop {
        let event = routine.tick(true, None);
        if event != HomingEvent::None {
            break event;
        }
        assert!(routine.ticks < 100_000);
    };
    assert_eq!(event, HomingEvent::Failed(FaultCode::HomeSwitchStuck));
    assert!(routine.sample.position.0 > travel);
}

#[test]
fn the_origin_is_defined_after_the_whole_rest() {
    let mut routine = Routine::new(parameters());
    let edge = routine.until_released();
    let mut rest = 0;
    let offset = loop {
        match routine.tick(false, None) {
            HomingEvent::None => {}
            HomingEvent::Origin(offset) => break offset,
            other => panic!("{other:?}"),
        }
        rest += u32::from(routine.rests());
        assert!(routine.ticks < 100_000);
    };
    assert_eq!(offset, parameters().home_offset - edge);
    // And the tick that defines it.
    assert_eq!(rest, SETTLE);
    let mut event = HomingEvent::None;
    while event == HomingEvent::None {
        event = routine.tick(false, None);
    }
    assert_eq!(event, HomingEvent::Finished);
    assert_eq!(routine.sample.position, parameters().parking);
}

#[test]
fn an_index_pulse_is_trusted_an_eighth_of_the_spacing_away_from_the_edge_and_not_nearer() {
    let spacing = millimetres(10.0);
    let margin = spacing.0 / 8;
    let near = HomingEvent::Failed(FaultCode::IndexNearSwitch);
    for (distance, expected) in [
        (margin - 1, near),
        (margin, HomingEvent::None),
        (spacing.0 - margin, HomingEvent::None),
        (spacing.0 - margin + 1, near),
    ] {
        let mut routine = Routine::new(HomingParameters {
            index_spacing: Some(spacing),
            ..parameters()
        });
        let edge = routine.until_released();
        assert_eq!(routine.tick(false, None), HomingEvent::None);
        let index = edge + Position(distance);
        assert_eq!(routine.tick(false, Some(index)), expected, "{distance}");
    }
}

#[test]
fn an_index_pulse_is_missing_once_a_spacing_and_its_margin_are_passed() {
    /// Positions in the search for the pulse, its own beginning being zero, until it is missed.
    fn search(spacing: i64) -> Vec<i64> {
        let mut routine = Routine::new(HomingParameters {
            index_spacing: Some(Position(spacing)),
            ..parameters()
        });
        routine.until_released();
        // Released in this tick, and searched for from where the reference was.
        let from = routine.sample.position;
        assert_eq!(routine.tick(false, None), HomingEvent::None);
        let mut seen = vec![];
        loop {
            seen.push((routine.sample.position - from).0);
            match routine.tick(false, None) {
                HomingEvent::None => {}
                HomingEvent::Failed(FaultCode::IndexMissing) => return seen,
                other => panic!("{other:?}"),
            }
        }
    }
    let seen = search(millimetres(1.0).0);
    let (before, last) = (seen[seen.len() - 2], seen[seen.len() - 1]);
    let most = |spacing: i64| spacing + spacing / 8;
    assert!(before <= most(millimetres(1.0).0) && last > most(millimetres(1.0).0));
    // A place that the reference comes upon exactly is not beyond itself. One place in nine is no such sum.
    let places = seen.iter().rev().take(9);
    let (at, spacing) = places
        .flat_map(|&at| (at * 8 / 9 - 2..=at * 8 / 9 + 2).map(move |spacing| (at, spacing)))
        .find(|&(at, spacing)| most(spacing) == at)
        .expect("one of them");
    let again = search(spacing);
    assert_eq!(again[again.len() - 2], at);
}
