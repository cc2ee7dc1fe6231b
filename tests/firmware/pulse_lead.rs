//! Axes that another control leads by step and direction, and switches by its line.

use std::cell::RefCell;
use std::rc::Rc;

use quadrant::app::{Axis, Control, Inputs, PulseLead, Queues};
use quadrant::hal::{PulseReadings, Pulses};
use quadrant_fault_bench::tasks::Tasks;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{PulseState, Velocity};
use quadrant_law::safety::{AxisSwitches, FaultCode, SafetyState, Switches};
use quadrant_law::stage::Outputs;
use quadrant_law::units::Position;
use quadrant_link::message::{Body, LinkError, SettingsRequest};
use quadrant_settings::{PlanSettings, PulseSettings, StageSettings};
use quadrant_sim::plant::{SimulatedStage, StageParameters};

use crate::preemption::set;

const STEP_MM: f64 = 5e-3;
/// Distance to the reference of an axis that steps have stopped at once: it creeps into its place.
const NEAR_MM: f64 = 0.03;

/// The lines of a control, as a test sets them.
#[derive(Default)]
struct Lines {
    seen: PulseReadings,
    alarm: bool,
}

/// The end of the lines at the board.
struct BoardEnd(Rc<RefCell<Lines>>);

impl Pulses for BoardEnd {
    fn read(&mut self) -> PulseReadings {
        self.0.borrow().seen
    }

    fn set_alarm(&mut self, alarm: bool) {
        self.0.borrow_mut().alarm = alarm;
    }
}

/// The fast half behind those lines, on the simulated stage.
struct Rig {
    control: Control<'static, 'static, f32>,
    lead: PulseLead<'static, BoardEnd>,
    lines: Rc<RefCell<Lines>>,
    stage: SimulatedStage,
    outputs: Outputs,
    switches: Switches,
}

fn settings() -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.pulses = Some(PulseSettings {
            step_mm: STEP_MM,
            ..PulseSettings::default()
        });
    }
    settings
}

impl Rig {
    fn new(settings: &StageSettings) -> Self {
        let (axes, operation) = settings.build().expect("valid settings").into_axes();
        let plan = PlanSettings::default().build(settings).expect("no motion");
        let axes = axes.map(|axis| -> &'static mut Axis<f32> { Box::leak(Box::new(axis)) });
        let queues: &'static mut Queues<'static, f32> = Box::leak(Box::new(Queues::new()));
        let (ends, ..) = queues.split();
        let lines: Rc<RefCell<Lines>> = Rc::default();
        let memory = || Some(Box::leak(Box::<PulseState>::default()));
        Self {
            control: Control::new(axes, operation, plan, settings.rate_hz as u32, ends),
            lead: PulseLead::new(BoardEnd(Rc::clone(&lines)), [memory(), memory(), None]),
            lines,
            stage: SimulatedStage::new(&StageParameters::ideal(), settings.rate_hz, 1),
            outputs: Outputs::default(),
            switches: Switches::NONE,
        }
    }

    /// A rig whose line was off, and has come on: the axes follow.
    fn following() -> Self {
        let mut rig = Self::new(&settings());
        rig.run(100);
        rig.switch(true);
        assert_eq!(rig.mode(), MotionMode::Plan);
        rig
    }

    fn tick(&mut self, request: Option<Command>) {
        let command = self.lead.step(&mut self.control).or(request);
        let mut inputs = Inputs {
            command,
            switches: self.switches,
            ..Inputs::default()
        };
        inputs.set_counts(self.stage.read_counters());
        self.outputs = self.control.tick(&mut inputs);
        self.stage.step(&self.outputs);
    }

    fn run(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.tick(None);
        }
    }

    /// Makes steps of x, evenly over some ticks.
    fn step(&mut self, steps: i32, ticks: i32) {
        let from = self.lines.borrow_mut().seen.counts[0];
        for tick in 1..=ticks {
            let made = steps * tick / ticks;
            self.lines.borrow_mut().seen.counts[0] = from.wrapping_add_signed(made);
            self.tick(None);
        }
    }

    /// Sets the line SERVO ON, and waits.
    fn switch(&mut self, on: bool) {
        self.lines.borrow_mut().seen.servo_on = on;
        self.run(100);
    }

    fn alarm(&self) -> bool {
        self.lines.borrow().alarm
    }

    fn mode(&self) -> MotionMode {
        self.control.state().axes()[AxisName::X].mode()
    }

    fn reference(&self) -> Position {
        self.control.state().axes()[AxisName::X].reference()
    }

    fn position_mm(&self) -> f64 {
        self.stage.axes()[0].position_mm()
    }

