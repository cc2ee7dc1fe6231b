//! The plant and the law of three axes alone, timed, and the same job as a file for the programs beside this one: in C++, Numba and NumPy.
//! `cargo xtask peers` runs all of them.

#[path = "../../../target-tests/peer/src/parameters.rs"]
mod parameters;

use std::f64::consts::TAU;
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;
use std::{array, fs, io};

use parameters::{ELEMENTS, NODES, Parameters, node, surface_end};
use quadrant_law::control::feedback::Feedback;
use quadrant_law::control::terms::{FeedbackInput, FeedbackState};
use quadrant_law::feedforward::{Feedforward, FeedforwardKind, FeedforwardState, ReferenceStep};
use quadrant_law::friction::Direction;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::friction::stribeck::SlidingTable;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::Outputs;
use quadrant_law::units::DacCode;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::benchmark_job::circle_and_sine;
use quadrant_sim::law_machine::{LawMachine, Operator, TickInput};
use quadrant_sim::plant::{
    AxisParameters, PLANT_ELEMENTS, SUBSTEPS, SimulatedStage, StageParameters,
};

/// Control periods of the job: 10 s.
const TICKS: usize = 100_000;
/// Rate of the control law, Hz.
const RATE_HZ: f64 = 10e3;
/// Control periods after which the positions are compared first: what the slowest program does.
const FIRST_TICKS: usize = 2000;
/// Repetitions, of which the shortest counts.
const REPETITIONS: usize = 5;
/// Amplitudes of the axes' sines, mm.
const AMPLITUDE_MM: [f64; 3] = [4.0, 3.0, 2.0];
/// Frequencies of the axes' sines, Hz.
const FREQUENCY_HZ: [f64; 3] = [0.6, 0.7, 0.9];

/// Reference of an axis in a control period.
#[derive(Clone, Copy)]
struct Reference {
    /// Position of the feedback's reference, mm.
    position_mm: f64,
    /// Reference of the feedforward, which looks ahead by the dead time.
    ahead: ReferenceStep<f32>,
}

/// The law of an axis.
struct Law {
    feedback: Feedback<f32>,
    feedforward: Feedforward<f32, ELEMENTS>,
    limit_v: f32,
    codes_per_volt: f32,
}

/// Memory of the law.
#[derive(Default)]
struct LawState {
    feedback: FeedbackState<f32>,
    feedforward: FeedforwardState<f32, ELEMENTS>,
}

/// Outcome of a run.
struct Outcome {
    /// Time of a control period, ns.
    tick_ns: f64,
    /// Digests of the encoder counts up to [`FIRST_TICKS`] and to the end.
    digests: [u32; 2],
    /// Positions at those, mm.
    positions_mm: [[f64; 3]; 2],
}

/// Writes the job into the folder that `QUADRANT_PEERS` names, if it is set, and prints the outcome of running it; then, on a line of
/// its own, the time of the whole control tick on its stage.
fn main() -> io::Result<()> {
    let settings = StageSettings::simulated();
    let mut truth = StageParameters::real();
    for axis in &mut truth.axes {
        // The noise is the one part whose numbers the others would not have.
        axis.imperfections.encoder_noise_mm = 0.0;
    }
    let references: Vec<[Reference; 3]> = (0..TICKS)
        .map(|tick| array::from_fn(|axis| reference(tick, axis, truth.axes[axis].delay_s)))
        .collect();
    if let Some(folder) = std::env::var_os("QUADRANT_PEERS") {
        let path = PathBuf::from(folder).join("job.bin");
        fs::write(path, job(&settings, &truth, &references))?;
    }
    let laws = settings.axes.each_ref().map(Law::of);
    let runs = (0..REPETITIONS).map(|_| run(&laws, &truth, &references));
    let best = runs
        .min_by(|a, b| a.tick_ns.total_cmp(&b.tick_ns))
        .expect("there are repetitions");
    let mut out = io::stdout().lock();
    write!(out, "{:.2}", best.tick_ns)?;
    for (digest, positions) in best.digests.iter().zip(best.positions_mm) {
        write!(out, " {digest}")?;
        for position in positions {
            write!(out, " {position:?}")?;
        }
    }
    writeln!(out)?;
    let whole = (0..REPETITIONS).map(|_| whole_tick_ns());
    writeln!(out, "{:.2}", whole.fold(f64::INFINITY, f64::min))
}

