//! The conditions of enabling and of motion: proved by trying every view of the stage there is.
//!
//! A view is finite. Of the three axes y stands for all: what is asked of an axis depends on that axis and on what holds for
//! the whole stage.

use quadrant_law::admission::{Refusal, StageView, refusal, refusal_from};
use quadrant_law::axes::{AxisName, PerAxis};
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{MotionScale, Velocity};
use quadrant_law::safety::{EnableInterlock, EnabledBy, Fault, FaultCode, SafetyState, Station};

const AXIS: AxisName = AxisName::Y;
const FAULT: Fault = Fault {
    code: FaultCode::Overspeed,
    axis: Some(AXIS),
    tick: 1,
};
const STATES: [SafetyState; 5] = [
    SafetyState::Start,
    SafetyState::Disabled,
    SafetyState::Enabled,
    SafetyState::Stopping(FAULT),
    SafetyState::Faulted(FAULT),
];
const MODES: [MotionMode; 7] = [
    MotionMode::Hold,
    MotionMode::Plan,
    MotionMode::Jog,
    MotionMode::Home,
    MotionMode::Stream,
    MotionMode::Stopping,
    MotionMode::OpenLoop,
];
/// Flags of a view that are enumerated as bits.
const FLAGS: u32 = 15;

fn commands() -> [Command; 10] {
    let scale = MotionScale {
        resolution_mm: 5e-4,
        rate_hz: 1e4,
    };
    [
        Command::Enable,
        Command::Disable,
        Command::ResetFault,
        Command::Run,
        Command::Stop,
        Command::Home(AXIS),
        Command::Jog(AXIS, Velocity::from_mm_s(1.0, scale)),
        Command::StartMove(AXIS),
        Command::StartStream,
        Command::StartInjection,
    ]
}

/// True for what starts a motion.
fn starts(command: Command) -> bool {
    !matches!(
        command,
        Command::Enable | Command::Disable | Command::ResetFault | Command::Stop
    )
}

/// Every view, with each of the enablers.
fn views() -> impl Iterator<Item = StageView> {
    STATES.into_iter().flat_map(|safety| {
        MODES.into_iter().flat_map(move |mode| {
            (0..1 << FLAGS).map(move |bits: u32| {
                let flag = |bit: u32| bits >> bit & 1 == 1;
                let on_axis = |yes: bool| PerAxis::from_fn(|axis| yes && axis == AXIS);
                StageView {
                    safety,
                    running: flag(0),
                    interlock: flag(1).then_some(EnableInterlock {
                        code: FaultCode::AmplifierFault,
                        axis: Some(AXIS),
                    }),
                    moving: flag(2).then_some(AXIS),
                    held: flag(3).then_some(FAULT),
                    modes: PerAxis::from_fn(
                        |axis| {
                            if axis == AXIS { mode } else { MotionMode::Hold }
                        },
                    ),
                    homed: on_axis(flag(4)),
                    awaiting_homing: on_axis(flag(5)),
                    stream_ready: flag(6),
                    injection_ready: flag(7),
                    injecting: flag(8),
                    commissioned: flag(9),
                    uncommissioned: (!flag(9) && flag(14)).then_some(AXIS),
                    inert: on_axis(flag(13)),
                    inert_planned: flag(14).then_some(AXIS),
                    inert_streamed: flag(14).then_some(AXIS),
                    inert_injected: flag(14).then_some(AXIS),
                    locked: flag(12),
                    settings_invalid: flag(10),
                    brake_moves: flag(11),
                    enabled_by: EnabledBy::Any,
                }
            })
        })
    })
}

#[test]
fn nothing_is_enabled_unless_all_is_well() {
    let mut enabled = 0u32;
    for view in views() {
        for enabled_by in [EnabledBy::Any, EnabledBy::Host, EnabledBy::Operator] {
            let view = StageView { enabled_by, ..view };
            for (station, other) in [
                (Station::Host, EnabledBy::Operator),
                (Station::Operator, EnabledBy::Host),
            ] {
                if refusal_from(station, view, Command::Enable).is_some() {
                    continue;
                }
                let mut safety = view.safety;
                if !safety.apply(Command::Enable) {
                    // It was enabled before, and stays so.
                    assert_eq!(view.safety, SafetyState::Enabled);
                    assert_eq!(safety, view.safety);
                    continue;
                }
                enabled += 1;
                assert_eq!(view.safety, SafetyState::Disabled, "{view:?}");
                assert!(
                    view.interlock.is_none()
                        && view.moving.is_none()
                        && view.commissioned
                        && !view.locked
                        && !view.settings_invalid
                        && !view.brake_moves
                        && enabled_by != other,
                    "{view:?}"
                );
            }
        }
    }
    assert!(enabled > 0);
}

