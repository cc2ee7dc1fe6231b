//! A simulated stage of one's own as a file: what a person knows or guesses of an axis, in the units of data sheets.
//!
//! TOML with a table for each of `x`, `y` and `z`. What is left out of a table is that of the simulated stage's x axis; an
//! axis without a table is the simulated stage's own.

mod fields;

use std::path::{Path, PathBuf};

use quadrant::axes::AxisName;
use quadrant::friction::PerDirection;
use quadrant::friction::dahl::DahlParameters;
use quadrant::friction::lugre::LugreParameters;
use quadrant::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant::friction::stribeck::{StaticFriction, StribeckCurve};
use serde::Deserialize;

use self::fields::Numbers;
pub use self::fields::{FIELDS, Field};
use crate::plant::{
    AxisParameters, Backlash, Drive, EncoderSide, FrictionParameters, Imperfections,
    MarkParameters, PLANT_ELEMENTS, StageParameters, virgin_curve_elements,
};

/// Travel where it is left out, from where the axis stands, mm.
const TRAVEL_MM: [f64; 2] = [-200.0, 200.0];
/// Distance of the limit switches from the ends of the travel, mm.
const LIMIT_BEYOND_MM: f64 = 5.0;
/// Shares of the way to the negative end at which the home switch and the index pulse beside it are.
const HOME_SHARE: f64 = 0.2;
const INDEX_SHARE: f64 = 0.18;
/// Least counts between two index pulses, as settings allow them.
const LEAST_INDEX_COUNTS: i64 = 16;
/// Largest way to an end of the travel, mm.
const MOST_TRAVEL_MM: f64 = 1e4;
/// Acceleration by a volt that is simulated, mm/(V s²): beyond it the simulation's steps are too long.
const GAINS_MM_PER_V_S2: (f64, f64) = (10.0, 2e6);
/// Frequency at which the teeth of a gap oscillate without a resonance of their own, Hz.
const TEETH_HZ: f64 = 500.0;

/// Friction model of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FrictionModel {
    #[default]
    Gms,
    SmoothedGms,
    Lugre,
    Dahl,
}

/// Side of resonance and backlash that the encoder is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum EncoderPlace {
    #[default]
    Table,
    Motor,
}

/// A simulated stage of one's own.
#[derive(Clone, Debug, PartialEq)]
pub struct StageFile {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// The stage.
    pub truth: StageParameters,
    /// Travel of x, y and z from where they stand, mm: to the negative and to the positive end; none where the axis has no
    /// table in the file.
    pub travel_mm: [Option<[f64; 2]>; 3],
    /// Switches and index pulses.
    pub marks: [MarkParameters; 3],
}

/// The text of a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    x: Option<Numbers>,
    y: Option<Numbers>,
    z: Option<Numbers>,
}

/// Reasons for which a stage file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StageFileError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    /// It is no TOML, a name is misspelt, or a value is of the wrong type.
    #[error("{}: {source}", path.display())]
    Syntax {
        path: PathBuf,
        source: Box<toml::de::Error>,
    },
    /// It describes no axis.
    #[error("{}: no axis: begin with a line `[x]`, `[y]` or `[z]`", path.display())]
    Empty { path: PathBuf },
    /// A number is out of its range.
    #[error("{}: {axis}.{name} = {value} is outside {least} to {most}", path.display())]
    Range {
        path: PathBuf,
        axis: AxisName,
        name: &'static str,
        value: f64,
        least: f64,
        most: f64,
    },
    /// Numbers that do not go together.
    #[error("{}: {axis}: {reason}", path.display())]
    Together {
        path: PathBuf,
        axis: AxisName,
        reason: String,
    },
}

impl StageFile {
    /// Reads and checks a file.
    ///
    /// # Errors
    /// A file that cannot be read or understood, or the first number that is refused.
    pub fn read(path: &Path) -> Result<Self, StageFileError> {
        let text = std::fs::read_to_string(path).map_err(|source| StageFileError::Io {
            path: path.to_owned(),
            source,
        })?;
        Self::parse(&text, path)
    }

