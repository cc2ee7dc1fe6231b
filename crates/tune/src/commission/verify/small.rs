//! Small slow motions: the chosen law must not be worse than the PID there either.
//!
//! The level of friction that is fed forward at the slow speed of the reference is more than a table needs once it breaks away. What is
//! left over, divided by the stiffness of a soft loop, throws the axis. Less friction takes the throw away; the same level at every
//! speed, below what sliding keeps, loses least on other motions.

use quadrant_settings::AxisSettings;
use quadrant_sim::sine_test::SineTest;

use super::VerifyError;
use super::law_result::{LawResult, NEGLIGIBLE_COUNTS};
use super::sines::{CHOICE_SINES, SmallSine};
use super::trials::Trials;
use super::variants::{flattened, with_friction};

/// A law that was better than the PID on the usual sines, and worse on a small slow one.
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

/// Change of a feedforward that throws the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Remedy {
    /// A level that no speed changes: this share of the lower one of the Coulomb and the breakaway level.
    Flat(f64),
    /// This share of all friction.
    Share(f64),
}

/// What is tried, the first that is not worse than the PID on any sine is chosen.
pub(super) const REMEDIES: [Remedy; 5] = [
    Remedy::Flat(0.9),
    Remedy::Share(0.75),
    Remedy::Flat(0.7),
    Remedy::Share(0.5),
    Remedy::Share(0.25),
];

impl Remedy {
    /// The changed law: its name and settings.
    fn of(self, law: &LawResult) -> (String, AxisSettings) {
        match self {
            Self::Flat(share) => (
                format!("{}, level x {share:.2} at any speed", law.law),
                flattened(&law.settings, share),
            ),
            Self::Share(share) => (
                format!("{} x {share:.2}", law.law),
                with_friction(&law.settings, share),
            ),
        }
    }
}

impl Trials<'_, '_> {
    /// The chosen law's index where it is not worse than the PID on small slow sines, else that of one with less friction, or the PID's;
    /// and the law that was refused. Laws that ran are added.
    pub(super) fn keep_small(
        &mut self,
        chosen: usize,
    ) -> Result<(usize, Option<Refused>), VerifyError> {
        if chosen == 0 {
            return Ok((0, None));
        }
        self.bench.run_small(&mut self.laws[0])?;
        // One that is stopped is refused.
        let _ = self.bench.run_small(&mut self.laws[chosen]);
        let law = self.laws[chosen].clone();
        let Some(refused) = self.refused_when_small(&law) else {
            return Ok((chosen, None));
        };
        for remedy in REMEDIES {
            let index = self.try_remedy(remedy, &law)?;
            if index != 0 {
                return Ok((index, Some(refused)));
            }
        }
        Ok((0, Some(refused)))
    }

    /// Runs a law with less friction; its index if it is chosen, else the PID's.
    fn try_remedy(&mut self, remedy: Remedy, law: &LawResult) -> Result<usize, VerifyError> {
        let (name, settings) = remedy.of(law);
        let Ok((mut found, _)) = self.bench.try_law(&name, &settings, 0) else {
            return Ok(0);
        };
        found.is_share = true;
        if self.bench.run_small(&mut found).is_err() || self.refused_when_small(&found).is_some() {
            return Ok(0);
        }
        self.bench.run_on(&mut found, CHOICE_SINES);
        self.add_and_judge(found)
    }

    /// The reason why a law that ran on the small sines is not chosen; none if it is not worse than the PID there.
    fn refused_when_small(&self, law: &LawResult) -> Option<Refused> {
        let worst = worst_when_small(law, &self.laws[0], self.bench.small_sines);
        (worst.is_some() || law.stopped.is_some()).then(|| Refused {
            law: law.law.clone(),
            worst,
        })
    }
}

/// The small sine on which a law is worse than the PID by most, if there is one.
fn worst_when_small(law: &LawResult, pid: &LawResult, sines: &[SmallSine]) -> Option<WorseSine> {
    let least_mm = NEGLIGIBLE_COUNTS * law.settings.encoder.resolution_mm;
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
    use quadrant_settings::StageSettings;
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
    fn a_law_is_worse_where_its_largest_error_exceeds_the_pids_by_more_than_noise() {
        let pid = law(&[40.0, 60.0]);
        let worst = |counts: [f64; 2]| {
            worst_when_small(&law(&counts), &pid, &SMALL_SINES).map(|worst| worst.sine)
        };
        assert_eq!(worst([40.2, 10.0]), None);
        assert_eq!(worst([41.0, 10.0]), Some(SMALL_SINES[0].sine));
        // By ratio, not by the difference.
        assert_eq!(worst([60.0, 85.0]), Some(SMALL_SINES[0].sine));
        assert_eq!(worst([60.0, 95.0]), Some(SMALL_SINES[1].sine));
    }

    #[test]
    fn each_remedy_feeds_less_friction_forward_than_the_law_at_any_slow_speed() {
        let law = law(&[]);
        let fed_v = |settings: &AxisSettings, speed_mm_s: f64| {
            let level_v = settings.friction.sliding.positive.curve.level_v(speed_mm_s);
            settings.feedforward.gains.presliding * level_v
        };
        for remedy in REMEDIES {
            let (name, settings) = remedy.of(&law);
            for speed_mm_s in [0.0, 0.2, 1.0, 5.0, 50.0] {
                let share = fed_v(&settings, speed_mm_s) / fed_v(&law.settings, speed_mm_s);
                assert!(share <= 0.9, "{name}: {share} at {speed_mm_s} mm/s");
            }
        }
    }
}
