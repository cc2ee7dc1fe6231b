//! A host's voltage through the whole tick: what it adds up to, and when it is taken.

use proptest::prelude::*;
use quadrant_law::admission::Refusal;
use quadrant_law::admission::StageView;
use quadrant_law::admission::refusal;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::injection::{InjectedValue, Injection};
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::Velocity;
use quadrant_law::safety::FaultCode;
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;
use quadrant_settings::{InjectionSettings, PlanSettings, StageSettings};

use quadrant_test_support::{Rig, any_f32, repeatable, sine_on_x};

/// An x axis without friction, at 0.1 ms: 70 m/s^2 per volt, and a drag.
pub(crate) struct Bench<S: Scalar> {
    pub(crate) rig: Rig<S>,
    pub(crate) words: Vec<i16>,
    pub(crate) sent: usize,
    pub(crate) position_mm: f64,
    pub(crate) velocity_mm_s: f64,
    pub(crate) outputs: Outputs,
}

pub(crate) fn request(open_loop: bool) -> InjectionSettings {
    InjectionSettings {
        axis: AxisName::X,
        open_loop,
        with_plan: false,
        limit_v: 10.0,
        travel_mm: 50.0,
        max_velocity_mm_s: 200.0,
    }
}

impl<S: Scalar> Bench<S> {
    pub(crate) fn new(settings: &StageSettings, plan: &PlanSettings) -> Self {
        let mut rig = Rig::new(settings, plan);
        rig.tick();
        rig.command(Command::Enable);
        Self {
            rig,
            words: vec![],
            sent: 0,
            position_mm: 0.0,
            velocity_mm_s: 0.0,
            outputs: Outputs::default(),
        }
    }

    pub(crate) fn begin(&mut self, request: &InjectionSettings, words: &[i16]) {
        let (injection, _): (Injection<S>, u16) =
            StageSettings::simulated().injection(request).unwrap();
        self.rig.state.prepare_injection(injection);
        self.words = words.to_vec();
        self.sent = 0;
        self.feed();
        self.rig.inputs.command = Some(Command::StartInjection);
    }

    fn feed(&mut self) {
        if self.rig.state.wants_voltage()
            && let Some(&word) = self.words.get(self.sent)
        {
            self.sent += 1;
            let last = self.sent == self.words.len();
            self.rig.state.push_injection(InjectedValue { word, last });
        }
    }

    /// A tick of the law alone, the axis where it was put.
    pub(crate) fn tick(&mut self) -> Outputs {
        self.feed();
        self.outputs = self.rig.tick();
        self.outputs
    }

    /// A tick of the law and of the axis.
    pub(crate) fn step(&mut self) -> Outputs {
        self.rig.inputs.readings[0].count = (self.position_mm / 5e-4).round() as i32 as u32;
        let outputs = self.tick();
        let volts = outputs.codes[0].to_volts(10.0);
        let acceleration = 70_000.0 * volts - 150.0 * self.velocity_mm_s;
        self.velocity_mm_s += 1e-4 * acceleration;
        self.position_mm += 1e-4 * self.velocity_mm_s;
        outputs
    }

    pub(crate) fn steps(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.step();
        }
    }

    pub(crate) fn fault(&self) -> Option<FaultCode> {
        self.rig.state.safety().fault().map(|fault| fault.code)
    }

    pub(crate) fn mode(&self) -> MotionMode {
        self.rig.state.axes()[0].mode()
    }
}

pub(crate) fn bench() -> Bench<f32> {
    Bench::new(&StageSettings::simulated(), &PlanSettings::default())
}

fn words_are_put_out<S: Scalar>() {
    for open_loop in [false, true] {
        let mut bench = Bench::<S>::new(&StageSettings::simulated(), &PlanSettings::default());
        let words = [1, -2, 1000, -32_767, 32_767, 7];
        bench.begin(&request(open_loop), &words);
        // An axis at rest on its reference: the law itself puts nothing out.
        for &word in &words {
            let code = bench.tick().codes[0].0;
            assert!(
                (i32::from(code) - i32::from(word)).abs() <= 1,
                "{code} {word}"
            );
        }
        assert_eq!(bench.tick().codes[0].0, 0);
        assert!(!bench.rig.state.is_injecting());
        assert_eq!(bench.rig.state.injection_progress().values, 6);
    }
}

