//! Subject of a step: an axis of a machine, or a saved recording, with settings before and after.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use quadrant::axes::AxisName;
use quadrant::settings::{AxisSettings, StageSettings};
use quadrant_sim::machine::{Machine, TestAxis};
use quadrant_sim::settings_file::SettingsFile;

use super::endpoint::Endpoint;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::command_line;
use quadrant_cli::say;

/// Options that name the axis, the machine and the settings to start from.
#[derive(Clone, Debug, Args)]
pub(super) struct Subject {
    /// The axis: of the machine, or, with --record, of --settings and --into.
    #[arg(long, value_enum, required_unless_present = "record")]
    pub(super) axis: Option<Axis>,
    /// The machine: law (the control law alone on the simulated stage), simulated (the firmware's application on it),
    /// emulated or emulated:ELF (its image in QEMU), serial:PORT, tcp:HOST:PORT.
    #[arg(
        long,
        default_value = "law",
        value_name = "MACHINE",
        conflicts_with = "record"
    )]
    pub(super) machine: Endpoint,
    /// Travel either way from where the axis stands, mm; without it, that to the soft limits of a homed axis.
    #[arg(long, value_name = "MM", value_parser = travel, conflicts_with = "record")]
    pub(super) travel: Option<f64>,
    /// Settings to start from; without them those of --into if it is there, else those that the machine has.
    #[arg(long, value_name = "FILE")]
    pub(super) settings: Option<PathBuf>,
}

/// Option that names the settings to write.
#[derive(Clone, Debug, Args)]
pub(super) struct Destination {
    /// Write the result into the settings of --axis in this file; the other settings are those that the step started from.
    #[arg(long, value_name = "FILE", requires = "axis")]
    pub(super) into: Option<PathBuf>,
}

/// Measurements, and the machine that they were made on.
pub(super) struct Measured<T> {
    /// Result of the step's function.
    pub(super) found: T,
    /// The axis, for pages: "x axis of the simulated stage".
    pub(super) title: String,
    /// Settings of the machine.
    pub(super) stage: StageSettings,
}

/// Reads a travel, mm.
pub(super) fn travel(text: &str) -> Result<f64, String> {
    const MOST_MM: f64 = 1e4;
    let value: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if value > 0.0 && value <= MOST_MM {
        Ok(value)
    } else {
        Err(format!("it must be above 0 and at most {MOST_MM} mm"))
    }
}

/// Returns the travel that is given, else that to the soft limits, else `fallback_mm`.
pub(super) fn travel_mm(
    machine: &mut dyn Machine,
    axis: AxisName,
    given_mm: Option<f64>,
    fallback_mm: Option<f64>,
) -> anyhow::Result<f64> {
    let known_mm = match given_mm {
        Some(travel_mm) => Some(travel_mm),
        None => machine.free_travel_mm(axis)?,
    };
    known_mm.or(fallback_mm).with_context(|| {
        format!(
            "{axis} is not homed, or has no travel: home it and move it to the middle of its travel, or say with \
             --travel how far it may go from where it stands"
        )
    })
}

/// Runs `measure` on an axis, with the settings to start from: `start`, else those in force, which it has again
/// afterwards, whatever came of it.
pub(super) fn on_axis<T>(
    machine: &mut dyn Machine,
    axis: AxisName,
    travel_mm: f64,
    start: Option<&AxisSettings>,
    measure: impl FnOnce(&mut dyn TestAxis, &AxisSettings) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let mut test_axis = machine.test_axis(axis, travel_mm)?;
    let before = test_axis.settings().clone();
    let outcome = measure(&mut *test_axis, start.unwrap_or(&before));
    test_axis.apply(&before)?;
    outcome
}

impl Subject {
    /// Returns the axis, which must be given.
    pub(super) fn axis(&self) -> anyhow::Result<Axis> {
        self.axis
            .context("--axis is needed: which axis of the settings is it?")
    }

    /// Reads the settings to start from, if there are any.
    pub(super) fn start(&self, into: Option<&Path>) -> anyhow::Result<Option<SettingsFile>> {
        let existing = into.filter(|path| path.exists());
        let path = self.settings.as_deref().or(existing);
        Ok(path.map(SettingsFile::read).transpose()?)
    }

    /// Reads the axis' settings to start from, if there are any.
    pub(super) fn start_axis(&self, into: Option<&Path>) -> anyhow::Result<Option<AxisSettings>> {
        let (Some(file), Some(axis)) = (self.start(into)?, self.axis) else {
            return Ok(None);
        };
        Ok(Some(file.stage.axes[axis.index()].clone()))
    }

    /// Runs `measure` on the machine's axis. `fallback_mm` is the travel of an axis of which none is known.
    pub(super) fn measure<T>(
        &self,
        seed: u64,
        start: Option<&AxisSettings>,
        fallback_mm: Option<f64>,
        measure: impl FnOnce(&mut dyn TestAxis, &AxisSettings) -> anyhow::Result<T>,
    ) -> anyhow::Result<Measured<T>> {
        let axis = AxisName::from(self.axis()?);
        let mut machine = self.machine.open(seed)?;
        let travel_mm = travel_mm(&mut *machine, axis, self.travel, fallback_mm)?;
        let stage = machine.settings()?;
        let found = on_axis(&mut *machine, axis, travel_mm, start, measure)?;
        if machine.is_simulated() {
            say!("Simulated, not measured.");
        }
        Ok(Measured {
            found,
            title: format!("{axis} axis of {}", machine.description()),
            stage,
        })
    }
}

impl Destination {
    /// Writes what a step changes in the axis' settings, if that is asked for: into those that the step started from, else
    /// those of the machine, else the defaults.
    pub(super) fn write(
        &self,
        subject: &Subject,
        machine: Option<StageSettings>,
        records: &[PathBuf],
        sets: &[&str],
        change: impl FnOnce(&mut AxisSettings),
    ) -> anyhow::Result<()> {
        let Some(path) = &self.into else {
            return Ok(());
        };
        let axis = subject.axis()?;
        let mut file = match subject.start(Some(path))? {
            Some(file) => file,
            None => SettingsFile::new(machine.unwrap_or_else(StageSettings::simulated)),
        };
        change(&mut file.stage.axes[axis.index()]);
        let records = records
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        file.add_provenance(&command_line(), axis.name(), records, sets);
        file.write(path)?;
        say!(
            "{}: the settings with this {} of {}",
            path.display(),
            sets.join(" and "),
            axis.name()
        );
        Ok(())
    }
}
