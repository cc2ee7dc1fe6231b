//! Homing on a stage that follows its reference to the count: what is found does not depend on where the axis started,
//! nor on a switch that scatters, bounces and has play.

use proptest::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::friction::Direction;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::{AxisSwitches, FaultCode, SafetyState, Switches};
use quadrant_law::units::Position;
use quadrant_settings::{AxisSettings, HomeSwitch, HomingSettings, PlanSettings};

use quadrant_test_support::{Noise, Rig, repeatable, with_x};

/// Counts between index pulses.
const REVOLUTION: i64 = 20_000;
/// Count of one of them.
const PULSE: i64 = 8_000;

/// The machine around the x axis, in its own counts, of which the encoder knows nothing.
struct Machine {
    rig: Rig<f32>,
    /// Position at which the encoder's counter was switched on.
    start: i64,
    raw: i64,
    /// The table, which hangs behind the screw by the play.
    table: i64,
    play: i64,
    switch: Box<dyn Fn(i64) -> AxisSwitches>,
    has_index: bool,
    noise: Noise,
    /// Scatter of the switch's edge.
    scatter: i64,
}

fn home_below(edge: i64) -> Box<dyn Fn(i64) -> AxisSwitches> {
    Box::new(move |table| {
        if table <= edge {
            AxisSwitches::HOME
        } else {
            AxisSwitches::default()
        }
    })
}

/// Within -60..60 mm; fast, so that a test is short.
fn settings(axis: &mut AxisSettings) {
    axis.homing = Some(HomingSettings {
        direction: Direction::Negative,
        switch: HomeSwitch::Home,
        search_mm_s: 80.0,
        latch_mm_s: 10.0,
        debounce_s: 5e-4,
        index: true,
        mark_mm: -36.0,
        park_mm: -30.0,
        travel_mm: 130.0,
    });
}

impl Machine {
    fn new(start: i64, change: impl FnOnce(&mut AxisSettings)) -> Self {
        let settings = with_x(|axis| {
            settings(axis);
            change(axis);
        });
        let mut machine = Self {
            rig: Rig::new(&settings, &PlanSettings::default()),
            start,
            raw: 0,
            table: start,
            play: 0,
            switch: home_below(-80_000),
            has_index: true,
            noise: Noise::new(start as u64),
            scatter: 0,
        };
        machine.tick(None);
        machine.tick(Some(Command::Enable));
        machine
    }

    fn tick(&mut self, command: Option<Command>) {
        let telemetry = *self.rig.state.axes()[0].telemetry();
        let drives = self.rig.state.safety().drives();
        let reference = telemetry.reference.0 >> 16;
        let step = if drives {
            reference - telemetry.measured.0
        } else {
            0
        };
        let before = self.raw + self.start;
        self.raw += step;
        let here = self.raw + self.start;
        self.table = self.table.clamp(here - self.play, here + self.play);
        let (low, high) = (before.min(here), before.max(here));
        // Passed since the last tick: of a pulse that was stood on, only leaving it counts once.
        let pulse = (high - PULSE).div_euclid(REVOLUTION) * REVOLUTION + PULSE;
        let reading = &mut self.rig.inputs.readings[0];
        reading.count = self.raw as u32;
        reading.index =
            (self.has_index && pulse > low && step != 0).then_some((pulse - self.start) as u32);
        let scatter = if self.scatter > 0 {
            self.noise.counts(self.scatter)
        } else {
            0
        };
        let x = (self.switch)(self.table + scatter);
        self.rig.inputs.switches = Switches::NONE.with_axis(AxisName::X, x);
        self.rig.inputs.command = command;
        let switches = self.rig.inputs.switches;
        self.rig.tick();
        self.rig.inputs.switches = switches;
    }

    /// Homes and waits for the end.
    fn home(&mut self) {
        self.tick(Some(Command::Home(AxisName::X)));
        for _ in 0..200_000 {
            self.tick(None);
            if !self.rig.state.is_running() {
                break;
            }
        }
        for _ in 0..400 {
            self.tick(None);
        }
        assert!(!self.rig.state.is_running(), "it never ends");
    }

    /// The machine's count at which the encoder's is zero, once homed.
    fn origin(&self) -> Option<i64> {
        let x = &self.rig.state.axes()[0];
        let known = x.is_homed() && self.rig.state.safety() == SafetyState::Enabled;
        known.then_some(self.raw + self.start - x.telemetry().measured.0)
    }

