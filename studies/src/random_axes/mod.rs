//! `quadrant commission` on random axes: every axis from a seed, none of them the simulated stage's.
//!
//! The commissioned settings are judged on sines that the commissioning did not see, with noise that it did not see, against
//! the PID that it designed. A result is one line of a CSV file, so that a campaign can be interrupted, divided and merged.

pub mod cases;
mod healthy;
mod motion;
mod page;
mod plant;
mod program;
mod subject;
mod summary;

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use quadrant_cli::warn;

use quadrant_host::client::{Client, ClientError};
use quadrant_host::machine::{Machine, SimulatedLink};
use quadrant_law::axes::AxisName;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::metrics::worst_and_mean;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::sine_test::SineTest;
use quadrant_sim::stage_setup::StageSetup;
use quadrant_tune::commission::bootstrap::{self, measuring_settings};
use quadrant_tune::commission::verify::Cycles;
use quadrant_tune::commission::{CommissionError, CommissionSettings, Commissioned, commission};
use quadrant_tune::design::DesignError;
use quadrant_tune::identify::plant::PlantError;
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{
    AxisInfo, Experiment, ExperimentError, MachineError, SimulatedTestAxis, TestAxis,
};
use serde::{Deserialize, Serialize};

use self::healthy::Health;
use self::motion::Motion;
use crate::campaign::{Campaign, Lines, make_folder};
pub use plant::RandomAxis;
pub use subject::Subject;

/// `quadrant-studies axes`.
#[derive(Clone, Debug, Args)]
pub struct Axes {
    /// Folder for a page of each axis: what was found beside what is true, and everything that was tried.
    #[arg(long, value_name = "FOLDER")]
    pages: Option<PathBuf>,
    /// Only axes without a resonance.
    #[arg(long)]
    rigid: bool,
}

impl Campaign for Axes {
    type Line = Line;
    const NAME: &'static str = "axes";
    const COLUMNS: &'static [&'static str] = &[
        "outcome",
        "worst_ratio",
        "mean_ratio",
        "pid_um",
        "program_ratio",
        "small_worse",
        "small_ratio",
        "small_sine",
        "small_few_counts",
        "health_hum",
        "health_faults",
        "health_fault",
        "trial_worst",
        "gain_ratio",
        "feedforward",
        "axis_min",
        "computed_s",
        "axis",
        "reason",
    ];

    fn prepare(&self) -> anyhow::Result<()> {
        make_folder(self.pages.as_deref())
    }

    fn requests(&self, seed: u64) -> bool {
        !self.rigid || RandomAxis::new(seed).is_rigid()
    }

    /// Commissions the axis of a seed, judges the result, and leaves its page in a folder.
    fn judge(&self, seed: u64) -> Line {
        let subject = RandomAxis::new(seed).subject();
        let judged = judged(&subject, Path::of(seed), Judging::SmallToo);
        if let Some(folder) = &self.pages {
            let path = folder.join(format!("{seed}.html"));
            // The result is worth more than its page.
            if let Err(error) = page::page(&subject, &judged).write_html(&path) {
                warn!("{}: {error}", path.display());
            }
        }
        judged.line
    }

    fn summarise(lines: &Lines<Line>) -> anyhow::Result<()> {
        summary::print(lines);
        Ok(())
    }
}

/// Result of one axis.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, strum::Display, strum::VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Outcome {
    /// The chosen settings beat the PID.
    Commissioned,
    /// Nothing was better than the PID, and its settings were kept.
    PidAlone,
    /// The chosen settings are worse than the PID on a sine that the commissioning did not see.
    WorseThanPid,
    /// They are worse on a move alone.
    WorseOnMoves,
    /// Settings were chosen that are worse than the PID on small slow sines alone.
    WorseWhenSmall,
    /// The commissioning ended early, and its reason names the resonance that the axis has.
    Refused,
    /// It ended early for another reason, though every axis of the campaign can be controlled.
    RefusedWrongly,
    /// The axis hums at rest after a knock, and nothing said so.
    Hums,
    /// A fault ended a move within the limits.
    FalseFault,
    /// The axis left its travel while it was commissioned, with any outcome.
    LeftTravel,
}

