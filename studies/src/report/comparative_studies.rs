//! Studies that the thesis names beside its own method: other laws, other friction models, other disturbances and
//! drives; and the circle as machine builders know it.

use indicatif::ProgressBar;
use quadrant_pages::circle::page::circle_sections;
use quadrant_pages::circle::{CircleRequest, run_circle_tests};
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_report::Section;
use quadrant_sim::stage_setup::BUILT_IN_STAGE;

use crate::friction_models::page::friction_models_sections;
use crate::friction_models::{Parameters, compare, tracking};
use crate::laws;
use crate::laws::page::laws_section;
use crate::report::{Context, Progress};
use crate::robustness::page::robustness_sections;
use crate::robustness::study::{StudyRequest, run_study, runs};
use crate::wrong_model::page::wrong_model_section;

/// Most noise seeds of the laws, and of the scenarios: their spread is small, and their runs are many.
const MOST_SEEDS: u64 = 2;
/// Backlash of the rack, mm: as `quadrant-studies robustness` has it.
const BACKLASH_MM: f64 = 0.02;

/// The feedback laws at equal robustness, and what a wrong model costs.
pub(super) fn laws(context: &Context, progress: &Progress) -> anyhow::Result<Vec<Section>> {
    let stage = &context.settings.stage;
    let seeds = context.seeds.min(MOST_SEEDS);
    let study = laws::study::run_study(stage, 0, context.seed, seeds, &|share| {
        progress.advance(share);
    })?;
    Ok(vec![
        laws_section(&study.laws, &study.outcomes),
        wrong_model_section(&study.wrong),
    ])
}

/// The friction models, driven alike, and as feedforward.
pub(super) fn friction_models(
    context: &Context,
    progress: &Progress,
) -> anyhow::Result<Vec<Section>> {
    let mut x = context.settings.stage.axes[0].clone();
    let parameters = Parameters::of(&x)?;
    x.friction = parameters.friction.clone();
    let behaviours = compare(&parameters, &ProgressBar::hidden());
    progress.at(0.3);
    let tracked = tracking::track(&x, 0, context.seed, &ProgressBar::hidden())?;
    Ok(friction_models_sections(&parameters, &behaviours, &tracked))
}

/// Changed axes, loads and other drives.
pub(super) fn scenarios(context: &Context, progress: &Progress) -> anyhow::Result<Vec<Section>> {
    let request = StudyRequest {
        stage: context.settings.stage.clone(),
        axis: 0,
        backlash_mm: BACKLASH_MM,
        force: None,
        only: None,
        seed: context.seed,
        seeds: context.seeds.min(MOST_SEEDS),
    };
    let step = 1.0 / runs(&request) as f64;
    let study = run_study(&request, &|| progress.advance(step))?;
    Ok(robustness_sections(&study))
}

pub(super) fn circles(context: &Context, _: &Progress) -> anyhow::Result<Vec<Section>> {
    let request = CircleRequest {
        configurations: Configuration::EXTREMES.to_vec(),
        seeds: vec![context.seed],
        ..CircleRequest::default()
    };
    let setup = RunConfiguration::identified(context.settings.stage.clone());
    let results = run_circle_tests(&request, &setup, &|| {});
    Ok(circle_sections(&results, BUILT_IN_STAGE))
}
