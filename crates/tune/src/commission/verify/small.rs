//! Small slow motions: the chosen law is not to be worse than the PID there either, if less of it is not.
//!
//! The level of friction that is fed forward at the slow speed of the reference is more than a table needs once it breaks away. What is
//! left over, divided by the stiffness of a soft loop, throws the axis. The same level at every speed, below what sliding keeps, takes the
//! throw away and loses least on other motions. Where it is not enough, or an axis that noise shakes meets hardly any friction when slow,
//! none is fed forward on slow motions.

use quadrant_settings::AxisSettings;
use quadrant_sim::sine_test::SineTest;

use super::VerifyError;
use super::law_result::{LawResult, MAX_ERROR_RATIO, MAX_SCATTER_RATIO};
use super::sines::{CHOICE_SINES, SmallSine};
use super::trials::Trials;
use super::variants::{feeding_from, flattened};

/// Largest excess of a largest error over the PID's that counts as none, counts: one, by which that of an axis that sticks scatters, and
/// what rounding adds.
const MAX_EXCESS_COUNTS: f64 = 1.1;

/// A law that was worse than the PID on a small slow sine.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Its name.
    pub law: String,
    /// The sine on which it was worst; none where it was stopped.
    pub worst: Option<WorseSine>,
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
    /// A level that no speed changes: this share of the lower one of the Coulomb and the breakaway level.
    Flat(f64),
    /// No friction fed forward on motions up to a velocity, mm/s.
    From(f64),
    /// The same without the nonlinear gain: on such motions it is the PID.
    LinearFrom(f64),
}

/// Remedies in the order in which they are tried: the first that is not worse than the PID on any sine is chosen. On random axes a flat level
/// of 0.9 lost least where the table was thrown.
pub(super) const REMEDIES: [Remedy; 4] = [
    Remedy::Flat(0.9),
    Remedy::From(0.4),
    Remedy::From(FROM_MM_S),
    Remedy::LinearFrom(FROM_MM_S),
];

/// Velocity that no small slow sine exceeds, mm/s.
const FROM_MM_S: f64 = 1.6;

