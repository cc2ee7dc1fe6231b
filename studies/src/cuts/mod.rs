//! Learning under random cuts, on axes that are no longer what they were: is it ever worse than no feedforward?
//!
//! The axis of a seed differs from its settings in mass, delay and noise. Its friction steps or drifts while it runs a sine,
//! and a tool enters and leaves. The same run is made without feedforward, with the feedforward as commissioned, with
//! learning, and with learning and cancelling at the speed of the spindle. Every 2 s of it after the first 5 s are compared with the
//! run without. Windows are *settled* while nothing has changed since the last reversal but one: what comes before the next reversal
//! cannot be learnt, because only a reversal shows it.

mod summary;

use std::path::{Path, PathBuf};

use clap::Args;
use quadrant_cli::warn;
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::SafetyState;
use quadrant_settings::StageSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::law_machine::Operator;
use quadrant_sim::law_machine::TickInput;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::Load;
use quadrant_sim::plant::{AxisParameters, NEWTONS_PER_VOLT, SimulatedAxis, StageParameters};
use quadrant_tune::record::{TraceError, write_trace};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::campaign::{Campaign, Lines, make_folder};
use crate::competitor::Feedforward;
use crate::true_friction::TrueFriction;
use crate::x_alone::law_of;

/// `quadrant-studies cuts`.
#[derive(Clone, Debug, Args)]
pub struct Cuts {
    /// Folder for a trace of each seed: errors, scale, gate and voltages over time, as CSV.
    #[arg(long, value_name = "FOLDER")]
    traces: Option<PathBuf>,
    /// Model of the axis' true friction; the feedforward is the identified stage's, static and GMS, beside any.
    #[arg(long, value_enum, default_value_t)]
    friction: TrueFriction,
}

impl Campaign for Cuts {
    type Line = Line;
    const NAME: &'static str = "cuts";
    const COLUMNS: &'static [&'static str] = &[
        "settled_percent",
        "off_um",
        "fixed_worst_ratio",
        "fixed_worst_at_s",
        "fixed_worse_percent",
        "fixed_settled_worst_ratio",
        "fixed_settled_worse_percent",
        "fixed_um",
        "learning_worst_ratio",
        "learning_worst_at_s",
        "learning_worse_percent",
        "learning_settled_worst_ratio",
        "learning_settled_worse_percent",
        "learning_um",
        "cancelling_worst_ratio",
        "cancelling_worst_at_s",
        "cancelling_worse_percent",
        "cancelling_settled_worst_ratio",
        "cancelling_settled_worse_percent",
        "cancelling_um",
        "case",
    ];

    fn prepare(&self) -> anyhow::Result<()> {
        make_folder(self.traces.as_deref())
    }

    fn judge(&self, seed: u64) -> Line {
        judge(seed, self.friction, self.traces.as_deref())
    }

    fn summarise(lines: &Lines<Line>) -> anyhow::Result<()> {
        summary::print(lines);
        Ok(())
    }
}

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
const WORSE: f64 = 1.005;
/// Time from one line of a trace to the next, s.
const MOMENT_S: f64 = 1e-3;
/// Lead-in of the sine, s.
const LEAD_S: f64 = 0.5;
/// Ratio of frictions that are the same.
const SAME_FRICTION: f64 = 1.05;
/// Time from one change of a drifting friction to the next, s.
const DRIFT_S: f64 = 0.01;

/// Result of a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Share of the windows that are settled, %.
    pub settled_percent: f64,
    /// RMS error of all that is compared without feedforward, um.
    pub off_um: f64,
    pub fixed: Comparison,
    pub learning: Comparison,
    /// Learning and cancelling.
    pub cancelling: Comparison,
    /// The case, for a person.
    pub case: String,
}

