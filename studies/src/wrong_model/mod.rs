//! "A well-tuned PID is as good": what feedforward is worth when its model is wrong.
//!
//! Four competitors at equal robustness: the tuned PID; the tuned N-PID; a *cautious* N-PID, whose loop keeps the bounds
//! at every gain of its sector and not only at small errors; and each of the first two with feedforward. The model of the
//! feedforward is then made wrong on purpose, in three ways: its force too small or too large; its pre-sliding range too
//! short or too long; and every parameter off by a given share, up or down at random.

pub mod page;

use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_settings::{AxisSettings, FeedbackSettings};
use quadrant_sim::plant::AxisParameters;
use quadrant_sim::run::RunError;
use quadrant_sim::sine_test::{SineTest, SineTestOutcome, run_sine_tests};
use rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::laws::tuning::TunedLaw;

/// The sines of the study.
pub const SINES: [SineTest; 3] = [
    SineTest {
        amplitude_mm: 15.0,
        velocity_mm_s: 5.0,
    },
    SineTest {
        amplitude_mm: 15.0,
        velocity_mm_s: 10.0,
    },
    SineTest {
        amplitude_mm: 15.0,
        velocity_mm_s: 15.0,
    },
];

/// Factors on the feedforward's force.
pub const FORCE_FACTORS: [f64; 11] = [0.0, 0.25, 0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 1.5, 1.75, 2.0];
/// Factors on the pre-sliding range.
pub const RANGE_FACTORS: [f64; 7] = [0.5, 0.7, 0.9, 1.0, 1.1, 1.3, 1.5];
/// Shares by which every parameter is off.
pub const SHARES: [f64; 4] = [0.0, 0.1, 0.3, 0.5];
/// Draws of the signs at each share.
pub const DRAWS: usize = 8;
/// Largest gain of the cautious N-PID's sector.
const CAUTIOUS_SECTOR: f64 = 2.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Competitor {
    Pid,
    NPid,
    /// N-PID within the bounds at every gain of its sector.
    CautiousNPid,
}

impl Competitor {
    pub const ALL: [Self; 3] = [Self::Pid, Self::NPid, Self::CautiousNPid];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pid => "PID",
            Self::NPid => "N-PID",
            Self::CautiousNPid => "N-PID, bounds at every gain",
        }
    }
}

/// Error of the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wrong {
    /// There is no feedforward.
    NoFeedforward,
    /// Its force is off by this factor.
    Force(f64),
    /// Its pre-sliding range is off by this factor.
    Range(f64),
    /// Every parameter is off by this share, in the signs of this draw.
    Everything { share: f64, draw: usize },
}

/// Result of a competitor with a model.
#[derive(Clone, Copy, Debug)]
pub struct WrongOutcome {
    pub competitor: Competitor,
    pub wrong: Wrong,
    /// Score, mean over the sine tests.
    pub mean: SineTestOutcome,
}

/// All that is run.
pub fn cases() -> Vec<Wrong> {
    let force = FORCE_FACTORS.into_iter().filter(|factor| *factor > 0.0);
    let draws = |share: f64| if share == 0.0 { 1 } else { DRAWS };
    std::iter::once(Wrong::NoFeedforward)
        .chain(force.map(Wrong::Force))
        .chain(RANGE_FACTORS.into_iter().map(Wrong::Range))
        .chain(SHARES.into_iter().flat_map(move |share| {
            (0..draws(share)).map(move |draw| Wrong::Everything { share, draw })
        }))
        .collect()
}

/// The feedback of a competitor; nothing when the law was not tuned.
pub fn feedback(laws: &[TunedLaw], competitor: Competitor) -> Option<FeedbackSettings> {
    let of = |kind| {
        laws.iter()
            .find(|tuned| tuned.law == kind)
            .map(|tuned| tuned.feedback.clone())
    };
    match competitor {
        Competitor::Pid => of(LawKind::Pid),
        Competitor::NPid => of(LawKind::NPid),
        Competitor::CautiousNPid => {
            let mut feedback = of(LawKind::NPid)?;
            let gain = feedback.nonlinear?;
            // The whole PID times the gain is the PID that keeps the bounds.
            let pid = &mut feedback.pid;
            pid.kp_v_per_mm /= CAUTIOUS_SECTOR;
            pid.ki_v_per_mm_s /= CAUTIOUS_SECTOR;
            pid.kd_v_s_per_mm /= CAUTIOUS_SECTOR;
            feedback.nonlinear = Some(NonlinearGain {
                rate_per_mm: CAUTIOUS_SECTOR.acosh() / gain.range_mm,
                ..gain
            });
            Some(feedback)
        }
    }
}

