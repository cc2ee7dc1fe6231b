//! The errors of one law on the sines, and their comparison with the PID's.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::AxisSettings;
use quadrant_sim::metrics::{Score, worst_and_mean};

use super::super::drift::Drift;
use super::super::ringing::{Ringing, alike};
use super::sines::CHOICE_SINES;
use crate::record::Recording;

/// Errors over the PID's up to which a law counts as no worse: a repeated run scatters by as much.
pub(super) const MAX_SCATTER_RATIO: f64 = 1.01;
/// Largest mean error over the PID's, and largest error on a withheld sine over the PID's, of a law that is selected: with a smaller improvement
/// it is not worth its risk on motions that are not tried.
pub(super) const MAX_ERROR_RATIO: f64 = 0.95;
/// Largest RMS error on a withheld sine over the PID's of a law whose largest error is no larger than the PID's: what is left then
/// are single spikes.
const MAX_RMS_RATIO: f64 = 0.85;
/// Least error that the encoder resolves, counts.
const RESOLVED_COUNTS: f64 = 2.0;
/// Largest excess of a largest error over the PID's that counts as none, counts.
const NEGLIGIBLE_COUNTS: f64 = 0.25;
/// The same of an RMS error, counts.
const NEGLIGIBLE_RMS_COUNTS: f64 = 0.025;
/// Largest factor on the friction that is fed forward.
const MOST_SCALE: f64 = 1.5;

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
    pub(super) rings: Vec<Ringing>,
    /// True for one that feeds less friction forward, because the whole of it is worse than the PID.
    pub(super) is_share: bool,
    /// Times at which the sines had been run, s from the first trial on.
    pub(super) at_s: Vec<f64>,
    pub(super) settings: AxisSettings,
}

impl LawResult {
    /// The same with the scores of some of its sines, by their indices, as far as it ran on them.
    pub(super) fn only(&self, sines: &[usize]) -> Self {
        let ran = || sines.iter().filter(|&&index| index < self.scores.len());
        Self {
            scores: ran().map(|&index| self.scores[index]).collect(),
            at_s: ran().map(|&index| self.at_s[index]).collect(),
            ..self.clone()
        }
    }

    /// Its kind of feedforward.
    pub(super) fn kind(&self) -> FeedforwardKind {
        self.settings.feedforward.kind
    }

    /// True for one with feedforward.
    pub(super) fn feeds_forward(&self) -> bool {
        self.kind() != FeedforwardKind::None
    }

    /// The oscillation that has the same frequency on sines of different speed: no ripple of the axis has.
    pub(super) fn rings_alike(&self) -> Option<Ringing> {
        let mut pairs = self.rings.windows(2);
        pairs
            .find(|pair| alike(&pair[0], &pair[1]))
            .map(|pair| pair[0])
    }

    /// Factor on the friction that it feeds forward with which it would have left the least error on the first sine, by the errors
    /// that the same feedback leaves without; 1 where they show none.
    pub(super) fn best_scale(&self, without: &Self, drift: &Drift) -> f64 {
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
    pub(super) fn is_better_than(&self, pid: &Self, drift: &Drift) -> bool {
        let (worst, mean) = self.against(pid, drift);
        let enough = CHOICE_SINES.min(pid.scores.len());
        self.scores.len() >= enough && worst <= self.most_worse() && mean <= MAX_ERROR_RATIO
    }

    /// True if on every withheld sine its largest error is below the PID's by enough, or all but what the encoder shows, or no larger
    /// while its RMS error is far below: what is just no worse there may be worse on the next motion.
    pub(super) fn keeps_clear_of(&self, pid: &Self, drift: &Drift) -> bool {
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
    pub(super) fn most_worse(&self) -> f64 {
        if self.is_share {
            1.0
        } else {
            MAX_SCATTER_RATIO
        }
    }

    /// Its errors over those that the PID would have made at the same time: the largest of all ratios, and their geometric mean,
    /// over the sines that both ran; infinite for a law that was stopped. What exceeds the PID's by less than a share of a count
    /// is as good: it is the encoder's noise.
    pub(super) fn against(&self, pid: &Self, drift: &Drift) -> (f64, f64) {
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

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use quadrant_settings::StageSettings;

    use super::super::super::ringing::lasting;
    use super::super::sines::SINES;
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