#[test]
fn words_are_put_out_in_every_number_type() {
    words_are_put_out::<f32>();
    words_are_put_out::<f64>();
    words_are_put_out::<Fixed>();
}

#[test]
fn in_closed_loop_the_voltage_is_added_to_the_laws() {
    let settings = StageSettings::simulated();
    let mut plain = Bench::<f64>::new(&settings, &sine_on_x(5.0, 10.0));
    let mut driven = Bench::<f64>::new(&settings, &sine_on_x(5.0, 10.0));
    let with_plan = InjectionSettings {
        with_plan: true,
        ..request(false)
    };
    driven.begin(&with_plan, &[500; 3000]);
    plain.rig.inputs.command = Some(Command::Run);
    for _ in 0..2000 {
        let codes = [plain.tick(), driven.tick()].map(|outputs| i32::from(outputs.codes[0].0));
        assert!((codes[1] - codes[0] - 500).abs() <= 1, "{codes:?}");
        // Both follow the same way: nothing but the voltage differs.
        let reference = plain.rig.state.axes()[0].telemetry().reference;
        assert_eq!(driven.rig.state.axes()[0].telemetry().reference, reference);
        for bench in [&mut plain, &mut driven] {
            bench.rig.inputs.readings[0].count = (reference.0 >> 16) as u32;
        }
    }
}

#[test]
fn the_output_limit_holds_whatever_is_injected() {
    let mut settings = StageSettings::simulated();
    settings.axes[0].amplifier.output_limit_v = 2.0;
    for axis in &mut settings.axes {
        axis.feedback.integral_limit_v = axis.feedback.integral_limit_v.min(2.0);
    }
    for open_loop in [false, true] {
        let mut bench = Bench::<f32>::new(&settings, &PlanSettings::default());
        bench.begin(&request(open_loop), &[30_000; 3]);
        let codes = [bench.tick(), bench.tick()].map(|outputs| outputs.codes[0].0);
        let limit = DacCode::from_volts(2.0, 10.0).0;
        assert_eq!(codes, [limit; 2], "{open_loop}");
    }
}

#[test]
fn in_open_loop_the_law_is_off_and_the_others_hold() {
    let mut bench = bench();
    bench.begin(&request(true), &[50; 400]);
    bench.tick();
    // Far beyond the limit of the tracking error, but slowly.
    for tick in 1..300 {
        bench.rig.inputs.set_counts([20 * tick, 3, 0]);
        let outputs = bench.tick();
        assert_eq!(outputs.codes[0].0, 50);
        assert_eq!(bench.fault(), None);
    }
    assert!(bench.outputs.codes[1].0 < 0, "y is pushed and holds");
    assert_eq!(bench.mode(), MotionMode::OpenLoop);
    let seen = bench.rig.state.axes()[0].telemetry();
    assert_eq!(seen.reference.0 >> 16, seen.measured.0);
}

#[test]
fn nothing_else_begins_meanwhile_and_it_begins_only_at_rest() {
    let mut bench = bench();
    bench.begin(&request(false), &[0; 500]);
    bench.tick();
    let view = bench
        .rig
        .stage
        .as_ref()
        .view(&bench.rig.plan, &bench.rig.state);
    assert!(view.injecting && view.running);
    let jog = Command::Jog(
        AxisName::Y,
        Velocity::from_mm_s(1.0, StageSettings::simulated().motion_scale(1)),
    );
    for command in [
        jog,
        Command::StartMove(AxisName::Y),
        Command::Home(AxisName::Z),
    ] {
        assert_eq!(refusal(view, command), Some(Refusal::Injecting));
        bench.rig.inputs.command = Some(command);
        bench.tick();
        assert!(
            bench.rig.state.axes().as_slice()[1..]
                .iter()
                .all(|axis| !axis.is_running())
        );
    }
    assert_eq!(refusal(view, Command::Run), Some(Refusal::AlreadyRunning));

    let mut moving = Bench::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
    moving.rig.inputs.command = Some(jog);
    moving.tick();
    moving.begin(&request(false), &[100; 10]);
    moving.tick();
    assert!(!moving.rig.state.is_injecting());

    let ready = StageView {
        injection_ready: false,
        running: false,
        injecting: false,
        commissioned: true,
        ..view
    };
    assert_eq!(
        refusal(ready, Command::StartInjection),
        Some(Refusal::NoInjection)
    );
}