/// Result of a seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Line {
    pub outcome: Outcome,
    /// Largest error over that of the PID: the worst of the usual motions.
    pub worst_ratio: Option<f64>,
    /// Largest error over that of the PID: the geometric mean.
    pub mean_ratio: Option<f64>,
    /// The PID's largest error of all usual motions, um.
    pub pid_um: Option<f64>,
    /// Largest error on the program of moves over that of the PID.
    pub program_ratio: Option<f64>,
    pub small: Small,
    pub health: Health,
    /// Error over that of the PID, the worst of the trials by which the commissioning chose its law.
    pub trial_worst: Option<f64>,
    /// Acceleration per volt that was identified, over the true one.
    pub gain_ratio: Option<f64>,
    /// Feedforward that was chosen.
    pub feedforward: String,
    /// Time for which the axis was used, min.
    pub axis_min: f64,
    /// Time of the computation, s.
    pub computed_s: f64,
    /// The axis, for a person.
    pub axis: String,
    /// Reason of a refusal.
    pub reason: String,
}

/// Result on the small slow sines.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Small {
    /// Sines on which it is worse than the PID.
    pub worse: usize,
    /// Largest error over that of the PID: the worst of them, with its amplitude and velocity.
    pub ratio: Option<f64>,
    pub sine: String,
    /// Errors on a move of a few counts of the encoder, if it is worse there: no more than what it leaves on longer ones.
    pub few_counts: String,
}

/// Amplitudes, mm, and velocities, mm/s, of the small slow sines: one of each with each.
const SMALL_MM: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.5, 1.0];
const SLOW_MM_S: [f64; 5] = [0.2, 0.35, 0.5, 0.8, 1.5];
/// Largest error over the PID's from which on a result is worse, if it is also larger by a count of the encoder: where errors are a few
/// counts, their largest scatters by as much. [`Compared`] says what is done about chance.
const WORSE: f64 = 1.02;

/// Sines that a result is judged on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judging {
    /// The usual ones.
    Usual,
    /// The small slow ones, too: twenty times as many.
    SmallToo,
}

/// Way from the commissioning to the axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Path {
    /// The law alone, on an axis that warms.
    Law,
    /// The firmware's application behind a link, as a person's machine is; the axis does not warm.
    Simulated,
}

/// Seeds of which one goes over [`Path::Simulated`].
const SIMULATED_SHARE: u64 = 8;

impl Path {
    /// The way of a seed in a campaign.
    pub const fn of(seed: u64) -> Self {
        if seed.is_multiple_of(SIMULATED_SHARE) {
            Self::Simulated
        } else {
            Self::Law
        }
    }
}

/// An axis as it is reached.
enum Bench<'a> {
    Law(Box<SimulatedTestAxis>),
    Linked(Box<dyn TestAxis + 'a>),
}

impl Bench<'_> {
    fn axis(&self) -> &dyn TestAxis {
        match self {
            Self::Law(axis) => &**axis,
            Self::Linked(axis) => &**axis,
        }
    }

    fn axis_mut(&mut self) -> &mut dyn TestAxis {
        match self {
            Self::Law(axis) => &mut **axis,
            Self::Linked(axis) => &mut **axis,
        }
    }
}

/// An axis that counts the time for which it is used, and warms meanwhile.
struct Timed<'a> {
    subject: &'a Subject,
    bench: Bench<'a>,
    used_s: f64,
    tried: Vec<Tried>,
}

/// An experiment on the axis.
struct Tried {
    name: String,
    /// Time from the beginning of the commissioning at which it ended, s.
    ended_s: f64,
    /// The reason for which it was stopped.
    stopped: Option<String>,
}

/// An axis that was commissioned, or not.
struct Judged {
    line: Line,
    found: Option<Commissioned>,
    tried: Vec<Tried>,
}

