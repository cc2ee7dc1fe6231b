//! `quadrant laws`.

use std::path::PathBuf;

use clap::Args;
use quadrant::feedforward::FeedforwardKind;
use quadrant_sim::experiment::compensator::identified;
use quadrant_sim::experiment::laws::comparison::compare_laws;
use quadrant_sim::experiment::laws::tuning::tune_all;
use quadrant_sim::experiment::laws::wrong_model::{Competitor, cases, run_wrong_models};
use quadrant_sim::identify::characteristic::{CharacteristicSettings, measure};
use quadrant_sim::plant::StageTruth;
use quadrant_sim::presentation::{laws_section, provenance, wrong_model_section};
use quadrant_sim::report::{Block, Page};
use quadrant_sim::settings_file::SettingsFile;

use super::identify::rig::Axis;
use super::output::{Output, command_line, progress, share};

/// Options of `quadrant laws`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum, default_value_t = Axis::X)]
    axis: Axis,
    /// What is known of the axis, as `quadrant commission` leaves it; without it, the simulated stage's own commissioning.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Noise seeds of the comparison, from --seed on.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    #[command(flatten)]
    output: Output,
}

/// Feedforwards that each law is compared with.
const FEEDFORWARDS: [FeedforwardKind; 2] = [FeedforwardKind::None, FeedforwardKind::Combined];

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { output, axis, .. } = arguments;
    let stage = match &arguments.settings {
        Some(path) => SettingsFile::read(path)?.stage,
        None => identified()?.stage,
    };
    let settings = &stage.axes[axis.index()];
    let truth = &StageTruth::real().axes[axis.index()];
    let characteristic = measure(
        &mut axis.rig(output.seed),
        &CharacteristicSettings::default(),
        &mut |_| {},
    )?;

    let bar = share("tuning every law");
    let laws = tune_all(
        settings,
        &characteristic,
        stage.rate_hz,
        output.seed,
        &|done| {
            bar.set_position((1000.0 * done) as u64);
        },
    )?;
    bar.finish_and_clear();

    let runs = (laws.len() * FEEDFORWARDS.len()) as u64 * arguments.seeds;
    let studies = (Competitor::ALL.len() * cases().len()) as u64;
    let bar = progress(runs + studies, "running the laws");
    let outcomes = compare_laws(
        &laws,
        &FEEDFORWARDS,
        (settings, truth),
        stage.rate_hz,
        output.seed..output.seed + arguments.seeds,
        &|| bar.inc(1),
    )?;
    let wrong = run_wrong_models(
        &laws,
        (settings, truth),
        stage.rate_hz,
        output.seed,
        &|| {
            bar.inc(1);
        },
    )?;
    bar.finish_and_clear();

    println!(
        "Simulated, not measured. {} axis, 10 kHz, f32; seeds from {}\n",
        axis.name(),
        output.seed
    );
    let sections = vec![laws_section(&laws, &outcomes), wrong_model_section(&wrong)];
    for block in sections.iter().flat_map(|section| &section.blocks) {
        if let Block::Table(table) = block {
            output.table(table)?;
        }
    }
    let page = Page {
        title: "Feedback laws at equal robustness".to_owned(),
        subtitle: format!(
            "{} axis of the simulated stage; simulated, not measured",
            axis.name()
        ),
        provenance: provenance(&command_line(), output.seed),
        sections,
    };
    output.page(&page, "laws.html")
}
