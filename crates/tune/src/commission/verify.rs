//! Trials of the commissioned laws on the axis itself, by its own encoder, and the choice among them: no law is selected
//! that is worse than the PID alone on any of the sines, or on those that no law was chosen by.

use std::f64::consts::TAU;

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_settings::AxisSettings;
use quadrant_sim::metrics::{Score, score, worst_and_mean};
use quadrant_sim::sine_test::SineTest;

use super::bootstrap::measuring_settings;
use super::drift::Drift;
use super::ringing::{Ringing, alike, lasting};
use crate::record::Recording;
use crate::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, MachineError, TestAxis, approach,
};

/// The sines on an axis with room: those by which a law is chosen, the middle velocity of the thesis first, then short, slow and fast;
/// and from [`CHOICE_SINES`] on, those that are withheld until then.
const SINES: [SineTest; 7] = [
    SineTest {
        amplitude_mm: 5.0,
        velocity_mm_s: 10.0,
    },
    SineTest {
        amplitude_mm: 0.2,
        velocity_mm_s: 1.0,
    },
    SineTest {
        amplitude_mm: 1.0,
        velocity_mm_s: 2.0,
    },
    SineTest {
        amplitude_mm: 15.0,
        velocity_mm_s: 60.0,
    },
    SineTest {
        amplitude_mm: 3.0,
        velocity_mm_s: 4.0,
    },
    SineTest {
        amplitude_mm: 0.5,
        velocity_mm_s: 2.0,
    },
    SineTest {
        amplitude_mm: 8.0,
        velocity_mm_s: 25.0,
    },
];
/// Number of sines by which a law is chosen.
const CHOICE_SINES: usize = 4;
/// Largest number of laws that run on the withheld sines, the best first, until one is worse than the PID on none.
const MAX_CANDIDATES: usize = 3;
/// Number of sines on which kinds of feedforward are compared; the best then runs on all [`CHOICE_SINES`].
const COMPARISON_SINES: usize = 2;
/// Largest amplitude of a sine over the travel.
const MOST_TRAVEL: f64 = 0.4;
/// Largest velocity of a sine over the velocity limit.
const MOST_VELOCITY: f64 = 0.5;
/// Kinds of feedforward that are tried, as far as they were identified.
const KINDS: [FeedforwardKind; 5] = [
    FeedforwardKind::Combined,
    FeedforwardKind::SmoothedGms,
    FeedforwardKind::Lugre,
    FeedforwardKind::Dahl,
    FeedforwardKind::Static,
];
/// Further kinds that are tried on all sines where the best is worse than the PID anywhere.
const OTHER_KINDS: usize = 2;
/// Shares of the identified friction that are tried where the whole of it is worse than the PID anywhere.
const SHARES: [f64; 3] = [0.75, 0.5, 0.25];
/// Largest error over that of the best kind up to which a kind that stands before it in [`KINDS`] is preferred.
const EQUAL_ERROR_RATIO: f64 = 1.1;
/// Errors of the static model alone over the PID's from which on its steps make the axis jump.
const JUMP_RATIO: f64 = 3.0;
/// Errors over the PID's up to which a law counts as no worse: a repeated run scatters by as much.
const MAX_SCATTER_RATIO: f64 = 1.01;
/// Largest mean error over the PID's, and largest error on a withheld sine over the PID's, of a law that is selected: with a smaller improvement
/// it is not worth its risk on motions that are not tried.
const MAX_ERROR_RATIO: f64 = 0.95;
/// Largest RMS error on a withheld sine over the PID's of a law whose largest error is no larger than the PID's: what is left then
/// are single spikes.
const MAX_RMS_RATIO: f64 = 0.85;
/// Least error that the encoder resolves, counts.
const RESOLVED_COUNTS: f64 = 2.0;
/// Largest excess of a largest error over the PID's that counts as none, counts.
const NEGLIGIBLE_COUNTS: f64 = 0.25;
/// The same of an RMS error, counts.
const NEGLIGIBLE_RMS_COUNTS: f64 = 0.025;

/// The sines that fit an axis.
pub fn sines(info: &AxisInfo) -> Vec<SineTest> {
    SINES
        .iter()
        .map(|sine| {
            let sine = sine.within(MOST_TRAVEL * info.travel_mm);
            SineTest {
                velocity_mm_s: sine
                    .velocity_mm_s
                    .min(MOST_VELOCITY * info.max_velocity_mm_s),
                ..sine
            }
        })
        .collect()
}

/// Scores of one law.
#[derive(Clone, Debug)]
pub struct LawResult {
    /// Name of the law.
    pub law: String,
    /// Its scores, on the measured position, sine by sine as far as it ran.
    pub scores: Vec<Score>,
    /// Recording of the first sine's scored cycles.
    pub recording: Recording,
    /// The reason why the axis was stopped, if it was.
    pub stopped: Option<String>,
    /// Oscillations that lasted all through a sine and were most of its error, as far as they were looked for.
    rings: Vec<Ringing>,
    /// True for one that feeds less friction forward, because the whole of it is worse than the PID.
    is_share: bool,
    /// Times at which the sines had been run, s from the first trial on.
    at_s: Vec<f64>,
    settings: AxisSettings,
}

