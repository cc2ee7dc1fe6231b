//! Less friction fed forward where the chosen law is worse than the PID on small slow motions.
//!
//! The level of friction that is fed forward at the slow speed of the reference is more than a table needs once it breaks away. What is
//! left over, divided by the stiffness of a soft loop, throws the axis; and one that noise shakes meets hardly any friction when slow. There
//! none is fed forward on slow motions. Where strokes are so short that the PID sticks, it leaves no more than a stroke, and what friction
//! is fed forward has to be exact to gain anything: there none is, if that is the harm.

use quadrant_settings::AxisSettings;
use quadrant_sim::sine_test::SineTest;

use super::VerifyError;
use super::law_result::{LawResult, MAX_ERROR_RATIO, MAX_SCATTER_RATIO};
use super::sines::{CHOICE_SINES, USUAL_CYCLES};
use super::small::Refused;
use super::small_motions::{FROM_MM_S, SmallMotion};
use super::trials::Trials;
use super::variants::{feeding_beyond, feeding_from, with_friction};

/// Change of a law that is worse than the PID on small slow motions.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Remedy {
    /// No friction fed forward on motions up to a velocity, mm/s.
    From(f64),
    /// No nonlinear gain: it may be the harm where no friction is fed forward.
    Linear,
    /// Neither up to a velocity, mm/s: on such motions it is the PID.
    LinearFrom(f64),
    /// A share of the friction on every motion.
    Share(f64),
}

/// Remedies in the order in which they are tried: the first that is not worse than the PID on any sine is chosen.
const REMEDIES: [Remedy; 6] = [
    Remedy::From(0.4),
    Remedy::From(0.8),
    Remedy::Linear,
    Remedy::From(FROM_MM_S),
    Remedy::LinearFrom(FROM_MM_S),
    Remedy::LinearFrom(FAST_MM_S[1]),
];

/// Largest error over the PID's on a usual sine up to which a remedy is chosen where there is no better one: that of an axis that sticks
/// scatters by more than [`MAX_SCATTER_RATIO`].
const MAX_REMEDY_RATIO: f64 = 1.1;
/// Velocities up to which no friction is fed forward where it is worse than the PID on usual sines, mm/s.
const FAST_MM_S: [f64; 2] = [FROM_MM_S, 5.0];
/// Remedies that are tried where the whole of a law is far worse than the PID when small, and no other remedy is not worse at all: on the law
/// beyond short strokes.
const LESS: [Remedy; 4] = [
    Remedy::LinearFrom(FAST_MM_S[0]),
    Remedy::LinearFrom(FAST_MM_S[1]),
    Remedy::Share(0.6),
    Remedy::Share(0.3),
];

/// Longest stroke up to which no friction is fed forward, over that of the sine on which it was worse.
const STROKE_ROOM: f64 = 1.1;
/// Longest stroke up to which no friction is fed forward, mm: less friction is the remedy of what is worse on longer ones.
const MOST_STROKE_MM: f64 = 0.12;
/// Parts of such a law's name before and after the length.
const STROKES: &str = ", strokes from ";
const ON: &str = " mm on";

/// Name of a law without its nonlinear gain.
fn linear_name(name: &str) -> String {
    name.replacen("N-PID", "PID", 1)
}

/// Settings under the feedback of the PID alone.
fn linear(settings: &AxisSettings, pid: &AxisSettings) -> AxisSettings {
    AxisSettings {
        feedback: pid.feedback.clone(),
        ..settings.clone()
    }
}

impl Remedy {
    /// The same for a law that may have no nonlinear gain to lose.
    fn suiting(self, law: &LawResult, pid: &AxisSettings) -> Self {
        match self {
            Self::LinearFrom(from_mm_s) if law.settings.feedback == pid.feedback => {
                Self::From(from_mm_s)
            }
            remedy => remedy,
        }
    }

    /// The changed law, its name and settings; none where it changes nothing that the one before has not. `pid`: the PID alone.
    fn of(self, law: &LawResult, pid: &AxisSettings) -> Option<(String, AxisSettings)> {
        let name = &law.law;
        Some(match self {
            Self::From(from_mm_s) => (
                format!("{name}, from {from_mm_s} mm/s"),
                feeding_from(&law.settings, from_mm_s),
            ),
            Self::Linear | Self::LinearFrom(_) if law.settings.feedback == pid.feedback => {
                return None;
            }
            Self::Linear => (linear_name(name), linear(&law.settings, pid)),
            Self::LinearFrom(from_mm_s) => (
                format!("{}, from {from_mm_s} mm/s", linear_name(name)),
                linear(&feeding_from(&law.settings, from_mm_s), pid),
            ),
            Self::Share(share) => (
                format!("{name} x {share:.2}"),
                with_friction(&law.settings, share),
            ),
        })
    }
}

