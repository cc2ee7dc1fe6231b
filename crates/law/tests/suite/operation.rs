//! The rules of operation: enabling, motions that need their host, and the emergency stop.

use quadrant_law::admission::StageView;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::safety::{AxisSwitches, FaultCode, Operation, Reaction, SafetyState, Switches};
use quadrant_law::stage::Outputs;
use quadrant_law::supervisor::{Event, Supervisor};
use quadrant_settings::{EmergencyReaction, StageSettings};

use crate::safety_faults::{follow, moving};
use quadrant_test_support::Rig;

/// A stage in motion whose emergency stop brakes.
fn braking() -> Rig<f32> {
    let mut settings = StageSettings::simulated();
    settings.operation.emergency_stop = EmergencyReaction::Stop;
    let mut rig = moving(&settings);
    rig.inputs.switches = Switches::EMERGENCY_STOP;
    follow(&mut rig);
    assert!(rig.tick().enabled);
    rig
}

#[test]
fn an_emergency_stop_of_category_1_brakes_and_then_switches_off() {
    let mut rig = braking();
    // 105 ms of braking, 20 ms of rest.
    let mut ticks = 0;
    loop {
        follow(&mut rig);
        ticks += 1;
        if !rig.tick().enabled {
            break;
        }
        assert!(ticks < 1250, "never ends");
    }
    assert!(ticks > 200, "{ticks}");
    let fault = rig.state.safety().fault().expect("latched");
    assert_eq!((fault.code, fault.axis), (FaultCode::EmergencyStop, None));
    // Nothing is enabled while it is pressed.
    rig.command(Command::ResetFault);
    assert_eq!(rig.command(Command::Enable), Outputs::default());
}

#[test]
fn what_switches_off_still_does_while_an_emergency_stop_brakes() {
    let fault = Switches::EMERGENCY_STOP.with_axis(AxisName::Z, AxisSwitches::AMPLIFIER_FAULT);
    for ticks_before in [0, 5] {
        let mut rig = if ticks_before == 0 {
            let mut settings = StageSettings::simulated();
            settings.operation.emergency_stop = EmergencyReaction::Stop;
            moving(&settings)
        } else {
            braking()
        };
        rig.inputs.switches = fault;
        follow(&mut rig);
        assert_eq!(rig.tick(), Outputs::default());
        // The first fault is the one that is reported.
        let first = rig.state.safety().fault().expect("latched").code;
        assert_eq!(first, FaultCode::EmergencyStop);
    }
}

#[test]
fn an_axis_that_is_pushed_while_the_outputs_are_off_is_reported_once_a_push() {
    let standing = StageView {
        safety: SafetyState::Disabled,
        commissioned: true,
        ..StageView::default()
    };
    let pushed = StageView {
        moving: Some(AxisName::Y),
        ..standing
    };
    let enabled = StageView {
        safety: SafetyState::Enabled,
        ..standing
    };
    let mut supervisor = Supervisor::default();
    let mut reported = |view, runs| {
        (0..runs)
            .flat_map(|_| supervisor.step(view, None).events)
            .flatten()
            .filter(|event| matches!(event, Event::MovedWhileOff(AxisName::Y)))
            .count()
    };
    assert_eq!(reported(standing, 200), 0);
    assert_eq!(reported(pushed, 50), 1);
    assert_eq!(reported(standing, 200), 0);
    assert_eq!(reported(pushed, 1), 1);
    // What coasts after it was switched off was not pushed.
    assert_eq!(reported(enabled, 200), 0);
    assert_eq!(reported(standing, 1), 0);
    assert_eq!(reported(pushed, 50), 0);
}

#[test]
fn the_rules_decide_over_three_faults_and_every_other_has_its_own_reaction() {
    for [emergency_stop, link_lost, underrun] in [
        [Reaction::Off, Reaction::Stop, Reaction::Hold],
        [Reaction::Stop, Reaction::Hold, Reaction::Off],
        [Reaction::Hold, Reaction::Off, Reaction::Stop],
    ] {
        let operation = Operation {
            emergency_stop,
            link_lost,
            underrun,
            ..Operation::default()
        };
        for code in FaultCode::ALL {
            let expected = match code {
                FaultCode::EmergencyStop => emergency_stop,
                FaultCode::LinkLost => link_lost,
                FaultCode::StreamUnderrun => underrun,
                other => other.reaction(),
            };
            assert_eq!(operation.reaction(code), expected, "{code:?}");
        }
    }
}
