//! Learning under random cuts, on axes that are no longer what they were: is it ever worse than no feedforward?
//!
//! The axis of a seed differs from its settings in mass, delay and noise. Its friction steps or drifts while it runs a sine,
//! and a tool enters and leaves. The same run is made without feedforward, with the feedforward as commissioned, with
//! learning, and with learning and cancelling at the speed of the spindle. Every 2 s of it after the first 5 s are compared with the
//! run without. Windows are *settled* while nothing has changed since the last reversal but one: what comes before the next reversal
//! cannot be learnt, because only a reversal shows it.

pub mod command;

use std::path::Path;

use quadrant_cli::warn;
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::SafetyState;
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, StageSettings};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::law_machine::{LawMachine, Operator, TickInput};
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT, SimulatedAxis, StageParameters};
use quadrant_sim::run::ELEMENTS;
use quadrant_written::whole;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// Length of a run, s.
const RUN_S: f64 = 45.0;
/// First part of a run, which is not compared, s.
const FIRST_S: f64 = 5.0;
/// Length of a window, s.
const WINDOW_S: f64 = 2.0;
/// Time from one window to the next, s.
const STRIDE_S: f64 = 0.1;
/// Excess of an error that is none, RMS, um: a count of the encoder.
const FLOOR_UM: f64 = 0.5;
/// Ratio of RMS errors beyond which a window is worse.
pub const WORSE: f64 = 1.005;
/// Time from one line of a trace to the next, s.
const MOMENT_S: f64 = 1e-3;
/// Lead-in of the sine, s.
const LEAD_S: f64 = 0.5;
/// Ratio of frictions that are the same.
const SAME_FRICTION: f64 = 1.05;
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
    /// Share of the windows that are settled, %; and of these the largest ratio, of learning, and the share that is worse, %.
    pub settled_percent: f64,
    pub settled_worst_ratio: f64,
    pub settled_worse_percent: f64,
    /// The same of the feedforward as commissioned.
    pub fixed_worst_ratio: f64,
    pub fixed_worse_percent: f64,
    pub fixed_settled_worst_ratio: f64,
    pub fixed_settled_worse_percent: f64,
    /// The same of learning and cancelling.
    pub cancelling_worst_ratio: f64,
    pub cancelling_worst_at_s: f64,
    pub cancelling_worse_percent: f64,
    pub cancelling_settled_worst_ratio: f64,
    pub cancelling_settled_worse_percent: f64,
    /// RMS errors of all that is compared, um: without, as commissioned, learning, learning and cancelling.
    pub off_um: f64,
    pub fixed_um: f64,
    pub learning_um: f64,
    pub cancelling_um: f64,
    /// The case, for a person.
    pub case: String,
}

/// A run of a case.
#[derive(Clone, Debug, Default)]
struct Run {
    /// The true error over time, um.
    errors: Vec<f64>,
    /// What a person may want to see beside it, every [`MOMENT_S`].
    moments: Vec<Moment>,
}

/// The state of the axis at a moment of a run.
#[derive(Clone, Copy, Debug)]
struct Moment {
    reference_mm: f64,
    load_v: f64,
    scale: f32,
    gate: f32,
    cancelling_v: f32,
}

/// A line of a trace: one moment of the four runs of a case.
#[derive(Clone, Debug, Serialize)]
struct TraceLine {
    time_s: f64,
    reference_mm: f64,
    /// Friction over the nominal's.
    friction: f64,
    /// The tool's force, V.
    load_v: f64,
    off_um: f64,
    fixed_um: f64,
    learning_um: f64,
    learning_scale: f32,
    learning_gate: f32,
    cancelling_um: f64,
    cancelling_scale: f32,
    cancelling_gate: f32,
    cancelling_v: f32,
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

