//! A host's voltage through the whole tick: what it adds up to, how it ends, and what ends it.

use proptest::prelude::*;
use quadrant::axis::CourseMode;
use quadrant::injection::Injection;
use quadrant::reference::Velocity;
use quadrant::safety::{AxisName, AxisSwitches, Command, FaultCode, SafetyState, Switches};
use quadrant::scalar::{Fixed, Scalar};
use quadrant::settings::{InjectionSettings, PlanSettings, StageSettings, TravelSettings};
use quadrant::stage::Outputs;
use quadrant::supervisor::{Refusal, StageView, refusal};

use crate::common::{Rig, any_f32, repeatable, sine_on_x, with_x};

/// An x axis without friction, at 0.1 ms: 70 m/s^2 per volt, and a drag.
struct Bench<S: Scalar> {
    rig: Rig<S>,
    words: Vec<i16>,
    sent: usize,
    position_mm: f64,
    velocity_mm_s: f64,
    outputs: Outputs,
}

fn request(open_loop: bool) -> InjectionSettings {
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
    fn new(settings: &StageSettings, plan: &PlanSettings) -> Self {
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

    fn begin(&mut self, request: &InjectionSettings, words: &[i16]) {
        let (injection, _): (Injection<S>, u16) =
            StageSettings::default().injection(request).unwrap();
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
            self.rig.state.offer_voltage(word, last);
        }
    }

    /// A tick of the law alone, the axis where it was put.
    fn tick(&mut self) -> Outputs {
        self.feed();
        self.outputs = self.rig.tick();
        self.outputs
    }

    /// A tick of the law and of the axis.
    fn step(&mut self) -> Outputs {
        self.rig.inputs.readings[0].count = (self.position_mm / 5e-4).round() as i32 as u32;
        let outputs = self.tick();
        let volts = 10.0 * f64::from(outputs.codes[0].0) / 32767.0;
        let acceleration = 70_000.0 * volts - 150.0 * self.velocity_mm_s;
        self.velocity_mm_s += 1e-4 * acceleration;
        self.position_mm += 1e-4 * self.velocity_mm_s;
        outputs
    }

    fn steps(&mut self, ticks: usize) {
        for _ in 0..ticks {
            self.step();
        }
    }

    fn fault(&self) -> Option<FaultCode> {
        self.rig.state.safety().fault().map(|fault| fault.code)
    }

    fn mode(&self) -> CourseMode {
        self.rig.state.axes()[0].mode()
    }
}

fn bench() -> Bench<f32> {
    Bench::new(&StageSettings::default(), &PlanSettings::default())
}

