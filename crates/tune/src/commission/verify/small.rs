//! Small slow motions: the chosen law is not to be worse than the PID there either, if less of it is not.
//!
//! The level of friction that is fed forward at the slow speed of the reference is more than a table needs once it breaks away. What is
//! left over, divided by the stiffness of a soft loop, throws the axis; and one that noise shakes meets hardly any friction when slow. There
//! none is fed forward on slow motions. Where strokes are so short that the PID sticks, it leaves no more than a stroke, and what friction
//! is fed forward has to be exact to gain anything: there none is, if that is the harm.

use quadrant_settings::AxisSettings;
use quadrant_sim::metrics::Score;
use quadrant_sim::sine_test::SineTest;

use super::VerifyError;
use super::law_result::{LawResult, MAX_ERROR_RATIO, MAX_SCATTER_RATIO};
use super::sines::{MARGIN_SINES, SmallSine};
use super::trials::Trials;
use super::variants::{feeding_beyond, feeding_from, with_friction};

/// Largest excess of a largest error over the PID's that counts as none, counts: one, by which that of an axis that sticks scatters, and
/// what rounding adds.
const MAX_EXCESS_COUNTS: f64 = 1.1;

/// Factor on the friction fed forward with which a law is not to be worse either, on the short sines: friction falls by as much where an
/// axis warms, or its lubricant spreads.
const MARGIN: f64 = 1.15;

/// A law that was worse than the PID on a small slow sine.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Its name.
    pub law: String,
    /// Factor on its friction with which it was.
    pub factor: f64,
    /// The sine on which it was worse; none where it was stopped.
    pub worse: Option<WorseSine>,
}

/// Errors on a sine on which a law is worse than the PID.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorseSine {
    /// The sine.
    pub sine: SineTest,
    /// Largest error of the law, mm.
    pub largest_mm: f64,
    /// Largest error of the PID, mm.
    pub pid_mm: f64,
}

/// Change of a law that is worse than the PID on small slow motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Remedy {
    /// No friction fed forward on motions up to a velocity, mm/s.
    From(f64),
    /// The same without the nonlinear gain: on such motions it is the PID.
    LinearFrom(f64),
}

/// Remedies in the order in which they are tried: the first that is not worse than the PID on any sine is chosen.
pub(super) const REMEDIES: [Remedy; 4] = [
    Remedy::From(0.4),
    Remedy::From(0.8),
    Remedy::From(FROM_MM_S),
    Remedy::LinearFrom(FROM_MM_S),
];

/// Largest error over the PID's on a usual sine up to which a remedy is chosen where there is no better one: that of an axis that sticks
/// scatters by more than [`MAX_SCATTER_RATIO`].
const MAX_REMEDY_RATIO: f64 = 1.1;
/// Error over the PID's on a small sine from which on a law that no remedy mends is not chosen, whatever it gains on others.
const FAR_RATIO: f64 = 1.5;
/// Least excess of such an error over the PID's, counts.
const FAR_COUNTS: f64 = 5.0;

/// Longest stroke up to which no friction is fed forward, over that of the sine on which it was worse.
const STROKE_ROOM: f64 = 1.1;
/// Longest stroke up to which no friction is fed forward, mm: less friction is the remedy of what is worse on longer ones.
const MOST_STROKE_MM: f64 = 0.12;
/// Part of such a law's name before the length.
const STROKES: &str = ", strokes from ";

/// Velocity that no small slow sine exceeds, mm/s.
const FROM_MM_S: f64 = 1.6;

impl Remedy {
    /// The changed law, its name and settings; none where it changes nothing that the one before has not. `pid`: the PID alone.
    fn of(self, law: &LawResult, pid: &AxisSettings) -> Option<(String, AxisSettings)> {
        let name = &law.law;
        Some(match self {
            Self::From(from_mm_s) => (
                format!("{name}, from {from_mm_s} mm/s"),
                feeding_from(&law.settings, from_mm_s),
            ),
            Self::LinearFrom(_) if law.settings.feedback == pid.feedback => return None,
            Self::LinearFrom(from_mm_s) => (
                format!(
                    "{}, from {from_mm_s} mm/s",
                    name.replacen("N-PID", "PID", 1)
                ),
                AxisSettings {
                    feedback: pid.feedback.clone(),
                    ..feeding_from(&law.settings, from_mm_s)
                },
            ),
        })
    }
}

