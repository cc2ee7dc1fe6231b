//! Learning under random cuts, on axes that are no longer what they were: is it ever worse than no feedforward?
//!
//! The axis of a seed differs from its settings in mass, delay and noise. Its friction steps or drifts while it runs a sine,
//! and a tool enters and leaves. The same run is made without feedforward, with the feedforward as commissioned, with
//! learning, and with learning and cancelling at the speed of the spindle. Every 2 s of it after the first 5 s are compared with the run without.

pub mod command;

use quadrant::cancelling::CancellingSettings;
use quadrant::control::feedback::LawKind;
use quadrant::feedforward::FeedforwardKind;
use quadrant::learning::LearningSettings;
use quadrant::lockstep::{InputRecord, Job};
use quadrant::reference::{HarmonicSettings, MotionSettings};
use quadrant::safety::SafetyState;
use quadrant::settings::{PlanSettings, StageSettings};
use quadrant_sim::experiment::configuration::ELEMENTS;
use quadrant_sim::experiment::run_configuration::identified_settings;
use quadrant_sim::machine::{LawMachine, Operator};
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT, SimulatedAxis, StageParameters};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// Length of a run, s; its first part, which is not compared; a window, and the way from one to the next.
const RUN_S: f64 = 45.0;
const FIRST_S: f64 = 5.0;
const WINDOW_S: f64 = 2.0;
const STRIDE_S: f64 = 0.1;
/// Excess of an error that is none, RMS, um: a count of the encoder.
const FLOOR_UM: f64 = 0.5;
/// Ratio of RMS errors beyond which a window is worse.
pub const WORSE: f64 = 1.005;
/// Time from one change of a drifting friction to the next, s.
const DRIFT_S: f64 = 0.01;

/// One line of a campaign's results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    pub seed: u64,
    /// Largest RMS error of a window over that without feedforward, of learning; and when the window begins, s.
    pub worst_ratio: f64,
    pub worst_at_s: f64,
    /// Share of the windows that are worse, %.
    pub worse_percent: f64,
    /// The same of the feedforward as commissioned.
    pub fixed_worst_ratio: f64,
    pub fixed_worse_percent: f64,
    /// The same of learning and cancelling.
    pub cancelling_worst_ratio: f64,
    pub cancelling_worst_at_s: f64,
    pub cancelling_worse_percent: f64,
    /// RMS errors of all that is compared, um: without, as commissioned, learning, learning and cancelling.
    pub off_um: f64,
    pub fixed_um: f64,
    pub learning_um: f64,
    pub cancelling_um: f64,
    /// The case, for a person.
    pub case: String,
}

/// A case drawn from a seed.
struct Case {
    law: LawKind,
    truth: AxisParameters,
    amplitude_mm: f64,
    velocity_mm_s: f64,
    /// Friction over the nominal's, before and after; when it changes, s, and for how long.
    friction: (f64, f64),
    changes_at_s: f64,
    changes_for_s: f64,
    cut: Milling,
    component: Component,
    engaged_s: (f64, f64),
}

fn log_uniform(random: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random::<f64>())
}

impl Case {
    /// Teeth pass at 20 Hz to 1 kHz, up to 2.5 mm deep; friction x 0.5 to 2, at once or over up to 20 s; mass x 0.8 to 1.25, up
    /// to 0.1 ms more dead time; sines of 3 to 30 mm at 2 to 20 mm/s.
    fn new(seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut truth = StageParameters::real().axes[0]
            .clone()
            .with_mass(log_uniform(&mut random, 0.8, 1.25))
            .with_more_delay(random.random_range(0.0..1e-4));
        truth.imperfections.encoder_noise_mm = random.random_range(0.05e-3..0.3e-3);
        let teeth = random.random_range(1..=4);
        let passing_hz = log_uniform(&mut random, 20.0, 1000.0);
        let enters_s = random.random_range(0.0..20.0);
        Self {
            law: [LawKind::Pid, LawKind::NPid][random.random_range(0..2)],
            truth,
            amplitude_mm: log_uniform(&mut random, 3.0, 30.0),
            velocity_mm_s: log_uniform(&mut random, 2.0, 20.0),
            friction: (
                log_uniform(&mut random, 0.7, 1.4),
                log_uniform(&mut random, 0.5, 2.0),
            ),
            changes_at_s: random.random_range(5.0..30.0),
            changes_for_s: [0.0, random.random_range(1.0..20.0)][random.random_range(0..2)],
            cut: Milling {
                spindle_rpm: 60.0 * passing_hz / f64::from(teeth),
                teeth,
                axial_depth_mm: random.random_range(0.0..2.5),
                feed_per_tooth_mm: random.random_range(0.01..0.06),
                engagement_rad: (0.0, std::f64::consts::PI * random.random_range(0.1..1.0)),
                runout: random.random_range(0.0..0.3),
                ..Milling::slot()
            },
            component: [Component::Normal, Component::Feed][random.random_range(0..2)],
            engaged_s: (enters_s, enters_s + random.random_range(2.0..30.0)),
        }
    }