/// Returns the time of a control tick with everything around the law (safety, references, telemetry) and a noisy stage, ns.
fn whole_tick_ns() -> f64 {
    let job = circle_and_sine(0.5);
    let mut machine =
        LawMachine::<f32, FIRMWARE_ELEMENTS>::new(&job).expect("the settings are valid");
    let mut stage = SimulatedStage::new(&StageParameters::real(), RATE_HZ, 1);
    let mut operator = Operator::runs_the_plan();
    let start = Instant::now();
    for tick in 0..TICKS as u32 {
        let inputs = TickInput::of_counts(stage.read_counters(), operator.request(tick));
        stage.step(&machine.tick(&inputs));
    }
    let taken = start.elapsed();
    assert!(
        machine.state().is_running(),
        "the motion goes on without an end"
    );
    taken.as_secs_f64() * 1e9 / TICKS as f64
}

/// Runs the job once.
fn run(laws: &[Law; 3], truth: &StageParameters, references: &[[Reference; 3]]) -> Outcome {
    let mut stage = SimulatedStage::new(truth, RATE_HZ, 1);
    let mut states: [LawState; 3] = Default::default();
    let resolutions = truth.axes.each_ref().map(|axis| axis.resolution_mm);
    let mut outcome = Outcome {
        tick_ns: 0.0,
        digests: [0; 2],
        positions_mm: [[0.0; 3]; 2],
    };
    let mut digest = 0_u32;
    let start = Instant::now();
    for (tick, reference) in references.iter().enumerate() {
        if tick == FIRST_TICKS {
            outcome.digests[0] = digest;
            outcome.positions_mm[0] = stage.axes().each_ref().map(|axis| axis.position_mm());
        }
        let counters = stage.read_counters();
        let mut codes = [DacCode::ZERO; 3];
        for axis in 0..3 {
            digest = digest.wrapping_mul(31).wrapping_add(counters[axis]);
            let measured_mm = f64::from(counters[axis] as i32) * resolutions[axis];
            codes[axis] = laws[axis].step(&mut states[axis], &reference[axis], measured_mm);
        }
        stage.step(&Outputs {
            codes: codes.into(),
            enabled: true,
            ..Outputs::default()
        });
    }
    outcome.tick_ns = start.elapsed().as_secs_f64() * 1e9 / references.len() as f64;
    outcome.digests[1] = digest;
    outcome.positions_mm[1] = stage.axes().each_ref().map(|axis| axis.position_mm());
    outcome
}

impl Law {
    fn of(axis: &AxisSettings) -> Self {
        Self {
            feedback: axis.feedback.build(1.0 / RATE_HZ),
            feedforward: Feedforward::build(
                FeedforwardKind::Combined,
                &axis.feedforward.gains,
                &axis.friction,
                1.0 / RATE_HZ,
            ),
            limit_v: axis.amplifier.output_limit_v as f32,
            codes_per_volt: (DacCode::FULL_SCALE / axis.amplifier.full_scale_v) as f32,
        }
    }

    #[inline(always)]
    fn step(&self, state: &mut LawState, reference: &Reference, measured_mm: f64) -> DacCode {
        let ahead = reference.ahead;
        let base = self.feedforward.step(&mut state.feedforward, ahead).total();
        let input = FeedbackInput {
            error: (reference.position_mm - measured_mm) as f32,
            velocity: ahead.velocity,
        };
        let rest = self
            .feedback
            .step(&mut state.feedback, input, base, self.limit_v);
        let output_v = (rest.output + base).within(self.limit_v);
        DacCode::saturating(output_v.round_scaled(self.codes_per_volt))
    }
}

/// The reference of an axis: a sine, which rises from rest in its first half second.
fn reference(tick: usize, axis: usize, delay_s: f64) -> Reference {
    let rate = TAU * FREQUENCY_HZ[axis];
    let position = |time_s: f64| {
        let rise = (time_s / 0.5).clamp(0.0, 1.0);
        let rise = rise * rise * (3.0 - 2.0 * rise);
        rise * AMPLITUDE_MM[axis] * (rate * time_s).sin()
    };
    let period_s = 1.0 / RATE_HZ;
    let now = tick as f64 * period_s;
    let ahead = now + delay_s;
    let displacement = |time_s: f64| position(time_s) - position(time_s - period_s);
    let velocity = |time_s: f64| displacement(time_s) / period_s;
    Reference {
        position_mm: position(now),
        ahead: ReferenceStep {
            displacement: displacement(ahead) as f32,
            velocity: velocity(ahead) as f32,
            acceleration: ((velocity(ahead) - velocity(ahead - period_s)) / period_s) as f32,
        },
    }
}

