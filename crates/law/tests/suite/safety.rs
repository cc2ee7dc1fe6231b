//! The stage's states: who drives the outputs, and what ends it.

use quadrant_law::axes::AxisName;
use quadrant_law::axes::PerAxis;
use quadrant_law::command::Command;
use quadrant_law::safety::{Fault, FaultCode, SafetyState};
use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::{Rig, sine_on_x};

fn rig() -> Rig<f32> {
    Rig::new(&StageSettings::simulated(), &sine_on_x(1.0, 10.0))
}

fn off() -> Outputs {
    Outputs {
        codes: PerAxis::splat(DacCode::ZERO),
        ..Outputs::default()
    }
}

/// Enabled, with an error on every axis so that the outputs are not zero.
fn working() -> Rig<f32> {
    let mut rig = rig();
    rig.tick();
    rig.command(Command::Enable);
    rig.inputs.set_counts([50, 50, 50]);
    let outputs = rig.tick();
    assert!(outputs.enabled);
    assert!(outputs.codes.iter().all(|code| code.0 != 0), "{outputs:?}");
    rig
}

fn fault(rig: &Rig<f32>) -> Fault {
    match rig.state.safety() {
        SafetyState::Faulted(fault) => fault,
        other => panic!("no fault: {other:?}"),
    }
}

#[test]
fn the_stage_starts_disabled_and_stays_so_unasked() {
    let mut rig = rig();
    for tick in 0..1000u32 {
        rig.inputs
            .set_counts([tick * 90, tick, 0u32.wrapping_sub(tick)]);
        assert_eq!(rig.tick(), off());
    }
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
}

#[test]
fn enabling_holds_the_present_position_with_no_output() {
    let mut rig = rig();
    rig.inputs.set_counts([1_000_000, 5, 0xFFFF_0000]);
    rig.tick();
    rig.inputs.set_counts([1_000_100, 95, 0xFFFF_0010]);
    rig.stand();
    let outputs = rig.command(Command::Enable);
    assert!(outputs.enabled);
    assert_eq!(outputs.codes, [DacCode::ZERO; 3]);
    assert_eq!(rig.tick().codes, [DacCode::ZERO; 3]);
}

#[test]
fn enabling_again_forgets_the_last_time() {
    let mut rig = working();
    for _ in 0..1000 {
        rig.tick();
    }
    assert_ne!(rig.state.axes()[0].telemetry().feedback.integral, 0.0);
    assert_eq!(rig.command(Command::Disable), off());
    assert_eq!(rig.tick(), off());
    let outputs = rig.command(Command::Enable);
    assert!(outputs.enabled);
    assert_eq!(outputs.codes, [DacCode::ZERO; 3]);
}

#[test]
fn disabling_switches_off_in_the_same_tick() {
    let mut rig = working();
    assert_eq!(rig.command(Command::Disable), off());
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
    let seen = rig.state.axes()[0].telemetry();
    assert_eq!((seen.output, seen.code), (0.0, DacCode::ZERO));
}

#[test]
fn an_encoder_jump_switches_off_in_the_same_tick_and_names_its_axis() {
    for (index, name) in AxisName::ALL.into_iter().enumerate() {
        let mut rig = working();
        rig.inputs.readings[index].count += 103;
        let tick = rig.state.tick();
        assert_eq!(rig.tick(), off());
        let expected = Fault {
            code: FaultCode::EncoderJump,
            axis: Some(name),
            tick,
        };
        assert_eq!(fault(&rig), expected);
    }
}

#[test]
fn a_following_error_switches_off_in_the_same_tick_and_names_its_axis() {
    for (index, name) in AxisName::ALL.into_iter().enumerate() {
        for direction in [1u32, u32::MAX] {
            let mut rig = working();
            rig.inputs.set_counts([0; 3]);
            rig.tick();
            let mut last = off();
            let mut moved = 0;
            while rig.state.safety().is_enabled() {
                let counts = &mut rig.inputs.readings[index].count;
                *counts = counts.wrapping_add(direction.wrapping_mul(50));
                moved += 50;
                last = rig.tick();
            }
            assert_eq!(last, off());
            let fault = fault(&rig);
            assert_eq!(
                (fault.code, fault.axis),
                (FaultCode::FollowingError, Some(name))
            );
            assert_eq!(fault.tick, rig.state.tick() - 1);
            // 1 mm is 2000 counts.
            assert_eq!(moved, 2050);
        }
    }
}