impl Remedy {
    /// The changed law, its name and settings; none where it changes nothing that the one before has not. `pid`: the PID alone.
    fn of(self, law: &LawResult, pid: &AxisSettings) -> Option<(String, AxisSettings)> {
        let name = &law.law;
        Some(match self {
            Self::Flat(share) => (
                format!("{name}, level x {share:.2} at any speed"),
                flattened(&law.settings, share),
            ),
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
    /// The chosen law's index where it is not worse than the PID on small slow sines, else that of one with less friction. Where all of
    /// those are worse, too, the chosen one stays, among those that were refused; but for one that was stopped there, or that feeds
    /// nothing forward: the PID's, then. Laws that ran on the usual sines are added.
    pub(super) fn keep_small(&mut self, chosen: usize) -> Result<usize, VerifyError> {
        if chosen == 0 {
            return Ok(0);
        }
        self.bench.run_small(&mut self.laws[0])?;
        // One that is stopped is refused.
        let _ = self.bench.run_small(&mut self.laws[chosen]);
        let law = self.laws[chosen].clone();
        if !self.refuses_when_small(&law) {
            return Ok(chosen);
        }
        if !law.feeds_forward() {
            return Ok(0);
        }
        for remedy in REMEDIES {
            let found = self.try_remedy(remedy, &law)?;
            if found != 0 {
                return Ok(found);
            }
        }
        Ok(if law.stopped.is_some() { 0 } else { chosen })
    }

    /// Runs a changed law; its index if it is chosen, else the PID's.
    fn try_remedy(&mut self, remedy: Remedy, law: &LawResult) -> Result<usize, VerifyError> {
        let Some((name, settings)) = remedy.of(law, &self.pid) else {
            return Ok(0);
        };
        let Ok((mut found, _)) = self.bench.try_law(&name, &settings, 0) else {
            return Ok(0);
        };
        if self.bench.run_small(&mut found).is_err() {
            return Ok(0);
        }
        let from_mm_s = settings.feedforward.from_mm_s;
        let is_linear = settings.feedback == self.pid.feedback;
        let is_pid = |sine: &SineTest| is_linear && sine.velocity_mm_s <= from_mm_s;
        // What differs there is chance.
        let same = self
            .bench
            .small_sines
            .iter()
            .all(|small| is_pid(&small.sine));
        if !same && self.refuses_when_small(&found) {
            return Ok(0);
        }
        if from_mm_s == 0.0 {
            found.is_share = true;
            self.bench.run_on(&mut found, CHOICE_SINES);
            return self.add_and_judge(found);
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
        Ok(if worst <= MAX_SCATTER_RATIO && mean <= MAX_ERROR_RATIO {
            self.laws.len() - 1
        } else {
            0
        })
    }

    /// True if a law that ran on the small sines is worse than the PID there; it is added to those that were refused.
    pub(super) fn refuses_when_small(&mut self, law: &LawResult) -> bool {
        let worst = worst_when_small(law, &self.laws[0], self.bench.small_sines);
        let is_refused = worst.is_some() || law.stopped.is_some();
        if is_refused {
            self.refused.push(Refused {
                law: law.law.clone(),
                worst,
            });
        }
        is_refused
    }
}

/// The small sine on which a law is worse than the PID by most, if there is one.
fn worst_when_small(law: &LawResult, pid: &LawResult, sines: &[SmallSine]) -> Option<WorseSine> {
    let least_mm = MAX_EXCESS_COUNTS * law.settings.encoder.resolution_mm;
    let runs = sines.iter().zip(law.small.iter().zip(&pid.small));
    let worse = runs.map(|(small, (own, pid))| WorseSine {
        sine: small.sine,
        largest_mm: own.largest_mm,
        pid_mm: pid.largest_mm,
    });
    let ratio = |worse: &WorseSine| worse.largest_mm / worse.pid_mm;
    worse
        .filter(|worse| worse.largest_mm - worse.pid_mm > least_mm)
        .max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
}

#[cfg(test)]
mod tests {
    use quadrant_settings::{FeedbackSettings, StageSettings};
    use quadrant_sim::metrics::Score;

    use super::super::sines::SMALL_SINES;
    use super::*;
    use crate::record::Recording;

    /// A law with a largest error on each of the first small sines, in counts.
    fn law(largest_counts: &[f64]) -> LawResult {
        let settings = StageSettings::simulated().axes[0].clone();
        let count_mm = settings.encoder.resolution_mm;
        LawResult {
            law: "a law".to_owned(),
            scores: Vec::new(),
            small: largest_counts
                .iter()
                .map(|counts| Score {
                    largest_mm: counts * count_mm,
                    rms_mm: counts * count_mm,
                    glitch_mm: 0.0,
                })
                .collect(),
            recording: Recording::default(),
            stopped: None,
            rings: Vec::new(),
            is_share: false,
            at_s: Vec::new(),
            settings,
        }
    }

    #[test]
    fn a_law_is_worse_where_its_largest_error_exceeds_the_pids_by_more_than_a_count() {
        let pid = law(&[40.0, 60.0]);
        let worst = |counts: [f64; 2]| {
            worst_when_small(&law(&counts), &pid, &SMALL_SINES).map(|worst| worst.sine)
        };
        assert_eq!(worst([41.0, 61.0]), None);
        assert_eq!(worst([41.2, 10.0]), Some(SMALL_SINES[0].sine));
        // By ratio, not by the difference.
        assert_eq!(worst([60.0, 85.0]), Some(SMALL_SINES[0].sine));
        assert_eq!(worst([60.0, 95.0]), Some(SMALL_SINES[1].sine));
    }

    #[test]
    fn each_remedy_feeds_less_friction_forward_when_slow_and_as_much_when_fast() {
        let law = law(&[]);
        let pid = AxisSettings {
            feedback: FeedbackSettings {
                nonlinear: None,
                ..law.settings.feedback.clone()
            },
            ..law.settings.clone()
        };
        for remedy in REMEDIES {
            let (name, settings) = remedy.of(&law, &pid).unwrap();
            let curve = |settings: &AxisSettings| settings.friction.sliding.positive.curve;
            let lower = curve(&settings).level_v(0.2) < 0.91 * curve(&law.settings).level_v(0.2);
            assert!(lower || settings.feedforward.from_mm_s >= 0.4, "{name}");
            assert_eq!(settings.feedforward.gains, law.settings.feedforward.gains);
        }
        let linear = LawResult {
            settings: pid.clone(),
            ..law
        };
        assert_eq!(Remedy::LinearFrom(1.6).of(&linear, &pid), None);
    }
}
