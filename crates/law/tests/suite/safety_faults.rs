//! Every fault provoked: in which tick it is found, and what the outputs are in that tick. Prints the table of
//! `docs/safety.md`.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::{AxisSwitches, Fault, FaultCode, Reaction, SafetyState, Switches};
use quadrant_law::stage::Outputs;
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::Rig;

/// Peak velocity of the motions, mm/s.
const VELOCITY_MM_S: f64 = 30.0;

/// A sine on every axis, without an end.
pub(crate) fn sines() -> PlanSettings {
    let sine = HarmonicSettings {
        cycles: None,
        ..HarmonicSettings::with_velocity(1.0, VELOCITY_MM_S, 1.0, 0.1)
    };
    PlanSettings {
        motions: [MotionSettings::Harmonic(sine); 3],
    }
}

/// Lets the encoders follow the references, each a tenth of a millimetre behind: the outputs are not zero.
pub(crate) fn follow(rig: &mut Rig<f32>) {
    for index in 0..3 {
        let reference = rig.state.axes()[index].telemetry().reference;
        // Not at once: that would be a jump.
        let behind = i64::from(rig.state.tick().min(200));
        rig.inputs.readings[index].count = ((reference.0 >> 16) - behind) as u32;
    }
}

/// Along the sines at full speed, towards larger positions.
pub(crate) fn moving(settings: &StageSettings) -> Rig<f32> {
    let mut rig = Rig::<f32>::new(settings, &sines());
    rig.start();
    to_full_speed(&mut rig, 1.0);
    rig
}

/// Goes on until every axis moves at full speed in a direction.
fn to_full_speed(rig: &mut Rig<f32>, direction: f64) {
    for _ in 0..20_000 {
        let before = rig.state.axes()[0].telemetry().reference;
        follow(rig);
        assert!(rig.tick().enabled);
        let moved = rig.state.axes()[0].telemetry().reference - before;
        if direction * moved.to_mm(5e-4) * 1e4 > 0.99 * VELOCITY_MM_S {
            follow(rig);
            return;
        }
    }
    panic!("it never comes to full speed");
}

/// Enabled at rest, each axis a tenth of a millimetre off.
pub(crate) fn standing(settings: &StageSettings) -> Rig<f32> {
    let mut rig = Rig::<f32>::new(settings, &PlanSettings::default());
    rig.tick();
    rig.command(Command::Enable);
    rig.inputs.set_counts([100; 3]);
    rig.tick();
    rig.inputs.set_counts([200; 3]);
    for _ in 0..50 {
        // Without the step's velocity.
        assert!(rig.tick().enabled);
    }
    rig
}

/// A flaw of an axis from a tick on; the tick counts from zero.
type Cause = fn(&mut Rig<f32>, AxisName, u32);

pub(crate) struct Case {
    pub(crate) code: FaultCode,
    /// Along the sines, or at rest.
    moves: bool,
    /// On each axis, or on the stage.
    pub(crate) of_axes: bool,
    /// Ticks from the cause to the fault: 1 is the tick of the cause.
    ticks: u32,
    cause: Cause,
}

fn index(axis: AxisName) -> usize {
    axis as usize
}

pub(crate) fn push(rig: &mut Rig<f32>, axis: AxisName, counts: u32) {
    let count = &mut rig.inputs.readings[index(axis)].count;
    *count = count.wrapping_add(counts);
}

fn press(rig: &mut Rig<f32>, axis: AxisName, switch: AxisSwitches) {
    rig.inputs.switches = Switches::NONE.with_axis(axis, switch);
}

