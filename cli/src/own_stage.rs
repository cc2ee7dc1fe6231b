//! A simulated stage of one's own: the option that names it, and the settings of its law.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, command_line, share};
use quadrant_cli::say;
use quadrant_law::axes::AxisName;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::SettingsFile;
use quadrant_sim::stage_file::StageFile;
use quadrant_sim::stage_setup::{BUILT_IN_STAGE, StageSetup};
use quadrant_tune::commission::commission_stage;
use quadrant_tune::record::AxisLimits;
use quadrant_written::whole;

/// Option that names a simulated stage of one's own.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct OwnStage {
    /// A simulated stage of your own in place of the built-in one: mass, friction, delay, resonance, backlash, encoder and travel of
    /// its axes, in a TOML file (examples/stage.toml has every number).
    #[arg(long, value_name = "FILE")]
    pub(super) stage: Option<PathBuf>,
}

impl OwnStage {
    /// Reads the file, if there is one.
    ///
    /// # Errors
    /// A file that cannot be read, or describes no stage, or one that the firmware has no settings for.
    pub(super) fn read(&self) -> anyhow::Result<Option<StageFile>> {
        let Some(path) = &self.stage else {
            return Ok(None);
        };
        let file = StageFile::read(path)?;
        let settings = StageSetup::of(&file).settings;
        settings.validate(FIRMWARE_ELEMENTS).with_context(|| {
            format!(
                "{}: its limits and its encoder do not go together",
                path.display()
            )
        })?;
        Ok(Some(file))
    }

    /// Returns the option as a command line repeats it, with a space before it; empty without a file.
    pub(super) fn option(&self) -> String {
        let option = |path: &PathBuf| format!(" --stage {}", path.display());
        self.stage.as_ref().map_or_else(String::new, option)
    }
}

/// Name of the simulated stage, for captions.
pub(super) fn name(stage: Option<&StageFile>) -> String {
    stage.map_or_else(
        || BUILT_IN_STAGE.to_owned(),
        |stage| format!("{BUILT_IN_STAGE} of {}", stage.path.display()),
    )
}

/// The same where it is one's own, for a line that says nothing of the built-in one.
pub(super) fn on(stage: Option<&StageFile>) -> String {
    stage.map_or_else(String::new, |_| format!(", on {}", name(stage)))
}

/// Axes that the file describes.
pub(super) fn axes(stage: &StageFile) -> Vec<AxisName> {
    let described = |axis: &AxisName| stage.known[*axis as usize].is_some();
    AxisName::ALL.into_iter().filter(described).collect()
}

/// A stage of one's own under the settings that are given for it, or else under those that commissioning `axes` gives, which are kept
/// among the results.
///
/// # Errors
/// Settings that cannot be read or are for another encoder or amplifier; an axis that cannot be commissioned.
pub(super) fn setup(
    stage: &StageFile,
    axes: &[AxisName],
    given: &LawSettings,
    output: &Output,
) -> anyhow::Result<RunConfiguration> {
    if given.path.is_some() {
        let settings = given.read()?.stage;
        refuse_other_hardware(stage, axes, &settings)?;
        return Ok(RunConfiguration::on(settings, stage.truth.clone()).with_best_pid()?);
    }
    let bar = share("commissioning your stage");
    let done = |share: f64| bar.set_position((1000.0 * share) as u64);
    let settings = commission_stage(stage, axes, output.seed, &done);
    bar.finish_and_clear();
    let settings = settings?;
    keep(stage, axes, &settings, output)?;
    Ok(RunConfiguration::commissioned(
        settings,
        stage.truth.clone(),
        axes,
    )?)
}