impl LawResult {
    /// True for one with feedforward.
    fn feeds_forward(&self) -> bool {
        self.settings.feedforward.kind != FeedforwardKind::None
    }

    /// The oscillation that has the same frequency on sines of different speed: no ripple of the axis has.
    fn rings_alike(&self) -> Option<Ringing> {
        let mut pairs = self.rings.windows(2);
        pairs
            .find(|pair| alike(&pair[0], &pair[1]))
            .map(|pair| pair[0])
    }

    /// Factor on the friction that it feeds forward with which it would have left the least error on the first sine, by the errors
    /// that the same feedback leaves without; 1 where they show none.
    fn best_scale(&self, without: &Self, drift: &Drift) -> f64 {
        let (Some(own_s), Some(without_s)) = (self.at_s.first(), without.at_s.first()) else {
            return 1.0;
        };
        let changed = drift.between(*without_s, *own_s);
        let errors = |law: &Self| -> Vec<f64> {
            let Recording {
                reference_mm,
                position_mm,
                ..
            } = &law.recording;
            let pairs = reference_mm.iter().zip(position_mm);
            pairs
                .map(|(reference, position)| reference - position)
                .collect()
        };
        let (mut taken, mut all) = (0.0, 0.0);
        for (own_mm, without_mm) in errors(self).into_iter().zip(errors(without)) {
            let without_mm = changed * without_mm;
            let effect_mm = without_mm - own_mm;
            taken += without_mm * effect_mm;
            all += effect_mm * effect_mm;
        }
        let scale = taken / all;
        if scale.is_finite() {
            scale.clamp(1.0 / MOST_SCALE, MOST_SCALE)
        } else {
            1.0
        }
    }

    /// True if it ran on every sine by which a law is chosen, is better on the mean by enough, and on none that it ran on worse than the PID.
    fn is_better_than(&self, pid: &Self, drift: &Drift) -> bool {
        let (worst, mean) = self.against(pid, drift);
        let enough = CHOICE_SINES.min(pid.scores.len());
        self.scores.len() >= enough && worst <= self.most_worse() && mean <= MAX_ERROR_RATIO
    }

    /// True if on every withheld sine its largest error is below the PID's by enough, or all but what the encoder shows, or no larger
    /// while its RMS error is far below: what is just no worse there may be worse on the next motion.
    fn keeps_clear_of(&self, pid: &Self, drift: &Drift) -> bool {
        let seen_mm = RESOLVED_COUNTS * self.settings.encoder.resolution_mm;
        let own = self.scores.iter().zip(&self.at_s);
        let pairs = own.zip(pid.scores.iter().zip(&pid.at_s));
        pairs
            .skip(CHOICE_SINES)
            .all(|((own, own_s), (pid, pid_s))| {
                let changed = drift.between(*pid_s, *own_s);
                let pid_mm = changed * pid.largest_mm;
                let mostly_clear = own.rms_mm <= MAX_RMS_RATIO * changed * pid.rms_mm;
                own.largest_mm <= seen_mm.max(MAX_ERROR_RATIO * pid_mm)
                    || mostly_clear && own.largest_mm <= pid_mm
            })
    }

    /// Errors over the PID's up to which it counts as no worse: more of the same is known to be, and that is no scatter.
    fn most_worse(&self) -> f64 {
        if self.is_share {
            1.0
        } else {
            MAX_SCATTER_RATIO
        }
    }

    /// Its errors over those that the PID would have made at the same time: the largest of all ratios, and their geometric mean,
    /// over the sines that both ran; infinite for a law that was stopped. What exceeds the PID's by less than a share of a count
    /// is as good: it is the encoder's noise.
    fn against(&self, pid: &Self, drift: &Drift) -> (f64, f64) {
        if self.stopped.is_some() {
            return (f64::INFINITY, f64::INFINITY);
        }
        let runs = |law: &Self| -> Vec<(Score, f64)> {
            let times = law.at_s.iter().copied();
            law.scores.iter().copied().zip(times).collect()
        };
        let resolution_mm = self.settings.encoder.resolution_mm;
        let ratio = |own_mm: f64, pid_mm: f64, unseen_counts: f64| {
            if (0.0..unseen_counts * resolution_mm).contains(&(own_mm - pid_mm)) {
                1.0
            } else {
                own_mm / pid_mm
            }
        };
        let ratios: Vec<f64> = runs(self)
            .into_iter()
            .zip(runs(pid))
            .flat_map(|((own, own_s), (pid, pid_s))| {
                let changed = drift.between(pid_s, own_s);
                [
                    ratio(own.largest_mm, changed * pid.largest_mm, NEGLIGIBLE_COUNTS),
                    ratio(own.rms_mm, changed * pid.rms_mm, NEGLIGIBLE_RMS_COUNTS),
                ]
            })
            .collect();
        worst_and_mean(&ratios)
    }
}