impl Trials<'_, '_> {
    /// The chosen law's index where it is not worse than the PID on small slow motions, else that of one with less friction, or of that which
    /// is least worse on the usual sines. Where there is none, the chosen one stays, among those that were refused; but for one that was
    /// stopped there, that feeds nothing forward, or that is far worse: a share of it, then, or the PID. Laws that ran on the usual sines are added.
    pub(super) fn keep_small(&mut self, chosen: usize) -> Result<usize, VerifyError> {
        if chosen == 0 {
            return Ok(0);
        }
        let mut law = self.laws[chosen].clone();
        if !self.refuses_when_small(&mut law)? {
            return Ok(chosen);
        }
        self.laws[chosen] = law.clone();
        if !law.feeds_forward() {
            return Ok(0);
        }
        while let Some(mut beyond) = self.beyond_refused_stroke(&law) {
            if !self.refuses_when_small(&mut beyond)? {
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
        let mut whole = self.laws[chosen].clone();
        if self.errors_unless_far(&mut whole)?.is_some() {
            return Ok(chosen);
        }
        self.laws[chosen] = whole;
        let beyond = self.beyond(&law, MOST_STROKE_MM).unwrap_or(law);
        self.less_of(&beyond)
    }

    /// Index of a law with less of another's friction that is not far worse than the PID on any small slow motion; the PID's without one.
    fn less_of(&mut self, law: &LawResult) -> Result<usize, VerifyError> {
        for remedy in LESS {
            let remedy = remedy.suiting(law, &self.pid);
            let Some(mut found) = self.begin_remedy(remedy, law) else {
                continue;
            };
            let Some(errors_mm) = self.errors_unless_far(&mut found)? else {
                continue;
            };
            let worse = self.worst_when_small(&found.settings, &errors_mm);
            let worse = worse.map(|worse| Refused {
                law: found.law.clone(),
                factor: 1.0,
                worse: Some(worse),
            });
            if let Some((found, worst)) = self.run_remedy(found)
                && worst < MAX_REMEDY_RATIO
            {
                self.refused.extend(worse);
                return Ok(found);
            }
        }
        Ok(0)
    }

    /// Index of a law that feeds friction forward on fast motions alone, and is the PID on others, where no law was better than the PID on
    /// every sine: so it is where the encoder's noise is most of the error on slow ones. The PID's if that is no better either.
    pub(super) fn when_fast(&mut self) -> Result<usize, VerifyError> {
        let fed = self.laws.iter().filter(|law| {
            let ran = law.scores.len() >= CHOICE_SINES;
            law.feeds_forward() && !law.is_share && ran
        });
        let best = fed.min_by(|a, b| self.against_pid(a).1.total_cmp(&self.against_pid(b).1));
        let Some(best) = best.cloned() else {
            return Ok(0);
        };
        let all = self.bench.sines.len();
        if let Some(stopped) = self.bench.run_on(&mut self.laws[0], all) {
            return Err(stopped.into());
        }
        for from_mm_s in FAST_MM_S {
            let remedy = Remedy::LinearFrom(from_mm_s).suiting(&best, &self.pid);
            if let Some((found, worst)) = self.try_remedy(remedy, &best)?
                && worst <= MAX_SCATTER_RATIO
            {
                return Ok(found);
            }
        }
        Ok(0)
    }

    /// True if the last law that was refused was so on a motion on which every remedy feeds friction forward.
    fn is_refused_when_fast(&self) -> bool {
        let worse = self.refused.last().and_then(|refused| refused.worse);
        worse.is_some_and(|worse| worse.motion.velocity_mm_s() > FROM_MM_S)
    }

    /// A law that feeds friction forward beyond the stroke on which it was refused, where that is a short one, and the usual sines are so much
    /// longer that it does on them what it did.
    fn beyond_refused_stroke(&self, law: &LawResult) -> Option<LawResult> {
        let motion = self.refused.last()?.worse?.motion;
        self.beyond(law, STROKE_ROOM * motion.stroke_mm())
    }

    /// A law that feeds no friction forward on strokes up to a length, mm, if that is a short one and changes the law.
    fn beyond(&self, law: &LawResult, from_mm: f64) -> Option<LawResult> {
        let is_longer = |usual: &SineTest| usual.amplitude_mm >= from_mm;
        let tries = from_mm > law.settings.feedforward.from_mm
            && from_mm <= MOST_STROKE_MM
            && self.bench.sines.iter().all(is_longer);
        tries.then(|| LawResult {
            law: beyond_strokes(&law.law, from_mm),
            settings: feeding_beyond(&law.settings, from_mm),
            ..law.clone()
        })
    }

    /// Runs a changed law, where it is refused on a short quick stroke beyond that: its index, and the largest of its errors over the PID's on the
    /// usual sines; none if it is worse than the PID when small, or gains too little on the mean.
    fn try_remedy(
        &mut self,
        remedy: Remedy,
        law: &LawResult,
    ) -> Result<Option<(usize, f64)>, VerifyError> {
        let Some(mut found) = self.begin_remedy(remedy, law) else {
            return Ok(None);
        };
        while self.refuses_when_small(&mut found)? {
            // Of slow motions the next remedy takes care.
            let beyond = self
                .is_refused_when_fast()
                .then(|| self.beyond_refused_stroke(&found));
            let Some(beyond) = beyond.flatten() else {
                return Ok(None);
            };
            found = beyond;
        }
        Ok(self.run_remedy(found))
    }

    /// A changed law that has run on nothing yet; none where it changes nothing, or is refused.
    fn begin_remedy(&mut self, remedy: Remedy, law: &LawResult) -> Option<LawResult> {
        let (name, settings) = remedy.of(law, &self.pid)?;
        let (found, _) = self.bench.try_law(&name, &settings, 0).ok()?;
        Some(found)
    }

    /// Runs a changed law on the usual sines: its index, and the largest of its errors over the PID's; none if it gains too little on the mean.
    fn run_remedy(&mut self, mut found: LawResult) -> Option<(usize, f64)> {
        // The whole of it was judged on these sines before, and part of it need not keep clear of the PID by as much.
        let all = self.bench.sines.len();
        self.bench.run_on(&mut found, all);
        // Where it is the PID, what differs is chance.
        let differing: Vec<usize> = (0..all)
            .filter(|&index| {
                let sine = SmallMotion::Sine(self.bench.sines[index], USUAL_CYCLES);
                !self.is_pid_on(&found.settings, sine)
            })
            .collect();
        let (worst, _) = found
            .only(&differing)
            .against(&self.laws[0].only(&differing), &self.drift);
        let (_, mean) = self.against_pid(&found);
        self.laws.push(found);
        (mean <= MAX_ERROR_RATIO).then_some((self.laws.len() - 1, worst))
    }
}

/// The name of a law that feeds friction forward on strokes from a length on, mm, by that of one that may do so from a shorter one on.
fn beyond_strokes(law: &str, from_mm: f64) -> String {
    let (whole, shorter) = law.split_once(STROKES).unwrap_or((law, ""));
    let others = shorter.split_once(ON).map_or("", |(_, others)| others);
    format!("{whole}{STROKES}{from_mm:.3}{ON}{others}")
}

#[cfg(test)]
mod tests {
    use quadrant_settings::{FeedbackSettings, StageSettings};

    use super::*;
    use crate::record::Recording;

    #[test]
    fn a_law_that_is_refused_on_a_longer_stroke_keeps_the_rest_of_its_name() {
        assert_eq!(
            beyond_strokes("N-PID", 0.044),
            "N-PID, strokes from 0.044 mm on"
        );
        let refused = "PID, strokes from 0.044 mm on, from 1.6 mm/s";
        let name = beyond_strokes(refused, 0.11);
        assert_eq!(name, "PID, strokes from 0.110 mm on, from 1.6 mm/s");
    }

    #[test]
    fn each_remedy_is_linear_or_feeds_less_friction_forward_when_slow_and_as_much_when_fast() {
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
            let is_linear = settings.feedback == pid.feedback;
            assert!(is_linear || settings.feedforward.from_mm_s >= 0.4, "{name}");
            assert_eq!(settings.friction, law.settings.friction);
            assert_eq!(settings.feedforward.gains, law.settings.feedforward.gains);
        }
        let linear = LawResult {
            settings: pid.clone(),
            ..law
        };
        assert_eq!(Remedy::Linear.of(&linear, &pid), None);
        let remedy = Remedy::LinearFrom(1.6);
        assert_eq!(remedy.of(&linear, &pid), None);
        assert!(remedy.suiting(&linear, &pid).of(&linear, &pid).is_some());
    }
}
