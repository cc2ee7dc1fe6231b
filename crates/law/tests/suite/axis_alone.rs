//! One axis by itself: what it cannot be made with, what a tick of it does, and what of it is seen.

use quadrant_law::axes::AxisName;
use quadrant_law::axis::telemetry::LimitedBy;
use quadrant_law::axis::{Axis, AxisBuilder, AxisError, AxisState, OutputStage};
use quadrant_law::command::Command;
use quadrant_law::control::feedback::{Feedback, LawKind};
use quadrant_law::control::pid::{Pid, PidGains};
use quadrant_law::encoder::EncoderReading;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::injection::{Coupling, InjectedValue, Injection};
use quadrant_law::reference::{Motion, MotionScale, MotionState, ReferenceSample};
use quadrant_law::safety::{AxisSwitches, FaultCode, Switches};
use quadrant_law::stage::StageState;
use quadrant_law::units::{DacCode, Position};
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::{Rig, sine_on_x, with_x, x_alone};

const KP_V_PER_MM: f64 = 1.0;
const RESOLUTION_MM: f64 = 1e-3;
const PERIOD_S: f64 = 1e-4;

fn pid() -> Feedback<f64> {
    let gains = PidGains {
        kp_v_per_mm: KP_V_PER_MM,
        ki_v_per_mm_s: 0.0,
        kd_v_s_per_mm: 0.0,
        derivative_filter_s: 50e-6,
    };
    Feedback::Pid(Pid::build(&gains, 2.0, PERIOD_S))
}

#[test]
fn an_axis_is_not_made_of_parts_that_cannot_be_and_the_first_is_named() {
    type Change = fn(AxisBuilder<f64, 4>) -> AxisBuilder<f64, 4>;
    fn build(resolution_mm: f64, period_s: f64, change: Change) -> (Option<AxisError>, i16) {
        let mut axis = Axis::blank();
        let built = change(
            AxisBuilder::new(&mut axis, resolution_mm, period_s)
                .feedback(Feedback::Pid(Pid::default())),
        )
        .try_build();
        let error = built.err();
        // A refused one puts out nothing.
        let stage = axis.clone();
        let mut state = AxisState::default();
        let code = stage
            .tick(&mut state, &Motion::Hold, &EncoderReading::of(0))
            .map_or(0, |code| code.0);
        (error, code)
    }
    let usual: Change = |builder| builder.output(OutputStage::limited_to(10.0));
    assert_eq!(build(RESOLUTION_MM, PERIOD_S, usual).0, None);
    for bad in [0.0, -1e-3, f64::INFINITY, f64::NAN] {
        for (error, of) in [
            (build(bad, PERIOD_S, usual).0, "count"),
            (build(RESOLUTION_MM, bad, usual).0, "period"),
        ] {
            let said = error.expect("refused").to_string();
            assert!(
                said.contains(of) && said.contains("not above zero"),
                "{said}"
            );
        }
    }
    let refused: [(Change, &str); 7] = [
        (|builder| builder, "an output limit of 0 V"),
        (
            |builder| builder.output(OutputStage::limited_to(0.0)),
            "limit of 0 V",
        ),
        (
            |builder| builder.output(OutputStage::limited_to(-1.0)),
            "limit of -1 V",
        ),
        (
            |builder| builder.output(OutputStage::limited_to(10.5)),
            "10.5 V",
        ),
        (
            |builder| {
                builder.output(OutputStage {
                    full_scale_v: f64::INFINITY,
                    ..OutputStage::limited_to(f64::INFINITY)
                })
            },
            "within the amplifier's full scale",
        ),
        (
            |builder| builder.output(OutputStage::limited_to(10.0)).bumpless(0.0),
            "a bumpless time of 0 s",
        ),
        (
            |builder| {
                let gains = StageSettings::simulated().axes[0].feedforward.gains;
                builder.output(OutputStage::limited_to(10.0)).feedforward(
                    quadrant_law::feedforward::FeedforwardKind::None,
                    &gains,
                    &StageSettings::simulated().axes[0].friction,
                    1000,
                )
            },
            "a preview of 1000 ticks",
        ),
    ];
    for (change, expected) in refused {
        let (error, code) = build(RESOLUTION_MM, PERIOD_S, change);
        let said = error.expect("refused").to_string();
        assert!(said.contains(expected), "{said}");
        assert_eq!(code, 0);
    }
    // The first of two.
    let said = build(0.0, 0.0, usual).0;
    assert_eq!(said, Some(AxisError::Resolution(0.0)));
}