/// All trials, and the chosen law.
#[derive(Clone, Debug)]
pub struct Verification {
    pub sines: Vec<SineTest>,
    /// The PID alone first.
    pub laws: Vec<LawResult>,
    /// Index of the chosen law.
    pub chosen: usize,
    /// Change of the axis meanwhile, on the first sine.
    pub drift: Drift,
}

impl Verification {
    /// True if a law was found that is better than the PID alone by enough, and nowhere worse.
    pub fn is_better_than_pid(&self) -> bool {
        self.chosen != 0
    }

    pub fn chosen(&self) -> &LawResult {
        &self.laws[self.chosen]
    }

    /// Errors of one of the laws over those that the PID would have made at the same time: the largest of all ratios, and their
    /// geometric mean, over the sines that the law ran on; infinite for one that was stopped.
    pub fn against_pid(&self, law: &LawResult) -> (f64, f64) {
        law.against(&self.laws[0], &self.drift)
    }

    /// Settings of the chosen law, with the limits of `base`.
    pub fn settings(&self, base: &AxisSettings) -> AxisSettings {
        AxisSettings {
            limits: base.limits,
            ..self.chosen().settings.clone()
        }
    }
}

/// Reason why the trials cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The machine did not take the settings.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// The PID alone was stopped.
    #[error(transparent)]
    TestAxis(#[from] ExperimentError),
    /// The PID alone oscillates.
    #[error(
        "The PID oscillates at {:.0} Hz ({:.1} um), in every motion of the axis",
        .0.frequency_hz,
        1e3 * .0.amplitude_mm
    )]
    Rings(Ringing),
}

impl VerifyError {
    /// True if a softer PID may do: this one oscillates, or does not hold the axis.
    pub(super) fn asks_for_softer(&self) -> bool {
        match self {
            Self::Machine(_) => false,
            Self::TestAxis(error) => error.strayed(),
            Self::Rings(_) => true,
        }
    }
}

/// Amplitude over the RMS error from which on an oscillation is most of the error: a reversal is followed by one, too, but it decays.
const MIN_DOMINANT_RATIO: f64 = 1.0;