impl Trials<'_, '_> {
    /// The chosen law's index where it is not worse than the PID on small slow sines, else that of one with less friction, or of that which
    /// is least worse on the usual sines. Where there is none, the chosen one stays, among those that were refused; but for one that was
    /// stopped there, that feeds nothing forward, or that is far worse: the PID's, then. Laws that ran on the usual sines are added.
    pub(super) fn keep_small(&mut self, chosen: usize) -> Result<usize, VerifyError> {
        if chosen == 0 {
            return Ok(0);
        }
        let (pid, sines) = (&mut self.laws[0], self.bench.small_sines);
        self.pid_when_small = self.bench.run_small(pid, &self.pid, sines, |_, _| false)?;
        let mut law = self.laws[chosen].clone();
        if !self.refuses_when_small(&mut law) {
            return Ok(chosen);
        }
        self.laws[chosen] = law.clone();
        if !law.feeds_forward() {
            return Ok(0);
        }
        while let Some(mut beyond) = self.beyond_refused_stroke(&law) {
            if !self.refuses_when_small(&mut beyond) {
                self.laws.push(beyond);
                return Ok(self.laws.len() - 1);
            }
            law = beyond;
        }
        let mut worse = Vec::new();
        for remedy in REMEDIES {
            match self.try_remedy(remedy, &law)? {
                Some((found, worst)) if worst <= MAX_SCATTER_RATIO => return Ok(found),
                Some((found, worst)) if worst < MAX_REMEDY_RATIO => worse.push((found, worst)),
                _ => {}
            }
        }
        if let Some((found, _)) = worse.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)) {
            return Ok(found);
        }
        let is_far_worse = self.is_far_worse_when_small(chosen)?;
        Ok(if is_far_worse { 0 } else { chosen })
    }

    /// True if a law's largest error on any small sine exceeds the PID's by far, or it is stopped.
    fn is_far_worse_when_small(&mut self, index: usize) -> Result<bool, VerifyError> {
        let mut law = self.laws[index].clone();
        if law.stopped.is_some() {
            return Ok(true);
        }
        let scores = self.scores_when_small(&mut law)?;
        let least_mm = FAR_COUNTS * law.settings.encoder.resolution_mm;
        let is_far = |(own, pid): (&Score, &Score)| {
            own.largest_mm > FAR_RATIO * pid.largest_mm
                && own.largest_mm - pid.largest_mm > least_mm
        };
        let is_far = scores.iter().zip(&self.pid_when_small).any(is_far);
        self.laws[index] = law;
        Ok(self.laws[index].stopped.is_some() || is_far)
    }

    /// Runs a law on all small sines, unless it is stopped: its scores.
    fn scores_when_small(&mut self, law: &mut LawResult) -> Result<Vec<Score>, VerifyError> {
        let (settings, sines) = (law.settings.clone(), self.bench.small_sines);
        self.bench.run_small(law, &settings, sines, |_, _| false)
    }

    /// True if a law's largest error on any small sine exceeds both the PID's and that of another one by more than chance, or it is stopped.
    pub(super) fn exceeds_when_small(
        &mut self,
        law: &mut LawResult,
        other: &LawResult,
    ) -> Result<bool, VerifyError> {
        let others = self.scores_when_small(&mut other.clone())?;
        let own = self.scores_when_small(law)?;
        let count_mm = law.settings.encoder.resolution_mm;
        let exceeds = own.iter().enumerate().any(|(index, own)| {
            [&self.pid_when_small, &others].into_iter().all(|bounds| {
                let bound = bounds.get(index);
                bound.is_none_or(|bound| is_worse(own, bound, count_mm))
            })
        });
        Ok(law.stopped.is_some() || exceeds)
    }

    /// A law that feeds friction forward beyond the stroke on which it was refused, where that is a short one, and the usual sines are so much
    /// longer that it does on them what it did.
    fn beyond_refused_stroke(&self, law: &LawResult) -> Option<LawResult> {
        let sine = self.refused.last()?.worse?.sine;
        let from_mm = STROKE_ROOM * 2.0 * sine.amplitude_mm;
        let is_longer = |usual: &SineTest| usual.amplitude_mm >= from_mm;
        let tries = from_mm > law.settings.feedforward.from_mm
            && from_mm <= MOST_STROKE_MM
            && self.bench.sines.iter().all(is_longer);
        let whole = law.law.split(STROKES).next()?;
        tries.then(|| LawResult {
            law: format!("{whole}{STROKES}{from_mm:.3} mm on"),
            settings: feeding_beyond(&law.settings, from_mm),
            ..law.clone()
        })
    }

    /// Runs a changed law: its index, and the largest of its errors over the PID's on the usual sines; none if it is worse than the PID
    /// when small, or gains too little on the mean.
    fn try_remedy(
        &mut self,
        remedy: Remedy,
        law: &LawResult,
    ) -> Result<Option<(usize, f64)>, VerifyError> {
        let Some((name, settings)) = remedy.of(law, &self.pid) else {
            return Ok(None);
        };
        let Ok((mut found, _)) = self.bench.try_law(&name, &settings, 0) else {
            return Ok(None);
        };
        let from_mm_s = settings.feedforward.from_mm_s;
        let is_linear = settings.feedback == self.pid.feedback;
        let is_pid = |sine: &SineTest| is_linear && sine.velocity_mm_s <= from_mm_s;
        // What differs there is chance.
        let same = self
            .bench
            .small_sines
            .iter()
            .all(|small| is_pid(&small.sine));
        let refused = self.refuses_when_small(&mut found);
        if found.stopped.is_some() || refused && !same {
            return Ok(None);
        }
        // The whole of it was judged on these sines before, and part of it need not keep clear of the PID by as much.
        let all = self.bench.sines.len();
        self.bench.run_on(&mut found, all);
        let differing: Vec<usize> = (0..all)
            .filter(|&index| !is_pid(&self.bench.sines[index]))
            .collect();
        let (worst, _) = found
            .only(&differing)
            .against(&self.laws[0].only(&differing), &self.drift);
        let (_, mean) = self.against_pid(&found);
        self.laws.push(found);
        Ok((mean <= MAX_ERROR_RATIO).then_some((self.laws.len() - 1, worst)))
    }

    /// Runs a law on the small sines; true if it is worse than the PID on one, at which it ends, or is stopped. One that is worse on none
    /// runs on the short ones again, with too much of its friction. What is refused is added to those that were.
    pub(super) fn refuses_when_small(&mut self, law: &mut LawResult) -> bool {
        let sines = self.bench.small_sines;
        let feeds = law.feeds_forward() && law.settings.feedforward.from_mm_s < FROM_MM_S;
        let margin = feeds.then_some((MARGIN, &sines[..MARGIN_SINES]));
        for (factor, sines) in [(1.0, sines)].into_iter().chain(margin) {
            let worse = self.run_small(law, factor, sines);
            if worse.is_some() || law.stopped.is_some() {
                self.refused.push(Refused {
                    law: law.law.clone(),
                    factor,
                    worse,
                });
                return true;
            }
        }
        false
    }

    /// Runs a law with a factor on its friction on small sines, until it is worse than the PID on one: that.
    fn run_small(
        &mut self,
        law: &mut LawResult,
        factor: f64,
        sines: &[SmallSine],
    ) -> Option<WorseSine> {
        if law.stopped.is_some() {
            return None;
        }
        let settings = with_friction(&law.settings, factor);
        let count_mm = settings.encoder.resolution_mm;
        let pid = &self.pid_when_small;
        let worse = |index: usize, own: &Score| {
            let pid = pid.get(index)?;
            is_worse(own, pid, count_mm).then_some(WorseSine {
                sine: sines[index].sine,
                largest_mm: own.largest_mm,
                pid_mm: pid.largest_mm,
            })
        };
        let enough = |index: usize, own: &Score| worse(index, own).is_some();
        // More friction may make a model too stiff for the control rate: it has no margin to be tried.
        let scores = self.bench.run_small(law, &settings, sines, enough).ok()?;
        worse(scores.len().checked_sub(1)?, scores.last()?)
    }
}

