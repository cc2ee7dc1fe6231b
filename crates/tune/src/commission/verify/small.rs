//! Small slow motions: the chosen law is not to be worse than the PID there either.

use std::ops::Range;

use quadrant_settings::AxisSettings;

use super::VerifyError;
use super::law_result::LawResult;
use super::small_motions::{FROM_MM_S, MARGIN_MOTIONS, SHORT_MOTIONS, SmallMotion};
use super::trials::Trials;
use super::variants::with_friction;

/// Largest excess of a largest error over the PID's that counts as none, counts: one, by which that of an axis that sticks scatters, and
/// what rounding adds.
const MAX_EXCESS_COUNTS: f64 = 1.1;
/// The same over the PID's error.
const MAX_EXCESS_RATIO: f64 = 1.02;

/// Factor on the friction fed forward with which a law is not to be worse either, on the short sines: friction falls by as much where an
/// axis warms, or its lubricant spreads.
const MARGIN: f64 = 1.15;

/// A law that was worse than the PID on a small slow motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Its name.
    pub law: String,
    /// Factor on its friction with which it was.
    pub factor: f64,
    /// The sine on which it was worse; none where it was stopped.
    pub worse: Option<Worse>,
}

/// Errors on a sine on which a law is worse than the PID.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worse {
    /// The motion.
    pub motion: SmallMotion,
    /// Largest error of the law, mm.
    pub largest_mm: f64,
    /// Largest error of the PID, mm.
    pub pid_mm: f64,
}

impl Worse {
    fn ratio(&self) -> f64 {
        self.largest_mm / self.pid_mm
    }
}

/// Error over the PID's on a small motion from which on a law that no remedy mends is not chosen, whatever it gains on others.
const FAR_RATIO: f64 = 1.5;
/// Least excess of such an error over the PID's, counts.
const FAR_COUNTS: f64 = 5.0;

impl Trials<'_, '_> {
    /// Largest errors of a law on the small motions, mm; none if one exceeds the PID's by far, or the law is stopped.
    pub(super) fn errors_unless_far(
        &mut self,
        law: &mut LawResult,
    ) -> Result<Option<Vec<f64>>, VerifyError> {
        if law.stopped.is_some() {
            return Ok(None);
        }
        let motions = self.bench.small_motions;
        self.run_pid_when_small(motions.len())?;
        let settings = law.settings.clone();
        let least_mm = FAR_COUNTS * settings.encoder.resolution_mm;
        let pid_when_small_mm = &self.pid_when_small_mm;
        let differs = motions
            .iter()
            .map(|motion| !self.is_pid_on(&settings, *motion));
        let differs: Vec<bool> = differs.collect();
        let is_far = |index: usize, own_mm: f64| {
            let pid_mm = pid_when_small_mm.get(index).filter(|_| differs[index]);
            pid_mm.is_some_and(|pid_mm| own_mm > FAR_RATIO * pid_mm && own_mm - pid_mm > least_mm)
        };
        match self.bench.run_small(law, &settings, motions, is_far) {
            Err(_) if law.stopped.is_some() => Ok(None),
            outcome => {
                let errors_mm = outcome?;
                let mut each = errors_mm.iter().enumerate();
                let is_any_far = each.any(|(index, own_mm)| is_far(index, *own_mm));
                Ok((!is_any_far).then_some(errors_mm))
            }
        }
    }

    /// The motion on which errors that were measured on all small ones are worst beside the PID's, if they are worse on any.
    pub(super) fn worst_when_small(
        &self,
        settings: &AxisSettings,
        errors_mm: &[f64],
    ) -> Option<Worse> {
        let count_mm = self.pid.encoder.resolution_mm;
        let pairs = errors_mm.iter().zip(&self.pid_when_small_mm);
        let worse = self.bench.small_motions.iter().zip(pairs);
        worse
            .map(|(motion, (largest_mm, pid_mm))| Worse {
                motion: *motion,
                largest_mm: *largest_mm,
                pid_mm: *pid_mm,
            })
            .filter(|it| {
                is_worse(it.largest_mm, it.pid_mm, count_mm) && !self.is_pid_on(settings, it.motion)
            })
            .max_by(|a, b| a.ratio().total_cmp(&b.ratio()))
    }

    /// Runs a law on all small motions, unless it is stopped: its largest errors, mm.
    fn errors_when_small(&mut self, law: &mut LawResult) -> Result<Vec<f64>, VerifyError> {
        let (settings, motions) = (law.settings.clone(), self.bench.small_motions);
        match self.bench.run_small(law, &settings, motions, |_, _| false) {
            Err(_) if law.stopped.is_some() => Ok(Vec::new()),
            outcome => outcome,
        }
    }

    /// Runs the PID on the first small motions, as far as it has not run on them.
    fn run_pid_when_small(&mut self, count: usize) -> Result<(), VerifyError> {
        let (pid, motions) = (&mut self.laws[0], self.bench.small_motions);
        if let Some(further) = motions.get(self.pid_when_small_mm.len()..count) {
            let scores = self
                .bench
                .run_small(pid, &self.pid, further, |_, _| false)?;
            self.pid_when_small_mm.extend(scores);
        }
        Ok(())
    }