    /// Checks a file's text; `path` is what messages call it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, path: &Path) -> Result<Self, StageFileError> {
        let Text { x, y, z } = toml::from_str(text).map_err(|source| StageFileError::Syntax {
            path: path.to_owned(),
            source: Box::new(source),
        })?;
        let mut truth = StageParameters::real();
        let mut travel_mm = [None; 3];
        let mut marks = [MarkParameters::default(); 3];
        for (axis, numbers) in AxisName::ALL.into_iter().zip([x, y, z]) {
            let Some(numbers) = numbers else {
                continue;
            };
            numbers.check(axis, path)?;
            truth.axes[axis as usize] = numbers.parameters();
            travel_mm[axis as usize] = Some(numbers.travel_mm);
            marks[axis as usize] = numbers.marks();
        }
        if travel_mm == [None; 3] {
            return Err(StageFileError::Empty {
                path: path.to_owned(),
            });
        }
        Ok(Self {
            path: path.to_owned(),
            truth,
            travel_mm,
            marks,
        })
    }
}

impl Numbers {
    fn check(&self, axis: AxisName, path: &Path) -> Result<(), StageFileError> {
        for (field, value) in FIELDS.iter().zip(self.values()) {
            let (least, most) = field.range;
            if !(least..=most).contains(&value) {
                return Err(StageFileError::Range {
                    path: path.to_owned(),
                    axis,
                    name: field.name,
                    value,
                    least,
                    most,
                });
            }
        }
        match self.contradiction() {
            None => Ok(()),
            Some(reason) => Err(StageFileError::Together {
                path: path.to_owned(),
                axis,
                reason,
            }),
        }
    }

    /// What does not go together, if anything.
    fn contradiction(&self) -> Option<String> {
        let [negative, positive] = self.travel_mm;
        if !(-MOST_TRAVEL_MM..=0.0).contains(&negative)
            || !(0.0..=MOST_TRAVEL_MM).contains(&positive)
            || negative == positive
        {
            return Some(format!(
                "travel_mm = [{negative}, {positive}]: give the ways to both ends from where the axis stands, such as [-200, 200]; the \
                 first -{MOST_TRAVEL_MM} to 0, the second 0 to {MOST_TRAVEL_MM}"
            ));
        }
        let gain = self.gain_mm_per_v_s2();
        let (least, most) = GAINS_MM_PER_V_S2;
        if !(least..=most).contains(&gain) {
            return Some(format!(
                "a volt would accelerate the axis by {gain:.4} mm/s² (1000 force_n_per_v / mass_kg), and {least} to {most} are simulated"
            ));
        }
        let most_n = self.force_n_per_v * self.full_scale_v;
        let share = 1.0 + 0.01 * self.friction_asymmetry_percent.abs();
        let friction_n = share * self.coulomb_n.max(self.breakaway_n);
        if friction_n + self.gravity_n.abs() >= most_n {
            return Some(format!(
                "friction and gravity of {:.2} N hold it against the drive's {most_n:.2} N (force_n_per_v times full_scale_v)",
                friction_n + self.gravity_n.abs()
            ));
        }
        let holding_n = (2.0 - share) * self.coulomb_n.min(self.breakaway_n);
        (self.gravity_n.abs() >= holding_n).then(|| {
            format!(
                "gravity of {} N moves it with the amplifier off: friction holds {holding_n:.2} N",
                self.gravity_n
            )
        })
    }

    fn gain_mm_per_v_s2(&self) -> f64 {
        1e3 * self.force_n_per_v / self.mass_kg
    }