#[test]
fn a_missed_deadline_switches_off_in_the_same_tick() {
    let mut rig = working();
    rig.inputs.deadline_missed = true;
    assert_eq!(rig.tick(), off());
    let fault = fault(&rig);
    assert_eq!((fault.code, fault.axis), (FaultCode::DeadlineMissed, None));
}

#[test]
fn faults_need_driven_outputs() {
    let mut rig = rig();
    rig.tick();
    rig.inputs.deadline_missed = true;
    rig.inputs.set_counts([1 << 30; 3]);
    assert_eq!(rig.tick(), off());
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
}

#[test]
fn the_first_fault_stays() {
    let mut rig = working();
    rig.inputs.readings[2].count += 500;
    rig.inputs.deadline_missed = true;
    rig.tick();
    let first = fault(&rig);
    assert_eq!(first.code, FaultCode::EncoderJump);
    for _ in 0..10 {
        rig.inputs.readings[0].count += 1 << 20;
        rig.inputs.deadline_missed = true;
        assert_eq!(rig.tick(), off());
        assert_eq!(fault(&rig), first);
    }
}

#[test]
fn a_fault_outlasts_every_command_but_a_reset() {
    let mut rig = working();
    rig.inputs.deadline_missed = true;
    rig.tick();
    let first = fault(&rig);
    for command in [Command::Enable, Command::Run, Command::Disable] {
        assert_eq!(rig.command(command), off());
        assert_eq!(fault(&rig), first, "{command:?}");
    }
    assert_eq!(rig.command(Command::ResetFault), off());
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
    rig.stand();
    assert!(rig.command(Command::Enable).enabled);
}

#[test]
fn a_reset_in_the_tick_of_the_fault_does_not_hide_it() {
    let mut rig = working();
    rig.inputs.deadline_missed = true;
    assert_eq!(rig.command(Command::ResetFault), off());
    assert_eq!(fault(&rig).code, FaultCode::DeadlineMissed);
}

#[test]
fn a_reset_without_a_fault_changes_nothing() {
    let mut rig = working();
    assert!(rig.command(Command::ResetFault).enabled);
    rig.command(Command::Disable);
    rig.command(Command::ResetFault);
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
}

#[test]
fn a_motion_needs_enabled_outputs_and_starts_once() {
    let mut rig = rig();
    rig.tick();
    rig.command(Command::Run);
    assert!(!rig.state.is_running());
    rig.command(Command::Enable);
    assert!(!rig.state.is_running());
    rig.command(Command::Run);
    assert!(rig.state.is_running());
    for _ in 0..200 {
        rig.tick();
    }
    let reference = |rig: &Rig<f32>| rig.state.axes()[0].telemetry().reference;
    let before = reference(&rig);
    // Asked again, the motion under way goes on.
    rig.command(Command::Run);
    let step = (reference(&rig) - before).to_mm(5e-4);
    assert!(step > 0.0 && step < 2e-3, "{step}");
}

#[test]
fn a_fault_ends_the_motion() {
    let mut rig = rig();
    rig.start();
    rig.tick();
    rig.inputs.deadline_missed = true;
    rig.tick();
    assert!(!rig.state.is_running());
    rig.command(Command::ResetFault);
    rig.command(Command::Enable);
    assert!(!rig.state.is_running());
}

#[test]
fn a_plan_without_motion_ends_at_once() {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &PlanSettings::default());
    rig.start();
    assert!(!rig.state.is_running());
    assert!(rig.state.safety().is_enabled());
}

#[test]
fn every_fault_has_its_own_number_cause_and_remedy() {
    for (index, code) in FaultCode::ALL.into_iter().enumerate() {
        assert_eq!(usize::from(code.number()), index + 1);
        for other in &FaultCode::ALL[..index] {
            assert_ne!(code.cause(), other.cause());
            assert_ne!(code.remedy(), other.remedy());
        }
    }
}