impl TestAxis for Timed<'_> {
    fn info(&self) -> AxisInfo {
        self.bench.axis().info()
    }

    fn settings(&self) -> &AxisSettings {
        self.bench.axis().settings()
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        self.bench.axis_mut().apply(settings)
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.bench.axis_mut().switch_off()
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let outcome = self.bench.axis_mut().perform(experiment, progress);
        let recorded = outcome.as_ref().ok().or(self.bench.axis().interrupted());
        let lasted_s = recorded.map_or(0.0, Recording::duration_s);
        self.tried.push(Tried {
            name: experiment.name.clone(),
            ended_s: self.used_s + lasted_s,
            stopped: outcome.as_ref().err().map(ToString::to_string),
        });
        let recording = outcome?;
        self.used_s += lasted_s;
        if let Bench::Law(axis) = &mut self.bench
            && let Some(warmed) = self.subject.warmed(self.used_s)
        {
            axis.change(warmed);
        }
        Ok(recording)
    }

    fn interrupted(&self) -> Option<&Recording> {
        self.bench.axis().interrupted()
    }
}

/// Commissions the axis of a seed and judges the result.
pub fn judge(seed: u64, judging: Judging) -> Line {
    judged(&RandomAxis::new(seed).subject(), Path::of(seed), judging).line
}

/// Commissions an axis and judges the result.
pub fn judge_subject(subject: &Subject, path: Path) -> Line {
    judged(subject, path, Judging::Usual).line
}

/// The result of a commissioning, and the largest distance of the table from the middle of its travel, mm.
struct Tested {
    found: Result<Commissioned, CommissionError>,
    used_s: f64,
    tried: Vec<Tried>,
    farthest_mm: f64,
}

/// Commissions the axis, with the law alone.
fn with_the_law(subject: &Subject, base: &AxisSettings) -> Tested {
    let axis = SimulatedTestAxis::new(0, subject.parameters.clone(), subject.seed);
    let mut timed = Timed {
        subject,
        bench: Bench::Law(Box::new(axis.with_travel(subject.travel))),
        used_s: 0.0,
        tried: Vec::new(),
    };
    let found = run(&mut timed, base);
    Tested {
        found,
        used_s: timed.used_s,
        farthest_mm: match &timed.bench {
            Bench::Law(axis) => axis.farthest_mm(),
            Bench::Linked(_) => f64::INFINITY,
        },
        tried: timed.tried,
    }
}

/// Commissions the x axis of a machine behind a link, which has it beside the simulated stage's others.
fn over_a_link(subject: &Subject, base: &AxisSettings) -> Result<Tested, MachineError> {
    let mut settings = StageSettings::simulated();
    settings.axes[0] = bootstrap::zero_gain_settings(base);
    settings.axes[0].homing = None;
    let mut truth = StageParameters::real();
    truth.axes[0] = subject.parameters.clone();
    let connection = |error: ClientError| MachineError::Connection(Box::new(error));
    let mut setup = StageSetup {
        settings,
        truth,
        ..StageSetup::simulated()
    };
    let beyond_mm = 2.0 * subject.travel.half_mm();
    setup.marks[0].negative_limit_mm = -beyond_mm;
    setup.marks[0].positive_limit_mm = beyond_mm;
    let link = SimulatedLink::start(&setup, subject.seed, None)
        .map_err(|error| MachineError::Connection(Box::new(error)))?;
    let mut client = Client::open(link).map_err(connection)?;
    let (found, used_s, tried) = {
        let mut timed = Timed {
            subject,
            bench: Bench::Linked(client.test_axis(AxisName::X, subject.travel)?),
            used_s: 0.0,
            tried: Vec::new(),
        };
        (run(&mut timed, base), timed.used_s, timed.tried)
    };
    let start_mm = subject.travel.start_mm();
    let been_mm = client.simulated_io().and_then(|io| io.been_mm());
    Ok(Tested {
        found,
        used_s,
        tried,
        farthest_mm: been_mm.map_or(f64::INFINITY, |[(low_mm, high_mm), ..]| {
            (start_mm + low_mm).abs().max((start_mm + high_mm).abs())
        }),
    })
}

fn run(axis: &mut dyn TestAxis, base: &AxisSettings) -> Result<Commissioned, CommissionError> {
    commission(axis, base, &CommissionSettings::default(), &mut |_, _| {})
}

