//! The whole study of the laws on one axis: trajectory, tuning, comparison, wrong models.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_settings::StageSettings;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::run::RunError;
use quadrant_tune::identify::characteristic::{
    CharacteristicError, CharacteristicSettings, measure,
};
use quadrant_tune::test_axis::SimulatedTestAxis;

use crate::laws::comparison::{LawOutcome, compare_laws};
use crate::laws::tuning::{TunedLaw, TuningError, tune_all};
use crate::wrong_model::{Competitor, WrongOutcome, cases, run_wrong_models};

/// Feedforwards that each law is compared with.
const FEEDFORWARDS: [FeedforwardKind; 2] = [FeedforwardKind::None, FeedforwardKind::Combined];
/// Share of the time that tuning takes.
const TUNING_SHARE: f64 = 0.3;
/// Laws that are tuned.
const LAWS: u64 = 7;

/// Results of the study.
#[derive(Clone, Debug)]
pub struct LawsStudy {
    /// The laws as tuned.
    pub laws: Vec<TunedLaw>,
    /// Results on the axis.
    pub outcomes: Vec<LawOutcome>,
    /// Results of competitors whose models are wrong on purpose.
    pub wrong: Vec<WrongOutcome>,
}

/// Reasons for which there is no study.
#[derive(Debug, thiserror::Error)]
pub enum LawsError {
    /// The trajectory that NCTF follows cannot be measured.
    #[error(transparent)]
    Characteristic(#[from] CharacteristicError),
    /// A law cannot be tuned.
    #[error(transparent)]
    Tuning(#[from] TuningError),
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Studies axis `index` (0 to 2) of the simulated stage, of which `stage` is what is known, with `seeds` noise seeds from
/// `seed` on. `advance` receives shares of the whole, from any thread.
///
/// # Errors
/// An axis that cannot be measured or tuned, or a failed run.
pub fn run_study(
    stage: &StageSettings,
    index: usize,
    seed: u64,
    seeds: u64,
    advance: &(dyn Fn(f64) + Sync),
) -> Result<LawsStudy, LawsError> {
    let settings = &stage.axes[index];
    let truth = &StageParameters::real().axes[index];
    let mut rig = SimulatedTestAxis::new(index, truth.clone(), seed);
    let characteristic = measure(&mut rig, &CharacteristicSettings::default(), &mut |_| {})?;
    let laws = tune_all(settings, &characteristic, stage.rate_hz, seed, &|share| {
        advance(TUNING_SHARE * share);
    })?;
    let compared = LAWS * FEEDFORWARDS.len() as u64 * seeds;
    let studied = (Competitor::ALL.len() * cases().len()) as u64;
    let step = (1.0 - TUNING_SHARE) / (compared + studied) as f64;
    let outcomes = compare_laws(
        &laws,
        &FEEDFORWARDS,
        (settings, truth),
        stage.rate_hz,
        seed..seed + seeds,
        &|| advance(step),
    )?;
    let wrong = run_wrong_models(&laws, (settings, truth), stage.rate_hz, seed, &|| {
        advance(step);
    })?;
    Ok(LawsStudy {
        laws,
        outcomes,
        wrong,
    })
}
