//! The settings of a stage as a file: the result of commissioning, and the start of replays, comparisons and the firmware.
//!
//! TOML, with the names and units of [`StageSettings`], and above them where the numbers come from. What it leaves out is
//! the default. A file is checked as a whole, against the firmware's own rules and its room for GMS elements.

mod error;
mod sparse;
mod uncommissioned;

use std::io;
use std::path::Path;

use quadrant_law::axes::AxisName;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_settings::StageSettings;
use serde::{Deserialize, Serialize};

use self::error::FORM;
pub use self::error::SettingsFileError;
pub use self::sparse::defaults_at;
pub use self::uncommissioned::without_law;
use crate::toml_file::{TomlFileError, text_of};

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

/// One command that changed the settings.
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
        Self::parse(&text_of(path)?, path)
    }

    /// Reads a file to start from for a commissioning of `axis`: its law need not suit the rate and the limits, for it is replaced.
    ///
    /// # Errors
    /// As [`read`](Self::read), but for the law of this axis.
    pub fn read_for_commissioning(path: &Path, axis: AxisName) -> Result<Self, SettingsFileError> {
        let mut file: Self = sparse::parsed(&text_of(path)?, path)?;
        file.check_form(path)?;
        if file.check(path).is_err() {
            let rate_hz = file.stage.rate_hz;
            without_law(&mut file.stage.axes[axis as usize], rate_hz);
            file.check(path)?;
        }
        Ok(file)
    }

    /// Checks a file's text; `path` is what messages call it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, path: &Path) -> Result<Self, SettingsFileError> {
        let file: Self = sparse::parsed(text, path)?;
        file.check_form(path)?;
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
        write(path, text).map_err(|source| TomlFileError::io(path, source))?;
        Ok(())
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

    /// Checks the file and returns its text with the settings that differ from the defaults alone, each with its unit and meaning.
    ///
    /// # Errors
    /// A value that the firmware would refuse.
    pub fn sparse_text(&self, path: &Path) -> Result<String, SettingsFileError> {
        self.check(path)?;
        sparse::text(self, &self.stage).map_err(|source| SettingsFileError::Serialise {
            path: path.to_owned(),
            source,
        })
    }

    fn check_form(&self, path: &Path) -> Result<(), SettingsFileError> {
        if self.form == FORM {
            return Ok(());
        }
        Err(SettingsFileError::Form {
            path: path.to_owned(),
            form: self.form,
        })
    }

    /// Checks the settings as a whole; `path` is what messages call the file.
    ///
    /// # Errors
    /// Settings that the firmware would refuse.
    pub fn check(&self, path: &Path) -> Result<(), SettingsFileError> {
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
    use quadrant_law::control::feedback::LawKind;

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
    fn a_setting_is_read_under_its_former_name() {
        let text = "[[stage.axes]]\n[[stage.axes]]\nfeedforward.gains.gms = 0.75\n";
        let gains = parse(text)
            .unwrap()
            .stage
            .axes
            .map(|axis| axis.feedforward.gains);
        assert_eq!(gains[1].presliding, 0.75);
        assert_eq!(
            gains[0].presliding,
            StageSettings::default().axes[0]
                .feedforward
                .gains
                .presliding
        );
        let both = "[[stage.axes]]\nfeedforward.gains = { gms = 0.75, presliding = 0.5 }\n";
        let error = parse(both).unwrap_err();
        assert!(
            error.to_string().contains("x/feedforward/gains/gms"),
            "{error}"
        );
        let error = parse("[[stage.axes]]\nfeedforward.gms = 0.75\n").unwrap_err();
        assert!(error.to_string().contains("x/feedforward/gms"), "{error}");
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
    fn what_a_file_leaves_out_is_the_default() {
        let read = |text: &str| parse(text).unwrap().stage;
        assert_eq!(read("[stage]\n"), StageSettings::default());
        let mut known = StageSettings::default();
        known.axes[1].limits.max_velocity_mm_s = 80.0;
        let one = "[[stage.axes]]\n[[stage.axes]]\nlimits.max_velocity_mm_s = 80\n";
        assert_eq!(read(one), known);
        // A part that is named has its own defaults.
        let homed = read("[[stage.axes]]\n[stage.axes.homing]\ntravel_mm = 300\n");
        let homing = homed.axes[0].homing.as_ref().unwrap();
        assert_eq!((homing.travel_mm, homing.latch_mm_s), (300.0, 1.0));
        // The default filter of the derivative would be refused at this rate.
        let slow = read("stage.rate_hz = 2000\n");
        assert_eq!(slow.axes[2].feedback.pid.derivative_filter_s, 5e-4);
    }

    #[test]
    fn a_sparse_text_has_what_differs_alone_and_reads_back_to_the_last_bit() {
        let mut slow = StageSettings {
            rate_hz: 2e3,
            ..StageSettings::default()
        };
        for axis in &mut slow.axes {
            axis.feedback.pid.derivative_filter_s = 5e-4;
        }
        slow.axes[1].limits.max_velocity_mm_s = 1.0 / 3.0;
        let mut parts = StageSettings::simulated();
        parts.axes[0].feedforward.learning = Some(Default::default());
        let mut simulated = StageSettings::simulated();
        simulated.axes[2].plant = None;
        for stage in [StageSettings::default(), slow.clone(), parts, simulated] {
            let written = SettingsFile { stage, ..file() };
            let text = written.sparse_text(Path::new("stage.toml")).unwrap();
            assert_eq!(parse(&text).unwrap(), written, "{text}");
        }
        let text = SettingsFile::new(slow).sparse_text(Path::new("a")).unwrap();
        assert_eq!(text.matches(" = ").count(), 3, "{text}");
        assert!(
            text.contains("rate_hz = 2000.0 # Hz: Control rate."),
            "{text}"
        );
        assert!(text.contains(" # mm/s: Largest velocity"), "{text}");
    }

    #[test]
    fn a_value_that_no_setting_takes_is_named_with_its_line() {
        let refused = |text: &str| parse(text).unwrap_err().to_string();
        let head = "form = 1\n\n[stage]\nrate_hz = 5000\n\n[[stage.axes]]\n";
        for (text, line, parts) in [
            (
                "[stage.axes.feedback]\nlaw = \"pidd\"\n",
                8,
                "x/feedback/law: unknown variant `pidd`",
            ),
            (
                "limits.max_velocity_mm_s = \"fast\"\n",
                7,
                "x/limits/max_velocity_mm_s: invalid type",
            ),
            (
                "[[stage.axes]]\nencoder = 3\n",
                8,
                "y/encoder: invalid type",
            ),
            (
                "limits.max_velocity = 3\n",
                7,
                "x/limits/max_velocity; did you mean x/limits/max_velocity_mm_s?",
            ),
        ] {
            let message = refused(&format!("{head}{text}"));
            assert!(
                message.starts_with(&format!("stage.toml: line {line}: "))
                    && message.contains(parts),
                "{message}"
            );
        }
        let message = refused("rate_hz = 5000\n");
        assert!(
            message.contains("line 1: ") && message.contains("rate_hz below [stage]"),
            "{message}"
        );
        assert!(refused("form = 1\n").contains("missing field `stage`"));
    }

    #[test]
    fn the_law_of_the_axis_that_is_commissioned_need_not_suit_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stage.toml");
        let mut slower = file();
        slower.stage.rate_hz = 2e3;
        for axis in &mut slower.stage.axes[1..] {
            *axis = defaults_at(2e3).axes[0].clone();
        }
        std::fs::write(&path, toml::to_string_pretty(&slower).unwrap()).unwrap();
        let refused = SettingsFile::read(&path).unwrap_err().to_string();
        assert!(
            refused.contains("x/feedback/pid/derivative_filter_s"),
            "{refused}"
        );
        let read = |axis| SettingsFile::read_for_commissioning(&path, axis);
        let x = &read(AxisName::X).unwrap().stage.axes[0];
        assert_eq!(x.limits, slower.stage.axes[0].limits);
        assert_eq!(x.encoder, slower.stage.axes[0].encoder);
        assert!(x.plant.is_none() && !x.commissioned);
        // Another axis keeps its law, and that must suit.
        let refused = read(AxisName::Y).unwrap_err().to_string();
        assert!(
            refused.contains("x/feedback/pid/derivative_filter_s"),
            "{refused}"
        );
        // Limits are no law.
        slower.stage.axes[0].limits.overspeed_ratio = 9.0;
        std::fs::write(&path, toml::to_string_pretty(&slower).unwrap()).unwrap();
        let refused = read(AxisName::X).unwrap_err().to_string();
        assert!(refused.contains("x/limits/overspeed_ratio"), "{refused}");
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