    fn fault(&self) -> Option<FaultCode> {
        let fault = self.control.state().safety().fault()?;
        assert_eq!(fault.axis, Some(AxisName::X));
        Some(fault.code)
    }
}

#[test]
fn an_axis_follows_the_steps_from_where_it_stands_when_the_line_comes_on() {
    let mut rig = Rig::new(&settings());
    // What is counted before does not matter.
    rig.lines.borrow_mut().seen.counts = [123_456, 7, 0];
    rig.run(100);
    rig.step(-200, 100);
    assert!(!rig.outputs.enabled);
    let before = rig.reference();
    rig.switch(true);
    assert!(rig.outputs.enabled && !rig.alarm());
    assert_eq!(rig.reference(), before);
    // z has no counter on this board.
    let modes = rig.control.state().axes().by_ref().map(|axis| axis.mode());
    assert_eq!(
        modes.into_array(),
        [MotionMode::Plan, MotionMode::Plan, MotionMode::Hold]
    );
    rig.step(2000, 10_000);
    rig.run(500);
    assert!(
        (rig.position_mm() - 10.0).abs() < NEAR_MM,
        "{}",
        rig.position_mm()
    );
    assert_eq!(rig.reference() - before, Position::from_mm(10.0, 5e-4));
}

#[test]
fn the_line_switches_off_at_once_and_a_second_time_counts_from_there() {
    let mut rig = Rig::following();
    rig.step(400, 4000);
    rig.run(500);
    rig.lines.borrow_mut().seen.servo_on = false;
    rig.tick(None);
    assert!(!rig.outputs.enabled);
    rig.step(1000, 100);
    rig.run(1000);
    assert!(!rig.alarm(), "the control itself switched off");
    assert!((rig.position_mm() - 2.0).abs() < NEAR_MM);
    rig.switch(true);
    assert!(rig.outputs.enabled && !rig.alarm());
    rig.step(-400, 4000);
    rig.run(500);
    assert!(rig.position_mm().abs() < NEAR_MM, "{}", rig.position_mm());
}

#[test]
fn a_line_that_is_on_since_the_start_or_flickers_switches_nothing_on() {
    let mut rig = Rig::new(&settings());
    rig.switch(true);
    assert!(!rig.outputs.enabled);
    for tick in 0..2000 {
        rig.lines.borrow_mut().seen.servo_on = tick % 31 != 0;
        rig.tick(None);
        assert!(!rig.outputs.enabled);
    }
}

#[test]
fn steps_that_jump_or_are_lost_brake_the_axis_and_raise_the_alarm_until_the_line_was_off() {
    for lost in [false, true] {
        let mut rig = Rig::following();
        rig.step(400, 4000);
        if lost {
            rig.lines.borrow_mut().seen.lost[0] = true;
        } else {
            rig.lines.borrow_mut().seen.counts[0] += 500;
        }
        rig.tick(None);
        rig.lines.borrow_mut().seen.lost[0] = false;
        assert_eq!(rig.fault(), Some(FaultCode::PulseJump));
        assert_eq!(rig.mode(), MotionMode::Stopping);
        assert!(rig.outputs.enabled, "it brakes");
        rig.run(1000);
        assert!(!rig.outputs.enabled && rig.alarm());
        let stopped = rig.position_mm();
        assert!((stopped - 2.0).abs() < 0.2, "{stopped}");
        rig.switch(false);
        assert!(rig.alarm());
        rig.switch(true);
        assert!(rig.outputs.enabled && !rig.alarm());
        assert_eq!(rig.control.state().safety(), SafetyState::Enabled);
        rig.step(200, 4000);
        rig.run(500);
        assert!((rig.position_mm() - stopped - 1.0).abs() < NEAR_MM);
    }
}

#[test]
fn steps_faster_than_the_axis_are_an_overspeed() {
    let mut rig = Rig::following();
    // To 300 mm/s within 0.3 s: the limit is 250.
    let from = rig.lines.borrow_mut().seen.counts[0];
    for tick in 0..3000 {
        let time_s = f64::from(tick) * 1e-4;
        let steps = (500.0 * time_s * time_s / STEP_MM) as u32;
        rig.lines.borrow_mut().seen.counts[0] = from.wrapping_add(steps);
        rig.tick(None);
    }
    assert_eq!(rig.fault(), Some(FaultCode::PulseOverspeed));
}