/// Tries laws on the axis: the PID alone, the N-PID alone, the N-PID with every kind of feedforward that was identified, the best of
/// them over other ranges of pre-sliding displacement, less of it where it is worse than the PID anywhere, and as much of the best as its
/// errors ask for. Chooses the best of those that are not worse, on sines either that were withheld until then. Where there is none, other
/// kinds and shares take their turn, and then what was tried, without the nonlinear gain.
///
/// # Errors
/// A PID whose settings are refused, that is stopped, or that oscillates.
pub fn verify(
    test_axis: &mut dyn TestAxis,
    settings: &AxisSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Verification, VerifyError> {
    let sines = sines(&test_axis.info());
    let mut bench = Bench {
        test_axis,
        sines: &sines,
        progress,
        done: 0.0,
        used_s: 0.0,
        detects_ringing: true,
        interrupted: None,
    };
    let verdict = choose(&mut bench, settings);
    match bench.interrupted {
        // Laws that a person kept from running are no worse for it.
        Some(error) => Err(error.into()),
        None => verdict,
    }
}

/// [`verify`], unless a person ends it.
fn choose(bench: &mut Bench<'_>, settings: &AxisSettings) -> Result<Verification, VerifyError> {
    let pid = measuring_settings(settings);
    let npid = AxisSettings {
        feedback: settings.feedback.clone(),
        ..pid.clone()
    };
    let full = |kind: FeedforwardKind| {
        let mut full = npid.clone();
        full.feedforward = settings.feedforward;
        full.feedforward.kind = kind;
        full
    };
    let alone = bench.try_law("PID", &pid, CHOICE_SINES)?;
    if let Some(stopped) = alone.1 {
        return Err(stopped.into());
    }
    if let Some(ringing) = alone.0.rings_alike() {
        return Err(VerifyError::Rings(ringing));
    }
    bench.detects_ringing = false;
    let pid_alone = alone.0.clone();
    let mut drift = Drift::default();
    note(&mut drift, &pid_alone);
    let mut laws = vec![alone.0];
    let nonlinear = bench.try_law("N-PID", &npid, CHOICE_SINES);
    laws.extend(nonlinear.ok().map(|found| found.0));

    let mut kinds: Vec<(FeedforwardKind, LawResult)> = Vec::new();
    for kind in KINDS {
        // A model that was not identified, or that the control rate does not resolve, is refused.
        let law = format!("N-PID + {}", kind.name());
        if let Ok((found, _)) = bench.try_law(&law, &full(kind), COMPARISON_SINES) {
            kinds.push((kind, found));
        }
    }
    note(&mut drift, &bench.try_law(REPEATED_PID, &pid, 1)?.0);
    // An axis that the sign of the velocity alone makes jump is not to be given it beside a model with memory.
    let jumps = kinds.iter().any(|(kind, law)| {
        *kind == FeedforwardKind::Static && law.against(&pid_alone, &drift).1 > JUMP_RATIO
    });
    let is_step =
        |kind: FeedforwardKind| matches!(kind, FeedforwardKind::Combined | FeedforwardKind::Static);
    let (jumping, mut kinds): (Vec<_>, Vec<_>) = kinds
        .into_iter()
        .partition(|(kind, _)| jumps && is_step(*kind));
    let means = kinds
        .iter()
        .map(|(_, law)| law.against(&pid_alone, &drift).1);
    let means: Vec<f64> = means.collect();
    let smallest = means.iter().copied().fold(f64::INFINITY, f64::min);
    let best = means
        .iter()
        .position(|mean| *mean <= EQUAL_ERROR_RATIO * smallest);
    if let Some(index) = best {
        let (kind, compared) = kinds.remove(index);
        let mut whole = bench.stretched(&compared, &pid_alone, &drift);
        bench.run_on(&mut whole, CHOICE_SINES);
        if whole.law != compared.law {
            // One over another range that is stopped on a further sine goes back to the range that was measured.
            if whole.stopped.is_some() {
                laws.push(whole);
                whole = compared;
                bench.run_on(&mut whole, CHOICE_SINES);
            } else {
                kinds.push((kind, compared));
            }
        }
        let mut worst = whole.against(&pid_alone, &drift).0;
        let (law, settings) = (whole.law.clone(), whole.settings.clone());
        laws.push(whole);
        // Another kind may be better on the sines that it was not compared on.
        kinds.sort_by(|a, b| {
            let mean = |law: &LawResult| law.against(&pid_alone, &drift).1;
            mean(&a.1).total_cmp(&mean(&b.1))
        });
        for _ in 0..OTHER_KINDS.min(kinds.len()) {
            let (worst_so_far, mean_so_far) = kinds[0].1.against(&pid_alone, &drift);
            if worst <= MAX_SCATTER_RATIO || worst_so_far > MAX_SCATTER_RATIO || mean_so_far >= 1.0
            {
                break;
            }
            let (_, mut other) = kinds.remove(0);
            bench.run_on(&mut other, CHOICE_SINES);
            worst = other.against(&pid_alone, &drift).0;
            laws.push(other);
        }
        let mut is_worse = worst > MAX_SCATTER_RATIO;
        for share in SHARES {
            if !is_worse {
                break;
            }
            let law = format!("{law} x {share:.2}");
            if let Ok((mut found, _)) =
                bench.try_law(&law, &with_friction(&settings, share), CHOICE_SINES)
            {
                found.is_share = true;
                is_worse = found.against(&pid_alone, &drift).0 > found.most_worse();
                laws.push(found);
            }
        }
        note(&mut drift, &bench.try_law(REPEATED_PID, &pid, 1)?.0);
    }
    // What was measured early or slowly may differ by a scale from the friction on the sines.
    let best = &laws[better_than_pid(&laws, &drift).first().copied().unwrap_or(0)];
    let without = laws
        .iter()
        .find(|law| !law.feeds_forward() && law.settings.feedback == best.settings.feedback);
    let scale = without.map_or(1.0, |without| best.best_scale(without, &drift));
    if (scale - 1.0).abs() > LEAST_CORRECTION {
        let base = best;
        let settings = with_friction(&base.settings, scale);
        let law = format!("{} x {scale:.2}", base.law);
        if let Ok((scaled, _)) = bench.try_law(&law, &settings, CHOICE_SINES) {
            let scaled = LawResult {
                is_share: base.is_share,
                ..scaled
            };
            note(&mut drift, &bench.try_law(REPEATED_PID, &pid, 1)?.0);
            laws.push(scaled);
        }
    }
    let mut chosen = bench.withheld(&mut laws, 1, &drift)?;
    if chosen == 0 {
        chosen = bench.instead(&mut laws, &mut kinds, &drift)?;
    }
    if chosen == 0 && npid.feedback != pid.feedback {
        chosen = bench.without_nonlinear_gain(&mut laws, &pid, &drift)?;
    }
    // The others are shown, too, after those that ran on every sine.
    laws.extend(kinds.into_iter().chain(jumping).map(|(_, law)| law));
    Ok(Verification {
        sines: bench.sines.to_vec(),
        laws,
        chosen,
        drift,
    })
}

/// The same settings with `factor` times the friction fed forward, but for its viscous part.
fn with_friction(settings: &AxisSettings, factor: f64) -> AxisSettings {
    let mut scaled = settings.clone();
    let gains = &mut scaled.feedforward.gains;
    gains.level *= factor;
    gains.presliding *= factor;
    scaled
}

/// The same settings with pre-sliding friction, of whichever model, over `factor` times the displacement.
fn over_range(settings: &AxisSettings, factor: f64) -> AxisSettings {
    let mut softer = settings.clone();
    let friction = &mut softer.friction;
    for element in &mut friction.gms.elements {
        element.stiffness_v_per_mm /= factor;
    }
    if let Some(lugre) = &mut friction.lugre {
        lugre.stiffness_v_per_mm /= factor;
    }
    if let Some(dahl) = &mut friction.dahl {
        dahl.stiffness_v_per_mm /= factor;
    }
    softer
}

/// The laws that are better than the PID, the first of them, by their indices: the best first.
fn better_than_pid(laws: &[LawResult], drift: &Drift) -> Vec<usize> {
    let mean = |index: &usize| laws[*index].against(&laws[0], drift).1;
    let mut better: Vec<usize> = (1..laws.len())
        .filter(|&index| laws[index].is_better_than(&laws[0], drift))
        .collect();
    better.sort_by(|a, b| mean(a).total_cmp(&mean(b)));
    better
}

/// Least relative change of the friction that is fed forward that is worth a further trial.
const LEAST_CORRECTION: f64 = 0.02;
/// Largest factor on the friction that is fed forward.
const MOST_SCALE: f64 = 1.5;
/// Errors of the best kind over the PID's from which on other displacements are tried for its pre-sliding friction: where noise shakes
/// the axis, a slow sine shows too soft or too stiff a spring.
const MIN_REFIT_RATIO: f64 = 0.15;
/// Factor from one displacement to the next.
const STRETCH_RATIO: f64 = 2.5;
/// Largest number of displacements in each direction.
const MAX_STRETCHES: i32 = 4;
/// Largest error over that of the displacement before, up to which the search goes on.
const MAX_STRETCH_ERROR_RATIO: f64 = 0.95;
/// Largest error over the PID's up to which a law with the nonlinear gain is tried without that gain.
const MAX_RETRY_RATIO: f64 = 1.25;
/// Name of the PID's further runs.
const REPEATED_PID: &str = "PID, again";

/// Takes a run of the PID on the first sine into account.
fn note(drift: &mut Drift, pid: &LawResult) {
    if let (Some(score), Some(at_s)) = (pid.scores.first(), pid.at_s.first()) {
        drift.note(*at_s, score.rms_mm);
    }
}

/// Time that trials take on sines where no share of the friction is to be tried, s.
pub(super) fn lasts_s(sines: &[SineTest]) -> f64 {
    let runs = |index: usize| {
        if index >= CHOICE_SINES {
            return 2;
        }
        let compared = if index < COMPARISON_SINES {
            KINDS.len()
        } else {
            1
        };
        // The PID and the N-PID alone, the best law once more, and the PID again three times.
        3 + compared + 3 * usize::from(index == 0)
    };
    sines
        .iter()
        .enumerate()
        .map(|(index, sine)| runs(index) as f64 * one_lasts_s(sine))
        .sum()
}

/// Time of one run on a sine, s.
fn one_lasts_s(sine: &SineTest) -> f64 {
    let frequency_hz = sine.velocity_mm_s / (TAU * sine.amplitude_mm);
    CYCLES / frequency_hz + 2.0 * LEAD_S
}

/// Runs that all trials make at most, for progress.
const MOST_RUNS: f64 = 105.0;

struct Bench<'a> {
    test_axis: &'a mut dyn TestAxis,
    sines: &'a [SineTest],
    progress: &'a mut dyn FnMut(f64),
    done: f64,
    /// Time for which the axis has run on sines, s.
    used_s: f64,
    /// True while oscillations are looked for, which takes longer than anything else here: of the PID alone.
    detects_ringing: bool,
    /// The interruption by a person, after which nothing more runs.
    interrupted: Option<ExperimentError>,
}