#[test]
fn an_axis_by_value_is_the_axis_in_place() {
    let scale = MotionScale::new(RESOLUTION_MM, 1e4);
    let x = &StageSettings::simulated().axes[0];
    let gains = &x.feedback.pid;
    let kind = FeedforwardKind::Combined;
    let by_value = Axis::<f64, 4>::build(scale, |axis| {
        axis.output(OutputStage::limited_to(10.0))
            .pid(gains, 2.0)
            .feedforward(kind, &x.feedforward.gains, &x.friction, 12)
    });
    let mut in_place = Axis::<f64, 4>::blank();
    AxisBuilder::new(&mut in_place, RESOLUTION_MM, PERIOD_S)
        .output(OutputStage::limited_to(10.0))
        .feedback(Feedback::Pid(Pid::build(gains, 2.0, PERIOD_S)))
        .feedforward(kind, &x.feedforward.gains, &x.friction, 12)
        .try_build()
        .expect("valid");
    assert_eq!(by_value, Ok(in_place));
}

#[test]
fn an_axis_by_value_is_refused_as_in_place() {
    let refused = |resolution_mm, rate_hz| {
        Axis::<f64, 4>::build(MotionScale::new(resolution_mm, rate_hz), |axis| axis).err()
    };
    assert_eq!(refused(0.0, 1e4), Some(AxisError::Resolution(0.0)));
    assert_eq!(
        refused(RESOLUTION_MM, 0.0),
        Some(AxisError::Period(f64::INFINITY))
    );
    assert_eq!(
        refused(RESOLUTION_MM, -1e4),
        Some(AxisError::Period(-PERIOD_S))
    );
    assert_eq!(
        refused(RESOLUTION_MM, 1e4),
        Some(AxisError::OutputLimit(0.0))
    );
}

#[test]
fn a_tick_of_one_axis_reads_follows_and_puts_out() {
    let mut axis = Axis::<f64, 4>::blank();
    AxisBuilder::new(&mut axis, RESOLUTION_MM, PERIOD_S)
        .output(OutputStage::limited_to(10.0))
        .feedback(pid())
        .try_build()
        .expect("valid");
    let mut state = AxisState::default();
    let mut tick = |reading: EncoderReading| {
        axis.tick(&mut state, &Motion::Hold, &reading)
            .map(|code| code.0)
    };
    assert_eq!(tick(EncoderReading::of(0)), Ok(0));
    // 100 counts of 1 um at 1 V/mm: 0.1 V of 10 on a converter of 32767 steps.
    assert_eq!(tick(EncoderReading::of(100)), Ok(-328));
    assert_eq!(tick(EncoderReading::of(0xFFFF_FF9C)), Ok(328));
    let invalid = EncoderReading {
        valid: false,
        ..EncoderReading::of(0)
    };
    assert_eq!(tick(invalid), Err(FaultCode::EncoderInvalid));
}

#[test]
fn any_reading_that_may_have_lost_counts_costs_the_origin_whatever_else_is_wrong_with_it() {
    for (valid, count) in [(false, 0), (true, 1 << 30), (false, 1 << 30)] {
        let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
        rig.tick();
        rig.state.set_homed(AxisName::X, true);
        rig.inputs.readings[0] = EncoderReading {
            valid,
            ..EncoderReading::of(count)
        };
        rig.tick();
        assert!(!rig.state.axes()[0].is_homed(), "{valid} {count}");
    }
}