    /// True if nothing new happened in the window that begins at a time, and none since the last reversal but one before its
    /// end: the friction is still within [`SAME_FRICTION`], and the tool neither entered nor left. What a reversal needs can be learnt
    /// from another one only.
    fn is_settled(&self, begins_s: f64) -> bool {
        let ends_s = begins_s + WINDOW_S;
        let half_cycle_s = std::f64::consts::PI * self.amplitude_mm / self.velocity_mm_s;
        // Its first reversal is a quarter of a cycle after the lead-in.
        let first_s = LEAD_S + 0.5 * half_cycle_s;
        let last = ((ends_s - first_s) / half_cycle_s).floor();
        let second_last_s = first_s + (last - 1.0) * half_cycle_s;
        let since_s = begins_s.min(second_last_s).max(0.0);
        let frictions = [since_s, ends_s, self.changes_at_s.clamp(since_s, ends_s)]
            .map(|time_s| self.friction_at(time_s));
        let most = frictions.into_iter().fold(f64::MIN, f64::max);
        let least = frictions.into_iter().fold(f64::MAX, f64::min);
        let (enters_s, leaves_s) = self.engaged_s;
        let happens = |time_s: f64| (since_s..=ends_s).contains(&time_s);
        most <= SAME_FRICTION * least && !happens(enters_s) && !happens(leaves_s)
    }

    /// Runs the case; nothing of a run that a fault ended.
    fn run(
        &self,
        stage: &StageSettings,
        kind: FeedforwardKind,
        learning: Option<LearningSettings>,
        cancels: bool,
        seed: u64,
    ) -> Option<Run> {
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
            HarmonicSettings::with_velocity(self.amplitude_mm, self.velocity_mm_s, cycles, LEAD_S);
        let plan = PlanSettings {
            motions: [
                MotionSettings::Harmonic(sine),
                MotionSettings::Hold,
                MotionSettings::Hold,
            ],
        };
        let mut machine = LawMachine::<f32, ELEMENTS>::new(&Job { stage, plan })
            .ok()?
            .with_x_alone();
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
        let mut moments = Vec::new();
        let moment = (MOMENT_S * rate_hz) as usize;
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
            let outputs = machine.tick(&TickInput::of_counts(counts, operator.request(tick)));
            let state = machine.state();
            if matches!(state.safety(), SafetyState::Faulted(_)) {
                return None;
            }
            if state.is_running() {
                let load_v = load.at_v(time_s);
                plant.set_load_v(load_v);
                let axis = &state.axes()[0];
                let reference_mm = axis.telemetry().reference.to_mm(resolution_mm);
                if errors.len().is_multiple_of(moment) {
                    moments.push(Moment {
                        reference_mm,
                        load_v,
                        scale: axis.learning().scale(),
                        gate: axis.learning().gate(),
                        cancelling_v: axis.cancelling().voltage(),
                    });
                }
                errors.push(1e3 * (reference_mm - plant.position_mm()));
            } else if !errors.is_empty() {
                break;
            }
            plant.step(outputs.codes[0], outputs.enabled);
        }
        Some(Run { errors, moments })
    }

    /// Writes the four runs side by side, a line every millisecond, as CSV.
    fn write_trace(&self, path: &Path, runs: [&Run; 4]) -> csv::Result<()> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let stride = (runs[0].errors.len() as f64 / RUN_S * MOMENT_S).round() as usize;
        let [off, fixed, learning, cancelling] = runs;
        for (index, (learns, cancels)) in
            learning.moments.iter().zip(&cancelling.moments).enumerate()
        {
            let time_s = MOMENT_S * index as f64;
            let error_um = |run: &Run| run.errors.get(index * stride).copied().unwrap_or(f64::NAN);
            writer.serialize(TraceLine {
                time_s,
                reference_mm: learns.reference_mm,
                friction: self.friction_at(time_s),
                load_v: learns.load_v,
                off_um: error_um(off),
                fixed_um: error_um(fixed),
                learning_um: error_um(learning),
                learning_scale: learns.scale,
                learning_gate: learns.gate,
                cancelling_um: error_um(cancelling),
                cancelling_scale: cancels.scale,
                cancelling_gate: cancels.gate,
                cancelling_v: cancels.cancelling_v,
            })?;
        }
        let text = writer.into_inner().map_err(|error| error.into_error())?;
        Ok(whole::write(path, text)?)
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