impl Bench<'_> {
    /// The law over the range of pre-sliding displacement that leaves the least error on the sines that it ran on: farther ones first,
    /// shorter ones where the first of those is no better.
    fn stretched(&mut self, law: &LawResult, pid: &LawResult, drift: &Drift) -> LawResult {
        let error = |law: &LawResult| law.against(pid, drift).1;
        let mut best = law.clone();
        for step in [STRETCH_RATIO, 1.0 / STRETCH_RATIO] {
            let before = error(&best);
            for count in 1..=MAX_STRETCHES {
                if error(&best) < MIN_REFIT_RATIO {
                    break;
                }
                let factor = step.powi(count);
                let name = format!("{} over {factor:.2} x the range", law.law);
                let settings = over_range(&law.settings, factor);
                match self.try_law(&name, &settings, COMPARISON_SINES) {
                    Ok((found, _)) if error(&found) < MAX_STRETCH_ERROR_RATIO * error(&best) => {
                        best = found
                    }
                    // A spring that is refused ends it as well.
                    _ => break,
                }
            }
            if error(&best) < before {
                break;
            }
        }
        best
    }

    /// A law on the first sines; stops where the axis is stopped. Settings that are refused are an error.
    fn try_law(
        &mut self,
        law: &str,
        settings: &AxisSettings,
        count: usize,
    ) -> Result<(LawResult, Option<ExperimentError>), MachineError> {
        let mut settings = settings.clone();
        // Room for the error that a poor law makes, as for the PID.
        let measuring = measuring_settings(&settings);
        settings.limits = measuring.limits;
        self.test_axis.apply(&settings)?;
        let mut result = LawResult {
            law: law.to_owned(),
            scores: Vec::new(),
            recording: Recording::default(),
            stopped: None,
            rings: Vec::new(),
            is_share: false,
            at_s: Vec::new(),
            settings,
        };
        let stopped = self.run(&mut result, count);
        Ok((result, stopped))
    }

    /// The law that is chosen where the withheld sines refuse all that were better on the others: another kind, or a share of the
    /// best one's friction. Laws that ran are added.
    fn instead(
        &mut self,
        laws: &mut Vec<LawResult>,
        kinds: &mut Vec<(FeedforwardKind, LawResult)>,
        drift: &Drift,
    ) -> Result<usize, VerifyError> {
        let best = laws[1..].iter().rfind(|law| {
            let ran = law.scores.len() + usize::from(law.stopped.is_some());
            law.feeds_forward() && !law.is_share && ran > CHOICE_SINES
        });
        let Some(best) = best else {
            return Ok(0);
        };
        let (name, settings) = (best.law.clone(), best.settings.clone());
        let (others, left): (Vec<_>, Vec<_>) =
            std::mem::take(kinds).into_iter().partition(|(_, law)| {
                let (worst, mean) = law.against(&laws[0], drift);
                worst <= MAX_SCATTER_RATIO && mean <= MAX_ERROR_RATIO
            });
        *kinds = left;
        for (_, mut other) in others {
            self.run_on(&mut other, CHOICE_SINES);
            let found = self.add_and_judge(laws, other, drift)?;
            if found != 0 {
                return Ok(found);
            }
        }
        for share in SHARES {
            let name = format!("{name} x {share:.2}");
            let Ok((mut found, _)) =
                self.try_law(&name, &with_friction(&settings, share), CHOICE_SINES)
            else {
                continue;
            };
            found.is_share = true;
            let found = self.add_and_judge(laws, found, drift)?;
            if found != 0 {
                return Ok(found);
            }
        }
        Ok(0)
    }

    /// Adds a law that ran; its index if it is chosen, else the PID's.
    fn add_and_judge(
        &mut self,
        laws: &mut Vec<LawResult>,
        law: LawResult,
        drift: &Drift,
    ) -> Result<usize, VerifyError> {
        let from = laws.len();
        laws.push(law);
        self.withheld(laws, from, drift)
    }

    /// The law that is chosen where all with the nonlinear gain were refused: that is an addition, too, and noise or play may make it
    /// worse than the PID. What was not much worse is tried without it. Laws that ran are added.
    fn without_nonlinear_gain(
        &mut self,
        laws: &mut Vec<LawResult>,
        pid: &AxisSettings,
        drift: &Drift,
    ) -> Result<usize, VerifyError> {
        let hopeful = laws.iter().filter(|law| {
            let (worst, mean) = law.against(&laws[0], drift);
            let ran = law.scores.len() >= CHOICE_SINES;
            law.feeds_forward() && ran && worst <= MAX_RETRY_RATIO && mean <= MAX_ERROR_RATIO
        });
        let linear: Vec<_> = hopeful
            .map(|law| {
                let settings = AxisSettings {
                    feedback: pid.feedback.clone(),
                    ..law.settings.clone()
                };
                (law.law.replacen("N-PID", "PID", 1), settings, law.is_share)
            })
            .collect();
        let from = laws.len();
        for (name, settings, is_share) in linear {
            if let Ok((found, _)) = self.try_law(&name, &settings, CHOICE_SINES) {
                laws.push(LawResult { is_share, ..found });
            }
        }
        self.withheld(laws, from, drift)
    }

    /// The index of the chosen law, of those from one on: the best that is worse than the PID, the first of all, on none of
    /// the sines that were withheld either; the PID if there is none.
    fn withheld(
        &mut self,
        laws: &mut [LawResult],
        from: usize,
        drift: &Drift,
    ) -> Result<usize, VerifyError> {
        let mut better = better_than_pid(laws, drift);
        better.retain(|index| *index >= from);
        if better.is_empty() {
            return Ok(0);
        }
        if let Some(stopped) = self.run_on(&mut laws[0], self.sines.len()) {
            return Err(stopped.into());
        }
        for index in better.into_iter().take(MAX_CANDIDATES) {
            self.run_on(&mut laws[index], self.sines.len());
            let law = &laws[index];
            if law.is_better_than(&laws[0], drift) && law.keeps_clear_of(&laws[0], drift) {
                return Ok(index);
            }
        }
        Ok(0)
    }

    /// Runs a law that was not stopped on those of the first sines that it has not run on; the error that stops it.
    fn run_on(&mut self, result: &mut LawResult, count: usize) -> Option<ExperimentError> {
        if result.stopped.is_some() || self.test_axis.apply(&result.settings).is_err() {
            return None;
        }
        self.run(result, count)
    }

    /// The same of one that was just put into force.
    fn run(&mut self, result: &mut LawResult, count: usize) -> Option<ExperimentError> {
        for index in result.scores.len()..count {
            if self.interrupted.is_some() {
                return None;
            }
            let done = self.done;
            let progress = &mut *self.progress;
            let outcome = approach(self.test_axis, 0.0).and_then(|()| {
                run_sine(
                    self.test_axis,
                    &result.law,
                    self.sines[index],
                    &mut |share| {
                        progress(((done + share) / MOST_RUNS).min(1.0));
                    },
                )
            });
            self.done += 1.0;
            match outcome {
                Ok((score, recording)) => {
                    self.used_s += one_lasts_s(&self.sines[index]);
                    result.scores.push(score);
                    result.at_s.push(self.used_s);
                    if self.detects_ringing {
                        let resolution_mm = result.settings.encoder.resolution_mm;
                        let found = lasting(&recording, resolution_mm);
                        let is_all = |found: &Ringing| {
                            found.amplitude_mm > MIN_DOMINANT_RATIO * score.rms_mm
                        };
                        result.rings.extend(found.filter(is_all));
                    }
                    if index == 0 {
                        result.recording = recording;
                    }
                }
                Err(error @ ExperimentError::Interrupted { .. }) => {
                    self.interrupted = Some(error);
                    return None;
                }
                Err(error) => {
                    result.stopped = Some(error.to_string());
                    return Some(error);
                }
            }
        }
        None
    }
}

