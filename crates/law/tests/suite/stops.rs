//! A controlled stop has an end; and what must be so before an axis is driven.

use quadrant_law::admission::{Refusal, StageView, refusal};
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::axis::{Axis, AxisBuilder, OutputStage};
use quadrant_law::command::Command;
use quadrant_law::motion::ReferenceGenerator;
use quadrant_law::reference::{MotionScale, Ramp, Velocity};
use quadrant_law::safety::{AxisSwitches, FaultCode, Operation, SafetyState, Switches};
use quadrant_law::stage::{Outputs, Stage};
use quadrant_settings::{AxisSettings, HomeSwitch, PlanSettings, StageSettings};

use quadrant_test_support::{Rig, with_x};

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 1e4,
};

/// Lets the encoders follow the references to the count.
pub(crate) fn follow(rig: &mut Rig<f32>) {
    for index in 0..3 {
        let reference = rig.state.axes()[index].telemetry().reference;
        rig.inputs.readings[index].count = (reference.0 >> 16) as u32;
    }
}

fn refused(change: impl FnOnce(&mut AxisSettings)) -> String {
    with_x(change).validate(4).unwrap_err().to_string()
}

#[test]
fn settings_by_which_a_stop_would_not_end_are_refused_by_name() {
    for (said, field) in [
        (
            refused(|x| x.limits.braking_mm_s2 = 1e-3),
            "x/limits/braking_mm_s2",
        ),
        // 2000 mm/s^2 are the largest acceleration.
        (
            refused(|x| x.limits.braking_mm_s2 = 1999.0),
            "x/limits/braking_mm_s2",
        ),
        // A second from 250 mm/s.
        (
            refused(|x| {
                x.limits.max_acceleration_mm_s2 = 1.0;
                x.limits.braking_mm_s2 = 249.0;
            }),
            "x/limits/braking_mm_s2",
        ),
        (
            refused(|x| x.limits.braking_jerk_mm_s3 = 3999.0),
            "x/limits/braking_jerk_mm_s3",
        ),
    ] {
        assert!(said.starts_with(field), "{said}");
    }
    let least = with_x(|x| {
        x.limits.braking_mm_s2 = 2000.0;
        x.limits.braking_jerk_mm_s3 = 2000.0;
    });
    assert_eq!(least.validate(4), Ok(()));
}

/// An axis whose stop takes 100 s, and may take 100 ticks.
fn endless() -> Axis<f32, 4> {
    let mut axis = Axis::blank();
    AxisBuilder::new(&mut axis, SCALE.resolution_mm, 1.0 / SCALE.rate_hz)
        .output(OutputStage::limited_to(10.0))
        .generator(
            ReferenceGenerator::new(
                Ramp::new(1.0, 1e5, SCALE),
                Ramp::new(2000.0, 1e5, SCALE),
                Velocity::from_mm_s(100.0, SCALE),
                SCALE,
            )
            .with_stop_limit(100),
        )
        .try_build()
        .unwrap();
    axis
}

fn jogging() -> Rig<f32> {
    let mut rig = Rig::new(&StageSettings::simulated(), &PlanSettings::default());
    rig.stage = Stage::new(PerAxis::from_fn(|_| endless()), Operation::default());
    rig.tick();
    rig.command(Command::Enable);
    rig.command(Command::Jog(AxisName::X, Velocity::from_mm_s(100.0, SCALE)));
    for _ in 0..2000 {
        follow(&mut rig);
        rig.tick();
    }
    assert!(rig.state.is_running());
    rig
}

#[test]
fn a_stop_that_overruns_switches_off() {
    for after_a_fault in [true, false] {
        let mut rig = jogging();
        if after_a_fault {
            rig.inputs.link_lost = true;
        } else {
            rig.inputs.command = Some(Command::Stop);
        }
        let mut ticks = 0;
        loop {
            follow(&mut rig);
            let outputs = rig.tick();
            if !outputs.enabled {
                assert_eq!(outputs, Outputs::default());
                break;
            }
            ticks += 1;
            assert!(ticks < 1000, "it never ends");
        }
        assert_eq!(ticks, 100);
        let fault = rig.state.safety().fault().expect("latched");
        // The first fault stays.
        let expected = if after_a_fault {
            (FaultCode::LinkLost, None)
        } else {
            (FaultCode::StopOverrun, Some(AxisName::X))
        };
        assert_eq!((fault.code, fault.axis), expected);
    }
}

