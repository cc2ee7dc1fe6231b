//! `quadrant-studies friction`.

use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, command_line, progress};
use quadrant_cli::say;
use quadrant_pages::parts::provenance;

use crate::friction_models::page::{
    friction_models_page, friction_models_table, friction_parameters_table, tracking_table,
};
use crate::friction_models::{Model, Parameters, compare, tracking};

/// Options of `quadrant-studies friction`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// The axis of the settings and of the simulated stage.
    #[arg(long, value_enum, default_value = "x")]
    axis: Axis,
    #[command(flatten)]
    settings: LawSettings,
    /// Width of the smoothed GMS' transition over each element's breakaway level, 0.001 to 1, instead of the settings'.
    #[arg(long, value_name = "SHARE", value_parser = width)]
    width: Option<f64>,
    #[command(flatten)]
    output: Output,
}

fn width(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (1e-3..=1.0).contains(&value) => Ok(value),
        Ok(value) => Err(format!("{value} is outside 0.001 to 1")),
        Err(error) => Err(format!("{error}")),
    }
}

/// Runs the study, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments {
        axis,
        settings,
        width,
        output,
    } = arguments;
    let stage = settings.read()?.stage;
    let mut axis_settings = stage.axes[axis.index()].clone();
    if let Some(width) = width {
        axis_settings.friction.smoothed_gms.width = *width;
    }
    let parameters = Parameters::of(&axis_settings)?;
    axis_settings.friction = parameters.friction.clone();
    let bar = progress(Model::ALL.len() as u64, "moving the friction models");
    let behaviours = compare(&parameters, &bar);
    bar.finish_and_clear();
    let bar = progress(tracking::RUNS, "tracking with each feedforward");
    let tracked = tracking::track(&axis_settings, axis.index(), output.seed, &bar)?;
    bar.finish_and_clear();
    say!("Simulated, not measured. {} axis\n", axis.name());
    output.table(&friction_parameters_table(&parameters))?;
    output.table(&friction_models_table(&behaviours))?;
    output.table(&tracking_table(&tracked))?;
    let page = friction_models_page(
        &parameters,
        &behaviours,
        &tracked,
        &format!("{} axis", axis.name()),
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "friction-models.html")
}