/// Cycles at full speed, of which the last [`SCORED_CYCLES`] count.
const CYCLES: f64 = 3.25;
/// Cycles that are scored.
const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;

/// Runs the settings in force on a sine: score and recording of the last whole cycles.
///
/// # Errors
/// A run that is stopped.
pub fn run_sine(
    test_axis: &mut dyn TestAxis,
    law: &str,
    sine_test: SineTest,
    progress: &mut dyn FnMut(f64),
) -> Result<(Score, Recording), ExperimentError> {
    let sine = HarmonicSettings::with_velocity(
        sine_test.amplitude_mm,
        sine_test.velocity_mm_s,
        CYCLES,
        LEAD_S,
    );
    let recording = test_axis.perform(
        &Experiment {
            name: format!("{law} on a sine of {:.2} mm", sine_test.amplitude_mm),
            drive: Drive::ClosedLoop(MotionSettings::Harmonic(sine)),
            injection_v: Vec::new(),
            decimation: 1,
            time_limit_s: 60.0 + 2.0 * CYCLES / sine.frequency_hz,
        },
        progress,
    )?;
    let samples = |seconds: f64| (seconds / recording.sample_time_s).round() as usize;
    let cycle = samples(1.0 / sine.frequency_hz);
    // The recording ends with the lead-out, whose end is a little later than the last full-speed cycle's.
    let end = recording.len() - samples(LEAD_S);
    let scored = recording.slice(end.saturating_sub(SCORED_CYCLES * cycle)..end);
    let errors: Vec<f64> = scored
        .reference_mm
        .iter()
        .zip(&scored.position_mm)
        .map(|(reference, position)| reference - position)
        .collect();
    Ok((score(&scored.reference_mm, &errors, cycle), scored))
}