    fn friction_at(&self, time_s: f64) -> f64 {
        let (before, after) = self.friction;
        let share = if time_s < self.changes_at_s {
            0.0
        } else if self.changes_for_s > 0.0 {
            ((time_s - self.changes_at_s) / self.changes_for_s).min(1.0)
        } else {
            1.0
        };
        before + share * (after - before)
    }

    /// The true error over time, um; nothing of a run that a fault ended.
    fn run(
        &self,
        stage: &StageSettings,
        kind: FeedforwardKind,
        learning: Option<LearningSettings>,
        cancels: bool,
        seed: u64,
    ) -> Option<Vec<f64>> {
        let mut stage = stage.clone();
        let mut axis = stage.axes[0].clone();
        axis.feedback.law = self.law;
        axis.feedforward.kind = kind;
        axis.feedforward.learning = learning;
        axis.feedforward.cancelling = cancels.then(|| CancellingSettings {
            spindle_rpm: self.cut.spindle_rpm,
            teeth: self.cut.teeth as u8,
            ..CancellingSettings::default()
        });
        stage.axes = [axis.clone(), axis.clone(), axis];
        let rate_hz = stage.rate_hz;
        let resolution_mm = stage.axes[0].encoder.resolution_mm;
        let cycles = RUN_S * self.velocity_mm_s / (std::f64::consts::TAU * self.amplitude_mm);
        let sine =
            HarmonicSettings::with_velocity(self.amplitude_mm, self.velocity_mm_s, cycles, 0.5);
        let plan = PlanSettings {
            motions: [
                MotionSettings::Harmonic(sine),
                MotionSettings::Hold,
                MotionSettings::Hold,
            ],
        };
        let mut machine = LawMachine::<f32, ELEMENTS>::new(&Job { stage, plan }).ok()?;
        let load = Load::Milling {
            cut: self.cut,
            component: self.component,
            engaged_s: self.engaged_s,
            newtons_per_volt: NEWTONS_PER_VOLT,
        };
        let with_friction = |time_s| self.truth.clone().with_friction(self.friction_at(time_s));
        let mut plant = SimulatedAxis::new(with_friction(0.0), rate_hz, seed);
        let mut operator = Operator::runs_the_plan();
        let mut errors = Vec::new();
        let drift = (DRIFT_S * rate_hz) as usize;
        let mut factor = self.friction_at(0.0);
        for tick in 0.. {
            let time_s = errors.len() as f64 / rate_hz;
            if time_s >= RUN_S {
                break;
            }
            if errors.len().is_multiple_of(drift) && self.friction_at(time_s) != factor {
                factor = self.friction_at(time_s);
                plant.change(with_friction(time_s));
            }
            let counts = [plant.read_counter(), 0, 0];
            let outputs = machine.tick(&InputRecord::of_counts(counts, operator.request(tick)));
            let state = machine.state();
            if matches!(state.safety(), SafetyState::Faulted(_)) {
                return None;
            }
            if state.is_running() {
                plant.set_load_v(load.at_v(time_s));
                let reference = state.axes()[0].telemetry().reference;
                errors.push(1e3 * (reference.to_mm(resolution_mm) - plant.position_mm()));
            } else if !errors.is_empty() {
                break;
            }
            plant.step(outputs.codes[0], outputs.enabled);
        }
        Some(errors)
    }