#[test]
fn enabling_leaves_no_trace_of_the_motion_before_it() {
    let after = |counts: &[(u32, u32)]| {
        let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
        for &(count, ticks) in counts {
            rig.inputs.set_counts([count, 0, 0]);
            for _ in 0..ticks {
                rig.tick();
            }
        }
        rig.command(Command::Enable);
        assert!(rig.state.safety().is_enabled());
        rig.state.axes()[0].clone()
    };
    // As slow as may be enabled: a count now and then, the last one just before.
    assert_eq!(
        after(&[(299, 400), (300, 1)]),
        after(&[(299, 1), (300, 400)])
    );
}

#[test]
fn what_is_seen_of_an_axis_whose_outputs_are_off_is_where_it_is() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &sine_on_x(5.0, 10.0));
    rig.start();
    for count in 0..50 {
        rig.inputs.set_counts([count, 0, 0]);
        rig.tick();
    }
    let driven = *rig.state.axes()[0].telemetry();
    assert_ne!(driven.output_v(), 0.0);
    let volts = driven.code.to_volts(10.0) as f32;
    assert!((driven.output_v() - volts).abs() < 2e-4);
    rig.command(Command::Disable);
    rig.inputs.set_counts([70, 0, 0]);
    rig.tick();
    let seen = *rig.state.axes()[0].telemetry();
    assert_eq!((seen.measured.0, seen.reference), (70, Position(70 << 16)));
    assert_eq!(
        (seen.output_v(), seen.error_mm(), seen.code.0),
        (0.0, 0.0, 0)
    );
}

#[test]
fn the_largest_error_since_enabling_is_kept() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
    rig.start();
    for count in [0, 40, 0, 0] {
        rig.inputs.set_counts([count, 0, 0]);
        rig.tick();
    }
    let x = &rig.state.axes()[0];
    let share = x.following().high_mark();
    let limit = StageSettings::simulated().axes[0].limits.following_error_mm;
    assert!(
        (f64::from(share) * limit - 0.02).abs() < 1e-3,
        "{share} of {limit} mm"
    );
    assert_ne!(x.following(), rig.state.axes()[1].following());
}

/// The word of an x axis with +-2.5 V to put out, which was taken 2 mm away from where it holds while a voltage was added.
fn word_of_pushed_axis(away: i32, injected_word: i16) -> i16 {
    let settings = with_x(|x| {
        x.feedback.law = LawKind::Pid;
        x.feedback.pid.kp_v_per_mm = 2.0;
        x.amplifier.output_limit_v = 2.5;
        x.limits.following_error_mm = 20.0;
        x.limits.following_error_max_mm = 20.0;
    });
    let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
    rig.start();
    rig.command(Command::Stop);
    let injection = Injection::new(
        AxisName::X,
        Coupling::Added,
        10.0 / DacCode::FULL_SCALE,
        Position::from_mm(90.0, 5e-4),
        1e6,
    );
    rig.state.prepare_injection(injection);
    rig.state.push_injection(InjectedValue {
        word: injected_word,
        last: false,
    });
    rig.inputs.command = Some(Command::StartInjection);
    let mut word = 0;
    for step in 0..400 {
        rig.inputs.set_counts([(away * 10 * step) as u32, 0, 0]);
        let outputs = rig.tick();
        assert!(outputs.enabled, "{:?}", rig.state.safety());
        rig.state.push_injection(InjectedValue {
            word: injected_word,
            last: false,
        });
        word = outputs.codes[0].0;
    }
    word
}

#[test]
fn the_law_fills_what_a_voltage_beside_it_leaves_of_the_limit() {
    for away in [1, -1] {
        let alone = word_of_pushed_axis(away, 0);
        assert_eq!(i32::from(alone), -away * 8192);
        for injected in [1000, -1000] {
            assert_eq!(
                word_of_pushed_axis(away, injected),
                alone,
                "with {injected}"
            );
        }
    }
}