/// The windows of a run, as RMS errors in um, one every [`STRIDE_S`] from [`FIRST_S`] on.
fn windows(run: &Run) -> Vec<f64> {
    let errors = &run.errors;
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

/// When a window begins, s.
fn begins_s(window: usize) -> f64 {
    FIRST_S + STRIDE_S * window as f64
}

/// Errors of a law beside those without feedforward.
#[derive(Clone, Copy, Debug)]
struct Comparison {
    /// Largest ratio of the windows, and the number of its window.
    worst: f64,
    at: usize,
    /// Share of the windows that are worse, %.
    worse_percent: f64,
    /// The same of the windows that are settled.
    settled_worst: f64,
    settled_worse_percent: f64,
}

impl Comparison {
    /// Compares window by window. A run that a fault ended is worse in all of them.
    fn new(with: &[f64], without: &[f64], settled: &[bool]) -> Self {
        if with.is_empty() {
            return Self {
                worst: f64::INFINITY,
                at: 0,
                worse_percent: 100.0,
                settled_worst: f64::INFINITY,
                settled_worse_percent: 100.0,
            };
        }
        let ratios = || {
            let errors = with.iter().zip(without);
            errors.map(|(with, without)| (with - FLOOR_UM) / without)
        };
        let settled = || {
            let ratios = ratios().zip(settled);
            ratios.filter_map(|(ratio, settled)| settled.then_some(ratio))
        };
        let worse_percent = |ratios: &mut dyn Iterator<Item = f64>| {
            let (mut worse, mut all) = (0, 0);
            for ratio in ratios {
                worse += usize::from(ratio > WORSE);
                all += 1;
            }
            100.0 * f64::from(worse as u32) / f64::from(all.max(1))
        };
        let largest = ratios().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let (at, worst) = largest.unwrap_or((0, f64::NAN));
        Self {
            worst,
            at,
            worse_percent: worse_percent(&mut ratios()),
            settled_worst: settled().fold(0.0, f64::max),
            settled_worse_percent: worse_percent(&mut settled()),
        }
    }
}

/// Runs the case of a seed and compares; leaves the trace of its runs in a folder.
///
/// # Panics
/// Without the identified stage's settings, which are part of the repository.
pub fn judge(seed: u64, traces: Option<&Path>) -> Line {
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
        [&off, &fixed, &learning, &cancelling].map(windows);
    let settled: Vec<bool> = (0..of_off.len())
        .map(|window| case.is_settled(begins_s(window)))
        .collect();
    let settled_count = settled.iter().filter(|settled| **settled).count();
    let [learns, commissioned, cancels] = [&of_learning, &of_fixed, &of_cancelling]
        .map(|of_law| Comparison::new(of_law, &of_off, &settled));
    let whole = |run: &Run| {
        let first = (FIRST_S / RUN_S * run.errors.len() as f64) as usize;
        rms(&run.errors[first..])
    };
    if let Some(folder) = traces {
        let path = folder.join(format!("{seed}.csv"));
        // The result is worth more than its trace.
        if let Err(error) = case.write_trace(&path, [&off, &fixed, &learning, &cancelling]) {
            warn!("{}: {error}", path.display());
        }
    }
    Line {
        seed,
        worst_ratio: learns.worst,
        worst_at_s: begins_s(learns.at),
        worse_percent: learns.worse_percent,
        settled_percent: 100.0 * settled_count as f64 / settled.len() as f64,
        settled_worst_ratio: learns.settled_worst,
        settled_worse_percent: learns.settled_worse_percent,
        fixed_worst_ratio: commissioned.worst,
        fixed_worse_percent: commissioned.worse_percent,
        fixed_settled_worst_ratio: commissioned.settled_worst,
        fixed_settled_worse_percent: commissioned.settled_worse_percent,
        cancelling_worst_ratio: cancels.worst,
        cancelling_worst_at_s: begins_s(cancels.at),
        cancelling_worse_percent: cancels.worse_percent,
        cancelling_settled_worst_ratio: cancels.settled_worst,
        cancelling_settled_worse_percent: cancels.settled_worse_percent,
        off_um: whole(&off),
        fixed_um: whole(&fixed),
        learning_um: whole(&learning),
        cancelling_um: whole(&cancelling),
        case: case.describe(),
    }
}
