//! The phases of the trials: each adds laws that ran, the last one chooses.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_settings::AxisSettings;

use super::super::bootstrap::measuring_settings;
use super::super::drift::Drift;
use super::bench::Bench;
use super::law_result::{LawResult, MAX_ERROR_RATIO, MAX_SCATTER_RATIO};
use super::sines::{CHOICE_SINES, COMPARISON_SINES};
use super::small::Refused;
use super::variants::{over_range, with_friction, with_kind};
use super::{Verification, VerifyError};

/// Kinds of feedforward that are tried, as far as they were identified.
pub(super) const KINDS: [FeedforwardKind; 5] = [
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
/// Largest number of laws that run on the withheld sines, the best first, until one is worse than the PID on none.
const MAX_CANDIDATES: usize = 3;
/// Largest error over that of the best kind up to which a kind that stands before it in [`KINDS`] is preferred.
const EQUAL_ERROR_RATIO: f64 = 1.1;
/// Errors of the static model alone over the PID's from which on its steps make the axis jump.
const JUMP_RATIO: f64 = 3.0;
/// Least relative change of the friction that is fed forward that is worth a further trial.
const LEAST_CORRECTION: f64 = 0.02;
/// Errors of the best kind over the PID's from which on other displacements are tried for its pre-sliding friction: where noise shakes
/// the axis, a slow sine shows too soft or too stiff a spring.
const MIN_REFIT_RATIO: f64 = 0.15;
/// Factor from one displacement to the next.
const STRETCH_RATIO: f64 = 2.5;
/// Largest number of displacements in each direction.
const MAX_STRETCHES: u8 = 4;
/// Largest error over that of the displacement before, up to which the search goes on.
const MAX_STRETCH_ERROR_RATIO: f64 = 0.95;
/// Largest error over the PID's up to which a law with the nonlinear gain is tried without that gain.
const MAX_RETRY_RATIO: f64 = 1.25;
/// Name of the PID's further runs.
const REPEATED_PID: &str = "PID, again";
/// Number of the PID's further runs.
pub(super) const REPEATS: usize = 3;

/// Trials under way.
pub(super) struct Trials<'a, 'b> {
    pub(super) bench: &'a mut Bench<'b>,
    /// The commissioned settings, with all that they feed forward.
    full: AxisSettings,
    /// Learning, as the settings ask for it, or as it is by default.
    pub(super) learning: LearningSettings,
    /// The PID alone, and the N-PID alone.
    pub(super) pid: AxisSettings,
    npid: AxisSettings,
    /// Laws that ran on the sines by which one is chosen, as far as they were not stopped: the PID alone first.
    pub(super) laws: Vec<LawResult>,
    /// Kinds of feedforward that ran on the sines of the comparison alone.
    kinds: Vec<LawResult>,
    /// The same that make the axis jump.
    jumping: Vec<LawResult>,
    /// The PID's largest errors on the first small slow motions, mm, as far as it has run on them.
    pub(super) pid_when_small_mm: Vec<f64>,
    /// Laws that were worse than the PID on a small slow motion.
    pub(super) refused: Vec<Refused>,
    pub(super) drift: Drift,
}

impl<'a, 'b> Trials<'a, 'b> {
    /// Runs the PID and the N-PID alone.
    ///
    /// # Errors
    /// A PID whose settings are refused, that is stopped, or that oscillates.
    pub(super) fn begin(
        bench: &'a mut Bench<'b>,
        settings: &AxisSettings,
    ) -> Result<Self, VerifyError> {
        let pid = measuring_settings(settings);
        let npid = AxisSettings {
            feedback: settings.feedback.clone(),
            ..pid.clone()
        };
        let (alone, stopped) = bench.try_law("PID", &pid, CHOICE_SINES)?;
        if let Some(stopped) = stopped {
            return Err(stopped.into());
        }
        if let Some(ringing) = alone.rings_alike() {
            return Err(VerifyError::Rings(ringing));
        }
        bench.detects_ringing = false;
        let mut drift = Drift::default();
        note(&mut drift, &alone);
        let mut laws = vec![alone];
        let nonlinear = bench.try_law("N-PID", &npid, CHOICE_SINES);
        laws.extend(nonlinear.ok().map(|found| found.0));
        // Laws are compared as they are at first.
        let mut full = settings.clone();
        let learning = full.feedforward.learning.take().unwrap_or_default();
        Ok(Self {
            bench,
            full,
            learning,
            pid,
            npid,
            laws,
            kinds: Vec::new(),
            jumping: Vec::new(),
            pid_when_small_mm: Vec::new(),
            refused: Vec::new(),
            drift,
        })
    }

    /// Runs every kind of feedforward that was identified on the sines of the comparison.
    pub(super) fn compare_kinds(&mut self) -> Result<(), VerifyError> {
        let mut kinds = Vec::new();
        for kind in KINDS {
            let settings = with_kind(&self.npid, &self.full, kind);
            // A model that was not identified, or that the control rate does not resolve, is refused.
            let law = format!("N-PID + {}", kind.name());
            if let Ok((found, _)) = self.bench.try_law(&law, &settings, COMPARISON_SINES) {
                kinds.push(found);
            }
        }
        self.repeat_pid()?;
        // An axis that the sign of the velocity alone makes jump is not to be given it beside a model with memory.
        let jumps = kinds.iter().any(|law| {
            law.kind() == FeedforwardKind::Static && self.against_pid(law).1 > JUMP_RATIO
        });
        let is_step = |kind| matches!(kind, FeedforwardKind::Combined | FeedforwardKind::Static);
        (self.jumping, self.kinds) = kinds
            .into_iter()
            .partition(|law| jumps && is_step(law.kind()));
        Ok(())
    }

    /// Runs the best kind on all sines by which a law is chosen: over other ranges of pre-sliding displacement; and where it is worse
    /// than the PID anywhere, further kinds, and less of its friction.
    pub(super) fn refine_best_kind(&mut self) -> Result<(), VerifyError> {
        let means = self.kinds.iter().map(|law| self.against_pid(law).1);
        let means: Vec<f64> = means.collect();
        let smallest = means.iter().copied().fold(f64::INFINITY, f64::min);
        let best = means
            .iter()
            .position(|mean| *mean <= EQUAL_ERROR_RATIO * smallest);
        let Some(index) = best else {
            return Ok(());
        };
        let whole = self.best_range(index);
        let worst = self.against_pid(&whole).0;
        let (law, settings) = (whole.law.clone(), whole.settings.clone());
        self.laws.push(whole);
        let worst = self.try_other_kinds(worst);
        if worst > MAX_SCATTER_RATIO {
            self.try_shares(&law, &settings);
        }
        self.repeat_pid()
    }

    /// A kind over its best range of pre-sliding displacement, on all sines by which a law is chosen.
    fn best_range(&mut self, index: usize) -> LawResult {
        let mut compared = self.kinds.remove(index);
        let mut stretched = self.stretched(&compared);
        self.bench.run_on(&mut stretched, CHOICE_SINES);
        if stretched.law == compared.law {
            return stretched;
        }
        // One over another range that is stopped on a further sine goes back to the range that was measured.
        if stretched.stopped.is_some() {
            self.laws.push(stretched);
            self.bench.run_on(&mut compared, CHOICE_SINES);
            return compared;
        }
        self.kinds.push(compared);
        stretched
    }

    /// The law over the range of pre-sliding displacement that leaves the least error on the sines that it ran on: farther ones first,
    /// shorter ones where the first of those is no better.
    fn stretched(&mut self, law: &LawResult) -> LawResult {
        let mut best = law.clone();
        let mut error = self.against_pid(law).1;
        for step in [STRETCH_RATIO, 1.0 / STRETCH_RATIO] {
            let before = error;
            for count in 1..=MAX_STRETCHES {
                if error < MIN_REFIT_RATIO {
                    break;
                }
                let factor = step.powi(i32::from(count));
                let name = format!("{} over {factor:.2} x the range", law.law);
                let settings = over_range(&law.settings, factor);
                // A spring that is refused ends it as well.
                let Ok((found, _)) = self.bench.try_law(&name, &settings, COMPARISON_SINES) else {
                    break;
                };
                let found_error = self.against_pid(&found).1;
                if found_error >= MAX_STRETCH_ERROR_RATIO * error {
                    break;
                }
                (best, error) = (found, found_error);
            }
            if error < before {
                break;
            }
        }
        best
    }

    /// Runs further kinds while the last one is worse than the PID anywhere: another may be better on the sines that it was not
    /// compared on. The largest error of the last one over the PID's.
    fn try_other_kinds(&mut self, mut worst: f64) -> f64 {
        let (pid, drift) = (&self.laws[0], &self.drift);
        self.kinds.sort_by(|a, b| {
            let mean = |law: &LawResult| law.against(pid, drift).1;
            mean(a).total_cmp(&mean(b))
        });
        for _ in 0..OTHER_KINDS.min(self.kinds.len()) {
            let (worst_so_far, mean_so_far) = self.against_pid(&self.kinds[0]);
            if worst <= MAX_SCATTER_RATIO || worst_so_far > MAX_SCATTER_RATIO || mean_so_far >= 1.0
            {
                break;
            }
            let mut other = self.kinds.remove(0);
            self.bench.run_on(&mut other, CHOICE_SINES);
            worst = self.against_pid(&other).0;
            self.laws.push(other);
        }
        worst
    }

    /// Runs shares of a law's friction, until one is worse than the PID on no sine.
    fn try_shares(&mut self, law: &str, settings: &AxisSettings) {
        for share in SHARES {
            let law = format!("{law} x {share:.2}");
            let settings = with_friction(settings, share);
            let Ok((mut found, _)) = self.bench.try_law(&law, &settings, CHOICE_SINES) else {
                continue;
            };
            found.is_share = true;
            let is_worse = self.against_pid(&found).0 > found.most_worse();
            self.laws.push(found);
            if !is_worse {
                break;
            }
        }
    }

    /// Runs the best law with as much of its friction as its errors ask for: what was measured early or slowly may differ by a scale
    /// from the friction on the sines.
    pub(super) fn rescale(&mut self) -> Result<(), VerifyError> {
        let best = &self.laws[self.better_than_pid().first().copied().unwrap_or(0)];
        let without = self
            .laws
            .iter()
            .find(|law| !law.feeds_forward() && law.settings.feedback == best.settings.feedback);
        let scale = without.map_or(1.0, |without| best.best_scale(without, &self.drift));
        if (scale - 1.0).abs() <= LEAST_CORRECTION {
            return Ok(());
        }
        let settings = with_friction(&best.settings, scale);
        let law = format!("{} x {scale:.2}", best.law);
        let is_share = best.is_share;
        if let Ok((scaled, _)) = self.bench.try_law(&law, &settings, CHOICE_SINES) {
            self.repeat_pid()?;
            self.laws.push(LawResult { is_share, ..scaled });
        }
        Ok(())
    }

    /// Index of the law that is worse than the PID on no sine, the withheld ones included; the PID's if there is none.
    pub(super) fn confirm(&mut self) -> Result<usize, VerifyError> {
        let mut chosen = self.withheld(1)?;
        if chosen == 0 {
            chosen = self.instead()?;
        }
        if chosen == 0 && self.npid.feedback != self.pid.feedback {
            chosen = self.without_nonlinear_gain()?;
        }
        if chosen == 0 {
            chosen = self.when_fast()?;
        }
        Ok(chosen)
    }

    /// The result, with the law of an index.
    pub(super) fn ended(mut self, chosen: usize) -> Verification {
        // The others are shown, too, after those that ran on every sine.
        self.laws.append(&mut self.kinds);
        self.laws.append(&mut self.jumping);
        Verification {
            sines: self.bench.sines.to_vec(),
            laws: self.laws,
            chosen,
            refused: self.refused,
            drift: self.drift,
        }
    }

    /// Runs the PID on the first sine once more: its error shows how the axis changes.
    fn repeat_pid(&mut self) -> Result<(), VerifyError> {
        let (pid, _) = self.bench.try_law(REPEATED_PID, &self.pid, 1)?;
        note(&mut self.drift, &pid);
        Ok(())
    }

    /// The errors of a law over the PID's: the largest of all ratios, and their geometric mean.
    pub(super) fn against_pid(&self, law: &LawResult) -> (f64, f64) {
        law.against(&self.laws[0], &self.drift)
    }

    /// The laws that are better than the PID, the first of them, by their indices: the best first.
    fn better_than_pid(&self) -> Vec<usize> {
        let mean = |index: &usize| self.against_pid(&self.laws[*index]).1;
        let mut better: Vec<usize> = (1..self.laws.len())
            .filter(|&index| self.laws[index].is_better_than(&self.laws[0], &self.drift))
            .collect();
        better.sort_by(|a, b| mean(a).total_cmp(&mean(b)));
        better
    }

    /// The law that is chosen where the withheld sines refuse all that were better on the others: another kind, or a share of the
    /// best one's friction. Laws that ran are added.
    fn instead(&mut self) -> Result<usize, VerifyError> {
        let best = self.laws[1..].iter().rfind(|law| {
            let ran = law.scores.len() + usize::from(law.stopped.is_some());
            law.feeds_forward() && !law.is_share && ran > CHOICE_SINES
        });
        let Some(best) = best else {
            return Ok(0);
        };
        let (name, settings) = (best.law.clone(), best.settings.clone());
        let (others, left) = std::mem::take(&mut self.kinds)
            .into_iter()
            .partition(|law| {
                let (worst, mean) = self.against_pid(law);
                worst <= MAX_SCATTER_RATIO && mean <= MAX_ERROR_RATIO
            });
        self.kinds = left;
        let others: Vec<LawResult> = others;
        for mut other in others {
            self.bench.run_on(&mut other, CHOICE_SINES);
            let found = self.add_and_judge(other)?;
            if found != 0 {
                return Ok(found);
            }
        }
        for share in SHARES {
            let name = format!("{name} x {share:.2}");
            let settings = with_friction(&settings, share);
            let Ok((mut found, _)) = self.bench.try_law(&name, &settings, CHOICE_SINES) else {
                continue;
            };
            found.is_share = true;
            let found = self.add_and_judge(found)?;
            if found != 0 {
                return Ok(found);
            }
        }
        Ok(0)
    }

    /// Adds a law that ran; its index if it is chosen, else the PID's.
    fn add_and_judge(&mut self, law: LawResult) -> Result<usize, VerifyError> {
        let from = self.laws.len();
        self.laws.push(law);
        self.withheld(from)
    }

    /// The law that is chosen where all with the nonlinear gain were refused: that is an addition, too, and noise or play may make it
    /// worse than the PID. What was not much worse is tried without it. Laws that ran are added.
    fn without_nonlinear_gain(&mut self) -> Result<usize, VerifyError> {
        let hopeful = self.laws.iter().filter(|law| {
            let (worst, mean) = self.against_pid(law);
            let ran = law.scores.len() >= CHOICE_SINES;
            law.feeds_forward() && ran && worst <= MAX_RETRY_RATIO && mean <= MAX_ERROR_RATIO
        });
        let linear: Vec<_> = hopeful
            .map(|law| {
                let settings = AxisSettings {
                    feedback: self.pid.feedback.clone(),
                    ..law.settings.clone()
                };
                (law.law.replacen("N-PID", "PID", 1), settings, law.is_share)
            })
            .collect();
        let from = self.laws.len();
        for (name, settings, is_share) in linear {
            if let Ok((found, _)) = self.bench.try_law(&name, &settings, CHOICE_SINES) {
                self.laws.push(LawResult { is_share, ..found });
            }
        }
        self.withheld(from)
    }

    /// The index of the chosen law, of those from one on: the best that is worse than the PID, the first of all, on none of
    /// the sines that were withheld either; the PID if there is none.
    fn withheld(&mut self, from: usize) -> Result<usize, VerifyError> {
        let mut better = self.better_than_pid();
        better.retain(|index| *index >= from);
        if better.is_empty() {
            return Ok(0);
        }
        if let Some(stopped) = self.bench.run_on(&mut self.laws[0], self.bench.sines.len()) {
            return Err(stopped.into());
        }
        for index in better.into_iter().take(MAX_CANDIDATES) {
            self.bench
                .run_on(&mut self.laws[index], self.bench.sines.len());
            let (law, pid) = (&self.laws[index], &self.laws[0]);
            if law.is_better_than(pid, &self.drift) && law.keeps_clear_of(pid, &self.drift) {
                return Ok(index);
            }
        }
        Ok(0)
    }
}

/// Takes a run of the PID on the first sine into account.
fn note(drift: &mut Drift, pid: &LawResult) {
    if let (Some(score), Some(at_s)) = (pid.scores.first(), pid.at_s.first()) {
        drift.note(*at_s, score.rms_mm);
    }
}
