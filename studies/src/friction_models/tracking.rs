//! Worth of each friction model as feedforward: the comparison's sine under N-PID, on axes whose friction really
//! follows one model or another.

use indicatif::ProgressBar;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::compare::sine::run_configuration;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_settings::AxisSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::metrics::Score;
use quadrant_sim::plant::{AxisParameters, FrictionParameters, StageParameters};
use quadrant_sim::run::RunError;
use quadrant_sim::settings_file::SettingsFileError;
use quadrant_tune::identify::single_state::with_all_models;
use rayon::prelude::*;

use crate::friction_models::Model;

/// The models that can be an axis' truth.
pub const TRUTHS: [Model; 4] = [Model::Gms, Model::SmoothedGms, Model::Lugre, Model::Dahl];

/// Runs in a comparison.
pub const RUNS: u64 = (TRUTHS.len() * FeedforwardKind::ALL.len()) as u64;

/// Mean scores over the comparison's velocities, of one kind of feedforward on one truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracked {
    /// Friction model of the axis.
    pub truth: Model,
    /// Friction model of the feedforward.
    pub kind: FeedforwardKind,
    /// RMS tracking error, mm.
    pub rms_mm: f64,
    /// Quadrant glitch, mm.
    pub glitch_mm: f64,
}

/// Reasons for which there is no comparison.
#[derive(Debug, thiserror::Error)]
pub enum TrackingError {
    /// The settings of the stage that the axis is put into.
    #[error(transparent)]
    Settings(#[from] SettingsFileError),
    /// A model that the truth's elements do not give.
    #[error("Dahl and LuGre cannot be fitted to the simulated axis' elements")]
    NotFitted,
    /// A run that was refused or stopped.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// The simulated axis with another friction model, its parameters fitted to the axis' own.
fn with_model(axis: &AxisParameters, model: Model) -> Option<AxisParameters> {
    let fitted = with_all_models(axis.friction, axis.gms.clone());
    let model = match model {
        Model::Static => return None,
        Model::Dahl => FrictionParameters::Dahl(fitted.dahl?),
        Model::Lugre => FrictionParameters::Lugre(fitted.lugre?),
        Model::Gms => FrictionParameters::Gms,
        Model::SmoothedGms => FrictionParameters::Smoothed(fitted.smoothed_gms),
    };
    Some(AxisParameters {
        model,
        ..axis.clone()
    })
}

/// Runs every kind of feedforward on every truth, N-PID with these settings on axis `index` (0 to 2) of the simulated
/// stage. The same seed gives the same scores; `bar` counts [`RUNS`].
///
/// # Errors
/// Refused settings, or a run that a fault stopped.
pub fn track(
    settings: &AxisSettings,
    index: usize,
    seed: u64,
    bar: &ProgressBar,
) -> Result<Vec<Tracked>, TrackingError> {
    let mut stage = identified_settings()?.stage;
    // The comparison runs on the first axis.
    stage.axes[0] = settings.clone();
    let axis = &StageParameters::real().axes[index];
    let runs: Vec<(Model, FeedforwardKind)> = TRUTHS
        .into_iter()
        .flat_map(|truth| FeedforwardKind::ALL.map(|kind| (truth, kind)))
        .collect();
    runs.into_par_iter()
        .map(|(truth, kind)| {
            let mut setup = RunConfiguration::identified(stage.clone());
            setup.truth.axes[0] = with_model(axis, truth).ok_or(TrackingError::NotFitted)?;
            let configuration = Configuration {
                controller: LawKind::NPid,
                feedforward: kind,
                ..Configuration::BEST
            };
            let outcomes = run_configuration::<f32>(configuration, &setup, seed)?;
            bar.inc(1);
            let count = outcomes.len() as f64;
            let mean = |part: fn(&Score) -> f64| {
                outcomes.iter().map(|o| part(&o.score)).sum::<f64>() / count
            };
            Ok(Tracked {
                truth,
                kind,
                rms_mm: mean(|score| score.rms_mm),
                glitch_mm: mean(|score| score.glitch_mm),
            })
        })
        .collect()
}
