//! The settings of a stage as a file: the result of commissioning, and the start of replays, comparisons and the firmware.
//!
//! TOML, with the names and units of [`StageSettings`], and above them where the numbers come from. A file is checked
//! as a whole, against the firmware's own rules and its room for GMS elements.

use std::io;
use std::path::{Path, PathBuf};

use quadrant::axes::AxisName;
use quadrant::friction::gms::FIRMWARE_ELEMENTS;
use quadrant::settings::{SettingsError, StageSettings};
use serde::{Deserialize, Serialize};

/// Form of the file; a file of another form is refused.
const FORM: u32 = 1;

/// A stage's settings and their origin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SettingsFile {
    /// Form of the file: 1.
    form: u32,
    /// Origin of the numbers, newest last.
    #[serde(default)]
    pub provenance: Vec<Provenance>,
    /// The settings.
    pub stage: StageSettings,
}

/// One command that had a hand in the settings.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The command line that wrote the settings.
    pub command: String,
    /// Version of the program.
    pub version: String,
    /// The axis that it set: "x", "y" or "z".
    pub axis: String,
    /// The recordings that it worked on, and what each was for.
    pub records: Vec<String>,
    /// Settings that it set.
    pub sets: Vec<String>,
}

/// Reason why a settings file cannot be used, or written.
#[derive(Debug, thiserror::Error)]
pub enum SettingsFileError {
    /// The file cannot be read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// It is no TOML, a field is missing, misspelt, or of the wrong type.
    #[error("{}: {source}", path.display())]
    Syntax {
        /// Path of the file.
        path: PathBuf,
        /// Line and cause.
        source: Box<toml::de::Error>,
    },
    /// It cannot be expressed as TOML.
    #[error("{}: {source}", path.display())]
    Serialise {
        /// Path of the file.
        path: PathBuf,
        /// Cause.
        source: toml::ser::Error,
    },
    /// It is of a form that this program does not know.
    #[error("{}: form {form} of the settings file; this program reads form {FORM}", path.display())]
    Form {
        /// Path of the file.
        path: PathBuf,
        /// Form that the file names.
        form: u32,
    },
    /// It has more axes than a stage.
    #[error("{}: {count} times [[stage.axes]]; a stage has x, y and z", path.display())]
    Axes {
        /// Path of the file.
        path: PathBuf,
        /// Number of axes that the file has.
        count: usize,
    },
    /// A value is refused.
    #[error("{}: {source}", path.display())]
    Refused {
        /// Path of the file.
        path: PathBuf,
        /// The field and what is allowed.
        source: SettingsError,
    },
}

impl SettingsFile {
    /// A file for these settings, of unknown origin.
    pub fn new(stage: StageSettings) -> Self {
        Self {
            form: FORM,
            provenance: Vec::new(),
            stage,
        }
    }

    /// Adds a command that has set `sets` on an axis from `records`.
    pub fn add_provenance(
        &mut self,
        command: &str,
        axis: &str,
        records: Vec<String>,
        sets: &[&str],
    ) {
        self.provenance.push(Provenance {
            command: command.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            axis: axis.to_owned(),
            records,
            sets: sets.iter().map(|&part| part.to_owned()).collect(),
        });
    }