/// The job as the other programs read it, little-endian: numbers of ticks, then of each axis the plant's numbers (`f64`) and the law's
/// words (`struct parameters` of `law.c`), then the references of every tick.
fn job(
    settings: &StageSettings,
    truth: &StageParameters,
    references: &[[Reference; 3]],
) -> Vec<u8> {
    let mut bytes = Vec::new();
    for ticks in [TICKS, FIRST_TICKS] {
        bytes.extend((ticks as u64).to_le_bytes());
    }
    for (axis, truth) in settings.axes.iter().zip(&truth.axes) {
        bytes.extend(plant(axis, truth).into_iter().flat_map(f64::to_le_bytes));
        bytes.extend(law_words(axis).into_iter().flat_map(u32::to_le_bytes));
    }
    for reference in references.iter().flatten() {
        let ReferenceStep {
            displacement,
            velocity,
            acceleration,
        } = reference.ahead;
        bytes.extend(reference.position_mm.to_le_bytes());
        for value in [displacement, velocity, acceleration, 0.0] {
            bytes.extend(value.to_le_bytes());
        }
    }
    bytes
}

/// The plant's numbers, in the order of the other programs' parameters.
fn plant(axis: &AxisSettings, truth: &AxisParameters) -> Vec<f64> {
    let step_s = 1.0 / (RATE_HZ * SUBSTEPS as f64);
    let odd = &truth.imperfections;
    let mut numbers = vec![
        truth.gain_mm_per_v_s2,
        truth.damping_per_s,
        step_s,
        (truth.delay_s / step_s).round(),
        truth.full_scale_v / DacCode::FULL_SCALE,
        truth.full_scale_v,
        odd.offset_v,
        odd.ripple_v,
        odd.lead_mm,
        truth.resolution_mm,
        DacCode::FULL_SCALE / axis.amplifier.full_scale_v,
    ];
    let senses = [Direction::Positive, Direction::Negative];
    numbers.extend(senses.map(|sense| truth.friction.of(sense).viscous_v_s_per_mm));
    let element = |index: usize| truth.gms.elements[index];
    numbers.extend((0..PLANT_ELEMENTS).map(|index| element(index).stiffness_v_per_mm));
    numbers.extend((0..PLANT_ELEMENTS).map(|index| element(index).weight));
    let curves = truth.friction.map(|model| model.curve);
    let surface = SlidingTable::<f64>::build(&curves, truth.gms.attraction_v_s, step_s);
    for sense in senses {
        let end = surface_end(curves.of(sense));
        // The end of the first interval.
        numbers.push(node(1, end));
        for index in 0..NODES {
            let sliding = surface.at(node(index, end), sense);
            numbers.extend([sliding.level, sliding.decay]);
        }
    }
    numbers
}

/// The words of `struct parameters`, in its order.
fn law_words(axis: &AxisSettings) -> Vec<u32> {
    let gain = axis.feedback.nonlinear.as_ref();
    let law = Parameters::of(axis, gain.expect("the preset is on N-PID"), 1.0 / RATE_HZ);
    let mut words: Vec<u32> = [
        law.limit,
        law.proportional,
        law.derivative,
        law.pole,
        law.integral,
        law.error_limit,
        law.integral_limit,
    ]
    .into_iter()
    .chain(law.viscous)
    .chain([law.inertia, law.share])
    .chain(law.stiffness)
    .chain(law.weight)
    .chain([law.largest])
    .map(f32::to_bits)
    .collect();
    let [positive, negative] = law.surface_octaves;
    for octaves in [law.gain_octaves, positive, negative] {
        words.extend([
            octaves.key,
            octaves.below.to_bits(),
            octaves.bound.to_bits(),
        ]);
    }
    words.extend(law.gain.into_iter().map(f32::to_bits));
    let nodes = law.surface.as_flattened().as_flattened();
    words.extend(nodes.iter().copied().map(f32::to_bits));
    words
}
