//! The whole machine on the simulated stage: homing, jogging, streaming and stopping as a host would ask for them.

use std::f64::consts::TAU;

use quadrant_law::admission::Refusal;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{Motion, MotionSettings, ReferenceSample, Velocity};
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_law::supervisor::Event;
use quadrant_law::units::Position;
use quadrant_settings::Job;
use quadrant_settings::stream_planner::{AxisPoint, SetPoint, StreamPlanner};
use quadrant_settings::{PlanSettings, StageSettings};
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::plant::{MarkParameters, SimulatedStage, StageParameters};

/// Length of a count, mm.
const COUNT_MM: f64 = 5e-4;

/// Machine and stage under one clock.
struct Bench {
    settings: StageSettings,
    machine: LawMachine<f32, 4>,
    plant: SimulatedStage,
}

impl Bench {
    fn new(settings: StageSettings) -> Self {
        let job = Job {
            stage: settings,
            plan: PlanSettings::default(),
        };
        let mut bench = Self {
            machine: LawMachine::new(&job).expect("valid"),
            plant: SimulatedStage::new(&StageParameters::real(), job.stage.rate_hz, 7),
            settings: job.stage,
        };
        bench.run(20);
        bench.ask(Command::Enable);
        bench.run(100);
        assert!(bench.machine.state().safety().is_enabled());
        bench
    }

    fn tick(&mut self, request: Option<Command>) {
        let outputs = self.machine.tick(&self.plant.read_inputs(request));
        self.plant.step(&outputs);
    }

    fn ask(&mut self, command: Command) {
        self.tick(Some(command));
        // The supervisor runs every tenth tick.
        self.run(12);
    }

    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.tick(None);
        }
    }

    /// Waits until nothing moves, and half a second more for the axes to settle.
    fn rest(&mut self) {
        let ended = (0..400_000).any(|_| {
            self.tick(None);
            !self.machine.state().is_running()
        });
        assert!(ended, "it never ends");
        self.run(5_000);
    }

    fn home(&mut self) {
        for axis in AxisName::ALL {
            self.ask(Command::Home(axis));
        }
        self.rest();
    }

    fn jog(&mut self, axis: AxisName, velocity_mm_s: f64) {
        let scale = self.settings.motion_scale(axis as usize);
        self.ask(Command::Jog(
            axis,
            Velocity::from_mm_s(velocity_mm_s, scale),
        ));
    }

    fn measured_mm(&self, axis: usize) -> f64 {
        self.machine.state().axes()[axis].telemetry().measured.0 as f64 * COUNT_MM
    }

    fn assert_enabled(&self) {
        let safety = self.machine.state().safety();
        assert!(safety.is_enabled(), "{safety:?}");
    }

    fn planner(&self) -> StreamPlanner {
        let limits = self.settings.stream_limits([true; 3]);
        let here = self
            .machine
            .state()
            .axes()
            .each_ref()
            .map(|axis| axis.reference());
        StreamPlanner::new(limits, PERIOD_TICKS, here)
    }
}

const PERIOD_TICKS: u32 = 10;
const RADIUS_MM: f64 = 15.0;
const SECONDS: f64 = 4.0;

/// One turn from rest to rest, from where the axes stand: position, velocity and acceleration of x and y.
fn circle(time_s: f64) -> [[f64; 3]; 2] {
    let share = time_s / SECONDS;
    let angle = TAU * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share.powi(2));
    let speed = TAU / SECONDS * 30.0 * (share * (1.0 - share)).powi(2);
    let change = TAU / SECONDS.powi(2) * 60.0 * share * (1.0 - share) * (1.0 - 2.0 * share);
    let (sine, cosine) = angle.sin_cos();
    [
        [
            RADIUS_MM * (cosine - 1.0),
            -RADIUS_MM * speed * sine,
            -RADIUS_MM * (speed * speed * cosine + change * sine),
        ],
        [
            RADIUS_MM * sine,
            RADIUS_MM * speed * cosine,
            RADIUS_MM * (change * cosine - speed * speed * sine),
        ],
    ]
}