    /// Exchanges an axis for a machine's, with the origin of what it had; everything else stays.
    ///
    /// # Errors
    /// The first sign that the file is of another machine: the control rate, or the encoder or amplifier of another axis.
    pub fn exchange_axis(&mut self, machine: &StageSettings, axis: AxisName) -> Result<(), String> {
        if self.stage.rate_hz != machine.rate_hz {
            return Err("the control rate".to_owned());
        }
        for other in AxisName::ALL.into_iter().filter(|other| *other != axis) {
            let [here, there] = [&self.stage, machine].map(|stage| &stage.axes[other as usize]);
            if here.encoder != there.encoder {
                return Err(format!("the encoder of {other}"));
            }
            if here.amplifier != there.amplifier {
                return Err(format!("the amplifier of {other}"));
            }
        }
        self.stage.axes[axis as usize].clone_from(&machine.axes[axis as usize]);
        self.provenance
            .retain(|origin| origin.axis != axis.as_str());
        Ok(())
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// A file that cannot be read or understood, or the first value that the firmware would refuse.
    pub fn read(path: &Path) -> Result<Self, SettingsFileError> {
        let text = std::fs::read_to_string(path).map_err(|source| SettingsFileError::Io {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text, path)
    }

    /// Checks a file's text; `path` is what messages call it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, path: &Path) -> Result<Self, SettingsFileError> {
        let file: Self = toml::from_str(text).map_err(|source| SettingsFileError::Syntax {
            path: path.to_owned(),
            source: Box::new(source),
        })?;
        // What is too many for an array is passed over in silence.
        let axes = toml::from_str::<toml::Table>(text)
            .ok()
            .and_then(|table| table.get("stage")?.get("axes")?.as_array().map(Vec::len));
        if let Some(count) = axes.filter(|count| *count > AxisName::ALL.len()) {
            return Err(SettingsFileError::Axes {
                path: path.to_owned(),
                count,
            });
        }
        if file.form != FORM {
            return Err(SettingsFileError::Form {
                path: path.to_owned(),
                form: file.form,
            });
        }
        file.check(path)?;
        Ok(file)
    }

    /// Checks the file, and has `write` write it.
    ///
    /// # Errors
    /// A value that the firmware would refuse, in which case nothing is written; or a file that cannot be written.
    pub fn write(
        &self,
        path: &Path,
        write: impl FnOnce(&Path, String) -> io::Result<()>,
    ) -> Result<(), SettingsFileError> {
        let text = self.text(path)?;
        write(path, text).map_err(|source| SettingsFileError::Io {
            path: path.to_owned(),
            source,
        })
    }

    /// Checks the file and returns its text; `path` is what messages call it.
    ///
    /// # Errors
    /// A value that the firmware would refuse.
    pub fn text(&self, path: &Path) -> Result<String, SettingsFileError> {
        self.check(path)?;
        toml::to_string_pretty(self).map_err(|source| SettingsFileError::Serialise {
            path: path.to_owned(),
            source,
        })
    }

    fn check(&self, path: &Path) -> Result<(), SettingsFileError> {
        self.stage
            .validate(FIRMWARE_ELEMENTS)
            .map_err(|source| SettingsFileError::Refused {
                path: path.to_owned(),
                source,
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quadrant::control::feedback::LawKind;

    fn file() -> SettingsFile {
        SettingsFile {
            provenance: vec![Provenance {
                command: "quadrant commission --axis x".to_owned(),
                version: "0.1.0".to_owned(),
                axis: "x".to_owned(),
                records: vec!["frf.csv".to_owned()],
                sets: vec!["plant".to_owned()],
            }],
            ..SettingsFile::new(StageSettings::simulated())
        }
    }

    fn parse(text: &str) -> Result<SettingsFile, SettingsFileError> {
        SettingsFile::parse(text, Path::new("stage.toml"))
    }

    #[test]
    fn a_fourth_axis_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stage.toml");
        file()
            .write(&path, |path, text| std::fs::write(path, text))
            .unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let at = text.rfind("[[stage.axes]]").unwrap();
        let error = parse(&format!("{text}\n{}", &text[at..])).unwrap_err();
        assert!(
            error.to_string().contains("4 times [[stage.axes]]"),
            "{error}"
        );
    }

    #[test]
    fn an_axis_is_exchanged_unless_the_file_is_of_another_machine() {
        let mut earlier = file();
        earlier.stage.brake.release_s = 0.2;
        for axis in &mut earlier.stage.axes {
            axis.feedback.pid.kp_v_per_mm *= 1.5;
        }
        let machine = StageSettings::simulated();
        let mut later = earlier.clone();
        later.exchange_axis(&machine, AxisName::Y).unwrap();
        assert_eq!(later.stage.axes[0], earlier.stage.axes[0]);
        assert_eq!(later.stage.axes[1], machine.axes[1]);
        assert_eq!(later.stage.brake, earlier.stage.brake);
        assert_eq!(later.provenance, earlier.provenance);
        later.exchange_axis(&machine, AxisName::X).unwrap();
        assert_eq!(later.provenance, []);

        let exchanged = |change: fn(&mut StageSettings)| {
            let mut other = machine.clone();
            change(&mut other);
            file().exchange_axis(&other, AxisName::Y)
        };
        let of = |what: &str| Err(what.to_owned());
        assert_eq!(
            exchanged(|stage| stage.rate_hz = 5e3),
            of("the control rate")
        );
        let encoder = exchanged(|stage| stage.axes[0].encoder.resolution_mm *= 2.0);
        assert_eq!(encoder, of("the encoder of x"));
        let amplifier = exchanged(|stage| stage.axes[2].amplifier.reversed = true);
        assert_eq!(amplifier, of("the amplifier of z"));
        assert_eq!(
            exchanged(|stage| stage.axes[1].encoder.reversed = true),
            Ok(())
        );
    }

    #[test]
    fn what_is_written_reads_back_to_the_last_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stage.toml");
        let mut written = file();
        written.stage.axes[1].feedback.law = LawKind::Pid;
        written.stage.axes[1].feedback.nonlinear = None;
        written.stage.axes[2].plant = None;
        written.stage.axes[0].feedback.pid.kp_v_per_mm = 1.0 / 3.0;
        written
            .write(&path, |path, text| std::fs::write(path, text))
            .unwrap();
        assert_eq!(SettingsFile::read(&path).unwrap(), written);
    }

    #[test]
    fn a_misspelt_field_is_named_with_its_line() {
        let text = toml::to_string_pretty(&file()).unwrap();
        let misspelt = text.replacen("kp_v_per_mm", "kp_v_per_m", 1);
        let message = parse(&misspelt).unwrap_err().to_string();
        assert!(
            message.contains("kp_v_per_m") && message.contains("line"),
            "{message}"
        );
    }

    #[test]
    fn a_refused_value_is_named_with_its_limits() {
        let mut bad = file();
        bad.stage.axes[1].encoder.resolution_mm = 7.0;
        let text = toml::to_string_pretty(&bad).unwrap();
        assert_eq!(
            parse(&text).unwrap_err().to_string(),
            "stage.toml: y/encoder/resolution_mm = 7 is outside 0.000001 to 1"
        );
    }

    #[test]
    fn refused_settings_are_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stage.toml");
        file()
            .write(&path, |path, text| std::fs::write(path, text))
            .unwrap();
        let mut bad = file();
        bad.stage.rate_hz = f64::NAN;
        assert!(
            bad.write(&path, |path, text| std::fs::write(path, text))
                .is_err()
        );
        assert_eq!(SettingsFile::read(&path).unwrap(), file());
    }

    #[test]
    fn another_form_is_refused() {
        let newer = SettingsFile { form: 2, ..file() };
        let text = toml::to_string_pretty(&newer).unwrap();
        let message = parse(&text).unwrap_err().to_string();
        assert_eq!(
            message,
            "stage.toml: form 2 of the settings file; this program reads form 1"
        );
    }
}