#[test]
fn its_first_tick_is_that_of_its_first_value() {
    let mut bench = bench();
    bench.tick();
    let tick = bench.rig.state.tick();
    bench.begin(&request(true), &[123, 0]);
    assert_eq!(bench.tick().codes[0].0, 123);
    assert_eq!(bench.rig.state.injection_progress().first_tick, tick);
}

#[test]
fn the_sum_of_codes_is_that_of_all_ticks_and_outlasts_a_disable() {
    let mut bench = bench();
    bench.begin(&request(true), &[100, -30, 7]);
    let codes: i32 = (0..3).map(|_| i32::from(bench.tick().codes[0].0)).sum();
    let sum = |bench: &Bench<f32>| bench.rig.state.axes()[0].telemetry().code_sum;
    assert_eq!((codes, sum(&bench)), (77, 77));
    bench.rig.inputs.command = Some(Command::Disable);
    bench.tick();
    bench.rig.inputs.command = Some(Command::Enable);
    bench.tick();
    assert_eq!(sum(&bench), 77);
}

#[test]
fn what_is_out_of_range_is_refused_by_name() {
    let settings = StageSettings::simulated();
    let refused = |change: fn(&mut InjectionSettings)| {
        let mut request = request(true);
        change(&mut request);
        let outcome = settings.injection::<f32>(&request);
        outcome.unwrap_err().to_string()
    };
    for (said, field) in [
        (refused(|r| r.limit_v = 0.0), "x/limit_v"),
        (refused(|r| r.limit_v = 10.1), "x/limit_v"),
        (refused(|r| r.limit_v = f64::NAN), "x/limit_v"),
        (refused(|r| r.travel_mm = -1.0), "x/travel_mm"),
        (
            refused(|r| r.max_velocity_mm_s = 1e4),
            "x/max_velocity_mm_s",
        ),
    ] {
        assert!(said.starts_with(field), "{said}");
    }
}

proptest! {
    #![proptest_config(repeatable(400))]

    #[test]
    fn outputs_are_bounded_and_end_at_zero_with_any_injection_and_reading(
        open_loop: bool,
        limit_v in any_f32(),
        travel_mm in any_f32(),
        words in prop::collection::vec(any::<i16>(), 1..40),
        readings in prop::collection::vec((any::<u32>(), any::<bool>(), 0u32..9), 1..120),
    ) {
        let request = InjectionSettings {
            limit_v: limit_v.into(),
            travel_mm: travel_mm.into(),
            ..request(open_loop)
        };
        let settings = StageSettings::simulated();
        let mut rig: Rig<Fixed> = Rig::new(&settings, &PlanSettings::default());
        rig.tick();
        rig.command(Command::Enable);
        if let Ok((injection, _)) = settings.injection(&request) {
            rig.state.prepare_injection(injection);
        }
        rig.inputs.command = Some(Command::StartInjection);
        let mut left = words.iter();
        for (count, near, command) in readings {
            if rig.state.wants_voltage() && let Some(&word) = left.next() {
                rig.state.push_injection(InjectedValue { word, last: left.len() == 0 });
            }
            let place = &mut rig.inputs.readings[0].count;
            *place = if near { place.wrapping_add(count % 20) } else { count };
            if rig.inputs.command.is_none() {
                rig.inputs.command = Command::from_number(command);
            }
            let outputs = rig.tick();
            if !rig.state.is_injecting() {
                prop_assert_eq!(rig.state.axes()[0].injected(), Fixed::ZERO);
                prop_assert!(rig.state.axes()[0].mode() != MotionMode::OpenLoop);
            }
            if !outputs.enabled {
                prop_assert_eq!(outputs, Outputs::default());
            }
        }
    }
}