    fn describe(&self) -> String {
        format!(
            "{}, {:.1} mm at {:.1} mm/s; friction x {:.2} to x {:.2} at {:.1} s over {:.1} s; {:.0} Hz, {:.2} mm deep, {:.3} mm a \
             tooth, {:?}, {:.1} to {:.1} s",
            self.law.name(),
            self.amplitude_mm,
            self.velocity_mm_s,
            self.friction.0,
            self.friction.1,
            self.changes_at_s,
            self.changes_for_s,
            self.cut.tooth_passing_hz(),
            self.cut.axial_depth_mm,
            self.cut.feed_per_tooth_mm,
            self.component,
            self.engaged_s.0,
            self.engaged_s.1
        )
    }
}

/// The windows of a run, as RMS errors in um.
fn windows(errors: &[f64]) -> Vec<f64> {
    if errors.is_empty() {
        return Vec::new();
    }
    let samples = |seconds: f64| (seconds * errors.len() as f64 / RUN_S).round() as usize;
    let first = samples(FIRST_S).min(errors.len());
    errors[first..]
        .windows(samples(WINDOW_S))
        .step_by(samples(STRIDE_S))
        .map(rms)
        .collect()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

/// Largest ratio of the windows, the number of its window, and the share of the windows that are worse, %. A run that a fault
/// ended is worse in all of them.
fn compare(with: &[f64], without: &[f64]) -> (f64, usize, f64) {
    if with.is_empty() {
        return (f64::INFINITY, 0, 100.0);
    }
    let ratios: Vec<f64> = with
        .iter()
        .zip(without)
        .map(|(with, without)| (with - FLOOR_UM) / without)
        .collect();
    let worse = ratios.iter().filter(|ratio| **ratio > WORSE).count();
    let (at, worst) = ratios
        .iter()
        .copied()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, f64::NAN));
    (worst, at, 100.0 * worse as f64 / ratios.len() as f64)
}

/// Runs the case of a seed and compares.
///
/// # Panics
/// Without the identified stage's settings, which are part of the repository.
pub fn judge(seed: u64) -> Line {
    let case = Case::new(seed);
    let stage = identified_settings()
        .expect("the settings of the repository")
        .stage;
    let learning = Some(LearningSettings::default());
    let [off, fixed, learning, cancelling] = [
        (FeedforwardKind::None, None, false),
        (FeedforwardKind::Combined, None, false),
        (FeedforwardKind::Combined, learning, false),
        (FeedforwardKind::Combined, learning, true),
    ]
    .map(|(kind, learning, cancels)| {
        case.run(&stage, kind, learning, cancels, seed)
            .unwrap_or_default()
    });
    let [of_off, of_fixed, of_learning, of_cancelling] =
        [&off, &fixed, &learning, &cancelling].map(|run| windows(run));
    let (worst_ratio, at, worse_percent) = compare(&of_learning, &of_off);
    let (cancelling_worst_ratio, cancelling_at, cancelling_worse_percent) =
        compare(&of_cancelling, &of_off);
    let (fixed_worst_ratio, _, fixed_worse_percent) = compare(&of_fixed, &of_off);
    let whole = |run: &[f64]| {
        let first = (FIRST_S / RUN_S * run.len() as f64) as usize;
        rms(&run[first..])
    };
    Line {
        seed,
        worst_ratio,
        worst_at_s: FIRST_S + STRIDE_S * at as f64,
        worse_percent,
        fixed_worst_ratio,
        fixed_worse_percent,
        cancelling_worst_ratio,
        cancelling_worst_at_s: FIRST_S + STRIDE_S * cancelling_at as f64,
        cancelling_worse_percent,
        off_um: whole(&off),
        fixed_um: whole(&fixed),
        learning_um: whole(&learning),
        cancelling_um: whole(&cancelling),
        case: case.describe(),
    }
}
