//! The holding brake: an axis that hangs on it never falls between brake and law.

use proptest::prelude::*;
use quadrant_law::admission::{Refusal, refusal};
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::reference::{MotionScale, Velocity};
use quadrant_law::safety::{FaultCode, SafetyState, Switches};
use quadrant_law::stage::Outputs;
use quadrant_settings::{EmergencyReaction, StageSettings};

use crate::stops::follow;
use quadrant_test_support::{Rig, repeatable, sine_on_x};

/// Ticks in which the brake of these tests releases.
const RELEASE: u32 = 300;
/// Ticks in which it applies.
const APPLY: u32 = 200;

fn settings() -> StageSettings {
    let mut settings = StageSettings::simulated();
    settings.brake.release_s = 0.03;
    settings.brake.apply_s = 0.02;
    settings
}

fn rig() -> Rig<f32> {
    let mut rig = Rig::new(&settings(), &sine_on_x(1.0, 10.0));
    rig.tick();
    rig
}

/// Ticks in which the outputs are as they are now, at most 5000.
fn ticks_until(rig: &mut Rig<f32>, done: impl Fn(Outputs) -> bool) -> u32 {
    for ticks in 1..5000 {
        follow(rig);
        if done(rig.tick()) {
            return ticks;
        }
    }
    panic!("never");
}

/// Enabled, and the brake released.
fn released() -> Rig<f32> {
    let mut rig = rig();
    rig.command(Command::Enable);
    for _ in 0..=RELEASE {
        rig.tick();
    }
    rig
}

fn off(outputs: Outputs) -> bool {
    outputs == Outputs::default()
}

#[test]
fn nothing_moves_before_the_brake_is_released() {
    let mut rig = rig();
    let outputs = rig.command(Command::Enable);
    assert!(outputs.enabled && outputs.brake_released);
    let view = rig.stage.as_ref().view(&rig.plan, &rig.state);
    assert_eq!(refusal(view, Command::Run), Some(Refusal::BrakeMoves));
    let ticks = (1..2 * RELEASE)
        .find(|_| {
            rig.command(Command::Run);
            rig.state.is_running()
        })
        .expect("runs");
    assert!((RELEASE..RELEASE + 3).contains(&ticks), "{ticks}");
}

#[test]
fn the_law_holds_the_axes_until_the_brake_does() {
    let mut rig = released();
    let outputs = rig.command(Command::Disable);
    assert!(outputs.enabled && !outputs.brake_released);
    for command in [Command::Run, Command::Enable, Command::Home(AxisName::X)] {
        let view = rig.stage.as_ref().view(&rig.plan, &rig.state);
        assert_eq!(refusal(view, command), Some(Refusal::BrakeMoves));
    }
    let ticks = ticks_until(&mut rig, off);
    assert!((APPLY..APPLY + 3).contains(&ticks), "{ticks}");
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
}

#[test]
fn asked_a_second_time_or_in_motion_the_outputs_go_off_at_once() {
    let mut rig = released();
    rig.command(Command::Disable);
    assert!(off(rig.command(Command::Disable)));
    let mut rig = released();
    rig.command(Command::Run);
    for _ in 0..500 {
        follow(&mut rig);
        rig.tick();
    }
    assert!(rig.state.is_running());
    assert!(off(rig.command(Command::Disable)));
}

#[test]
fn a_stop_ends_with_the_brake_and_a_fault_that_switches_off_does_not_wait_for_it() {
    let mut rig = released();
    rig.command(Command::Run);
    for _ in 0..500 {
        follow(&mut rig);
        rig.tick();
    }
    rig.inputs.link_lost = true;
    ticks_until(&mut rig, |outputs| !outputs.brake_released);
    assert!(matches!(rig.state.safety(), SafetyState::Stopping(_)));
    assert!(!rig.state.is_running());
    let ticks = ticks_until(&mut rig, off);
    assert!((APPLY..APPLY + 3).contains(&ticks), "{ticks}");
    let fault = rig.state.safety().fault().expect("latched");
    assert_eq!(fault.code, FaultCode::LinkLost);

    let mut rig = released();
    rig.inputs.switches = Switches::EMERGENCY_STOP;
    assert!(off(rig.tick()));
}

#[test]
fn a_stop_at_rest_takes_the_200_ticks_of_settling_and_the_brake_s_time() {
    for (apply_s, ticks) in [(0.0, 200), (0.0001, 202), (0.02, 401)] {
        let mut settings = settings();
        settings.brake.apply_s = apply_s;
        settings.operation.emergency_stop = EmergencyReaction::Stop;
        let mut rig = Rig::<f32>::new(&settings, &sine_on_x(1.0, 10.0));
        rig.tick();
        rig.command(Command::Enable);
        for _ in 0..=RELEASE {
            rig.tick();
        }
        rig.inputs.switches = Switches::EMERGENCY_STOP;
        assert!(!off(rig.tick()));
        assert_eq!(ticks_until(&mut rig, off), ticks, "{apply_s} s");
    }
}

#[test]
fn without_times_the_brake_goes_with_the_outputs() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &sine_on_x(1.0, 10.0));
    rig.start();
    assert!(rig.state.is_running());
    let outputs = rig.tick();
    assert!(outputs.enabled && outputs.brake_released);
    rig.command(Command::Stop);
    for _ in 0..3000 {
        rig.tick();
    }
    assert!(off(rig.command(Command::Disable)));
}

/// A command, or what else happens in a tick.
fn event() -> impl Strategy<Value = u32> {
    0u32..9
}

proptest! {
    #![proptest_config(repeatable(48))]

    /// The brake of the test holds unless it has had its current for [`RELEASE`], or had it [`APPLY`] ago.
    #[test]
    fn an_axis_is_held_by_the_law_or_by_the_brake_whatever_is_asked(
        events in prop::collection::vec((event(), 1u32..900), 1..40),
    ) {
        let mut rig = rig();
        let scale = MotionScale { resolution_mm: 5e-4, rate_hz: 1e4 };
        let jog = Command::Jog(AxisName::Y, Velocity::from_mm_s(5.0, scale));
        let (mut on, mut since_off) = (0u32, u32::MAX);
        for (event, ticks) in events {
            match event {
                0 | 1 => rig.inputs.command = Some(Command::Enable),
                2 => rig.inputs.command = Some(Command::Disable),
                3 => rig.inputs.command = Some(Command::Run),
                4 => rig.inputs.command = Some(jog),
                5 => rig.inputs.command = Some(Command::Stop),
                6 => rig.inputs.command = Some(Command::ResetFault),
                7 => rig.inputs.link_lost = true,
                _ => {}
            }
            for _ in 0..ticks {
                let was_running = rig.state.is_running();
                let disables = rig.inputs.command == Some(Command::Disable);
                follow(&mut rig);
                let before = rig.state.safety();
                let outputs = rig.tick();
                prop_assert!(outputs.enabled || !outputs.brake_released);
                if outputs.brake_released {
                    (on, since_off) = (on + 1, 0);
                } else {
                    on = 0;
                    since_off = since_off.saturating_add(1);
                }
                // Nothing moves against a brake that may hold still.
                if rig.state.is_running() && !was_running {
                    prop_assert!(on > RELEASE, "{on}");
                }
                // Somebody asked twice, or in motion, for an axis that is let go.
                let at_once = disables && (was_running || !matches!(before, SafetyState::Enabled) || on == 0);
                if !outputs.enabled && before.drives() && !at_once {
                    prop_assert!(since_off > APPLY, "{since_off} ticks after the current");
                }
            }
        }
    }
}