fn words_are_put_out<S: Scalar>() {
    for open_loop in [false, true] {
        let mut bench = Bench::<S>::new(&StageSettings::default(), &PlanSettings::default());
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
    let settings = StageSettings::default();
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
    let mut settings = StageSettings::default();
    settings.axes[0].amplifier.output_limit_v = 2.0;
    for axis in &mut settings.axes {
        axis.feedback.integral_limit_v = axis.feedback.integral_limit_v.min(2.0);
    }
    for open_loop in [false, true] {
        let mut bench = Bench::<f32>::new(&settings, &PlanSettings::default());
        bench.begin(&request(open_loop), &[30_000; 3]);
        let codes = [bench.tick(), bench.tick()].map(|outputs| outputs.codes[0].0);
        let limit = (2.0 / 10.0 * 32_767.0_f64).round() as i16;
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
    assert_eq!(bench.mode(), CourseMode::OpenLoop);
    let seen = bench.rig.state.axes()[0].telemetry();
    assert_eq!(seen.reference.0 >> 16, seen.measured.0);
}

#[test]
fn the_loop_is_closed_without_a_bump_from_a_moving_axis() {
    let mut bench = bench();
    // 0.4 V for 15 ms: up to some 170 mm/s.
    bench.begin(&request(true), &[1300; 150]);
    bench.steps(151);
    let fast = bench.velocity_mm_s;
    assert!(fast > 100.0, "{fast}");
    let mut before = 0.0;
    let mut most_mm: f64 = 0.0;
    for tick in 0..2_000 {
        let outputs = bench.step();
        let volts = 10.0 * f64::from(outputs.codes[0].0) / 32_767.0;
        if tick == 0 {
            // What braking takes, and no more.
            assert!(volts.abs() < 1.0, "{volts}");
            before = volts;
        }
        assert!((volts - before).abs() < 1.0, "{volts} after {before}");
        before = volts;
        most_mm = most_mm.max(f64::from(bench.rig.state.axes()[0].telemetry().error_mm()).abs());
    }
    assert!(bench.rig.state.safety().is_enabled(), "{:?}", bench.fault());
    assert_eq!(bench.mode(), CourseMode::Hold);
    assert!(bench.velocity_mm_s.abs() < 1.0, "{}", bench.velocity_mm_s);
    assert!(most_mm < 0.2, "{most_mm}");
}

#[test]
fn a_missing_value_ends_it_and_stops_the_axes() {
    for open_loop in [false, true] {
        let mut bench = bench();
        bench.begin(&request(open_loop), &[300; 50]);
        bench.words.push(0);
        // All but the last: the next one never comes.
        for _ in 0..50 {
            bench.step();
        }
        bench.sent = usize::MAX;
        assert_eq!(bench.fault(), None);
        bench.step();
        assert_eq!(bench.fault(), Some(FaultCode::InjectionUnderrun));
        assert_eq!(bench.rig.state.axes()[0].injected(), 0.0);
        assert!(bench.outputs.enabled, "it brakes under control");
        bench.steps(2_000);
        assert!(matches!(bench.rig.state.safety(), SafetyState::Faulted(_)));
        assert_eq!(bench.outputs, Outputs::default());
    }
}

#[test]
fn leaving_the_given_travel_or_velocity_ends_it() {
    let near = InjectionSettings {
        travel_mm: 0.5,
        ..request(true)
    };
    let slow = InjectionSettings {
        max_velocity_mm_s: 20.0,
        ..request(true)
    };
    for (request, far_mm, fast_mm_s) in [(near, 0.5, 200.0), (slow, 50.0, 20.0)] {
        for sign in [1, -1] {
            let mut bench = bench();
            bench.begin(&request, &[sign * 400; 1_000]);
            while bench.fault().is_none() {
                bench.step();
            }
            assert_eq!(bench.fault(), Some(FaultCode::InjectionBounds));
            let (place, speed) = (bench.position_mm.abs(), bench.velocity_mm_s.abs());
            assert!(place < far_mm + 0.1, "{place}");
            // The speed is filtered over 8 ticks, and half a count is allowed for.
            assert!(speed < fast_mm_s + 12.0, "{speed}");
            bench.steps(3_000);
            assert!(matches!(bench.rig.state.safety(), SafetyState::Faulted(_)));
        }
    }
}

#[test]
fn every_monitor_but_the_following_error_watches_an_open_loop() {
    let settings = with_x(|x| {
        x.homing = None;
        x.limits.travel_mm = Some(TravelSettings {
            negative: -3.0,
            positive: 200.0,
        });
    });
    let provoke = |change: fn(&mut Bench<f32>)| {
        let mut bench = Bench::<f32>::new(&settings, &PlanSettings::default());
        bench.rig.state.set_homed(AxisName::X, true);
        bench.begin(&request(true), &[0; 3_000]);
        bench.tick();
        for _ in 0..2_500 {
            change(&mut bench);
            bench.tick();
            if let Some(fault) = bench.fault() {
                return Some((fault, bench.outputs.enabled));
            }
        }
        None
    };
    assert_eq!(
        provoke(|bench| bench.rig.inputs.switches = Switches::EMERGENCY_STOP),
        Some((FaultCode::EmergencyStop, false))
    );
    assert_eq!(
        provoke(|bench| bench.rig.inputs.readings[0].valid = false),
        Some((FaultCode::EncoderInvalid, false))
    );
    assert_eq!(
        provoke(|bench| bench.rig.inputs.deadline_missed = true),
        Some((FaultCode::DeadlineMissed, false))
    );
    assert_eq!(
        provoke(|bench| bench.rig.inputs.link_lost = true),
        Some((FaultCode::LinkLost, true))
    );
    let creep = |bench: &mut Bench<f32>| {
        let count = &mut bench.rig.inputs.readings[0].count;
        *count = count.wrapping_sub(4);
    };
    // 20 mm/s towards smaller positions: the travel of the axis ends before that of the request.
    let (fault, enabled) = provoke(creep).unwrap();
    assert!(
        matches!(fault, FaultCode::TravelAhead | FaultCode::TravelExceeded),
        "{fault:?}"
    );
    assert!(enabled);
    assert_eq!(
        provoke(|bench| {
            bench.rig.inputs.switches =
                Switches::NONE.with_axis(AxisName::X, AxisSwitches::NEGATIVE_LIMIT);
            let count = &mut bench.rig.inputs.readings[0].count;
            *count = count.wrapping_sub(1);
        }),
        Some((FaultCode::NegativeLimitSwitch, true))
    );
}

#[test]
fn a_stop_and_a_disable_end_it() {
    for open_loop in [false, true] {
        let mut bench = bench();
        bench.begin(&request(open_loop), &[400; 1_000]);
        bench.steps(100);
        bench.rig.inputs.command = Some(Command::Stop);
        bench.steps(1_500);
        assert!(!bench.rig.state.is_injecting() && !bench.rig.state.is_running());
        assert!(bench.rig.state.safety().is_enabled(), "{:?}", bench.fault());
        // What is left of it is not taken up again.
        assert!(!bench.rig.state.wants_voltage());

        bench.begin(&request(open_loop), &[400; 1_000]);
        bench.steps(50);
        bench.rig.inputs.command = Some(Command::Disable);
        assert_eq!(bench.step(), Outputs::default());
        assert!(!bench.rig.state.is_injecting());
        assert_eq!(bench.mode(), CourseMode::Hold);
    }
}

#[test]
fn nothing_else_begins_meanwhile_and_it_begins_only_at_rest() {
    let mut bench = bench();
    bench.begin(&request(false), &[0; 500]);
    bench.tick();
    let view = StageView::of(&bench.rig.state);
    assert!(view.injecting && view.running);
    let jog = Command::Jog(
        AxisName::Y,
        Velocity::from_mm_s(1.0, StageSettings::default().motion_scale(1)),
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
            bench.rig.state.axes()[1..]
                .iter()
                .all(|axis| !axis.is_running())
        );
    }
    assert_eq!(refusal(view, Command::Run), Some(Refusal::AlreadyRunning));

    let mut moving = Bench::<f32>::new(&StageSettings::default(), &PlanSettings::default());
    moving.rig.inputs.command = Some(jog);
    moving.tick();
    moving.begin(&request(false), &[100; 10]);
    moving.tick();
    assert!(!moving.rig.state.is_injecting());

    let ready = StageView {
        injection_ready: false,
        running: false,
        injecting: false,
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
    let settings = StageSettings::default();
    let refused = |change: fn(&mut InjectionSettings)| {
        let mut request = request(true);
        change(&mut request);
        let outcome = settings.injection::<f32>(&request);
        outcome.unwrap_err().to_string()
    };
    for (said, field) in [
        (refused(|r| r.limit_v = 0.0), "x.limit_v"),
        (refused(|r| r.limit_v = 10.1), "x.limit_v"),
        (refused(|r| r.limit_v = f64::NAN), "x.limit_v"),
        (refused(|r| r.travel_mm = -1.0), "x.travel_mm"),
        (
            refused(|r| r.max_velocity_mm_s = 1e4),
            "x.max_velocity_mm_s",
        ),
    ] {
        assert!(said.starts_with(field), "{said}");
    }
}

proptest! {
    #![proptest_config(repeatable(400))]

    #[test]
    fn whatever_is_injected_and_read_the_outputs_are_bounded_and_the_end_is_zero(
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
        let settings = StageSettings::default();
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
                rig.state.offer_voltage(word, left.len() == 0);
            }
            let place = &mut rig.inputs.readings[0].count;
            *place = if near { place.wrapping_add(count % 20) } else { count };
            if rig.inputs.command.is_none() {
                rig.inputs.command = Command::from_number(command);
            }
            let outputs = rig.tick();
            if !rig.state.is_injecting() {
                prop_assert_eq!(rig.state.axes()[0].injected(), Fixed::ZERO);
                prop_assert!(rig.state.axes()[0].mode() != CourseMode::OpenLoop);
            }
            if !outputs.enabled {
                prop_assert_eq!(outputs, Outputs::default());
            }
        }
    }
}