#[test]
fn no_motion_starts_but_on_an_enabled_stage_at_rest_whose_brake_is_released() {
    for view in views() {
        for command in commands().into_iter().filter(|&command| starts(command)) {
            if refusal(view, command).is_some() {
                continue;
            }
            assert_eq!(view.safety, SafetyState::Enabled, "{command:?} {view:?}");
            assert!(!view.brake_moves, "{command:?} {view:?}");
            match command {
                Command::Jog(axis, _) => {
                    assert!(!view.injecting && !view.inert[axis], "{view:?}");
                    assert!(
                        matches!(view.modes[axis], MotionMode::Hold | MotionMode::Jog),
                        "{view:?}"
                    );
                }
                Command::Home(axis) | Command::StartMove(axis) => {
                    assert_eq!(view.modes[axis], MotionMode::Hold, "{view:?}");
                    assert!(!view.injecting && !view.inert[axis], "{view:?}");
                    assert!(
                        matches!(command, Command::Home(_)) || !view.awaiting_homing[axis],
                        "{view:?}"
                    );
                }
                _ => {
                    assert!(!view.running, "{command:?} {view:?}");
                    assert!(!view.awaiting_homing[AXIS], "{command:?} {view:?}");
                    let without_law = match command {
                        Command::Run => view.inert_planned,
                        Command::StartStream => view.inert_streamed,
                        _ => view.inert_injected,
                    };
                    assert_eq!(without_law, None, "{command:?} {view:?}");
                    assert!(
                        command != Command::StartStream || view.stream_ready,
                        "{view:?}"
                    );
                    assert!(
                        command != Command::StartInjection || view.injection_ready,
                        "{view:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn stop_and_disable_are_never_refused_and_a_reset_only_clears_what_is_latched() {
    for view in views() {
        for station in [Station::Host, Station::Operator] {
            assert_eq!(refusal_from(station, view, Command::Stop), None);
            assert_eq!(refusal_from(station, view, Command::Disable), None);
        }
        let resets = refusal(view, Command::ResetFault).is_none();
        let may = matches!(view.safety, SafetyState::Faulted(_)) && !view.settings_invalid;
        assert_eq!(resets, may, "{view:?}");
    }
}

#[test]
fn every_refusal_says_something_of_its_own_and_names_its_axis() {
    let of_axis = |code, axis| Refusal::BadInput(EnableInterlock { code, axis });
    let whole = [
        Refusal::FaultLatched,
        Refusal::NotEnabled,
        Refusal::AlreadyRunning,
        Refusal::NoFault,
        Refusal::Stopping,
        Refusal::Starting,
        Refusal::NoStream,
        Refusal::NoInjection,
        Refusal::Injecting,
        Refusal::NotCommissioned,
        Refusal::BrakeMoves,
        Refusal::HostOnly,
        Refusal::OperatorOnly,
        Refusal::Locked,
        Refusal::SettingsInvalid,
        of_axis(FaultCode::EmergencyStop, None),
    ];
    let axis = [
        Refusal::AxisBusy(AXIS),
        Refusal::NotAtStandstill(AXIS),
        Refusal::NotHomed(AXIS),
        Refusal::NoLaw(AXIS),
        Refusal::LawNotCommissioned(AXIS),
        of_axis(FaultCode::AmplifierFault, Some(AXIS)),
        of_axis(FaultCode::OutputMismatch, Some(AXIS)),
        of_axis(FaultCode::StaleSample, Some(AXIS)),
        of_axis(FaultCode::EncoderInvalid, Some(AXIS)),
    ];
    for refusal in whole {
        assert_eq!(refusal.axis(), None, "{refusal}");
        assert_eq!(refusal.to_string(), refusal.as_str());
    }
    for refusal in axis {
        assert_eq!(refusal.axis(), Some(AXIS), "{refusal}");
        assert_eq!(refusal.to_string(), format!("y: {}", refusal.as_str()));
    }
    let mut said: Vec<&str> = whole
        .iter()
        .chain(&axis)
        .map(|refusal| refusal.as_str())
        .collect();
    assert!(said.iter().all(|text| text.len() > 20));
    said.sort_unstable();
    said.dedup();
    assert_eq!(said.len(), whole.len() + axis.len());
}

#[test]
fn an_axis_that_brakes_is_waited_for_before_a_reset_and_one_that_is_driven_moves_as_it_may() {
    let braking = StageView {
        safety: SafetyState::Stopping(FAULT),
        ..StageView::default()
    };
    assert_eq!(
        refusal(braking, Command::ResetFault),
        Some(Refusal::Stopping)
    );
    let driven = StageView {
        safety: SafetyState::Enabled,
        commissioned: true,
        inert: PerAxis::splat(false),
        moving: Some(AXIS),
        ..StageView::default()
    };
    assert_eq!(refusal(driven, Command::Enable), None);
}

#[test]
fn only_a_request_to_enable_makes_the_law_drive() {
    for state in STATES {
        for command in commands() {
            let mut after = state;
            let enabled = after.apply(command);
            assert_eq!(
                enabled,
                state == SafetyState::Disabled && command == Command::Enable
            );
            assert!(
                !after.drives() || state.drives() || enabled,
                "{state:?} {command:?}"
            );
            if command == Command::Disable {
                assert!(!after.drives(), "{state:?}");
            }
            // A fault goes by a reset alone.
            if state.fault().is_some() && command != Command::ResetFault {
                assert_eq!(after.fault(), state.fault(), "{state:?} {command:?}");
            }
        }
    }
}
