//! Trials of the commissioned laws on the axis itself, by its own encoder, and the choice among them: no law is selected
//! that is worse than the PID alone on any of the sines or on those that no law was chosen by; on small slow ones, if
//! any is not.

mod bench;
mod law_result;
mod learn;
mod remedies;
mod sines;
mod small;
mod small_motions;
mod trials;
mod variants;

use quadrant_settings::AxisSettings;
use quadrant_sim::sine_test::SineTest;

use self::bench::Bench;
pub use self::law_result::LawResult;
use self::sines::{CHOICE_SINES, COMPARISON_SINES, USUAL_CYCLES, one_lasts_s};
pub use self::sines::{Cycles, run_cycles, run_sine, sines};
pub use self::small::{Refused, Worse};
use self::small_motions::small_motions;
pub use self::small_motions::{Moves, SmallMotion, run_moves};
use self::trials::{KINDS, REPEATS, Trials};
use super::drift::Drift;
use super::ringing::Ringing;
use crate::test_axis::{AxisInfo, ExperimentError, MachineError, TestAxis};

/// Least error that is a fault, over the largest that the PID or the chosen law left.
const FOLLOWING_ROOM: f64 = 4.0;

/// All trials, and the chosen law.
#[derive(Clone, Debug)]
pub struct Verification {
    pub sines: Vec<SineTest>,
    /// The PID alone first.
    pub laws: Vec<LawResult>,
    /// Index of the chosen law.
    pub chosen: usize,
    /// The laws that were worse than the PID on a small slow motion, in the order in which they ran: the chosen one among them, if less
    /// of it was worse, too.
    pub refused: Vec<Refused>,
    /// Change of the axis meanwhile, on the first sine.
    pub drift: Drift,
}

impl Verification {
    /// True if a law was found that is better than the PID alone by enough, and nowhere worse.
    pub fn is_better_than_pid(&self) -> bool {
        self.chosen != 0
    }

    /// True if the chosen law is worse than the PID on a small slow motion: so was less of it.
    pub fn is_worse_when_small(&self) -> bool {
        let chosen = self.is_better_than_pid().then_some(&self.chosen().law);
        self.refused
            .iter()
            .any(|refused| Some(&refused.law) == chosen)
    }

    pub fn chosen(&self) -> &LawResult {
        &self.laws[self.chosen]
    }

    /// Errors of one of the laws over those that the PID would have made at the same time: the largest of all ratios, and their
    /// geometric mean, over the sines that the law ran on; infinite for one that was stopped.
    pub fn against_pid(&self, law: &LawResult) -> (f64, f64) {
        law.against(&self.laws[0], &self.drift)
    }

    /// Settings of the chosen law, with the limits of `base`, and room for what a healthy axis errs.
    pub fn settings(&self, base: &AxisSettings) -> AxisSettings {
        let mut settings = AxisSettings {
            limits: base.limits,
            ..self.chosen().settings.clone()
        };
        let scores = self.laws[0].scores.iter().chain(&self.chosen().scores);
        let largest_mm = scores.fold(0.0, |most, score| f64::max(most, score.largest_mm));
        let limits = &mut settings.limits;
        limits.following_error_mm = limits
            .following_error_mm
            .max((FOLLOWING_ROOM * largest_mm).min(limits.following_error_max_mm));
        settings
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
        "the PID oscillates at {:.0} Hz ({:.1} um), in every motion of the axis",
        .0.frequency_hz,
        1e3 * .0.amplitude_mm
    )]
    Rings(Ringing),
    /// The PID alone hums at rest.
    #[error(
        "at rest the PID hums at {:.0} Hz ({:.1} um) after a knock",
        .0.frequency_hz,
        1e3 * .0.amplitude_mm
    )]
    Hums(Ringing),
}

impl VerifyError {
    /// True if a softer PID may do: this one oscillates, or does not hold the axis.
    pub(super) fn asks_for_softer(&self) -> bool {
        match self {
            Self::Machine(_) => false,
            Self::TestAxis(error) => error.strayed(),
            Self::Rings(_) | Self::Hums(_) => true,
        }
    }
}

/// Tries laws on the axis: the PID alone, the N-PID alone, the N-PID with every kind of feedforward that was identified, the best of
/// them over other ranges of pre-sliding displacement, less of it where it is worse than the PID anywhere, and as much of the best as its
/// errors ask for.
///
/// Chooses the best law that is not worse than the PID, also on sines that were withheld until then. Where there is none, other kinds and
/// shares take their turn, and then what was tried, without the nonlinear gain. A choice that is worse on small slow motions is replaced by less
/// of it that is not. The choice learns, where that is not worse either.
///
/// # Errors
/// A PID whose settings are refused, that is stopped, or that oscillates.
pub fn verify(
    test_axis: &mut dyn TestAxis,
    settings: &AxisSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Verification, VerifyError> {
    let info = test_axis.info();
    let (sines, small_motions) = (sines(&info), small_motions(&info));
    let mut bench = Bench {
        test_axis,
        sines: &sines,
        small_motions: &small_motions,
        progress,
        used_s: 0.0,
        expected_s: lasts_s(&info),
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
    let mut trials = Trials::begin(bench, settings)?;
    trials.compare_kinds()?;
    trials.refine_best_kind()?;
    trials.rescale()?;
    let chosen = trials.confirm()?;
    // Where the law may learn at once, it need not be tried without.
    let chosen = match trials.let_learn(chosen)? {
        Some(learning) => learning,
        None => {
            let kept = trials.keep_small(chosen)?;
            trials.let_learn(kept)?.unwrap_or(kept)
        }
    };
    Ok(trials.ended(chosen))
}

/// Time that trials take where the first choice is not worse than the PID anywhere, s.
pub(super) fn lasts_s(info: &AxisInfo) -> f64 {
    let runs = |index: usize| {
        if index >= CHOICE_SINES {
            return 3;
        }
        let compared = if index < COMPARISON_SINES {
            KINDS.len()
        } else {
            1
        };
        // The PID and the N-PID alone, the best law once more, also learning, and the PID again.
        4 + compared + REPEATS * usize::from(index == 0)
    };
    let usual = sines(info).into_iter().enumerate();
    let usual_s = usual.map(|(index, sine)| runs(index) as f64 * one_lasts_s(&sine, USUAL_CYCLES));
    // The PID alone, and the chosen law as it learns.
    let small = small_motions(info).into_iter();
    let small_s = small.map(|motion| 2.0 * motion.lasts_s());
    usual_s.chain(small_s).sum()
}
