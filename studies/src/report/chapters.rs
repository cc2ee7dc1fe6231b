//! The headlines, and chapter 5.

use quadrant_pages::compare::comparison::Request;
use quadrant_pages::compare::sine::Sines;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_report::Section;

use crate::report::{Context, Progress};
use crate::thesis::chapter5::chapter5_sections;
use crate::thesis::headline::{headline_section, study_section};
use crate::thesis::imperfections::{Change, study};

/// Most seeds that the study of imperfections is run with: what it asks about is many times the deviations.
const STUDY_SEEDS: u64 = 3;
/// Time of the study's identifications, s.
const IDENTIFICATIONS_S: f64 = 6.0;

/// Time of the study.
pub(super) fn headline_s(context: &Context) -> f64 {
    let [_, identified] = context.setups();
    let one = Request {
        setups: &[identified],
        configurations: &Configuration::EXTREMES,
        sines: vec![Sines::default()],
        seed: context.seed,
        seeds: context.seeds.min(STUDY_SEEDS),
    };
    IDENTIFICATIONS_S + Change::ALL.len() as f64 * one.expected_s()
}

pub(super) fn headline(context: &Context, progress: &Progress) -> anyhow::Result<Vec<Section>> {
    let (comparison_s, study_s) = (context.comparison_s(), headline_s(context));
    let share = comparison_s / (comparison_s + study_s);
    let comparison = context.comparison(&|done| progress.advance(share * done))?;
    let [_, identified] = context.setups();
    let findings = study(
        &identified,
        &Change::ALL,
        context.seed,
        context.seeds.min(STUDY_SEEDS),
        &|done| progress.advance((1.0 - share) * done),
    )?;
    Ok(vec![headline_section(comparison), study_section(&findings)])
}

pub(super) fn chapter5(context: &Context, progress: &Progress) -> anyhow::Result<Vec<Section>> {
    let comparison = context.comparison(&|done| progress.advance(done))?;
    Ok(chapter5_sections(comparison))
}