pub(crate) const CASES: [Case; 16] = [
    Case {
        code: FaultCode::FollowingError,
        moves: false,
        of_axes: true,
        ticks: 19,
        cause: |rig, axis, _| push(rig, axis, 100),
    },
    Case {
        code: FaultCode::EncoderJump,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| push(rig, axis, 1000),
    },
    Case {
        code: FaultCode::DeadlineMissed,
        moves: true,
        of_axes: false,
        ticks: 1,
        cause: |rig, _, _| rig.inputs.deadline_missed = true,
    },
    Case {
        code: FaultCode::EmergencyStop,
        moves: true,
        of_axes: false,
        ticks: 1,
        cause: |rig, _, _| rig.inputs.switches = Switches::EMERGENCY_STOP,
    },
    Case {
        code: FaultCode::NegativeLimitSwitch,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| press(rig, axis, AxisSwitches::NEGATIVE_LIMIT),
    },
    Case {
        code: FaultCode::PositiveLimitSwitch,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| press(rig, axis, AxisSwitches::POSITIVE_LIMIT),
    },
    Case {
        code: FaultCode::TravelExceeded,
        moves: false,
        of_axes: true,
        // From 0.1 mm to 0.5 mm beyond the travel of 0.2 mm, 20 counts a tick, and the count after.
        ticks: 61,
        cause: |rig, axis, _| {
            rig.state.set_homed(axis, true);
            push(rig, axis, 20);
        },
    },
    Case {
        code: FaultCode::PredictedSoftLimit,
        moves: true,
        of_axes: true,
        // Set homed where the travel does not reach.
        ticks: 1,
        cause: |rig, axis, _| rig.state.set_homed(axis, true),
    },
    Case {
        code: FaultCode::Overspeed,
        moves: false,
        of_axes: true,
        // 500 mm/s where 300 are the limit, through the filter of 8 ticks.
        ticks: 7,
        cause: |rig, axis, _| push(rig, axis, 100),
    },
    Case {
        code: FaultCode::EncoderInvalid,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| rig.inputs.readings[index(axis)].valid = false,
    },
    Case {
        code: FaultCode::EncoderSignalLoss,
        moves: false,
        of_axes: true,
        // The way to a large error, silent_s, and the tick after.
        ticks: 1037,
        cause: |rig, axis, tick| {
            // An error of almost a millimetre, then one dead line.
            let dither = tick % 2;
            rig.inputs.readings[index(axis)].count = (200 + 50 * tick).min(1950) + dither;
        },
    },
    Case {
        code: FaultCode::IndexMismatch,
        moves: false,
        of_axes: true,
        // The second pulse, 100 ticks after the first.
        ticks: 101,
        cause: |rig, axis, tick| {
            let reading = &mut rig.inputs.readings[index(axis)];
            reading.index = (tick % 100 == 0).then_some(200 + tick);
        },
    },
    Case {
        code: FaultCode::StaleSample,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| rig.inputs.readings[index(axis)].fresh = false,
    },
    Case {
        code: FaultCode::AmplifierFault,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| press(rig, axis, AxisSwitches::AMPLIFIER_FAULT),
    },
    Case {
        code: FaultCode::OutputMismatch,
        moves: true,
        of_axes: true,
        ticks: 1,
        cause: |rig, axis, _| press(rig, axis, AxisSwitches::OUTPUT_MISMATCH),
    },
    Case {
        code: FaultCode::LinkLost,
        moves: true,
        of_axes: false,
        ticks: 1,
        cause: |rig, _, _| rig.inputs.link_lost = true,
    },
];

fn settings(code: FaultCode) -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        let travel = axis.limits.travel_mm.as_mut().expect("by default");
        match code {
            FaultCode::TravelExceeded => (travel.negative, travel.positive) = (-0.2, 0.2),
            FaultCode::PredictedSoftLimit => (travel.negative, travel.positive) = (-9.0, -4.0),
            // Nearer than the axis' own limit, and far from it.
            FaultCode::EncoderSignalLoss => axis.amplifier.output_limit_v = 1.0,
            FaultCode::Overspeed => {
                axis.limits.following_error_mm = 20.0;
                axis.limits.following_error_max_mm = 20.0;
            }
            FaultCode::FollowingError => axis.limits.overspeed_ratio = 2.0,
            _ => {}
        }
        let most = axis.amplifier.output_limit_v;
        axis.feedback.integral_limit_v = axis.feedback.integral_limit_v.min(most);
    }
    settings
}

/// The end of a case.
pub(crate) struct End {
    /// Ticks to the fault.
    pub(crate) ticks: u32,
    /// The outputs in its tick.
    pub(crate) outputs: Outputs,
    /// Ticks from there until the outputs are off.
    pub(crate) until_off: u32,
    /// The stage in the tick after.
    pub(crate) rig: Rig<f32>,
}

