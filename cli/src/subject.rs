//! Subject of a step: an axis of a machine, or a saved recording, with settings before and after.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::command_line;
use quadrant_cli::{explained, say};
use quadrant_host::machine::Machine;
use quadrant_law::axes::AxisName;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::settings_file::SettingsFile;
use quadrant_tune::test_axis::{MachineError, TestAxis, Travel};

use super::endpoint::{Endpoint, Simulation};
use super::kept;
use super::own_stage::OwnStage;

/// Options that name the axis, the machine and the settings to start from.
#[derive(Clone, Debug, Args)]
pub(super) struct Subject {
    /// The axis: of the machine, or, with --record, of --settings and --into.
    #[arg(long, value_enum, required_unless_present = "record")]
    pub(super) axis: Option<Axis>,
    /// The machine: law (the control law alone on the simulated stage), simulated (the firmware's application on it, not
    /// commissioned), simulated:commissioned, emulated or emulated:ELF (its image in QEMU), serial:PORT, tcp:HOST:PORT.
    #[arg(
        long,
        default_value = "law",
        value_name = "MACHINE",
        conflicts_with = "record"
    )]
    pub(super) machine: Endpoint,
    #[command(flatten)]
    pub(super) stage: OwnStage,
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

/// Largest travel, mm.
const MOST_MM: f64 = 1e4;

/// Reads a travel, mm.
pub(super) fn travel(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "no number".to_owned())?;
    if value > 0.0 && value <= MOST_MM {
        Ok(value)
    } else {
        Err(format!("it must be above 0 and at most {MOST_MM} mm"))
    }
}

/// Reads a travel from where the axis stands: "200" either way, mm, or "-5..180".
pub(super) fn travel_both_ways(text: &str) -> Result<Travel, String> {
    let Some((low, high)) = text.split_once("..") else {
        return travel(text).map(Travel::either_way);
    };
    let bound = |name: &str, text: &str, least: f64, most: f64| -> Result<f64, String> {
        let value: f64 = text
            .parse()
            .map_err(|_| format!("{name} end {text:?}: no number"))?;
        if (least..=most).contains(&value) {
            Ok(value)
        } else {
            Err(format!(
                "{name} end {value} mm: it must be {least} to {most} mm"
            ))
        }
    };
    let low_mm = bound("lower", low, -MOST_MM, 0.0)?;
    let high_mm = bound("upper", high, 0.0, MOST_MM)?;
    if low_mm == high_mm {
        return Err("the ends are the same: the axis could not move".to_owned());
    }
    Ok(Travel {
        negative_mm: -low_mm,
        positive_mm: high_mm,
    })
}

/// Returns the travel that is given, else that to the soft limits.
pub(super) fn known_travel(
    machine: &mut dyn Machine,
    axis: AxisName,
    given: Option<Travel>,
) -> anyhow::Result<Travel> {
    let known = match given {
        Some(travel) => Some(travel),
        None => machine.free_travel(axis)?,
    };
    let travel = known.with_context(|| unknown_travel(axis))?;
    if travel.half_mm() < LEAST_ROOM_MM {
        bail!(
            "{axis} has a travel of {:.2} mm in all, and at least {} mm are needed: the first test is in open loop",
            2.0 * travel.half_mm(),
            2.0 * LEAST_ROOM_MM
        );
    }
    if travel.nearer_mm() < LEAST_ROOM_MM {
        bail!(
            "{axis} stands {:.2} mm from an end of its travel: move it to at least {LEAST_ROOM_MM} mm from it, for the first test is in \
             open loop",
            travel.nearer_mm()
        );
    }
    Ok(travel)
}

/// Least way to the nearer end from where an axis is commissioned, mm.
const LEAST_ROOM_MM: f64 = 2.0;

