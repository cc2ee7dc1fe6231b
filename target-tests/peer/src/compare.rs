//! The run: both laws on the same inputs, and their words side by side.

use core::array;
use core::f64::consts::TAU;
use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m as _;
use cortex_m_semihosting::debug;
use defmt_semihosting as _;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::{Feedforward, FeedforwardKind};
use quadrant_settings::{AxisSettings, StageSettings};

use crate::c::{BarePid, Input, State, c_law, c_pid};
use crate::parameters::Parameters;
use crate::rust::{self, Law, rust_law, rust_pid};

/// Ticks: more than a cycle of every axis.
const TICKS: usize = 800;
/// Control period, s.
const PERIOD_S: f64 = 1e-4;
/// Amplitude of the reference's sine, mm.
const AMPLITUDE_MM: f64 = 0.2;
/// Its frequency, Hz.
const FREQUENCY_HZ: f64 = 15.0;
/// Amplitude of the error, mm.
const ERROR_MM: f64 = 0.02;
/// Its cycles in one of the reference.
const ERROR_CYCLES: f64 = 3.7;
/// Phase of an axis against the one before, rad: they reverse one after the other.
const PHASE_RAD: f64 = 0.4;

#[cortex_m_rt::entry]
fn main() -> ! {
    let settings = StageSettings::simulated();
    let laws = settings
        .axes
        .each_ref()
        .map(|axis| law(axis, LawKind::NPid));
    let pid_laws = settings.axes.each_ref().map(|axis| law(axis, LawKind::Pid));
    let parameters = settings.axes.each_ref().map(|axis| {
        let gain = axis.feedback.nonlinear.as_ref();
        Parameters::of(axis, gain.expect("the preset is on N-PID"), PERIOD_S)
    });
    let pids = settings
        .axes
        .each_ref()
        .map(|axis| BarePid::of(axis, PERIOD_S));
    let inputs: [[Input; 3]; TICKS] =
        array::from_fn(|tick| array::from_fn(|axis| input(tick, axis)));
    let found = compare(&laws, &parameters, &pid_laws, pids, &inputs);
    defmt::info!(
        "{=u32} words compared, {=u32} differ, by {=f32} V at most; {=u32} of them not zero",
        3 * TICKS as u32,
        found.differ,
        found.most_v,
        found.moving
    );
    exit(debug::EXIT_SUCCESS)
}

/// Comparison of outputs.
#[derive(Default)]
struct Found {
    differ: u32,
    most_v: f32,
    moving: u32,
}

/// Runs both laws, and both PIDs, tick by tick. What is counted is called from here alone, by addresses that the compiler does not
/// know.
#[inline(never)]
fn compare(
    laws: &[Law; 3],
    parameters: &[Parameters; 3],
    pid_laws: &[Law; 3],
    mut pids: [BarePid; 3],
    inputs: &[[Input; 3]],
) -> Found {
    let (rust_law, rust_pid) = (
        black_box(rust_law as fn(&_, &mut _, &_, &mut _)),
        black_box(rust_pid as fn(&_, &mut _, &_, &mut _)),
    );
    let mut states: [rust::State; 3] = Default::default();
    let mut pid_states: [rust::State; 3] = Default::default();
    let mut c_states: [State; 3] = Default::default();
    let mut found = Found::default();
    for input in inputs {
        let (mut ours, mut theirs, mut ignored) = ([0.0_f32; 3], [0.0_f32; 3], [0.0; 3]);
        rust_law(laws, &mut states, input, &mut ours);
        c_law(parameters, &mut c_states, input, &mut theirs);
        rust_pid(pid_laws, &mut pid_states, input, &mut ignored);
        c_pid(&mut pids, input, &mut ignored);
        for (ours, theirs) in ours.into_iter().zip(theirs) {
            if ours.to_bits() != theirs.to_bits() {
                found.differ += 1;
                found.most_v = found.most_v.max((ours - theirs).abs());
            }
            found.moving += u32::from(ours != 0.0);
        }
    }
    found
}

/// The law of an axis.
fn law(axis: &AxisSettings, kind: LawKind) -> Law {
    let mut feedback = axis.feedback.clone();
    feedback.law = kind;
    Law {
        feedback: feedback.build(PERIOD_S),
        feedforward: Feedforward::build(
            FeedforwardKind::Combined,
            &axis.feedforward.gains,
            &axis.friction,
            PERIOD_S,
        ),
        limit: axis.amplifier.output_limit_v as f32,
    }
}

/// The inputs of an axis in a tick: a sine, and an error that goes its own way.
fn input(tick: usize, axis: usize) -> Input {
    let phase = |tick: f64| TAU * FREQUENCY_HZ * PERIOD_S * tick + PHASE_RAD * axis as f64;
    let (now, before) = (phase(tick as f64), phase(tick as f64 - 1.0));
    let rate = TAU * FREQUENCY_HZ;
    Input {
        error: (ERROR_MM * libm::sin(ERROR_CYCLES * now)) as f32,
        displacement: (AMPLITUDE_MM * (libm::sin(now) - libm::sin(before))) as f32,
        velocity: (AMPLITUDE_MM * rate * libm::cos(now)) as f32,
        acceleration: (-AMPLITUDE_MM * rate * rate * libm::sin(now)) as f32,
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    exit(debug::EXIT_FAILURE)
}

/// Ends the emulator.
fn exit(status: debug::ExitStatus) -> ! {
    loop {
        debug::exit(status);
    }
}
