//! The faults as `docs/safety.md` has them, written by hand: what the law does is compared with this, not with the law's
//! own tables.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::safety::{FaultCode, SafetyState, Switches};
use quadrant_law::stage::{Outputs, StageState};
use quadrant_settings::StageSettings;

use crate::safety_faults::{CASES, End, provoke};
use quadrant_test_support::Rig;

/// A fault's effect on the outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Does {
    /// Zero volts and disabled in the tick that finds it.
    Off,
    /// A controlled stop, then the same: within 105 ms of braking and 200 ticks of rest.
    Stop,
    /// Found when the firmware starts: it never enables.
    Start,
}
use Does::{Off, Start, Stop};

/// Ticks of the longest stop with the simulated stage's settings, and the 200 that the axes rest before they are off.
const STOP_TICKS: u32 = 1050 + 200;

/// The way to clear a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clears {
    Reset,
    /// A reset, once valid settings were stored.
    StoreAndReset,
}
use Clears::{Reset, StoreAndReset};

/// Number, name, reaction, what clears it, and the ticks within which `safety_faults` provokes it; none: other tests do.
const EXPECTED: [(u8, &str, Does, Clears, Option<u32>); 33] = [
    (1, "following-error", Off, Reset, Some(19)),
    (2, "encoder-jump", Off, Reset, Some(1)),
    (3, "deadline-missed", Off, Reset, Some(1)),
    (4, "emergency-stop", Off, Reset, Some(1)),
    (5, "negative-limit-switch", Stop, Reset, Some(1)),
    (6, "positive-limit-switch", Stop, Reset, Some(1)),
    (7, "travel-exceeded", Stop, Reset, Some(61)),
    (8, "travel-ahead", Stop, Reset, Some(1)),
    (9, "overspeed", Off, Reset, Some(7)),
    (10, "encoder-invalid", Off, Reset, Some(1)),
    (11, "encoder-silent", Off, Reset, Some(1037)),
    (12, "index-mismatch", Off, Reset, Some(101)),
    (13, "stale-sample", Off, Reset, Some(1)),
    (14, "amplifier-fault", Off, Reset, Some(1)),
    (15, "output-mismatch", Off, Reset, Some(1)),
    (16, "link-lost", Stop, Reset, Some(1)),
    (17, "stream-underrun", Stop, Reset, None),
    (18, "watchdog-reset", Start, Reset, None),
    (19, "panic", Start, Reset, None),
    (20, "hard-fault", Start, Reset, None),
    (21, "settings-invalid", Start, StoreAndReset, None),
    (22, "home-switch-missing", Stop, Reset, None),
    (23, "home-switch-stuck", Stop, Reset, None),
    (24, "index-missing", Stop, Reset, None),
    (25, "index-near-switch", Stop, Reset, None),
    (26, "injection-underrun", Stop, Reset, None),
    (27, "injection-bounds", Stop, Reset, None),
    (28, "encoder-implausible", Off, Reset, None),
    (29, "stop-overrun", Off, Reset, None),
    (30, "overload", Stop, Reset, None),
    (31, "oscillation", Stop, Reset, None),
    (32, "pulse-overspeed", Stop, Reset, None),
    (33, "pulse-jump", Stop, Reset, None),
];

fn row(code: FaultCode) -> (Does, Clears, Option<u32>) {
    let found = EXPECTED.iter().find(|row| row.0 == code.number());
    let (_, name, does, clears, ticks) = *found.expect("every fault has a row");
    assert_eq!(code.name(), name);
    (does, clears, ticks)
}

#[test]
fn every_fault_has_the_number_and_the_name_of_the_document() {
    assert_eq!(FaultCode::ALL.into_iter().count(), EXPECTED.len());
    for code in FaultCode::ALL {
        row(code);
    }
}

#[test]
fn every_fault_reacts_and_stays_as_the_document_says() {
    for case in &CASES {
        let (does, clears, ticks) = row(case.code);
        let axes = if case.of_axes { 3 } else { 1 };
        for axis in AxisName::ALL.into_iter().take(axes) {
            let End {
                ticks: found,
                outputs,
                until_off,
                mut rig,
            } = provoke(case, axis);
            assert!(Some(found) <= ticks, "{:?}: {found} ticks", case.code);
            if does == Off {
                assert_eq!((outputs.enabled, until_off), (false, 0), "{:?}", case.code);
                assert!(outputs.codes.iter().all(|code| code.0 == 0));
            } else {
                assert!(
                    outputs.enabled && until_off <= STOP_TICKS,
                    "{:?}",
                    case.code
                );
            }
            stays_until_reset(&mut rig, case.code, clears);
        }
    }
}

/// Neither another fault nor any command but a reset changes a latched fault, and after the reset somebody must enable.
fn stays_until_reset(rig: &mut Rig<f32>, code: FaultCode, clears: Clears) {
    let first = rig.state.safety();
    assert_eq!(first.fault().map(|fault| fault.code), Some(code));
    rig.inputs.switches = Switches::EMERGENCY_STOP;
    rig.tick();
    rig.inputs.switches = Switches::NONE;
    for command in [
        Command::Enable,
        Command::Disable,
        Command::Stop,
        Command::Run,
    ] {
        assert_eq!(rig.command(command), Outputs::default());
        assert_eq!(rig.state.safety(), first, "{command:?}");
    }
    rig.command(Command::ResetFault);
    if clears == StoreAndReset {
        assert_eq!(rig.state.safety(), first);
        rig.state.accept_settings();
        rig.command(Command::ResetFault);
    }
    for _ in 0..100 {
        assert_eq!(rig.tick(), Outputs::default(), "nobody has asked to enable");
    }
    assert_eq!(rig.state.safety(), SafetyState::Disabled);
    assert!(rig.command(Command::Enable).enabled);
}

#[test]
fn what_the_last_run_left_stays_as_the_document_says() {
    for code in FaultCode::ALL {
        let (does, clears, _) = row(code);
        if does != Start {
            continue;
        }
        let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &Default::default());
        rig.state = StageState::default();
        rig.state.start_faulted(code);
        rig.tick();
        stays_until_reset(&mut rig, code, clears);
    }
}