    /// True of settings that are the PID's on a motion: what differs is chance.
    pub(super) fn is_pid_on(&self, settings: &AxisSettings, motion: SmallMotion) -> bool {
        let (stroke_mm, velocity_mm_s) = (motion.stroke_mm(), motion.velocity_mm_s());
        let (is_linear, fed) = (
            settings.feedback == self.pid.feedback,
            &settings.feedforward,
        );
        is_linear && (velocity_mm_s <= fed.from_mm_s || stroke_mm < fed.from_mm)
    }

    /// True if a law's largest error on any small motion exceeds both the PID's and that of another one by more than chance, or it is stopped.
    pub(super) fn exceeds_when_small(
        &mut self,
        law: &mut LawResult,
        other: &LawResult,
    ) -> Result<bool, VerifyError> {
        self.run_pid_when_small(self.bench.small_motions.len())?;
        let others = self.errors_when_small(&mut other.clone())?;
        let own = self.errors_when_small(law)?;
        let count_mm = law.settings.encoder.resolution_mm;
        let exceeds = own.iter().enumerate().any(|(index, own_mm)| {
            [&self.pid_when_small_mm, &others]
                .into_iter()
                .all(|bounds| {
                    let bound_mm = bounds.get(index);
                    bound_mm.is_none_or(|bound_mm| is_worse(*own_mm, *bound_mm, count_mm))
                })
        });
        Ok(law.stopped.is_some() || exceeds)
    }

    /// Runs a law on the small motions; true if it is worse than the PID on one, at which it ends, or is stopped. On the first ones it also
    /// runs with too much of its friction. What is refused is added to those that were.
    pub(super) fn refuses_when_small(&mut self, law: &mut LawResult) -> Result<bool, VerifyError> {
        let feeds = law.feeds_forward() && law.settings.feedforward.from_mm_s < FROM_MM_S;
        let margin = if feeds { MARGIN_MOTIONS } else { 0 };
        let all = self.bench.small_motions.len();
        for (factor, range) in [
            (1.0, 0..SHORT_MOTIONS),
            (MARGIN, 0..margin),
            (1.0, SHORT_MOTIONS..all),
        ] {
            let worse = self.run_small(law, factor, range)?;
            if worse.is_some() || law.stopped.is_some() {
                self.refused.push(Refused {
                    law: law.law.clone(),
                    factor,
                    worse,
                });
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Runs a law with a factor on its friction on some small motions, but for those on which it is the PID, until it is worse than the PID on
    /// one: that.
    fn run_small(
        &mut self,
        law: &mut LawResult,
        factor: f64,
        range: Range<usize>,
    ) -> Result<Option<Worse>, VerifyError> {
        let all = self.bench.small_motions;
        let end = range.end;
        let differs = |index: &usize| !self.is_pid_on(&law.settings, all[*index]);
        let indices: Vec<usize> = range.filter(differs).collect();
        if law.stopped.is_some() || indices.is_empty() {
            return Ok(None);
        }
        self.run_pid_when_small(end)?;
        let motions: Vec<SmallMotion> = indices.iter().map(|&index| all[index]).collect();
        let settings = with_friction(&law.settings, factor);
        let count_mm = settings.encoder.resolution_mm;
        let pid_when_small_mm = &self.pid_when_small_mm;
        let worse = |at: usize, largest_mm: f64| {
            let pid_mm = *pid_when_small_mm.get(indices[at])?;
            is_worse(largest_mm, pid_mm, count_mm).then_some(Worse {
                motion: motions[at],
                largest_mm,
                pid_mm,
            })
        };
        let enough = |at: usize, largest_mm: f64| worse(at, largest_mm).is_some();
        let Ok(errors_mm) = self.bench.run_small(law, &settings, &motions, enough) else {
            // More friction may make a model too stiff for the control rate: it has no margin to be tried.
            return Ok(None);
        };
        let last = errors_mm.len().checked_sub(1);
        Ok(last.and_then(|at| worse(at, errors_mm[at])))
    }
}

/// True if a largest error exceeds the PID's by more than chance.
fn is_worse(own_mm: f64, pid_mm: f64, count_mm: f64) -> bool {
    own_mm - pid_mm > MAX_EXCESS_COUNTS * count_mm && own_mm > MAX_EXCESS_RATIO * pid_mm
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_law_is_worse_where_its_largest_error_exceeds_the_pids_by_more_than_a_count_and_a_fiftieth()
    {
        assert!(!is_worse(41e-3, 40e-3, 1e-3));
        assert!(is_worse(41.2e-3, 40e-3, 1e-3));
        assert!(!is_worse(71.3e-3, 70e-3, 1e-3));
        assert!(is_worse(71.5e-3, 70e-3, 1e-3));
    }
}