#[test]
fn the_longest_stop_of_the_settings_is_no_overrun() {
    for (acceleration, braking, jerk) in [
        (2000.0, 2000.0, 2e4),
        (500.0, 4000.0, 1e6),
        (100.0, 250.0, 250.0),
    ] {
        let settings = with_x(|x| {
            x.limits.max_acceleration_mm_s2 = acceleration;
            x.limits.braking_mm_s2 = braking;
            x.limits.braking_jerk_mm_s3 = jerk;
        });
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.tick();
        rig.command(Command::Enable);
        rig.command(Command::Jog(AxisName::X, Velocity::from_mm_s(250.0, SCALE)));
        // Also from the middle of the rise, where the acceleration is to be taken back first.
        for ticks in [(0.5 * 250.0 / acceleration * 1e4) as u32, 40_000] {
            for _ in 0..ticks {
                follow(&mut rig);
                rig.tick();
            }
            rig.command(Command::Stop);
            while rig.state.is_running() {
                follow(&mut rig);
                assert!(rig.tick().enabled, "{:?}", rig.state.safety());
            }
            rig.command(Command::Jog(AxisName::X, Velocity::from_mm_s(250.0, SCALE)));
        }
    }
}

#[test]
fn an_axis_that_moves_is_not_enabled() {
    for axis in AxisName::ALL {
        for step in [11i32, -11] {
            let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
            rig.tick();
            // 55 mm/s.
            for _ in 0..100 {
                let count = &mut rig.inputs.readings[axis as usize].count;
                *count = count.wrapping_add_signed(step);
                rig.tick();
            }
            let view = StageView {
                commissioned: true,
                ..rig.stage.as_ref().view(&rig.plan, &rig.state)
            };
            let said = refusal(view, Command::Enable);
            assert_eq!(said, Some(Refusal::NotAtStandstill(axis)));
            let count = &mut rig.inputs.readings[axis as usize].count;
            *count = count.wrapping_add_signed(step);
            assert_eq!(rig.command(Command::Enable), Outputs::default());
            assert_eq!(rig.state.safety(), SafetyState::Disabled);
            // It has come to rest: the speed is filtered over 8 ticks.
            for _ in 0..40 {
                rig.tick();
            }
            assert_eq!(
                refusal(
                    rig.stage.as_ref().view(&rig.plan, &rig.state),
                    Command::Enable
                ),
                None
            );
            assert!(rig.command(Command::Enable).enabled);
            // Driven, it may move.
            assert_eq!(rig.stage.as_ref().view(&rig.plan, &rig.state).moving, None);
        }
    }
}

#[test]
fn homing_watches_the_limit_switch_that_it_does_not_search() {
    for (switch, on_it) in [
        (HomeSwitch::Home, AxisSwitches::HOME),
        (HomeSwitch::Limit, AxisSwitches::NEGATIVE_LIMIT),
    ] {
        let settings = with_x(|x| x.homing.as_mut().expect("by default").switch = switch);
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.tick();
        rig.command(Command::Enable);
        // On the switch, so it moves off it: towards the positive limit.
        let both = on_it.with(AxisSwitches::POSITIVE_LIMIT);
        rig.inputs.switches = Switches::NONE.with_axis(AxisName::X, both);
        rig.command(Command::Home(AxisName::X));
        for _ in 0..200 {
            follow(&mut rig);
            rig.tick();
        }
        let fault = rig.state.safety().fault().expect("found");
        assert_eq!(
            (fault.code, fault.axis),
            (FaultCode::PositiveLimitSwitch, Some(AxisName::X))
        );
    }
}

#[test]
fn an_axis_is_too_fast_either_way() {
    for direction in [1i32, -1] {
        let settings = with_x(|x| {
            x.limits.following_error_mm = 20.0;
            x.limits.following_error_max_mm = 20.0;
        });
        let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
        rig.tick();
        rig.command(Command::Enable);
        for _ in 0..20 {
            let count = &mut rig.inputs.readings[0].count;
            *count = count.wrapping_add_signed(100 * direction);
            rig.tick();
        }
        let fault = rig.state.safety().fault().expect("found");
        assert_eq!(fault.code, FaultCode::Overspeed, "{direction}");
    }
}