/// Writes settings among the results, and says what commissioning chose.
fn keep(
    stage: &StageFile,
    axes: &[AxisName],
    settings: &StageSettings,
    output: &Output,
) -> anyhow::Result<()> {
    let stem = stage.path.file_stem().unwrap_or_default();
    let names: String = axes.iter().map(|axis| axis.as_str()).collect();
    let path = output.file(&format!("{}-{names}-settings.toml", stem.display()))?;
    let mut file = SettingsFile::new(settings.clone());
    let sets = ["feedback", "friction", "feedforward", "plant"];
    for axis in axes {
        file.add_provenance(&command_line(), axis.as_str(), Vec::new(), &sets);
    }
    file.write(&path, whole::write)?;
    let chosen: Vec<String> = axes
        .iter()
        .map(|&axis| {
            let law = Configuration::name_of(&settings.axes[axis as usize]);
            format!("{axis} with {law}")
        })
        .collect();
    say!("Commissioned: {}.", chosen.join(", "));
    say!("{}: its settings\n", path.display());
    Ok(())
}

/// Refuses settings of another encoder or amplifier than the stage has.
///
/// # Errors
/// The first of these axes whose encoder or amplifier is another.
pub(super) fn refuse_other_hardware(
    stage: &StageFile,
    axes: &[AxisName],
    settings: &StageSettings,
) -> anyhow::Result<()> {
    for &axis in axes {
        let truth = &stage.truth.axes[axis as usize];
        let settings = &settings.axes[axis as usize];
        for (what, own, given) in [
            (
                "encoder.resolution_mm",
                truth.resolution_mm,
                settings.encoder.resolution_mm,
            ),
            (
                "amplifier.full_scale_v",
                truth.full_scale_v,
                settings.amplifier.full_scale_v,
            ),
        ] {
            if (own / given - 1.0).abs() > 1e-9 {
                bail!(
                    "--settings have {axis} {what} = {given}, and {} has {own}: give the settings that commissioning this stage left, \
                     leave --settings out, or write the settings' value into the stage's file",
                    stage.path.display()
                );
            }
        }
    }
    Ok(())
}

/// Length of an axis' travel, mm, where the file describes the axis.
fn span_mm(stage: &StageFile, axis: AxisName) -> Option<f64> {
    stage.known[axis as usize].map(|known| known.span_mm())
}

/// Refuses a motion that is longer than the travel of an axis; `what` names its option.
///
/// # Errors
/// A motion over `length_mm` that does not fit.
pub(super) fn refuse_longer(
    stage: &StageFile,
    axis: AxisName,
    length_mm: f64,
    what: &str,
) -> anyhow::Result<()> {
    match span_mm(stage, axis) {
        Some(span_mm) if length_mm > span_mm => bail!(
            "{what} moves {axis} over {length_mm} mm, and its travel in {} is {span_mm} mm: give a smaller one, or a longer travel_mm",
            stage.path.display()
        ),
        _ => Ok(()),
    }
}

/// The limits that a record for an axis of the stage must keep, for those of the built-in stage.
pub(super) fn record_limits(stage: &StageFile, axis: AxisName, built_in: AxisLimits) -> AxisLimits {
    let Some(known) = stage.known[axis as usize] else {
        return built_in;
    };
    AxisLimits {
        travel_mm: known.span_mm(),
        max_velocity_mm_s: known.max_velocity_mm_s,
        max_acceleration_mm_s2: known
            .max_acceleration_mm_s2
            .max(built_in.max_acceleration_mm_s2),
        resolution_mm: stage.truth.axes[axis as usize].resolution_mm,
    }
}

/// True if a motion over `length_mm` fits the travel of every one of these axes.
pub(super) fn fits(stage: &StageFile, axes: &[AxisName], length_mm: f64) -> bool {
    axes.iter()
        .all(|&axis| span_mm(stage, axis).is_none_or(|span_mm| length_mm <= span_mm))
}

/// Half the travel of an axis, mm, where the file describes it.
pub(super) fn half_travel_mm(stage: &StageFile, axis: AxisName) -> Option<f64> {
    span_mm(stage, axis).map(|span_mm| 0.5 * span_mm)
}