/// True if a largest error exceeds the PID's by more than chance.
fn is_worse(own: &Score, pid: &Score, count_mm: f64) -> bool {
    own.largest_mm - pid.largest_mm > MAX_EXCESS_COUNTS * count_mm
}

#[cfg(test)]
mod tests {
    use quadrant_settings::{FeedbackSettings, StageSettings};

    use super::*;
    use crate::record::Recording;

    #[test]
    fn a_law_is_worse_where_its_largest_error_exceeds_the_pids_by_more_than_a_count() {
        let score = |counts: f64| Score {
            largest_mm: 1e-3 * counts,
            rms_mm: 0.0,
            glitch_mm: 0.0,
        };
        assert!(!is_worse(&score(41.0), &score(40.0), 1e-3));
        assert!(is_worse(&score(41.2), &score(40.0), 1e-3));
    }

    #[test]
    fn each_remedy_feeds_less_friction_forward_when_slow_and_as_much_when_fast() {
        let law = LawResult {
            law: "a law".to_owned(),
            scores: Vec::new(),
            recording: Recording::default(),
            stopped: None,
            rings: Vec::new(),
            is_share: false,
            at_s: Vec::new(),
            settings: StageSettings::simulated().axes[0].clone(),
        };
        let pid = AxisSettings {
            feedback: FeedbackSettings {
                nonlinear: None,
                ..law.settings.feedback.clone()
            },
            ..law.settings.clone()
        };
        for remedy in REMEDIES {
            let (name, settings) = remedy.of(&law, &pid).unwrap();
            assert!(settings.feedforward.from_mm_s >= 0.4, "{name}");
            assert_eq!(settings.friction, law.settings.friction);
            assert_eq!(settings.feedforward.gains, law.settings.feedforward.gains);
        }
        let linear = LawResult {
            settings: pid.clone(),
            ..law
        };
        assert_eq!(Remedy::LinearFrom(1.6).of(&linear, &pid), None);
    }
}