/// Returns the travel either way that is given, else that to the nearer soft limit, else `fallback_mm`.
pub(super) fn travel_mm(
    machine: &mut dyn Machine,
    axis: AxisName,
    given_mm: Option<f64>,
    fallback_mm: Option<f64>,
) -> anyhow::Result<f64> {
    let known_mm = match given_mm {
        Some(travel_mm) => Some(travel_mm),
        None => machine.free_travel(axis)?.map(Travel::nearer_mm),
    };
    known_mm
        .or(fallback_mm)
        .with_context(|| unknown_travel(axis))
}

fn unknown_travel(axis: AxisName) -> String {
    format!(
        "{axis} is not homed, or has no travel: home it, or say with --travel how far it may go from where it stands"
    )
}

/// Runs `measure` on an axis, with the settings to start from: `start`, else those in force, which it has again
/// afterwards, also after an error. `measure` writes its recordings: they are there though the settings are not taken back.
pub(super) fn on_axis<T>(
    machine: &mut dyn Machine,
    axis: AxisName,
    travel_mm: f64,
    start: Option<&AxisSettings>,
    measure: impl FnOnce(&mut dyn TestAxis, &AxisSettings) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let mut test_axis = machine.test_axis(axis, Travel::either_way(travel_mm))?;
    let before = test_axis.settings().clone();
    let outcome = measure(&mut *test_axis, start.unwrap_or(&before));
    let restored = test_axis.apply(&before);
    and_restored(outcome, restored)
}