/// Commissions an axis and judges the result, with everything that was tried.
fn judged(subject: &Subject, path: Path, judging: Judging) -> Judged {
    let began = Instant::now();
    let Subject {
        parameters, travel, ..
    } = subject;
    let mut base = StageSettings::simulated().axes[0].clone();
    base.encoder.resolution_mm = parameters.resolution_mm;
    base.amplifier.full_scale_v = parameters.full_scale_v;
    let tested = match path {
        Path::Law => with_the_law(subject, &base),
        Path::Simulated => over_a_link(subject, &base).unwrap_or_else(|error| Tested {
            found: Err(error.into()),
            used_s: 0.0,
            tried: Vec::new(),
            farthest_mm: 0.0,
        }),
    };
    let mut line = Line {
        outcome: Outcome::RefusedWrongly,
        worst_ratio: None,
        mean_ratio: None,
        pid_um: None,
        program_ratio: None,
        small: Small::default(),
        health: Health::default(),
        trial_worst: None,
        gain_ratio: None,
        feedforward: String::new(),
        axis_min: tested.used_s / 60.0,
        computed_s: 0.0,
        axis: subject.description.clone(),
        reason: String::new(),
    };
    let found = match tested.found {
        Ok(found) => {
            line.fill(&found, subject, judging);
            Some(found)
        }
        Err(error) => {
            if names_resonance(&error, subject) {
                line.outcome = Outcome::Refused;
            }
            line.reason = quadrant_cli::explained(&error.into());
            None
        }
    };
    if tested.farthest_mm > travel.half_mm() {
        line.outcome = Outcome::LeftTravel;
    }
    line.computed_s = began.elapsed().as_secs_f64();
    Judged {
        line,
        found,
        tried: tested.tried,
    }
}

/// True if a refusal names the frequency of the axis' resonance.
fn names_resonance(error: &CommissionError, subject: &Subject) -> bool {
    let named_hz = match error {
        CommissionError::Rings { frequency_hz, .. }
        | CommissionError::Pid(DesignError::Mode { frequency_hz }) => *frequency_hz,
        CommissionError::Plant(PlantError::Misfit {
            mode_hz: Some(mode_hz),
            ..
        }) => *mode_hz,
        _ => return false,
    };
    subject.resonance_hz.is_some_and(|true_hz| {
        let ratio = named_hz / true_hz;
        ratio.max(1.0 / ratio) < NAMED
    })
}

/// Ratio of two frequencies that are the same: a loop moves a mode, and play lowers it.
const NAMED: f64 = 1.5;