#[test]
fn a_voltage_beyond_the_limit_is_shown_as_limited_also_in_open_loop() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
    rig.start();
    let full_scale_v = 10.0;
    let injection = Injection::new(
        AxisName::X,
        Coupling::OpenLoop,
        2.0 * full_scale_v / DacCode::FULL_SCALE,
        Position::from_mm(5.0, 5e-4),
        100.0,
    );
    rig.command(Command::Stop);
    rig.state.prepare_injection(injection);
    rig.state.push_injection(InjectedValue {
        word: 3000,
        last: false,
    });
    rig.command(Command::StartInjection);
    let shown = |rig: &Rig<f32>| rig.state.axes()[0].telemetry().limited_by;
    assert_eq!(shown(&rig), LimitedBy::Nothing);
    rig.state.push_injection(InjectedValue {
        word: 30_000,
        last: false,
    });
    assert!(rig.tick().enabled);
    assert_eq!(shown(&rig), LimitedBy::OutputLimit);
}

#[test]
fn settings_that_change_while_a_voltage_is_added_make_no_step() {
    let settings = x_alone(|x| x.feedback.law = LawKind::Pid);
    let mut rig = Rig::<f32>::new(&settings, &sine_on_x(5.0, 10.0));
    rig.start();
    rig.command(Command::Stop);
    rig.stand();
    let injection = Injection::new(
        AxisName::X,
        Coupling::Added,
        1e-4,
        Position::from_mm(5.0, 5e-4),
        100.0,
    );
    rig.state.prepare_injection(injection);
    rig.state.push_injection(InjectedValue {
        word: 10_000,
        last: false,
    });
    rig.command(Command::StartInjection);
    rig.inputs.set_counts([80, 0, 0]);
    let mut codes = vec![];
    for tick in 0..4000 {
        if tick == 100 {
            let mut other = settings.clone();
            other.axes[0].feedback.pid.kp_v_per_mm *= 3.0;
            rig.exchange(&other);
        }
        rig.state.push_injection(InjectedValue {
            word: 10_000,
            last: false,
        });
        let outputs = rig.tick();
        assert!(outputs.enabled, "{:?}", rig.state.safety());
        codes.push(outputs.codes[0].0);
    }
    let step = codes[50..]
        .windows(2)
        .map(|pair| pair[0].abs_diff(pair[1]))
        .max()
        .expect("some");
    let whole = codes[99].abs_diff(codes[3999]);
    assert!(whole > 100 && step < whole / 20, "{step} of {whole}");
}

#[test]
fn an_axis_at_rest_on_a_limit_switch_is_no_fault_and_may_leave_it() {
    for (switch, away_mm) in [
        (AxisSwitches::POSITIVE_LIMIT, -1.0),
        (AxisSwitches::NEGATIVE_LIMIT, 1.0),
    ] {
        for direction in [1.0, -1.0] {
            let settings = StageSettings::simulated();
            let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
            rig.inputs.switches = Switches::NONE.with_axis(AxisName::X, switch);
            rig.start();
            rig.command(Command::Stop);
            rig.stand();
            assert!(rig.state.safety().is_enabled(), "at rest on {switch:?}");
            let jog = settings
                .jog_at(AxisName::X, 2.0 * direction)
                .expect("slow enough");
            rig.command(Command::Jog(AxisName::X, jog));
            for _ in 0..300 {
                rig.tick();
            }
            let goes = rig.state.safety().is_enabled();
            assert_eq!(goes, direction == away_mm, "{switch:?} {direction}");
        }
    }
}

#[test]
fn a_fault_that_held_the_axes_is_shown_until_something_moves_and_not_until_somebody_enables() {
    let mut settings = StageSettings::simulated();
    settings.streaming.link_lost = quadrant_settings::LossReaction::Hold;
    let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
    rig.start();
    let velocity = settings.jog_at(AxisName::X, 1.0).expect("slow enough");
    rig.command(Command::Stop);
    rig.command(Command::Jog(AxisName::X, velocity));
    rig.inputs.link_lost = true;
    rig.tick();
    let held = |state: &StageState<f32, 4>| state.held().map(|fault| fault.code);
    assert_eq!(held(&rig.state), Some(FaultCode::LinkLost));
    for _ in 0..2000 {
        rig.tick();
    }
    rig.command(Command::Enable);
    assert_eq!(held(&rig.state), Some(FaultCode::LinkLost));
    rig.command(Command::Jog(AxisName::X, velocity));
    assert_eq!(held(&rig.state), None);
}