#[test]
fn enabling_holds_where_the_axis_is_not_where_it_was() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
    rig.tick();
    rig.command(Command::Enable);
    rig.command(Command::Jog(AxisName::X, Velocity::from_mm_s(50.0, SCALE)));
    for _ in 0..3000 {
        follow(&mut rig);
        rig.tick();
    }
    rig.command(Command::Disable);
    // A hand moves it on.
    for _ in 0..500 {
        rig.inputs.readings[0].count += 3;
        rig.tick();
    }
    rig.stand();
    rig.inputs.command = Some(Command::Enable);
    for _ in 0..100 {
        let outputs = rig.tick();
        assert!(outputs.enabled);
        assert_eq!(outputs.codes[0].0, 0);
        let x = &rig.state.axes()[0];
        let here = x.telemetry().measured.position();
        assert_eq!((x.reference(), x.telemetry().reference), (here, here));
    }
}

#[test]
fn a_fault_that_switches_off_goes_before_one_that_stops_in_the_same_tick() {
    let run = |press_at: Option<u32>| {
        let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
        rig.tick();
        rig.command(Command::Enable);
        rig.command(Command::Jog(AxisName::X, Velocity::from_mm_s(20.0, SCALE)));
        for tick in 0..2000 {
            follow(&mut rig);
            // z drifts off while x moves.
            rig.inputs.readings[2].count = 3 * tick;
            if press_at == Some(tick) {
                rig.inputs.switches =
                    Switches::NONE.with_axis(AxisName::X, AxisSwitches::POSITIVE_LIMIT);
            }
            rig.tick();
            if let Some(fault) = rig.state.safety().fault() {
                return (tick, fault.code, rig.state.safety());
            }
        }
        panic!("z does not drift");
    };
    let (tick, code, _) = run(None);
    assert_eq!(code, FaultCode::FollowingError);
    let (both, code, state) = run(Some(tick));
    assert_eq!((both, code), (tick, FaultCode::FollowingError));
    assert!(matches!(state, SafetyState::Faulted(_)), "{state:?}");
}

#[test]
fn until_it_is_homed_an_axis_is_slow_and_starts_nothing_but_jogs_and_homing() {
    let settings = with_x(|x| x.limits.unhomed_mm_s = Some(5.0));
    let mut rig = Rig::<f32>::new(&settings, &quadrant_test_support::sine_on_x(1.0, 10.0));
    rig.tick();
    rig.command(Command::Enable);
    let said =
        |rig: &Rig<f32>, command| refusal(rig.stage.as_ref().view(&rig.plan, &rig.state), command);
    let not_homed = Some(Refusal::NotHomed(AxisName::X));
    for command in [
        Command::Run,
        Command::StartStream,
        Command::StartInjection,
        Command::StartMove(AxisName::X),
    ] {
        assert_eq!(said(&rig, command), not_homed, "{command:?}");
        rig.command(command);
        assert!(!rig.state.is_running(), "{command:?}");
    }
    assert_eq!(said(&rig, Command::StartMove(AxisName::Y)), None);
    // A jog and homing are held to it.
    let fastest = |rig: &mut Rig<f32>, command| {
        rig.command(command);
        let mut most_mm_s = 0.0f64;
        for _ in 0..3000 {
            let before = rig.state.axes()[0].reference();
            follow(rig);
            assert!(rig.tick().enabled);
            let moved = rig.state.axes()[0].reference() - before;
            most_mm_s = most_mm_s.max(moved.to_mm(SCALE.resolution_mm).abs() * SCALE.rate_hz);
        }
        rig.command(Command::Stop);
        for _ in 0..500 {
            follow(rig);
            rig.tick();
        }
        most_mm_s
    };
    let jog = Command::Jog(AxisName::X, Velocity::from_mm_s(50.0, SCALE));
    let home = Command::Home(AxisName::X);
    let seen = [fastest(&mut rig, jog), fastest(&mut rig, home)];
    assert!(
        seen.iter().all(|most| (4.9..5.1).contains(most)),
        "{seen:?}"
    );
    // What is measured is watched too: 20 mm/s.
    let (state, count) = (rig.state.clone(), rig.inputs.readings[0].count);
    for homed in [false, true] {
        rig.state = state.clone();
        rig.state.set_homed(AxisName::X, homed);
        rig.inputs.readings[0].count = count;
        for _ in 0..40 {
            rig.inputs.readings[0].count += 4;
            rig.tick();
        }
        let fault = rig.state.safety().fault().map(|fault| fault.code);
        assert_eq!(fault, (!homed).then_some(FaultCode::Overspeed));
    }
    // Homed, it moves as it may.
    let mut rig = Rig::<f32>::new(&settings, &quadrant_test_support::sine_on_x(1.0, 10.0));
    rig.state.set_homed(AxisName::X, true);
    rig.start();
    assert!(rig.state.is_running());
}