    fn parameters(&self) -> AxisParameters {
        let gain_mm_per_v_s2 = self.gain_mm_per_v_s2();
        let volts = |newtons: f64| newtons / self.force_n_per_v;
        let directed = |sign: f64| {
            let factor = 1.0 + sign * 0.01 * self.friction_asymmetry_percent;
            StaticFriction {
                curve: StribeckCurve {
                    coulomb_v: factor * volts(self.coulomb_n),
                    breakaway_v: factor * volts(self.breakaway_n),
                    stribeck_velocity_mm_s: self.stribeck_velocity_mm_s,
                    exponent: 1.0,
                },
                // All of it is in the linear damping.
                viscous_v_s_per_mm: 0.0,
            }
        };
        let breakaway_v = volts(self.breakaway_n);
        let presliding_mm = 1e-3 * self.presliding_um;
        let mut gms = StageParameters::real().axes[0].gms.clone();
        gms.elements = virgin_curve_elements(breakaway_v, presliding_mm, PLANT_ELEMENTS);
        // As fast as on the simulated stage's x axis.
        gms.attraction_v_s = breakaway_v / 0.03;
        AxisParameters {
            gain_mm_per_v_s2,
            damping_per_s: self.viscous_n_s_per_m / self.mass_kg,
            stiffness_per_s2: 0.0,
            delay_s: 1e-3 * self.delay_ms,
            friction: PerDirection {
                positive: directed(1.0),
                negative: directed(-1.0),
            },
            gms,
            model: self.model(breakaway_v, presliding_mm),
            resolution_mm: 1e-3 * self.resolution_um,
            full_scale_v: self.full_scale_v,
            imperfections: Imperfections {
                gravity_v: volts(self.gravity_n),
                encoder_noise_mm: 1e-3 * self.noise_um,
                offset_v: 1e-3 * self.offset_mv,
                ripple_v: volts(self.ripple_n),
                lead_mm: self.screw_lead_mm,
                friction_variation: 0.01 * self.friction_variation_percent,
                friction_period_mm: self.friction_period_mm,
                ..Imperfections::default()
            },
            drive: self.drive(gain_mm_per_v_s2),
        }
    }

    /// Limit switches beyond the ends of the travel, home switch and index pulse within it.
    fn marks(&self) -> MarkParameters {
        let [negative_mm, positive_mm] = self.travel_mm;
        let counts = |mm: f64| (mm / (1e-3 * self.resolution_um)).round() as i64;
        MarkParameters {
            negative_limit_mm: negative_mm - LIMIT_BEYOND_MM,
            positive_limit_mm: positive_mm + LIMIT_BEYOND_MM,
            home_mm: HOME_SHARE * negative_mm,
            index_count: counts(INDEX_SHARE * negative_mm),
            counts_per_index: counts(self.screw_lead_mm).max(LEAST_INDEX_COUNTS),
            ..MarkParameters::default()
        }
    }

    fn model(&self, breakaway_v: f64, presliding_mm: f64) -> FrictionParameters {
        // A bristle model reaches 95 % of its level after three times level over stiffness.
        let stiffness_v_per_mm = 3.0 * breakaway_v / presliding_mm;
        match self.friction_model {
            FrictionModel::Gms => FrictionParameters::Gms,
            FrictionModel::SmoothedGms => {
                FrictionParameters::Smoothed(SmoothedGmsParameters::default())
            }
            FrictionModel::Lugre => FrictionParameters::Lugre(LugreParameters {
                stiffness_v_per_mm,
                damping_v_s_per_mm: 1e-3 * self.viscous_n_s_per_m / self.force_n_per_v,
            }),
            FrictionModel::Dahl => FrictionParameters::Dahl(DahlParameters {
                stiffness_v_per_mm,
                exponent: 1.0,
            }),
        }
    }