#[test]
fn of_two_faults_that_hold_the_axes_the_first_is_shown_and_of_one_that_stops_them_none() {
    for (reaction, expected) in [
        (
            quadrant_settings::LossReaction::Hold,
            Some(FaultCode::LinkLost),
        ),
        (quadrant_settings::LossReaction::Stop, None),
    ] {
        let mut settings = StageSettings::simulated();
        settings.streaming.link_lost = reaction;
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.start();
        let velocity = settings.jog_at(AxisName::X, 1.0).expect("slow enough");
        rig.command(Command::Stop);
        rig.command(Command::Jog(AxisName::X, velocity));
        let mut ticks = vec![];
        for _ in 0..3 {
            rig.inputs.link_lost = true;
            rig.tick();
            let held = rig.state.held();
            assert_eq!(held.map(|fault| fault.code), expected);
            ticks.push(held.map(|fault| fault.tick));
        }
        assert_eq!(ticks[0], ticks[2]);
    }
}

#[test]
fn a_law_that_needs_the_velocity_of_the_reference_has_nothing_to_do_on_an_axis_that_follows() {
    let settings = with_x(|x| {
        x.feedback.law = LawKind::Cascade;
        x.feedforward.kind = quadrant_law::feedforward::FeedforwardKind::None;
    });
    let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
    rig.start();
    rig.command(Command::Stop);
    let velocity = settings.jog_at(AxisName::X, 10.0).expect("slow enough");
    rig.command(Command::Jog(AxisName::X, velocity));
    let mut most = 0.0f32;
    for tick in 0..3000 {
        let reference = rig.state.axes()[0].telemetry().reference;
        rig.inputs.set_counts([(reference.0 >> 16) as u32, 0, 0]);
        rig.tick();
        if tick > 1500 {
            most = most.max(rig.state.axes()[0].telemetry().output_v().abs());
        }
    }
    assert!(rig.state.is_running());
    assert!(most < 0.1, "{most} V");
}

#[test]
fn a_pid_of_gains_that_cannot_be_is_refused() {
    let build = |ki_v_per_mm_s: f64, limit_v: f64| {
        let gains = PidGains {
            kp_v_per_mm: 1.0,
            ki_v_per_mm_s,
            kd_v_s_per_mm: 0.0,
            derivative_filter_s: 1e-4,
        };
        let scale = MotionScale::new(RESOLUTION_MM, 1.0 / PERIOD_S);
        let output = OutputStage::limited_to(10.0);
        Axis::<f32>::build(scale, |axis| axis.output(output).pid(&gains, limit_v)).err()
    };
    assert_eq!(build(1.0, 2.0), None);
    assert_eq!(build(0.0, 0.0), None);
    for (ki_v_per_mm_s, limit_v) in [
        (-1.0, 2.0),
        (f64::NAN, 2.0),
        (1.0, -1.0),
        (1.0, f64::INFINITY),
    ] {
        assert_eq!(build(ki_v_per_mm_s, limit_v), Some(AxisError::Gains));
    }
}

#[test]
fn a_reference_from_elsewhere_gives_the_words_of_the_same_motion() {
    // Else x waits for the longer preview of another axis.
    let settings = x_alone(|_| ());
    let axis: Axis<f32> = settings.build_axis(AxisName::X);
    let plan = sine_on_x(5.0, 10.0);
    let plan = plan.build::<f32>(&settings).expect("valid plan");
    let (mut own, mut elsewhere) = (AxisState::default(), AxisState::default());
    axis.handle_command(&mut own, Command::Run);
    let mut motion = MotionState::start(Position::ZERO);
    let (mut moved, mut output) = (0, 0);
    for tick in 0..8000 {
        // An encoder that follows by 5 um, with noise of its last count.
        let behind = own.telemetry().reference.0 >> 16;
        let reading = EncoderReading::of((behind - 10 + i64::from(tick % 2)) as u32);
        let code = axis.tick(&mut own, &plan[0], &reading);
        let ahead = plan[0].step(&mut motion);
        assert_eq!(
            axis.follow(&mut elsewhere, &ahead, &reading),
            code,
            "tick {tick}"
        );
        moved = moved.max(ahead.position.0 >> 16);
        output = output.max(code.map_or(0, |code| code.0));
    }
    assert!(moved > 1000 && output > 100, "{moved} counts, {output}");
}