impl Line {
    fn fill(&mut self, found: &Commissioned, subject: &Subject, judging: Judging) {
        let trials = found.verification.as_ref();
        let trials = trials.filter(|trials| trials.is_better_than_pid());
        self.trial_worst = trials.map(|trials| trials.against_pid(trials.chosen()).0);
        let true_gain = subject.parameters.gain_mm_per_v_s2;
        self.gain_ratio = Some(found.plant.plant.gain_mm_per_v_s2 / true_gain);
        self.feedforward = match found.settings.feedforward.kind {
            FeedforwardKind::None => "none".to_owned(),
            kind => kind.name().to_owned(),
        };
        if trials.is_none() {
            self.outcome = Outcome::PidAlone;
            return;
        }
        let pid = measuring_settings(&found.settings);
        // Under the limits of the result; where the PID leaves those, both have room.
        let narrow = AxisSettings {
            limits: found.settings.limits,
            ..pid.clone()
        };
        let used_s = 60.0 * self.axis_min;
        let judge = |motion: Motion| -> Result<Compared, String> {
            let run = |settings: &AxisSettings, noise: u64| {
                largest(settings, subject, used_s, motion, noise)
            };
            let (limits, pid_mm) = match run(&narrow, 0) {
                Ok(pid_mm) => (narrow.limits, pid_mm),
                Err(_) => (pid.limits, run(&pid, 0)?),
            };
            let [own, pid] = [&found.settings, &pid].map(|settings| AxisSettings {
                limits,
                ..settings.clone()
            });
            let mut compared = Compared {
                own_mm: vec![run(&own, 0)?],
                pid_mm: vec![pid_mm],
                count_mm: subject.parameters.resolution_mm,
            };
            if compared.is_worse() {
                compared.repeat(1..REPEATS, |noise| {
                    Ok((run(&own, noise)?, run(&pid, noise)?))
                })?;
            }
            if compared.is_worse() {
                // What was chosen for being worse may have been by chance: those runs do not count.
                compared.own_mm.clear();
                compared.pid_mm.clear();
                let fresh = REPEATS..3 * REPEATS;
                compared.repeat(fresh, |noise| Ok((run(&own, noise)?, run(&pid, noise)?)))?;
            }
            Ok(compared)
        };
        let mut motions = Motion::usual();
        let usual = motions.len();
        motions.push(Motion::Program);
        let errors_mm: Result<Vec<Compared>, String> = motions.iter().copied().map(judge).collect();
        match errors_mm {
            Ok(errors_mm) => {
                let ratios: Vec<f64> = errors_mm.iter().map(Compared::ratio).collect();
                let (worst, mean) = worst_and_mean(&ratios[..usual]);
                self.worst_ratio = Some(worst);
                self.mean_ratio = Some(mean);
                self.program_ratio = ratios.last().copied();
                let largest_mm = errors_mm[..usual].iter().map(|it| middle(&it.pid_mm));
                self.pid_um = Some(1e3 * largest_mm.fold(0.0, f64::max));
                let few_counts = Motion::of_few_counts(subject.parameters.resolution_mm);
                if let Ok(errors) = judge(few_counts)
                    && errors.is_worse()
                {
                    self.small.few_counts = errors.to_string();
                }
                let worse: Vec<(&Motion, &Compared)> = motions
                    .iter()
                    .zip(&errors_mm)
                    .filter(|(_, errors)| errors.is_worse())
                    .collect();
                let moves = |(motion, _): &(&Motion, &Compared)| motion.is_moves();
                self.outcome = if worse.is_empty() {
                    Outcome::Commissioned
                } else if worse.iter().all(moves) {
                    Outcome::WorseOnMoves
                } else {
                    Outcome::WorseThanPid
                };
                let described = worse
                    .iter()
                    .map(|(motion, errors)| format!("{motion}: {errors}"));
                self.reason = described.collect::<Vec<_>>().join("; ");
            }
            Err(reason) => {
                self.outcome = Outcome::WorseThanPid;
                self.reason = reason;
            }
        }
        let is_good = matches!(self.outcome, Outcome::Commissioned | Outcome::WorseOnMoves);
        if judging == Judging::SmallToo && is_good {
            self.judge_small(judge);
        }
        if judging == Judging::SmallToo {
            let warmed = subject.warmed(used_s);
            let parameters = warmed.unwrap_or_else(|| subject.parameters.clone());
            self.health = Health::of(&found.settings, subject, &parameters);
            if self.health.faults > 0 {
                self.outcome = Outcome::FalseFault;
            } else if self.health.hums() && found.hums.is_none() {
                self.outcome = Outcome::Hums;
            }
        }
    }

    /// Judges the small slow sines. `judge` runs one.
    fn judge_small(&mut self, judge: impl Fn(Motion) -> Result<Compared, String>) {
        for amplitude_mm in SMALL_MM {
            for velocity_mm_s in SLOW_MM_S {
                let sine = SineTest {
                    amplitude_mm,
                    velocity_mm_s,
                };
                let motion = Motion::Sine(sine, cycles(&sine));
                let errors = match judge(motion) {
                    Ok(errors) => errors,
                    Err(reason) => {
                        self.outcome = Outcome::WorseWhenSmall;
                        self.reason = reason;
                        return;
                    }
                };
                if !errors.is_worse() {
                    continue;
                }
                self.outcome = Outcome::WorseWhenSmall;
                self.small.worse += 1;
                if self.small.ratio.is_none_or(|worst| errors.ratio() > worst) {
                    self.small.ratio = Some(errors.ratio());
                    self.small.sine = format!("{motion}: {errors}");
                }
            }
        }
    }
}