#[cfg(test)]
mod tests {
    use quadrant_settings::StageSettings;

    use super::*;

    /// Two seconds of an error, mm, over time, s.
    fn recording(error: impl Fn(f64) -> f64) -> Recording {
        let sample_time_s = 1e-3;
        let times = (0..2000).map(|index| index as f64 * sample_time_s);
        Recording {
            sample_time_s,
            reference_mm: vec![0.0; 2000],
            position_mm: times.map(error).collect(),
            voltage_v: vec![0.0; 2000],
            injection_v: vec![0.0; 2000],
            parts: Vec::new(),
        }
    }

    fn law(scores: &[(f64, f64)], recordings: &[Recording]) -> LawResult {
        let settings = StageSettings::simulated().axes[0].clone();
        let resolution_mm = settings.encoder.resolution_mm;
        let lasting = |recording| lasting(recording, resolution_mm);
        LawResult {
            law: "a law".to_owned(),
            scores: scores
                .iter()
                .map(|&(largest_mm, rms_mm)| Score {
                    largest_mm,
                    rms_mm,
                    glitch_mm: 0.0,
                })
                .collect(),
            recording: Recording::default(),
            stopped: None,
            rings: recordings.iter().filter_map(lasting).collect(),
            is_share: false,
            at_s: vec![0.0; scores.len()],
            settings,
        }
    }

    #[test]
    fn an_oscillation_of_one_frequency_on_two_sines_is_the_loops_and_a_ripple_is_not() {
        let at = |frequency_hz: f64| recording(move |time| 0.1 * (TAU * frequency_hz * time).sin());
        let loops = law(&[], &[at(80.0), at(84.0)]).rings_alike().unwrap();
        assert!((loops.frequency_hz / 80.0 - 1.0).abs() < 0.05, "{loops:?}");
        // A ripple of the screw is as quick as the axis.
        assert_eq!(law(&[], &[at(10.0), at(40.0)]).rings_alike(), None);
    }

    #[test]
    fn an_oscillation_that_decays_after_a_reversal_does_not_last() {
        let after_reversals = recording(|time| {
            let since = time % 1.0;
            0.1 * (-10.0 * since).exp() * (TAU * 30.0 * since).sin()
        });
        assert_eq!(law(&[], &[after_reversals]).rings, Vec::new());
    }