/// The settings with their feedforward's model made wrong.
pub fn with_wrong_model(settings: &AxisSettings, wrong: Wrong, seed: u64) -> AxisSettings {
    let mut axis = settings.clone();
    axis.feedforward.kind = FeedforwardKind::Combined;
    match wrong {
        Wrong::NoFeedforward => axis.feedforward.kind = FeedforwardKind::None,
        Wrong::Force(factor) => {
            axis.feedforward.gains.gms *= factor;
            axis.feedforward.gains.viscous *= factor;
        }
        Wrong::Range(factor) => {
            for element in &mut axis.friction.gms.elements {
                element.stiffness_v_per_mm /= factor;
            }
        }
        Wrong::Everything { share, draw } => {
            let mut signs =
                Xoshiro256PlusPlus::seed_from_u64(seed.wrapping_mul(1000) + draw as u64);
            let mut factor = || {
                if signs.next_u64() >> 63 == 1 {
                    1.0 + share
                } else {
                    1.0 - share
                }
            };
            let mut directed = |model: &StaticFriction| {
                let mut model = *model;
                let curve = &mut model.curve;
                curve.coulomb_v *= factor();
                // The level at breakaway is never below that of sliding.
                curve.breakaway_v = (curve.breakaway_v * factor()).max(curve.coulomb_v);
                curve.stribeck_velocity_mm_s *= factor();
                model.viscous_v_s_per_mm *= factor();
                model
            };
            axis.friction.sliding = axis.friction.sliding.map(&mut directed);
            axis.friction.gms.attraction_v_s *= factor();
            let elements = &mut axis.friction.gms.elements;
            for element in elements.iter_mut() {
                element.stiffness_v_per_mm *= factor();
                element.weight *= factor();
            }
            let sum: f64 = elements.iter().map(|element| element.weight).sum();
            for element in elements {
                element.weight /= sum;
            }
            axis.feedforward.gains.inertia_v_s2_per_mm *= factor();
            axis.feedforward.preview_s *= factor();
        }
    }
    axis
}

/// Runs every case with every competitor on the axis, in parallel. `progress` is called once a run.
///
/// # Errors
/// Refused settings or a fault.
pub fn run_wrong_models(
    laws: &[TunedLaw],
    (settings, truth): (&AxisSettings, &AxisParameters),
    rate_hz: f64,
    seed: u64,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<WrongOutcome>, RunError> {
    let runs: Vec<(Competitor, FeedbackSettings, Wrong)> = Competitor::ALL
        .into_iter()
        .filter_map(|competitor| Some((competitor, feedback(laws, competitor)?)))
        .flat_map(|(competitor, feedback)| {
            cases()
                .into_iter()
                .map(move |wrong| (competitor, feedback.clone(), wrong))
        })
        .collect();
    runs.into_par_iter()
        .map(|(competitor, feedback, wrong)| {
            let mut axis = with_wrong_model(settings, wrong, seed);
            axis.feedback = feedback;
            let axes = [axis.clone(), axis.clone(), axis];
            let outcomes = run_sine_tests(axes, truth, SINES, rate_hz, seed)?;
            progress();
            Ok(WrongOutcome {
                competitor,
                wrong,
                mean: mean(&outcomes),
            })
        })
        .collect()
}

fn mean(outcomes: &[SineTestOutcome]) -> SineTestOutcome {
    let of = |read: fn(&SineTestOutcome) -> f64| {
        outcomes.iter().map(read).sum::<f64>() / outcomes.len() as f64
    };
    let mut mean = SineTestOutcome::default();
    mean.score.largest_mm = of(|outcome| outcome.score.largest_mm);
    mean.score.rms_mm = of(|outcome| outcome.score.rms_mm);
    mean.score.glitch_mm = of(|outcome| outcome.score.glitch_mm);
    mean.chatter_v = of(|outcome| outcome.chatter_v);
    mean
}