#[test]
fn a_host_that_stops_the_axes_ends_the_following_and_the_control_sees_an_alarm() {
    let mut rig = Rig::following();
    rig.tick(Some(Command::Stop));
    rig.run(10);
    assert!(rig.alarm() && rig.outputs.enabled);
    let stands = rig.reference();
    rig.step(400, 4000);
    assert_eq!((rig.mode(), rig.reference()), (MotionMode::Hold, stands));
    rig.switch(false);
    rig.switch(true);
    assert!(!rig.alarm());
    assert_eq!(rig.mode(), MotionMode::Plan);
}

#[test]
fn a_line_that_comes_on_while_a_host_moves_switches_all_off_and_leads_at_the_next_time() {
    let mut rig = Rig::new(&settings());
    rig.run(100);
    rig.tick(Some(Command::Enable));
    rig.run(10);
    let jog = Velocity::from_mm_s(1.0, settings().motion_scale(0));
    rig.tick(Some(Command::Jog(AxisName::X, jog)));
    rig.run(100);
    assert!(rig.outputs.enabled && !rig.alarm());
    rig.switch(true);
    assert!(!rig.outputs.enabled && rig.alarm());
    // Nor if the host enables once more.
    rig.run(1000);
    rig.tick(Some(Command::Enable));
    rig.run(10);
    assert_eq!(rig.mode(), MotionMode::Hold);
    rig.switch(false);
    rig.run(1000);
    rig.switch(true);
    assert_eq!(rig.mode(), MotionMode::Plan);
    assert!(!rig.alarm());
}

#[test]
fn an_input_that_is_bad_keeps_the_axes_off_and_the_alarm_on() {
    let mut rig = Rig::new(&settings());
    let switches = AxisSwitches::AMPLIFIER_FAULT;
    rig.switches = rig.switches.with_axis(AxisName::Y, switches);
    rig.run(100);
    rig.switch(true);
    assert!(!rig.outputs.enabled && rig.alarm());
    rig.switches = Switches::NONE;
    rig.run(1000);
    assert!(
        !rig.outputs.enabled && rig.alarm(),
        "nothing is enabled unasked"
    );
    // What a host enables is not the control's, before its line was off.
    rig.tick(Some(Command::Enable));
    rig.run(100);
    assert!(rig.outputs.enabled && rig.alarm());
    assert_eq!(rig.mode(), MotionMode::Hold);
    rig.switch(false);
    rig.switch(true);
    assert!(rig.outputs.enabled && !rig.alarm());
    assert_eq!(rig.mode(), MotionMode::Plan);
}

#[test]
fn without_the_setting_the_lines_do_nothing() {
    let mut rig = Rig::new(&StageSettings::simulated());
    rig.run(100);
    rig.switch(true);
    assert!(!rig.outputs.enabled && !rig.alarm());
}

#[test]
fn a_board_that_counts_no_steps_for_an_axis_refuses_its_pulses_by_name() {
    let given = settings();
    for (axis, counted) in [("x", true), ("y", false)] {
        let mut tasks = Tasks::new(&StageSettings::simulated(), 1);
        for leaf in ["", "/step_mm"] {
            let path = format!("/axes/{axis}/pulses{leaf}");
            tasks.ask(set(&path, &given)).expect("a setting");
        }
        let answer = tasks.ask(Body::Settings(SettingsRequest::Apply));
        let Err(LinkError::Invalid(text)) = &answer else {
            assert!(counted && answer.is_ok(), "{axis}: {answer:?}");
            continue;
        };
        assert!(
            !counted && text.starts_with("y/pulses: this board counts no steps"),
            "{text}"
        );
    }
}

#[test]
fn the_feedforward_alone_is_put_out_where_another_drive_closes_the_loop() {
    let mut settings = settings();
    settings.axes[0].amplifier.feedforward_alone = true;
    settings.axes[0].amplifier.offset_v = 0.0;
    let mut rig = Rig::new(&settings);
    rig.run(100);
    rig.switch(true);
    rig.stage = SimulatedStage::new(&StageParameters::ideal(), settings.rate_hz, 1);
    let mut largest = 0;
    for steps in 0..200 {
        rig.step(1, 10);
        let seen = rig.control.state().axes()[AxisName::X].telemetry();
        let volts = f64::from(seen.feedforward.total());
        let expected = (volts * 32_768.0 / settings.axes[0].amplifier.full_scale_v).round();
        let code = f64::from(rig.outputs.codes[0].0);
        assert!(
            (code - expected).abs() <= 1.0,
            "{steps}: {code} and {expected}"
        );
        largest = largest.max(rig.outputs.codes[0].0);
        // The law's own word is another.
        assert_eq!(
            seen.code.0 == rig.outputs.codes[0].0,
            seen.feedback.output == 0.0
        );
    }
    assert!(largest > 100, "{largest}");
}