    #[test]
    fn a_law_is_chosen_that_ran_on_every_sine_is_worth_it_and_nowhere_worse() {
        let drift = Drift::default();
        let pid = law(&[(1.0, 0.5), (1.0, 0.5)], &[]);
        let is_better = |scores: &[(f64, f64)], is_share: bool| {
            let law = LawResult {
                is_share,
                ..law(scores, &[])
            };
            law.is_better_than(&pid, &drift)
        };
        assert!(is_better(&[(0.5, 0.3), (1.005, 0.4)], false));
        assert!(!is_better(&[(0.5, 0.3), (1.02, 0.4)], false), "worse once");
        assert!(
            !is_better(&[(0.5, 0.3), (1.005, 0.4)], true),
            "the whole was worse there"
        );
        assert!(is_better(&[(0.5, 0.3), (0.99, 0.4)], true));
        assert!(
            !is_better(&[(0.99, 0.49), (0.98, 0.49)], false),
            "hardly better"
        );
        assert!(
            !is_better(&[(0.5, 0.3)], false),
            "stopped on the second sine"
        );
        // Of another law the PID has run on the withheld sines, too.
        let pid = law(&[(1.0, 0.5); SINES.len()], &[]);
        let next = law(&[(0.5, 0.3); CHOICE_SINES], &[]);
        assert!(next.is_better_than(&pid, &drift));
    }

    #[test]
    fn a_law_keeps_clear_of_the_pid_on_withheld_sines_or_is_as_good_as_the_encoder() {
        let drift = Drift::default();
        let count_mm = StageSettings::simulated().axes[0].encoder.resolution_mm;
        let beside = |withheld: [f64; 2], rms_mm: f64| {
            let chosen_by = [(0.1, 0.05); CHOICE_SINES];
            let withheld = withheld.map(|largest_mm| (largest_mm, rms_mm));
            law(&[&chosen_by[..], &withheld].concat(), &[])
        };
        let ran = |withheld: [f64; 2]| beside(withheld, 0.05);
        let pid = ran([1.0, 1.5 * count_mm]);
        assert!(ran([0.9, 1.4 * count_mm]).keeps_clear_of(&pid, &drift));
        assert!(ran([0.9, 2.0 * count_mm]).keeps_clear_of(&pid, &drift));
        assert!(!ran([0.9, 2.1 * count_mm]).keeps_clear_of(&pid, &drift));
        assert!(!ran([0.98, 1.4 * count_mm]).keeps_clear_of(&pid, &drift));
        // Spikes are left, and nothing else.
        let spiky = [0.98, 1.4 * count_mm];
        assert!(beside(spiky, 0.04).keeps_clear_of(&pid, &drift));
        assert!(!beside(spiky, 0.045).keeps_clear_of(&pid, &drift));
        assert!(!beside([1.01, 1.4 * count_mm], 0.01).keeps_clear_of(&pid, &drift));
    }

    #[test]
    fn the_scale_that_leaves_the_least_error_is_found_from_two_runs_and_their_times() {
        let times_s = [0.0, 100.0];
        let shape = |time: f64| (TAU * time).sin().powi(9);
        let ran = |error_mm: f64, at_s: f64| LawResult {
            recording: recording(move |time| -error_mm * shape(time)),
            at_s: vec![at_s],
            ..law(&[(error_mm, error_mm)], &[])
        };
        // Of the friction, 0.8 is fed forward, and it has grown by a tenth since the run without.
        let (without, with) = (ran(0.1, times_s[0]), ran(0.11 - 0.08, times_s[1]));
        let mut drift = Drift::default();
        for (at_s, error_mm) in times_s.into_iter().zip([0.1, 0.11]) {
            drift.note(at_s, error_mm);
        }
        let scale = with.best_scale(&without, &drift);
        assert!((scale - 0.11 / 0.08).abs() < 1e-9, "{scale}");
        assert_eq!(
            without.best_scale(&without, &Drift::default()),
            1.0,
            "nothing to compare"
        );
    }

    #[test]
    fn what_exceeds_the_pids_error_by_less_than_the_encoder_shows_is_as_good() {
        let drift = Drift::default();
        let count_mm = StageSettings::simulated().axes[0].encoder.resolution_mm;
        let pid = law(&[(10.0 * count_mm, count_mm)], &[]);
        let beside = |counts: f64| {
            let score = ((10.0 + counts) * count_mm, count_mm);
            law(&[score], &[]).against(&pid, &drift).0
        };
        assert_eq!(beside(0.2), 1.0);
        assert!((beside(0.5) - 1.05).abs() < 1e-9);
        let more = law(&[(10.0 * count_mm, 1.1 * count_mm)], &[]).against(&pid, &drift);
        assert!(
            (more.0 - 1.1).abs() < 1e-9,
            "an RMS error scatters less: {more:?}"
        );
        // What is better counts in full.
        let mean = law(&[(9.9 * count_mm, 0.9 * count_mm)], &[]).against(&pid, &drift);
        assert!((mean.0 - 0.99).abs() < 1e-9, "{mean:?}");
    }
}