/// Provokes a fault, and waits until the outputs are off.
pub(crate) fn provoke(case: &Case, axis: AxisName) -> End {
    let settings = settings(case.code);
    let mut rig = if case.moves {
        let mut rig = moving(&settings);
        if case.code == FaultCode::NegativeLimitSwitch {
            to_full_speed(&mut rig, -1.0);
        }
        rig
    } else {
        standing(&settings)
    };
    let expected = case.of_axes.then_some(axis);
    for tick in 0..2000 {
        if case.moves {
            follow(&mut rig);
        }
        (case.cause)(&mut rig, axis, tick);
        let at = rig.state.tick();
        let outputs = rig.tick();
        let Some(fault) = rig.state.safety().fault() else {
            assert!(outputs.enabled);
            continue;
        };
        let found = Fault {
            code: case.code,
            axis: expected,
            tick: at,
        };
        assert_eq!(fault, found);
        let mut until_off = 0;
        let mut last = outputs;
        while last.enabled {
            assert_eq!(rig.state.safety(), SafetyState::Stopping(found));
            // It brakes under control, so the axes follow.
            if case.moves {
                follow(&mut rig);
            }
            last = rig.tick();
            until_off += 1;
            assert!(until_off < 2000, "{:?} never ends", case.code);
        }
        assert_eq!(last, Outputs::default());
        assert_eq!(rig.state.safety(), SafetyState::Faulted(found));
        return End {
            ticks: tick + 1,
            outputs,
            until_off,
            rig,
        };
    }
    panic!("{:?} on {axis} is not found", case.code);
}

#[test]
fn every_fault_is_found_in_its_tick_with_the_outputs_of_its_reaction() {
    println!(
        "| number | fault | axis | reaction | ticks to find | outputs in that tick | ticks until off |"
    );
    for case in &CASES {
        for axis in AxisName::ALL {
            let End {
                ticks,
                outputs,
                until_off,
                ..
            } = provoke(case, axis);
            let code = case.code;
            let where_ = if case.of_axes { axis.as_str() } else { "-" };
            let words = outputs.codes.map(|code| code.0);
            println!(
                "| {} | {} | {where_} | {:?} | {ticks} | {words:?}, {} | {until_off} |",
                code.number(),
                code.name(),
                code.reaction(),
                if outputs.enabled {
                    "enabled"
                } else {
                    "disabled"
                },
            );
            assert_eq!(ticks, case.ticks, "{code:?} on {axis}");
            match code.reaction() {
                Reaction::Off => assert_eq!(outputs, Outputs::default(), "{code:?}"),
                _ => assert!(outputs.enabled && until_off >= 200, "{code:?}: {until_off}"),
            }
            if !case.of_axes {
                break;
            }
        }
    }
}

/// Those of other tests, and then those that the tick cannot find by itself.
pub(crate) const OF_OTHERS: [FaultCode; 13] = [
    // Of a stream: see the tests of streaming.
    FaultCode::StreamUnderrun,
    // Of an injected voltage: see its tests.
    FaultCode::InjectionUnderrun,
    FaultCode::InjectionBounds,
    // Of an axis that moves as its output makes it: see `encoder_dead`.
    FaultCode::EncoderImplausible,
    // Of a stop without an end: see `stops`.
    FaultCode::StopOverrun,
    // Of a motor that gets hot: see `overload`.
    FaultCode::Overload,
    // Of a loop that swings: see `oscillation`.
    FaultCode::Oscillation,
    // Of another control's pulses: see `pulses`.
    FaultCode::PulseOverspeed,
    FaultCode::PulseJump,
    FaultCode::WatchdogReset,
    FaultCode::Panic,
    FaultCode::HardFault,
    FaultCode::SettingsInvalid,
];

/// Those of homing, which its own tests provoke.
const OF_HOMING: [FaultCode; 4] = [
    FaultCode::HomeSwitchMissing,
    FaultCode::HomeSwitchStuck,
    FaultCode::IndexMissing,
    FaultCode::IndexNearSwitch,
];

#[test]
fn no_fault_is_left_out() {
    for code in FaultCode::ALL {
        let provoked = CASES.iter().filter(|case| case.code == code).count();
        let others = OF_OTHERS
            .iter()
            .chain(&OF_HOMING)
            .filter(|other| **other == code)
            .count();
        assert_eq!(provoked + others, 1, "{code:?}");
    }
}