/// Appends the whole circle to the queues.
fn send_circle(bench: &mut Bench) {
    let mut planner = bench.planner();
    let start = bench
        .machine
        .state()
        .axes()
        .each_ref()
        .map(|axis| axis.reference());
    let count = (SECONDS * bench.settings.rate_hz) as u32 / PERIOD_TICKS;
    for number in 1..=count {
        let time_s = f64::from(number * PERIOD_TICKS) / bench.settings.rate_hz;
        let last = number == count;
        let mut axes = start.map(AxisPoint::at_rest);
        if !last {
            for (index, [position, velocity, acceleration]) in
                circle(time_s).into_iter().enumerate()
            {
                axes[index] = AxisPoint::new(
                    ReferenceSample {
                        position: start[index] + Position::from_mm(position, COUNT_MM),
                        velocity,
                        acceleration,
                    },
                    bench.settings.motion_scale(index),
                );
            }
        }
        let point = SetPoint { number, axes, last };
        bench
            .machine
            .stream(planner.plan(&point).expect("within limits"));
    }
}

#[test]
fn three_axes_are_homed_at_once_to_the_count_of_their_index_pulses() {
    let mut bench = Bench::new(StageSettings::simulated());
    bench.home();
    bench.assert_enabled();
    for (index, axis) in bench.machine.state().axes().iter().enumerate() {
        assert!(axis.is_homed());
        assert_eq!(axis.reference(), Position::ZERO, "parked");
        // The pulse at -72 000 counts of the stage is to be -36 mm: the counter's own zero. The encoder is noisy.
        let off = bench.measured_mm(index) - bench.plant.axes()[index].position_mm();
        assert!(off.abs() <= 2.0 * COUNT_MM, "{index}: {off}");
        let error = bench.plant.axes()[index].position_mm();
        assert!(error.abs() < 5e-3, "{index}: {error}");
    }
}

#[test]
fn a_switch_elsewhere_gives_the_same_origin_to_the_count() {
    let mut origins = vec![];
    for home_mm in [-40.0, -39.2, -41.3, -38.1] {
        let mut bench = Bench::new(StageSettings::simulated());
        let marks = MarkParameters {
            home_mm,
            ..MarkParameters::default()
        };
        bench.plant.set_marks([marks; 3]);
        bench.ask(Command::Home(AxisName::X));
        bench.rest();
        bench.assert_enabled();
        let counter = bench.plant.read_inputs(None).readings[0].count as i32;
        origins.push(counter - bench.machine.state().axes()[0].telemetry().measured.0 as i32);
    }
    // Counter and count are read at two times; the noise is a few counts at most, and the origin is zero.
    assert!(
        origins.iter().all(|origin| origin.abs() <= 2),
        "{origins:?}"
    );
}

#[test]
fn a_jog_comes_to_rest_before_the_soft_limit_without_a_fault() {
    let mut bench = Bench::new(StageSettings::simulated());
    bench.home();
    for (velocity_mm_s, limit_mm) in [(150.0, 200.0), (-150.0, -200.0), (20.0, -150.0)] {
        bench.jog(AxisName::X, velocity_mm_s);
        if limit_mm == -150.0 {
            bench.run(20_000);
            bench.jog(AxisName::X, 0.0);
        }
        let mut farthest = 0.0f64;
        while bench.machine.state().is_running() {
            bench.tick(None);
            farthest = farthest.max(bench.plant.axes()[0].position_mm().abs());
        }
        bench.run(5_000);
        bench.assert_enabled();
        assert!(farthest < 200.0, "{farthest}");
        if limit_mm != -150.0 {
            let rest = bench.plant.axes()[0].position_mm();
            assert!((limit_mm - rest).abs() < 1.6, "{rest} of {limit_mm}");
        }
    }
}

