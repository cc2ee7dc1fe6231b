//! The settings that runs on the simulated stage start from.

use std::path::PathBuf;

use anyhow::ensure;
use clap::Args;
use quadrant_law::axes::AxisName;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::settings_file::SettingsFile;

use crate::warn;

/// Option that names the settings of the simulated stage's control law.
#[derive(Clone, Debug, Default, Args)]
pub struct LawSettings {
    /// Settings of the control law, as `quadrant commission` leaves them; without them, those that commissioning the
    /// simulated stage gave, or gives of a stage of your own.
    #[arg(id = "settings", long, value_name = "FILE")]
    pub path: Option<PathBuf>,
}

impl LawSettings {
    /// Reads the settings. An axis that nobody has commissioned there has no law: those of the simulated stage stand for its settings,
    /// with a note.
    ///
    /// # Errors
    /// A file that cannot be read, or settings that the firmware would refuse; an axis that has a law and is not commissioned, or has
    /// no nonlinear gain: the runs enable the outputs, and compare N-PID with PID.
    pub fn read(&self) -> anyhow::Result<SettingsFile> {
        let Some(path) = &self.path else {
            return Ok(identified_settings()?);
        };
        let mut file = SettingsFile::read(path)?;
        let mut inert = AxisName::ALL.to_vec();
        inert.retain(|axis| {
            let own = &file.stage.axes[*axis as usize];
            !own.commissioned && own.feedback.pid.kp_v_per_mm == 0.0
        });
        let shown = path.display();
        for axis in AxisName::ALL {
            let own = &file.stage.axes[axis as usize];
            if inert.contains(&axis) {
                continue;
            }
            ensure!(
                own.commissioned,
                "{shown}: {axis} has a law, but is not commissioned: `quadrant commission --axis {axis} --settings {shown}`, or set \
                 commissioned = true if its gains were checked"
            );
            ensure!(
                own.feedback.nonlinear.is_some(),
                "{shown}: {axis} has the law {} and no nonlinear gain, and N-PID is run beside it: `quadrant design npid --axis {axis} \
                 --settings {shown} --into {shown}` adds one",
                own.feedback.law.name()
            );
        }
        if inert.is_empty() {
            return Ok(file);
        }
        let identified = identified_settings()?;
        for axis in inert {
            file.stage.axes[axis as usize] = identified.stage.axes[axis as usize].clone();
            warn!(
                "note: {axis} is not commissioned in {}: it runs under the settings that came of commissioning the simulated stage",
                shown
            );
        }
        // As if it had been read so.
        file.check(path)?;
        Ok(file)
    }

    /// Returns the option as a command line repeats it, with a space before it; empty without a file.
    pub fn option(&self) -> String {
        let option = |path: &PathBuf| format!(" --settings {}", path.display());
        self.path.as_ref().map_or_else(String::new, option)
    }
}
