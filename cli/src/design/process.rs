//! Options that name the model to design on.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::output::Output;
use quadrant_cli::{say, warn};
use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::AxisSettings;
use quadrant_sim::settings_file::SettingsFile;
use quadrant_tune::design::Form;

use crate::kept;

/// File of the settings in the folder for results.
const SETTINGS: &str = "settings.toml";

/// Options that name a model of an axis: numbers, or settings that hold one.
#[derive(Clone, Debug, Args)]
pub(super) struct Model {
    /// The axis of the settings whose model and gains are taken.
    #[arg(long, value_enum, default_value_t = Axis::X)]
    pub(super) axis: Axis,
    /// Settings of the stage, as `quadrant commission` writes them; without it, those of --into if it is there, else those in the folder
    /// for results, else the built-in ones.
    #[arg(long, value_name = "FILE")]
    pub(super) settings: Option<PathBuf>,
    /// Write the result into the settings of --axis in this file; the other settings are those of --settings, else those of this file
    /// if it is there.
    #[arg(long, value_name = "FILE")]
    into: Option<PathBuf>,
    /// A, acceleration per volt, mm/(V s²), in place of the settings' model; the next three go with it.
    #[arg(long, value_name = "MM_PER_V_S2", requires = "damping")]
    gain: Option<f64>,
    /// B, damping over mass, 1/s.
    #[arg(long, value_name = "PER_S", requires = "gain")]
    damping: Option<f64>,
    /// C, stiffness over mass, 1/s².
    #[arg(long, value_name = "PER_S2", requires = "gain")]
    stiffness: Option<f64>,
    /// Td, dead time without the converter's hold, s.
    #[arg(long, value_name = "S", requires = "gain")]
    delay: Option<f64>,
    /// Control rate, Hz; without it, that of the settings.
    #[arg(long, value_name = "HZ")]
    rate_hz: Option<f64>,
    /// From reading the encoder to writing the converter, s.
    #[arg(long, default_value_t = 0.0, value_name = "S")]
    pub(super) computation_delay_s: f64,
}

impl Model {
    /// Reads the stage's settings, and says where they come from: what is in the folder for results stays there, so a design goes on
    /// from it.
    pub(super) fn file(&self, output: &Output) -> anyhow::Result<(SettingsFile, String)> {
        let of = |path: &Path| match self.gain {
            Some(_) => "A model given by its parameters".to_owned(),
            None => format!("The {} axis of {}", self.axis.name(), path.display()),
        };
        let existing = self.into.as_ref().filter(|path| path.exists());
        if let Some(path) = self.settings.as_ref().or(existing) {
            return Ok((SettingsFile::read(path)?, of(path)));
        }
        let left = output.file(SETTINGS)?;
        if left.exists() {
            warn!(
                "starting from {}; --settings takes another file, --out another folder",
                left.display()
            );
            return Ok((SettingsFile::read(&left)?, of(&left)));
        }
        let file = match self.gain {
            // The built-in models are not those of this machine.
            Some(_) => kept::built_in_for(self.axis.into()),
            None => kept::built_in(),
        };
        Ok((file, of(Path::new("the built-in settings"))))
    }