    fn fault(&self) -> Option<FaultCode> {
        self.rig.state.safety().fault().map(|fault| fault.code)
    }
}

/// The first pulse above the switch's edge at -80 000 is at -72 000; it is to be -36 mm, -72 000 counts.
const ORIGIN: i64 = 0;

#[test]
fn homing_finds_the_origin_and_parks() {
    for start in [12_345, -79_999, -81_234, -100_000] {
        let mut machine = Machine::new(start, |_| {});
        machine.home();
        assert_eq!(
            machine.origin(),
            Some(ORIGIN),
            "from {start}: {:?}",
            machine.fault()
        );
        let x = &machine.rig.state.axes()[0];
        let park = Position::from_mm(-30.0, 5e-4);
        assert_eq!((x.reference(), x.telemetry().reference), (park, park));
        assert_eq!(x.telemetry().measured.0, -60_000);
        assert_eq!(x.mode(), MotionMode::Hold);
    }
}

proptest! {
    #![proptest_config(repeatable(40))]

    #[test]
    fn the_origin_is_the_same_to_the_count_however_the_switch_scatters(
        start in -100_000i64..40_000,
        edge in -4_000i64..4_000,
        scatter in 0i64..200,
        play in 0i64..100,
    ) {
        let mut machine = Machine::new(start, |_| {});
        machine.switch = home_below(-80_000 + edge);
        machine.scatter = scatter;
        machine.play = play;
        machine.home();
        prop_assert_eq!(machine.origin(), Some(ORIGIN), "{:?}", machine.fault());
    }
}

#[test]
fn without_an_index_the_edge_of_the_switch_is_the_mark() {
    let mut origins = vec![];
    for start in [30_000, -50_000, -90_000] {
        let mut machine = Machine::new(start, |x| {
            let homing = x.homing.as_mut().expect("given");
            homing.index = false;
            homing.mark_mm = -40.0;
        });
        machine.home();
        origins.push(machine.origin().expect("homed"));
    }
    // Read once a tick at 10 mm/s: two counts.
    assert!(
        origins.iter().all(|origin| (0..=2).contains(origin)),
        "{origins:?}"
    );
}

#[test]
fn a_limit_switch_serves_as_the_home_switch() {
    let mut machine = Machine::new(0, |x| {
        x.homing.as_mut().expect("given").switch = HomeSwitch::Limit;
    });
    machine.switch = Box::new(|table| {
        if table <= -80_000 {
            AxisSwitches::NEGATIVE_LIMIT
        } else {
            AxisSwitches::default()
        }
    });
    machine.home();
    assert_eq!(machine.origin(), Some(ORIGIN), "{:?}", machine.fault());
    // As a limit it works otherwise.
    machine.tick(Some(Command::Jog(
        AxisName::X,
        quadrant_law::reference::Velocity::from_displacement(Position(-(2 << 16))),
    )));
    for _ in 0..60_000 {
        machine.tick(None);
    }
    assert_eq!(machine.fault(), Some(FaultCode::NegativeLimitSwitch));
}

#[test]
fn homing_towards_larger_positions_is_the_mirror_image() {
    let mut machine = Machine::new(0, |x| {
        let homing = x.homing.as_mut().expect("given");
        homing.direction = Direction::Positive;
        homing.mark_mm = 34.0;
        homing.park_mm = 30.0;
    });
    machine.switch = Box::new(|table| {
        if table >= 80_000 {
            AxisSwitches::HOME
        } else {
            AxisSwitches::default()
        }
    });
    machine.home();
    // The first pulse below 80 000 is at 68 000, which is 34 mm.
    assert_eq!(machine.origin(), Some(0), "{:?}", machine.fault());
}