/// The outcome of a measurement, after which a machine was to take its old settings back: of two errors both, the measurement's
/// first.
pub(super) fn and_restored<T>(
    outcome: anyhow::Result<T>,
    restored: Result<(), MachineError>,
) -> anyhow::Result<T> {
    let restored = restored.context("the machine did not take its old settings back");
    match (outcome, restored) {
        (outcome, Ok(())) => outcome,
        (Ok(_), Err(error)) => Err(error),
        (Err(first), Err(second)) => bail!("{}; {}", explained(&first), explained(&second)),
    }
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

    /// Runs `measure` on the machine's axis, as [`on_axis`]. `fallback_mm` is the travel of an axis of which none is known.
    pub(super) fn measure<T>(
        &self,
        seed: u64,
        start: Option<&AxisSettings>,
        fallback_mm: Option<f64>,
        measure: impl FnOnce(&mut dyn TestAxis, &AxisSettings) -> anyhow::Result<T>,
    ) -> anyhow::Result<Measured<T>> {
        let axis = AxisName::from(self.axis()?);
        let simulation = Simulation {
            seed,
            stage: self.stage.read()?,
            // A simulated machine has the encoders and the rate of the settings to start from.
            start: self.start(None)?.map(|file| file.stage),
            ..Simulation::default()
        };
        let known = simulation.stage.as_ref();
        let known = known.and_then(|stage| stage.known[axis as usize]);
        let nearer_mm = known.map(|known| Travel::between(known.travel_mm).nearer_mm());
        let mut machine = self.machine.open(&simulation)?;
        let given_mm = self.travel.or(nearer_mm);
        let travel_mm = travel_mm(&mut *machine, axis, given_mm, fallback_mm)?;
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
    /// those of the machine, else the built-in ones without any law.
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
        let mut file = match (subject.start(Some(path))?, machine) {
            (Some(file), _) => file,
            (None, Some(machine)) => SettingsFile::new(machine),
            (None, None) => kept::without_laws(axis.into()),
        };
        let start = file.stage.clone();
        change(&mut file.stage.axes[axis.index()]);
        let records = records
            .iter()
            .map(|path| path.display().to_string())
            .collect();
        file.add_provenance(&command_line(), axis.name(), records, sets);
        kept::refuse_loss(path, &start, &file.stage)?;
        for line in kept::write(&file, &start, path)? {
            say!("{line}");
        }
        say!(
            "{}: the settings with this {} of {}",
            path.display(),
            sets.join(" and "),
            axis.name()
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use quadrant_host::machine::LawStage;
    use quadrant_tune::record::Recording;
    use quadrant_tune::test_axis::{AxisInfo, Experiment, ExperimentError};

    use super::*;

    /// An axis of the simulated stage that does not take the settings back that it had.
    struct Stubborn<'a> {
        axis: Box<dyn TestAxis + 'a>,
        applied: usize,
    }

    impl TestAxis for Stubborn<'_> {
        fn info(&self) -> AxisInfo {
            self.axis.info()
        }

        fn settings(&self) -> &AxisSettings {
            self.axis.settings()
        }

        fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
            self.applied += 1;
            if self.applied > 1 {
                return Err(MachineError::Connection("the cable is out".into()));
            }
            self.axis.apply(settings)
        }

        fn switch_off(&mut self) -> Result<(), ExperimentError> {
            self.axis.switch_off()
        }

        fn perform(
            &mut self,
            experiment: &Experiment,
            progress: &mut dyn FnMut(f64),
        ) -> Result<Recording, ExperimentError> {
            self.axis.perform(experiment, progress)
        }
    }

    struct StubbornStage(LawStage);

    impl Machine for StubbornStage {
        fn description(&self) -> String {
            self.0.description()
        }

        fn is_simulated(&mut self) -> bool {
            true
        }

        fn settings(&mut self) -> Result<StageSettings, MachineError> {
            self.0.settings()
        }

        fn position_mm(&mut self, axis: AxisName) -> Result<f64, MachineError> {
            self.0.position_mm(axis)
        }

        fn free_travel(&mut self, axis: AxisName) -> Result<Option<Travel>, MachineError> {
            self.0.free_travel(axis)
        }

        fn test_axis(
            &mut self,
            axis: AxisName,
            travel: Travel,
        ) -> Result<Box<dyn TestAxis + '_>, MachineError> {
            let axis = self.0.test_axis(axis, travel)?;
            Ok(Box::new(Stubborn { axis, applied: 0 }))
        }

        fn load(&mut self, settings: &StageSettings) -> Result<(), MachineError> {
            self.0.load(settings)
        }

        fn store(&mut self, provenance: &str) -> Result<(), MachineError> {
            self.0.store(provenance)
        }
    }

    /// The message of a measurement on it.
    fn measured_in_vain(outcome: anyhow::Result<()>) -> String {
        let mut machine = StubbornStage(LawStage::new(1));
        let found = on_axis(&mut machine, AxisName::X, 20.0, None, |axis, base| {
            axis.apply(base)?;
            outcome
        });
        quadrant_cli::explained(&found.unwrap_err())
    }

    #[test]
    fn a_measurement_that_failed_says_so_though_the_settings_are_not_taken_back_either() {
        let one = measured_in_vain(Ok(()));
        assert!(
            one.contains("old settings") && one.contains("the cable is out"),
            "{one}"
        );
        let both = measured_in_vain(Err(anyhow::anyhow!("nothing moved")));
        assert!(both.starts_with("nothing moved"), "{both}");
        assert!(both.contains("the cable is out"), "{both}");
    }

    #[test]
    fn a_travel_is_as_much_either_way_or_from_one_end_to_the_other() {
        assert_eq!(travel_both_ways("200"), Ok(Travel::either_way(200.0)));
        let near_an_end = Travel {
            negative_mm: 5.0,
            positive_mm: 180.0,
        };
        assert_eq!(travel_both_ways("-5..180"), Ok(near_an_end));
        assert!(travel_both_ways("0..180").is_ok());
        for (text, said) in [
            ("5..180", "lower end 5 mm: it must be -10000 to 0 mm"),
            ("-5..-1", "upper end -1 mm: it must be 0 to 10000 mm"),
            ("-5..x", "upper end \"x\""),
            ("0..0", "could not move"),
            ("-5", "above 0"),
        ] {
            let refused = travel_both_ways(text).unwrap_err();
            assert!(refused.contains(said), "{text}: {refused}");
        }
    }
}