#[test]
fn a_move_to_a_position_starts_from_where_the_axis_stands() {
    let mut bench = Bench::new(StageSettings::simulated());
    bench.home();
    let scale = bench.settings.motion_scale(2);
    for (target_mm, velocity_mm_s) in [(40.0, 50.0), (-12.5, 80.0)] {
        let z = &bench.machine.state().axes()[2];
        let settings = bench
            .settings
            .move_to(
                AxisName::Z,
                z.reference(),
                z.is_homed(),
                target_mm,
                velocity_mm_s,
            )
            .expect("within the travel");
        let motion = Motion::build(&MotionSettings::PointToPoint(settings), scale);
        bench.machine.set_motion(AxisName::Z, motion);
        bench.ask(Command::StartMove(AxisName::Z));
        bench.rest();
        bench.assert_enabled();
        let z = &bench.machine.state().axes()[2];
        assert_eq!(z.reference(), Position::from_mm(target_mm, COUNT_MM));
        // Friction holds the axis short of the reference, and the integral takes seconds.
        let off = bench.plant.axes()[2].position_mm() - target_mm;
        println!(
            "half a second after the move z is off by {:.2} um",
            off * 1e3
        );
        assert!(off.abs() < 0.02, "{off}");
    }
}

#[test]
fn a_streamed_circle_is_driven_on_the_true_stage() {
    let mut bench = Bench::new(StageSettings::simulated());
    bench.home();
    send_circle(&mut bench);
    bench.run(1);
    let centre = [0, 1].map(|index| {
        let reference = bench.machine.state().axes()[index].reference();
        reference.to_mm(COUNT_MM) - if index == 0 { RADIUS_MM } else { 0.0 }
    });
    bench.ask(Command::StartStream);
    let mut radial = 0.0f64;
    let mut ticks = 0;
    while bench.machine.state().is_running() {
        bench.tick(None);
        ticks += 1;
        let [x, y] = [0, 1].map(|index| bench.plant.axes()[index].position_mm() - centre[index]);
        radial = radial.max((x.hypot(y) - RADIUS_MM).abs());
    }
    bench.assert_enabled();
    assert!(ticks > 39_000);
    println!(
        "largest radial error of the streamed circle: {:.2} um",
        radial * 1e3
    );
    assert!(radial < MOST_RADIAL_MM, "{radial}");
    for index in 0..2 {
        assert_eq!(
            bench.machine.state().axes()[index].reference(),
            Position::ZERO
        );
    }
}

/// Of the simulated stage with the default gains: about twice what it is.
const MOST_RADIAL_MM: f64 = 0.012;

#[test]
fn a_stop_in_the_middle_of_a_stream_holds_and_another_stream_starts_from_there() {
    let mut bench = Bench::new(StageSettings::simulated());
    bench.home();
    send_circle(&mut bench);
    bench.run(1);
    bench.ask(Command::StartStream);
    bench.run(20_000);
    bench.ask(Command::Stop);
    bench.rest();
    bench.assert_enabled();
    assert_eq!(bench.machine.state().axes()[0].mode(), MotionMode::Hold);
    // What is left of it is not taken up again.
    bench.ask(Command::StartStream);
    bench.run(1_000);
    assert!(!bench.machine.state().is_running());
    let refused = bench
        .machine
        .events()
        .iter()
        .any(|(_, event)| *event == Event::Refused(Command::StartStream, Refusal::NoStream));
    assert!(refused, "{:?}", bench.machine.events());
    while bench.machine.queued_segments() > 0 {
        bench.run(1);
    }
    send_circle(&mut bench);
    bench.run(1);
    bench.ask(Command::StartStream);
    assert!(bench.machine.state().is_running());
    bench.rest();
    bench.assert_enabled();
}

#[test]
fn a_home_switch_that_is_not_there_is_a_fault_and_the_axis_stops_first() {
    let mut settings = StageSettings::simulated();
    settings.axes[1]
        .homing
        .as_mut()
        .expect("by default")
        .travel_mm = 30.0;
    let mut bench = Bench::new(settings);
    bench.ask(Command::Home(AxisName::Y));
    bench.rest();
    let SafetyState::Faulted(fault) = bench.machine.state().safety() else {
        panic!("{:?}", bench.machine.state().safety());
    };
    assert_eq!(fault.code, FaultCode::HomeSwitchMissing);
    assert_eq!(fault.axis, Some(AxisName::Y));
    let at = bench.plant.axes()[1].position_mm();
    assert!((-30.5..-29.5).contains(&at), "{at}");
}