/// Errors of a feedforward beside those without.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Largest RMS error of a window over that without feedforward, and when the window begins, s.
    pub worst_ratio: f64,
    pub worst_at_s: f64,
    /// Share of the windows that are worse, %.
    pub worse_percent: f64,
    /// The same of the windows that are settled.
    pub settled_worst_ratio: f64,
    pub settled_worse_percent: f64,
    /// RMS error of all that is compared, um.
    pub rms_um: f64,
}

/// A run of a case.
#[derive(Clone, Debug, Default)]
struct Run {
    /// The true error over time, um.
    errors: Vec<f64>,
    /// What a person may want to see beside it, every [`MOMENT_S`]: the [`MOMENT`]'s values.
    moments: [Vec<f64>; 5],
}

/// Values of a moment of a run.
const MOMENT: [&str; 5] = ["reference_mm", "load_v", "scale", "gate", "cancelling_v"];

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
    fn new(seed: u64, friction: TrueFriction) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut truth = friction
            .of(StageParameters::real().axes[0].clone())
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

    /// Runs the case.
    ///
    /// # Errors
    /// The fault that ended it, and when; settings that are refused.
    fn run(
        &self,
        stage: &StageSettings,
        feedforward: Feedforward,
        cancels: bool,
        seed: u64,
    ) -> Result<Run, String> {
        let mut axis = stage.axes[0].clone();
        axis.feedback.law = self.law;
        feedforward.apply(&mut axis);
        axis.feedforward.cancelling = cancels.then(|| CancellingSettings {
            spindle_rpm: self.cut.spindle_rpm,
            teeth: self.cut.teeth as u8,
            ..CancellingSettings::default()
        });
        let rate_hz = stage.rate_hz;
        let resolution_mm = axis.encoder.resolution_mm;
        let cycles = RUN_S * self.velocity_mm_s / (std::f64::consts::TAU * self.amplitude_mm);
        let sine =
            HarmonicSettings::with_velocity(self.amplitude_mm, self.velocity_mm_s, cycles, LEAD_S);
        let mut machine = law_of(&axis, stage, MotionSettings::Harmonic(sine))
            .map_err(|error| error.to_string())?;
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
        let mut moments: [Vec<f64>; 5] = Default::default();
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
            if let SafetyState::Faulted(fault) = state.safety() {
                return Err(format!("{} at {time_s:.1} s", fault.code.name()));
            }
            if state.is_running() {
                let load_v = load.at_v(time_s);
                plant.set_load_v(load_v);
                let axis = &state.axes()[0];
                let reference_mm = axis.telemetry().reference.to_mm(resolution_mm);
                if errors.len().is_multiple_of(moment) {
                    let learning = axis.learning();
                    let voltages = [
                        learning.scale(),
                        learning.gate(),
                        axis.cancelling().voltage(),
                    ];
                    let [scale, gate, cancelling_v] = voltages.map(f64::from);
                    let values = [reference_mm, load_v, scale, gate, cancelling_v];
                    for (moments, value) in moments.iter_mut().zip(values) {
                        moments.push(value);
                    }
                }
                errors.push(1e3 * (reference_mm - plant.position_mm()));
            } else if !errors.is_empty() {
                break;
            }
            plant.step(outputs.codes[0], outputs.enabled);
        }
        Ok(Run { errors, moments })
    }

    /// Writes the runs side by side, a line every millisecond, as CSV.
    fn write_trace(&self, path: &Path, runs: &[(&str, Run)]) -> Result<(), TraceError> {
        let whole = runs.iter().filter(|(_, run)| !run.errors.is_empty());
        let lines = whole.clone().map(|(_, run)| run.moments[0].len()).min();
        let times: Vec<f64> = (0..lines.unwrap_or(0))
            .map(|index| MOMENT_S * index as f64)
            .collect();
        let frictions = times.iter().map(|time_s| self.friction_at(*time_s));
        let mut columns = vec![("friction".to_owned(), frictions.collect::<Vec<f64>>())];
        for (name, run) in whole {
            let stride = run.errors.len().div_ceil(run.moments[0].len());
            let errors = run.errors.iter().step_by(stride).copied();
            columns.push((format!("{name}_um"), errors.take(times.len()).collect()));
            for (value, moments) in MOMENT.iter().zip(&run.moments) {
                columns.push((format!("{name}_{value}"), moments[..times.len()].to_vec()));
            }
        }
        let mut all: Vec<(&str, &[f64])> = vec![("time_s", &times)];
        all.extend(
            columns
                .iter()
                .map(|(name, values)| (name.as_str(), values.as_slice())),
        );
        write_trace(path, &all)
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

impl Comparison {
    /// Compares window by window. A run that a fault ended is worse in all of them.
    fn new(run: &Run, without: &[f64], settled: &[bool]) -> Self {
        let with = windows(run);
        let rms_um = whole_um(run);
        if with.is_empty() {
            return Self {
                worst_ratio: f64::INFINITY,
                worst_at_s: begins_s(0),
                worse_percent: 100.0,
                settled_worst_ratio: f64::INFINITY,
                settled_worse_percent: 100.0,
                rms_um,
            };
        }
        let errors = with.iter().zip(without);
        let ratios: Vec<f64> = errors
            .map(|(with, without)| (with - FLOOR_UM) / without)
            .collect();
        let settled: Vec<f64> = ratios
            .iter()
            .zip(settled)
            .filter_map(|(ratio, settled)| settled.then_some(*ratio))
            .collect();
        let worse_percent = |ratios: &[f64]| {
            let worse = ratios.iter().filter(|ratio| **ratio > WORSE).count();
            100.0 * worse as f64 / ratios.len().max(1) as f64
        };
        let largest = ratios.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let (at, worst_ratio) = largest.unwrap_or((0, &f64::NAN));
        Self {
            worst_ratio: *worst_ratio,
            worst_at_s: begins_s(at),
            worse_percent: worse_percent(&ratios),
            settled_worst_ratio: settled.iter().copied().fold(0.0, f64::max),
            settled_worse_percent: worse_percent(&settled),
            rms_um,
        }
    }
}

/// RMS error of all that is compared, um.
fn whole_um(run: &Run) -> f64 {
    let first = (FIRST_S / RUN_S * run.errors.len() as f64) as usize;
    rms(&run.errors[first..])
}

/// Runs the case of a seed and compares; leaves the trace of its runs in a folder.
///
/// # Panics
/// Without the identified stage's settings, which are part of the repository.
pub fn judge(seed: u64, friction: TrueFriction, traces: Option<&Path>) -> Line {
    let case = Case::new(seed, friction);
    let stage = identified_settings()
        .expect("the settings of the repository")
        .stage;
    let mut described = case.describe();
    let runs = [
        ("off", Feedforward::Without, false),
        ("fixed", Feedforward::Fixed, false),
        ("learning", Feedforward::Learning, false),
        ("cancelling", Feedforward::Learning, true),
    ]
    .map(|(name, feedforward, cancels)| {
        let run = case.run(&stage, feedforward, cancels, seed);
        let run = run.unwrap_or_else(|ended| {
            described += &format!("; {name}: {ended}");
            Run::default()
        });
        (name, run)
    });
    let [(_, off), (_, fixed), (_, learning), (_, cancelling)] = &runs;
    let without = windows(off);
    let settled: Vec<bool> = (0..without.len())
        .map(|window| case.is_settled(begins_s(window)))
        .collect();
    if let Some(folder) = traces {
        let path = folder.join(format!("{seed}.csv"));
        // The result is worth more than its trace.
        if let Err(error) = case.write_trace(&path, &runs) {
            warn!("{}: {error}", path.display());
        }
    }
    let compared = |run: &Run| Comparison::new(run, &without, &settled);
    let settled_count = settled.iter().filter(|settled| **settled).count();
    Line {
        settled_percent: 100.0 * settled_count as f64 / settled.len() as f64,
        off_um: whole_um(off),
        fixed: compared(fixed),
        learning: compared(learning),
        cancelling: compared(cancelling),
        case: described,
    }
}