#[test]
fn what_is_not_found_or_not_to_be_trusted_is_a_fault_with_its_own_code() {
    type Change = fn(&mut Machine);
    let cases: [(Change, FaultCode); 4] = [
        (
            |m| m.switch = Box::new(|_| AxisSwitches::default()),
            FaultCode::HomeSwitchMissing,
        ),
        (
            |m| m.switch = Box::new(|_| AxisSwitches::HOME),
            FaultCode::HomeSwitchStuck,
        ),
        (|m| m.has_index = false, FaultCode::IndexMissing),
        (
            |m| m.switch = home_below(-73_000),
            FaultCode::IndexNearSwitch,
        ),
    ];
    for (change, code) in cases {
        let mut machine = Machine::new(0, |_| {});
        change(&mut machine);
        machine.home();
        assert!(
            matches!(machine.rig.state.safety(), SafetyState::Faulted(fault)
                if fault.code == code && fault.axis == Some(AxisName::X)),
            "{code:?}: {:?}",
            machine.rig.state.safety()
        );
        assert!(!machine.rig.state.axes()[0].is_homed());
    }
    // The index that the search passes near the switch's edge, on the other side of it.
    let mut machine = Machine::new(0, |_| {});
    machine.switch = home_below(-71_000);
    machine.home();
    assert_eq!(machine.fault(), Some(FaultCode::IndexNearSwitch));
}

#[test]
fn defining_the_origin_moves_nothing() {
    let mut machine = Machine::new(12_345, |_| {});
    machine.tick(Some(Command::Home(AxisName::X)));
    let mut last = 0i16;
    let mut shifted = false;
    for _ in 0..200_000 {
        let before = *machine.rig.state.axes()[0].telemetry();
        machine.tick(None);
        let x = &machine.rig.state.axes()[0];
        let telemetry = x.telemetry();
        let jumped = (telemetry.measured.0 - before.measured.0).abs() > 1_000;
        if jumped {
            shifted = true;
            assert_eq!(telemetry.error.to_bits(), before.error.to_bits());
            assert!(
                (telemetry.code.0 - last).abs() <= 1,
                "{last} {:?}",
                telemetry.code
            );
            let feedforward = &telemetry.feedforward;
            assert_eq!((feedforward.viscous, feedforward.inertia), (0.0, 0.0));
        }
        last = telemetry.code.0;
        if x.mode() == MotionMode::Hold {
            break;
        }
    }
    assert!(shifted);
}

#[test]
fn an_axis_that_is_homed_again_is_not_homed_meanwhile() {
    let mut machine = Machine::new(-70_000, |_| {});
    machine.home();
    assert!(machine.rig.state.axes()[0].is_homed());
    machine.tick(Some(Command::Home(AxisName::X)));
    assert!(!machine.rig.state.axes()[0].is_homed());
    machine.tick(Some(Command::Stop));
    for _ in 0..2_000 {
        machine.tick(None);
    }
    assert!(!machine.rig.state.is_running());
    assert!(machine.rig.state.safety().is_enabled());
    assert!(!machine.rig.state.axes()[0].is_homed());
}

#[test]
fn an_encoder_that_may_have_lost_counts_costs_the_origin() {
    for spoil in [
        (|rig| rig.inputs.readings[0].valid = false) as fn(&mut Rig<f32>),
        |rig| rig.inputs.readings[0].count = rig.inputs.readings[0].count.wrapping_add(5_000),
        |rig| {
            // Between two pulses: no multiple of a revolution.
            rig.inputs.readings[0].index = Some(rig.inputs.readings[0].count);
            rig.tick();
            rig.inputs.readings[0].index = Some(rig.inputs.readings[0].count.wrapping_add(777));
        },
    ] {
        let mut machine = Machine::new(-70_000, |_| {});
        machine.home();
        assert!(machine.rig.state.axes()[0].is_homed());
        spoil(&mut machine.rig);
        machine.rig.tick();
        assert!(machine.rig.state.safety().fault().is_some());
        assert!(!machine.rig.state.axes()[0].is_homed());
    }
}

#[test]
fn an_axis_that_is_found_beyond_its_travel_comes_back() {
    let mut machine = Machine::new(0, |x| {
        let travel = x.limits.travel_mm.as_mut().expect("by default");
        (travel.negative, travel.positive) = (-50.0, 50.0);
        // The mark is where the travel does not reach.
        x.homing.as_mut().expect("given").mark_mm = -70.0;
    });
    // It was within the travel when it was homed before.
    machine.rig.state.set_homed(AxisName::X, true);
    for _ in 0..10 {
        machine.tick(None);
    }
    machine.home();
    assert_eq!(machine.fault(), None);
    assert_eq!(
        machine.rig.state.axes()[0].reference(),
        Position::from_mm(-30.0, 5e-4)
    );
}