#[test]
fn a_reference_from_elsewhere_that_is_no_number_is_a_following_error() {
    let settings = StageSettings::simulated();
    let axis: Axis<f32> = settings.build_axis(AxisName::X);
    for (velocity, acceleration) in [(f32::NAN, 0.0), (0.0, f32::NAN), (f32::NEG_INFINITY, 0.0)] {
        let ahead = ReferenceSample {
            velocity,
            acceleration,
            ..ReferenceSample::default()
        };
        let found = axis.follow(&mut AxisState::default(), &ahead, &EncoderReading::of(0));
        assert_eq!(found, Err(FaultCode::FollowingError));
    }
}

#[test]
fn a_reference_from_elsewhere_that_jumps_is_a_following_error() {
    let settings = StageSettings::simulated();
    let axis: Axis<f32> = settings.build_axis(AxisName::X);
    let mut state = AxisState::default();
    let mut follow = |mm: f64| {
        let ahead = ReferenceSample {
            position: Position::from_mm(mm, settings.axes[0].encoder.resolution_mm),
            ..ReferenceSample::default()
        };
        axis.follow(&mut state, &ahead, &EncoderReading::of(0))
    };
    for _ in 0..100 {
        follow(0.0).expect("no fault");
    }
    let found = (0..100).find_map(|_| follow(20.0).err());
    assert_eq!(found, Some(FaultCode::FollowingError));
}

#[test]
fn the_feedback_follows_the_reference_by_the_longest_preview_that_there_is() {
    let longest = quadrant_law::axis::MAX_PREVIEW_TICKS;
    let mut axis = Axis::<f64, 4>::blank();
    let settings = StageSettings::simulated();
    let x = &settings.axes[0];
    AxisBuilder::new(&mut axis, RESOLUTION_MM, PERIOD_S)
        .output(OutputStage::limited_to(10.0))
        .feedback(pid())
        .feedforward(
            quadrant_law::feedforward::FeedforwardKind::None,
            &x.feedforward.gains,
            &x.friction,
            longest,
        )
        .try_build()
        .expect("valid");
    let plan = sine_on_x(5.0, 10.0);
    let plan = plan.build::<f64>(&settings).expect("valid plan");
    let mut state = AxisState::default();
    axis.handle_command(&mut state, Command::Run);
    let mut ahead = vec![];
    for tick in 0..300 {
        axis.tick(&mut state, &plan[0], &EncoderReading::of(0))
            .expect("no fault");
        ahead.push(state.reference());
        if let Some(before) = ahead.len().checked_sub(longest + 1) {
            assert_eq!(state.telemetry().reference, ahead[before], "tick {tick}");
        }
    }
    assert_ne!(ahead[0], ahead[299]);
}

#[test]
fn the_inputs_of_counts_have_them() {
    let inputs = quadrant_law::stage::Inputs::of_counts([1, 2, 3]);
    assert_eq!(inputs.readings.map(|reading| reading.count), [1, 2, 3]);
}

#[test]
fn an_injection_begins_only_with_its_first_value_and_on_an_axis_that_was_commissioned() {
    let begin = |axis: AxisName, with_value: bool| {
        let mut settings = StageSettings::simulated();
        settings.axes[1] = StageSettings::default().axes[1].clone();
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.start();
        rig.command(Command::Stop);
        rig.stand();
        let travel = Position::from_mm(5.0, 5e-4);
        rig.state
            .prepare_injection(Injection::new(axis, Coupling::Added, 1e-4, travel, 100.0));
        if with_value {
            rig.state.push_injection(InjectedValue {
                word: 10,
                last: true,
            });
        }
        rig.command(Command::StartInjection);
        assert!(rig.state.safety().is_enabled());
        rig.state.is_injecting()
    };
    assert!(begin(AxisName::X, true));
    assert!(!begin(AxisName::X, false));
    assert!(!begin(AxisName::Y, true));
}