    fn drive(&self, gain_mm_per_v_s2: f64) -> Drive {
        if self.resonance_hz == 0.0 && self.backlash_um == 0.0 {
            return Drive::BallScrew;
        }
        let frequency_hz = if self.resonance_hz > 0.0 {
            self.resonance_hz
        } else {
            TEETH_HZ
        };
        let encoder = match self.encoder {
            EncoderPlace::Table => EncoderSide::Load,
            EncoderPlace::Motor => EncoderSide::Motor,
        };
        Drive::RackAndPinion(Backlash {
            width_mm: 1e-3 * self.backlash_um,
            ..Backlash::resonating(
                frequency_hz,
                self.resonance_damping,
                self.motor_share,
                gain_mm_per_v_s2,
                encoder,
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<StageFile, StageFileError> {
        StageFile::parse(text, Path::new("mine.toml"))
    }

    fn refused(text: &str) -> String {
        parse(text).unwrap_err().to_string()
    }

    #[test]
    fn what_is_left_out_is_the_simulated_stages_x_axis() {
        let file = parse("[z]\n").unwrap();
        let known = StageParameters::real();
        assert_eq!(file.truth.axes[..2], known.axes[..2]);
        let [found, known] = [&file.truth.axes[2], &known.axes[0]];
        let close = |found: f64, known: f64| assert!((found - known).abs() <= 1e-9 * known.abs());
        close(found.gain_mm_per_v_s2, known.gain_mm_per_v_s2);
        close(found.delay_s, known.delay_s);
        for (found, known) in [
            (found.friction.positive, known.friction.positive),
            (found.friction.negative, known.friction.negative),
        ] {
            close(found.curve.coulomb_v, known.curve.coulomb_v);
            close(found.curve.breakaway_v, known.curve.breakaway_v);
        }
        // Viscous friction and linear damping together.
        let damping = |axis: &AxisParameters| {
            axis.damping_per_s + axis.gain_mm_per_v_s2 * axis.friction.positive.viscous_v_s_per_mm
        };
        close(damping(found), damping(known));
        for (found, known) in found.gms.elements.iter().zip(&known.gms.elements) {
            close(found.stiffness_v_per_mm, known.stiffness_v_per_mm);
        }
        close(found.gms.attraction_v_s, known.gms.attraction_v_s);
        close(found.imperfections.ripple_v, known.imperfections.ripple_v);
        close(found.imperfections.offset_v, known.imperfections.offset_v);
        close(
            found.imperfections.encoder_noise_mm,
            known.imperfections.encoder_noise_mm,
        );
        assert_eq!(found.drive, known.drive);
        assert_eq!(file.travel_mm, [None, None, Some(TRAVEL_MM)]);
        assert_eq!(file.marks, [MarkParameters::default(); 3]);
    }

    #[test]
    fn data_sheet_units_become_those_of_the_plant() {
        let text = "[x]\nmass_kg = 50\nforce_n_per_v = 100\ncoulomb_n = 40\nbreakaway_n = 60\nfriction_asymmetry_percent = 0\n\
                    delay_ms = 2\nresolution_um = 1\nbacklash_um = 5\nresonance_hz = 80\nencoder = \"motor\"\nfriction_model = \"lugre\"\n\
                    travel_mm = [-3, 37]\n";
        let file = parse(text).unwrap();
        let axis = &file.truth.axes[0];
        assert_eq!(axis.gain_mm_per_v_s2, 2000.0);
        assert_eq!(axis.friction.negative.curve.coulomb_v, 0.4);
        assert_eq!(axis.friction.positive.curve.breakaway_v, 0.6);
        assert_eq!((axis.delay_s, axis.resolution_mm), (2e-3, 1e-3));
        assert!(matches!(axis.model, FrictionParameters::Lugre(_)));
        let Drive::RackAndPinion(gap) = axis.drive else {
            panic!("{:?}", axis.drive);
        };
        assert_eq!((gap.width_mm, gap.encoder), (5e-3, EncoderSide::Motor));
        assert_eq!(file.travel_mm[0], Some([-3.0, 37.0]));
    }

    #[test]
    fn every_number_has_its_range_and_its_default_lies_in_it() {
        for field in FIELDS {
            let (least, most) = field.range;
            assert!((least..=most).contains(&field.default), "{field:?}");
            let beyond = most + 1.0;
            let said = refused(&format!("[y]\n{} = {beyond:?}\n", field.name));
            let expected = format!("mine.toml: y.{} = {beyond} is outside", field.name);
            assert!(said.starts_with(&expected), "{said}");
            let said = refused(&format!("[y]\n{} = nan\n", field.name));
            assert!(said.contains(field.name), "{said}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_the_line_or_the_reason() {
        for (text, parts) in [
            ("", ["no axis", "[x]"]),
            ("[x]\nmas_kg = 3\n", ["mas_kg", "line 2"]),
            ("[x]\nmass_kg = \"heavy\"\n", ["heavy", "line 2"]),
            ("[w]\n", ["`w`", "line 1"]),
            ("[x]\nfriction_model = \"sticky\"\n", ["sticky", "`lugre`"]),
            ("[x]\ntravel_mm = [5, 40]\n", ["travel_mm", "[-200, 200]"]),
            ("[x]\nmass_kg = 100000\n", ["mm/s²", "mass_kg"]),
            ("[x]\ncoulomb_n = 9000\n", ["hold it", "full_scale_v"]),
            ("[x]\ngravity_n = -90\n", ["gravity of -90 N", "80.77 N"]),
        ] {
            let said = refused(text);
            for part in parts {
                assert!(said.contains(part), "{text:?}: {said}");
            }
        }
    }
}
