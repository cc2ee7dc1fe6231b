//! `quadrant replay`.

use std::path::PathBuf;

use anyhow::{bail, ensure};
use clap::Args;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, progress};
use quadrant_cli::warn;
use quadrant_law::axes::AxisName;
use quadrant_pages::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use quadrant_pages::parts::provenance;
use quadrant_pages::replay::recorded::{self, RecordedAxis};
use quadrant_pages::replay::recorded_page::{recorded_page, recorded_table};
use quadrant_sim::stage_file::StageFile;
use quadrant_tune::record::Record;

use super::own_stage::{self, OwnStage};
use super::replay_program::{self, ProgramOptions};

/// Options of `quadrant replay`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// CSV file with the columns t_s and reference_m (or reference_mm); position_m (or position_mm), if present, is the
    /// recorded machine's own.
    #[arg(
        long,
        value_name = "FILE",
        requires = "axis",
        required_unless_present = "gcode",
        conflicts_with = "gcode"
    )]
    reference: Option<PathBuf>,
    /// The axis that follows the reference.
    #[arg(long, value_enum, conflicts_with = "gcode")]
    axis: Option<RecordedAxis>,
    #[command(flatten)]
    program: ProgramOptions,
    /// Friction that the law knows of the simulated stage: as identified from experiments, on a stage with noise, offset and ripple,
    /// or exactly, on one without. The controllers are the same.
    #[arg(long, value_enum, default_value = "identified")]
    model: ModelKnowledge,
    #[command(flatten)]
    stage: OwnStage,
    #[command(flatten)]
    settings: LawSettings,
    #[command(flatten)]
    output: Output,
}

impl Arguments {
    /// The axes of a stage of one's own that will move.
    fn axes_of(&self, own: &StageFile) -> anyhow::Result<Vec<AxisName>> {
        let described = own_stage::axes(own);
        let Some(axis) = self.axis else {
            return Ok(described);
        };
        let Some(name) = axis.name() else {
            bail!("--stage is for x, y and z; the EMPS axis has its published model");
        };
        ensure!(
            described.contains(&name),
            "{} has no table [{name}]: add one, or give another --axis",
            own.path.display()
        );
        Ok(vec![name])
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        reference,
        axis,
        program,
        model,
        stage,
        settings,
        output,
    } = arguments;
    output.ready()?;
    ensure!(
        settings.path.is_none() || *axis != Some(RecordedAxis::Emps),
        "--settings is for an axis of the simulated stage; the EMPS axis has its published model"
    );
    let own = stage.read()?;
    let setup = match &own {
        None => RunConfiguration::new(*model, settings.read()?.stage).with_best_pid()?,
        Some(own) => {
            ensure!(
                *model == ModelKnowledge::Identified,
                "--model exact is for the built-in stage: the law knows of yours what commissioning found"
            );
            let axes = arguments.axes_of(own)?;
            own_stage::setup(own, &axes, settings, output)?
        }
    };
    if let Some(path) = &program.gcode {
        return replay_program::run(path, program, &setup, own.as_ref(), output);
    }
    // The command line has either a program, or a reference and its axis.
    let (Some(reference), Some(axis)) = (reference, axis) else {
        bail!("nothing to follow; give --gcode, or --reference with --axis");
    };
    let limits = match (&own, axis.name()) {
        (Some(own), Some(name)) => own_stage::record_limits(own, name, axis.limits()),
        _ => axis.limits(),
    };
    let record = Record::read(reference, &limits)?;
    for doubt in &record.doubts {
        warn!("note: {doubt}");
    }
    let bar = progress(
        setup.configurations(true).len() as u64,
        "following the record",
    );
    let outcomes = recorded::replay(&record, *axis, &setup, output.seed, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let title = match (&own, axis.name()) {
        (Some(own), Some(name)) => format!("{name} of {}", own_stage::name(Some(own))),
        _ => axis.to_string(),
    };
    output.table(&recorded_table(&outcomes, &title))?;
    let settings = format!("{}{}", stage.option(), settings.option());
    let shown = match model {
        ModelKnowledge::Identified => "",
        ModelKnowledge::Exact => " --model exact",
    };
    let command = format!(
        "quadrant replay --reference {} --axis {}{shown}{settings} --seed {}",
        reference
            .file_name()
            .unwrap_or(reference.as_os_str())
            .display(),
        clap::ValueEnum::to_possible_value(axis)
            .map_or_else(String::new, |value| value.get_name().to_owned()),
        output.seed
    );
    let page = recorded_page(
        &outcomes,
        *axis,
        &title,
        *model,
        provenance(&command, output.seed),
    );
    output.page(&page, "replay.html")
}