/// Largest errors on a sine, each with other noise, and those of the PID.
struct Compared {
    own_mm: Vec<f64>,
    pid_mm: Vec<f64>,
    /// A count of the encoder.
    count_mm: f64,
}

/// Runs by which a sine is judged that one run found worse: an axis that sticks does not leave the same error with other noise.
const REPEATS: u64 = 7;
/// Share of the pairs of runs, of the law's with the PID's, of which the law's is to be the worse: over the seven, and then over fourteen
/// fresh ones. Of two equal laws one is with a probability of 0.3 % over seven runs.
const MOST_PAIRS: f64 = 0.9;

impl Compared {
    /// Adds the errors of a law and of the PID with other noise.
    fn repeat(
        &mut self,
        noises: Range<u64>,
        run: impl Fn(u64) -> Result<(f64, f64), String>,
    ) -> Result<(), String> {
        for noise in noises {
            let (own_mm, pid_mm) = run(noise)?;
            self.own_mm.push(own_mm);
            self.pid_mm.push(pid_mm);
        }
        Ok(())
    }

    /// The middle error over that of the PID.
    fn ratio(&self) -> f64 {
        middle(&self.own_mm) / middle(&self.pid_mm)
    }

    /// True if it is worse, by more than a count, and not by chance as far as that was tried.
    fn is_worse(&self) -> bool {
        let pairs = self.own_mm.iter().flat_map(|own| {
            let pid = self.pid_mm.iter();
            pid.map(move |pid| f64::from(u8::from(own > pid)))
        });
        let share = pairs.sum::<f64>() / (self.own_mm.len() * self.pid_mm.len()) as f64;
        let excess_mm = middle(&self.own_mm) - middle(&self.pid_mm);
        self.ratio() > WORSE && excess_mm > self.count_mm && share >= MOST_PAIRS
    }
}

impl fmt::Display for Compared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [own_um, pid_um] = [&self.own_mm, &self.pid_mm].map(|errors| 1e3 * middle(errors));
        write!(f, "{own_um:.1} um for {pid_um:.1}")
    }
}

/// The middle one of some errors, the upper one of two.
fn middle(errors_mm: &[f64]) -> f64 {
    let mut sorted = errors_mm.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}

/// Cycles of a sine that are scored: an axis that sticks does not do the same in each.
fn cycles(sine: &SineTest) -> Cycles {
    let period_s = std::f64::consts::TAU * sine.amplitude_mm / sine.velocity_mm_s;
    Cycles::scoring(((SCORED_S / period_s) as usize).clamp(2, 12))
}

/// Time that is scored, s, where that is no fewer than two cycles.
const SCORED_S: f64 = 40.0;

/// Largest error on a motion, mm, of a fresh axis with other noise: the n-th.
fn largest(
    settings: &AxisSettings,
    subject: &Subject,
    used_s: f64,
    motion: Motion,
    noise: u64,
) -> Result<f64, String> {
    let parameters = subject
        .warmed(used_s)
        .unwrap_or_else(|| subject.parameters.clone());
    motion.run(settings, parameters, subject, !subject.seed ^ (noise << 32))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared(own_mm: &[f64], pid_mm: &[f64]) -> Compared {
        Compared {
            own_mm: own_mm.to_vec(),
            pid_mm: pid_mm.to_vec(),
            count_mm: 0.1,
        }
    }

    #[test]
    fn a_law_is_worse_by_a_count_and_a_fiftieth_in_nine_of_ten_pairs_of_runs() {
        assert!(compared(&[1.2], &[1.0]).is_worse());
        assert!(!compared(&[1.09], &[1.0]).is_worse());
        assert!(!compared(&[10.15], &[10.0]).is_worse());
        // The same axis at rest in other places.
        let scattered = [2.9, 3.3, 4.0, 2.8, 3.1, 3.4, 2.6];
        let shifted = scattered.map(|it| it + 0.3);
        assert!(!compared(&shifted, &scattered).is_worse());
        assert!(compared(&scattered.map(|it| it + 1.2), &scattered).is_worse());
    }
}