    /// The axis' settings in them.
    pub(super) fn axis<'a>(&self, file: &'a SettingsFile) -> &'a AxisSettings {
        &file.stage.axes[self.axis.index()]
    }

    /// The filters behind the axis' law.
    pub(super) fn filters(&self, file: &SettingsFile) -> Vec<FilterSettings> {
        let filters = self.axis(file).feedback.filters.as_deref();
        filters.unwrap_or_default().to_vec()
    }

    /// Returns the linear model, checked.
    pub(super) fn plant(&self, file: &SettingsFile) -> anyhow::Result<PlantModel> {
        let plant = match self.gain {
            None => self.axis(file).plant.with_context(|| {
                format!(
                    "the settings hold no model of the {} axis: commission it, or give --gain, --damping, --stiffness and --delay",
                    self.axis.name()
                )
            })?,
            Some(gain_mm_per_v_s2) => PlantModel {
                gain_mm_per_v_s2,
                damping_per_s: self.damping.unwrap_or(0.0),
                stiffness_per_s2: self.stiffness.unwrap_or(0.0),
                delay_s: self.delay.unwrap_or(0.0),
            },
        };
        if !plant.is_valid() {
            bail!(
                "A = {} mm/(V s²), B = {} 1/s, C = {} 1/s², Td = {} s is no model: A must be above zero, the others zero or more",
                plant.gain_mm_per_v_s2,
                plant.damping_per_s,
                plant.stiffness_per_s2,
                plant.delay_s
            );
        }
        Ok(plant)
    }

    /// The loop as it runs.
    pub(super) fn sampled(&self, file: &SettingsFile) -> anyhow::Result<Form> {
        let rate_hz = self.rate_hz.unwrap_or(file.stage.rate_hz);
        if !(1e3..=1e5).contains(&rate_hz) {
            bail!("--rate-hz {rate_hz}: the control rate must be 1000 to 100000 Hz");
        }
        if !(0.0..=10.0 / rate_hz).contains(&self.computation_delay_s) {
            bail!(
                "--computation-delay-s {}: it must be zero to ten control periods",
                self.computation_delay_s
            );
        }
        Ok(Form::Sampled {
            sample_time_s: 1.0 / rate_hz,
            computation_delay_s: self.computation_delay_s,
        })
    }

    /// Writes the settings with what a design changes of the axis, checked as a whole.
    pub(super) fn write(
        &self,
        output: &Output,
        mut file: SettingsFile,
        command: &str,
        records: Vec<String>,
        sets: &str,
        change: impl FnOnce(&mut AxisSettings),
    ) -> anyhow::Result<()> {
        let start = file.stage.clone();
        let axis = &mut file.stage.axes[self.axis.index()];
        let feedback = axis.feedback.clone();
        change(axis);
        if are_rounded(&axis.feedback.pid, &feedback.pid) {
            axis.feedback.pid = feedback.pid;
        }
        if axis.commissioned && axis.feedback != feedback {
            warn!(
                "note: {name} was commissioned under the other gains, and its feedforward was tried with them; `quadrant commission \
                 --axis {name}` tries it with these",
                name = self.axis.name()
            );
        }
        file.add_provenance(command, self.axis.name(), records, &[sets]);
        let path = match &self.into {
            Some(path) => path.clone(),
            None => output.file(SETTINGS)?,
        };
        kept::refuse_loss(&path, &start, &file.stage)?;
        for line in kept::write(&file, &start, &path)? {
            say!("{line}");
        }
        say!(
            "{}: the settings with this {sets} of {}",
            path.display(),
            self.axis.name()
        );
        Ok(())
    }
}

/// Relative difference of two gains that rounding makes.
const ROUNDING: f64 = 1e-9;

/// True if gains differ by rounding at most.
fn are_rounded(found: &PidGains, before: &PidGains) -> bool {
    let values = |gains: &PidGains| {
        [
            gains.kp_v_per_mm,
            gains.ki_v_per_mm_s,
            gains.kd_v_s_per_mm,
            gains.derivative_filter_s,
        ]
    };
    let pairs = values(found).into_iter().zip(values(before));
    pairs
        .into_iter()
        .all(|(found, before)| (found - before).abs() <= ROUNDING * before.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_that_differ_by_rounding_alone_are_the_same_gains() {
        let before = PidGains {
            kp_v_per_mm: 1.329_923_982_666_029,
            ki_v_per_mm_s: 146.0,
            kd_v_s_per_mm: 5.5e-3,
            derivative_filter_s: 1e-4,
        };
        let with_kp = |kp_v_per_mm| PidGains {
            kp_v_per_mm,
            ..before
        };
        assert!(are_rounded(&with_kp(1.329_923_982_666_029_4), &before));
        assert!(!are_rounded(&with_kp(1.3300), &before));
    }
}
