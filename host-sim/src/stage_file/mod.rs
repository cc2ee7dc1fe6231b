//! A simulated stage of one's own as a file: what a person knows or guesses of an axis, in the units of data sheets.
//!
//! TOML with a table for each of `x`, `y` and `z`. What is left out of a table is that of the simulated stage's x axis, or follows from
//! what is written; an axis without a table is the simulated stage's own.

mod choices;
mod fields;

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use quadrant_law::axes::AxisName;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::gms::GmsElement;
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use serde::Deserialize;

use self::choices::{EncoderPlace, Friction};
pub use self::fields::{FIELDS, Field};
use self::fields::{Numbers, Written};
use crate::plant::{
    AxisParameters, Backlash, Drive, EncoderSide, FrictionParameters, Imperfections,
    MarkParameters, PLANT_ELEMENTS, StageParameters, VelocityDrive, virgin_curve_elements,
};
use crate::toml_file::{TomlFileError, text_of};

/// Travel where it is left out, from where the axis stands, mm.
const TRAVEL_MM: [f64; 2] = [-200.0, 200.0];
/// Distance of the limit switches from the ends of the travel, mm.
pub const LIMIT_BEYOND_MM: f64 = 5.0;
/// Share of the way to the negative end at which the home switch is.
const HOME_SHARE: f64 = 0.2;
/// Distance of an index pulse from the home switch, over the screw's lead.
const INDEX_SHARE: f64 = 0.4;
/// Largest such distance over the travel.
const INDEX_TRAVEL_SHARE: f64 = 0.1;
/// Least counts between two index pulses, as settings allow them.
const LEAST_INDEX_COUNTS: i64 = 16;
/// Largest way to an end of the travel, mm.
const MOST_TRAVEL_MM: f64 = 1e4;
/// Acceleration by a volt that is simulated, mm/(V s²): beyond it the simulation's steps are too long.
const GAINS_MM_PER_V_S2: (f64, f64) = (10.0, 2e6);
/// Largest frequency of the mass on the springs of its friction that is simulated, Hz: half a radian in each step.
const MOST_PRESLIDING_HZ: f64 = 3000.0;
/// Frequency at which the teeth of a gap oscillate without a resonance of their own, Hz.
const TEETH_HZ: f64 = 500.0;
/// Breakaway level over the Coulomb level where one of them is left out.
const BREAKAWAY_RATIO: f64 = 1.25;
/// Way before a model without pre-sliding breaks away, um: not zero, since a force that steps with the direction holds no mass at
/// rest.
const STIFF_UM: f64 = 1.0;
/// Highest frequency of the mass on that way, Hz.
const STIFF_HZ: f64 = 600.0;
/// Slope at which pre-sliding friction of the simulated stage begins, over level and way.
const VIRGIN_SLOPE: f64 = 4.0;
/// The same slope of a bristle, which reaches 95 % of its level after three times level over stiffness.
const BRISTLE_SLOPE: f64 = 3.0;
/// Counts in a second that a counter follows: the firmware takes 4096 in a tick at 10 kHz.
const MOST_COUNTS_PER_S: f64 = 4e7;
/// Encoder's noise where it is left out, counts.
const NOISE_COUNTS: f64 = 0.3;

/// A simulated stage of one's own.
#[derive(Clone, Debug, PartialEq)]
pub struct StageFile {
    /// Path of the file, for messages.
    pub path: PathBuf,
    /// The stage.
    pub truth: StageParameters,
    /// Data sheets of x, y and z; nothing where the axis has no table in the file.
    pub known: [Option<DataSheet>; 3],
    /// Switches and index pulses.
    pub marks: [MarkParameters; 3],
}

/// Numbers of an axis that a person knows without measuring it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DataSheet {
    /// Travel from where the axis stands, mm: to the negative and to the positive end.
    pub travel_mm: [f64; 2],
    /// Largest velocity, mm/s.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration, mm/s².
    pub max_acceleration_mm_s2: f64,
}

impl DataSheet {
    /// Length of the travel, mm.
    pub const fn span_mm(&self) -> f64 {
        let [negative_mm, positive_mm] = self.travel_mm;
        positive_mm - negative_mm
    }
}

/// The text of a file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    x: Option<Written>,
    y: Option<Written>,
    z: Option<Written>,
}

/// Reasons for which a stage file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StageFileError {
    /// The file cannot be read, is no TOML, has a name that is misspelt, or a value of the wrong type.
    #[error(transparent)]
    File(#[from] TomlFileError),
    /// It describes no axis.
    #[error("{}: no axis: begin with a line `[x]`, `[y]` or `[z]`", path.display())]
    Empty { path: PathBuf },
    /// A number is out of its range.
    #[error("{}: {axis}.{name} = {value} is outside {least} to {most}; leave it out for {default}", path.display())]
    Range {
        path: PathBuf,
        axis: AxisName,
        name: &'static str,
        value: f64,
        least: f64,
        most: f64,
        default: f64,
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
        let text = text_of(path)?;
        Self::parse(&text, path)
    }

    /// True if a text has a line that begins the table of an axis, as no other file of the project has.
    pub fn has_axes(text: &str) -> bool {
        let begins_axis = |line: &str| {
            let name = line.trim_start().strip_prefix('[');
            let name = name.and_then(|rest| rest.split(']').next());
            name.is_some_and(|name| {
                AxisName::ALL
                    .iter()
                    .any(|axis| axis.as_str() == name.trim())
            })
        };
        text.lines().any(begins_axis)
    }

    /// Checks a file's text; `path` is what messages call it.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, path: &Path) -> Result<Self, StageFileError> {
        let Text { x, y, z } =
            toml::from_str(text).map_err(|source| TomlFileError::syntax(path, source))?;
        let mut truth = StageParameters::real();
        let mut known = [None; 3];
        let mut marks = [MarkParameters::default(); 3];
        for (axis, written) in AxisName::ALL.into_iter().zip([x, y, z]) {
            let Some(written) = written else {
                continue;
            };
            let described = Axis::checked(&written, axis, path)?;
            truth.axes[axis as usize] = described.parameters();
            known[axis as usize] = Some(described.data_sheet());
            marks[axis as usize] = described.marks();
        }
        if known == [None; 3] {
            return Err(StageFileError::Empty {
                path: path.to_owned(),
            });
        }
        Ok(Self {
            path: path.to_owned(),
            truth,
            known,
            marks,
        })
    }
}

/// An axis of the file, with what it leaves out.
#[derive(Clone, Copy, Debug)]
struct Axis {
    numbers: Numbers,
    friction: Friction,
    encoder: EncoderPlace,
    /// Ways to both ends of its travel from where it stands, mm.
    travel_mm: [f64; 2],
}

impl Axis {
    fn of(written: &Written) -> Self {
        let mut numbers = written.with_defaults();
        match (written.coulomb_n, written.breakaway_n) {
            (None, Some(breakaway_n)) if written.friction == Friction::Coulomb => {
                numbers.coulomb_n = breakaway_n;
            }
            (_, None) if written.friction == Friction::Coulomb => {
                numbers.breakaway_n = numbers.coulomb_n;
            }
            (Some(coulomb_n), None) => numbers.breakaway_n = BREAKAWAY_RATIO * coulomb_n,
            (None, Some(breakaway_n)) => numbers.coulomb_n = breakaway_n / BREAKAWAY_RATIO,
            _ => {}
        }
        if let (Some(resolution_um), None) = (written.resolution_um, written.noise_um) {
            numbers.noise_um = NOISE_COUNTS * resolution_um;
        }
        if written.max_velocity_mm_s.is_none() {
            let counted_mm_s = 1e-3 * numbers.resolution_um * MOST_COUNTS_PER_S;
            numbers.max_velocity_mm_s = numbers.max_velocity_mm_s.min(counted_mm_s);
        }
        let mut axis = Self {
            numbers,
            friction: written.friction,
            encoder: written.encoder,
            travel_mm: written.travel_mm.unwrap_or(TRAVEL_MM),
        };
        if axis.is_stiff() && written.presliding_um.is_none() {
            axis.numbers.presliding_um = STIFF_UM;
            let softer = (axis.presliding_hz() / STIFF_HZ).powi(2).max(1.0);
            axis.numbers.presliding_um = softer * STIFF_UM;
        }
        axis
    }

    /// True for a friction model without pre-sliding.
    fn is_stiff(&self) -> bool {
        matches!(self.friction, Friction::Coulomb | Friction::Static)
    }

    fn checked(written: &Written, axis: AxisName, path: &Path) -> Result<Self, StageFileError> {
        let described = Self::of(written);
        for (field, value) in FIELDS.iter().zip(written.with_defaults().values()) {
            let (least, most) = field.range;
            if !(least..=most).contains(&value) {
                return Err(StageFileError::Range {
                    path: path.to_owned(),
                    axis,
                    name: field.name,
                    value,
                    least,
                    most,
                    default: field.default,
                });
            }
        }
        match described.contradiction() {
            None => Ok(described),
            Some(reason) => Err(StageFileError::Together {
                path: path.to_owned(),
                axis,
                reason,
            }),
        }
    }

    /// Returns the first contradiction between the numbers.
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
        if self.friction == Friction::Coulomb && self.numbers.coulomb_n != self.numbers.breakaway_n
        {
            return Some(format!(
                "friction = \"coulomb\" has one level, and coulomb_n = {} and breakaway_n = {} are two: leave one out, or give friction = \
                 \"static\"",
                self.numbers.coulomb_n, self.numbers.breakaway_n
            ));
        }
        if self.numbers.breakaway_n < self.numbers.coulomb_n {
            return Some(format!(
                "breakaway_n = {} is below coulomb_n = {}: friction at rest is at least that of sliding; leave one of them out",
                self.numbers.breakaway_n, self.numbers.coulomb_n
            ));
        }
        let spring_hz = self.presliding_hz();
        if spring_hz > MOST_PRESLIDING_HZ {
            let least_um = self.numbers.presliding_um * (spring_hz / MOST_PRESLIDING_HZ).powi(2);
            return Some(format!(
                "the mass would oscillate at {spring_hz:.0} Hz on the springs of its friction, and up to {MOST_PRESLIDING_HZ} Hz are simulated: \
                 give presliding_um = {:.1} or more (it is {})",
                (10.0 * least_um).ceil() / 10.0,
                self.numbers.presliding_um
            ));
        }
        let most_n = self.numbers.force_n_per_v * self.numbers.full_scale_v;
        let share = 1.0 + 0.01 * self.numbers.friction_asymmetry_percent.abs();
        let friction_n = share * self.numbers.coulomb_n.max(self.numbers.breakaway_n);
        if friction_n + self.numbers.gravity_n.abs() >= most_n {
            return Some(format!(
                "friction and gravity of {:.2} N hold it against the drive's {most_n:.2} N (force_n_per_v times full_scale_v)",
                friction_n + self.numbers.gravity_n.abs()
            ));
        }
        let holding_n = (2.0 - share) * self.numbers.coulomb_n.min(self.numbers.breakaway_n);
        (self.numbers.gravity_n.abs() >= holding_n).then(|| {
            format!(
                "gravity of {} N moves it with the amplifier off: friction holds {holding_n:.2} N",
                self.numbers.gravity_n
            )
        })
    }

    fn gain_mm_per_v_s2(&self) -> f64 {
        1e3 * self.numbers.force_n_per_v / self.numbers.mass_kg
    }

    /// Largest frequency at which the mass, or the table's share of it, oscillates on the springs of its friction, Hz.
    fn presliding_hz(&self) -> f64 {
        let slope = match self.friction {
            Friction::Coulomb | Friction::Static => 1.0,
            Friction::Lugre | Friction::Dahl => BRISTLE_SLOPE,
            Friction::Gms | Friction::SmoothedGms => VIRGIN_SLOPE,
        };
        let share = match self.drive(self.gain_mm_per_v_s2()) {
            Drive::RackAndPinion(gap) => 1.0 - gap.motor_share,
            Drive::BallScrew | Drive::Direct(_) => 1.0,
        };
        let stiffness_n_per_m = slope * 1e6 * self.numbers.breakaway_n / self.numbers.presliding_um;
        (stiffness_n_per_m / (share * self.numbers.mass_kg)).sqrt() / TAU
    }

    fn parameters(&self) -> AxisParameters {
        let gain_mm_per_v_s2 = self.gain_mm_per_v_s2();
        let volts = |newtons: f64| newtons / self.numbers.force_n_per_v;
        let directed = |sign: f64| {
            let factor = 1.0 + sign * 0.01 * self.numbers.friction_asymmetry_percent;
            StaticFriction {
                curve: StribeckCurve {
                    coulomb_v: factor * volts(self.numbers.coulomb_n),
                    breakaway_v: factor * volts(self.numbers.breakaway_n),
                    stribeck_velocity_mm_s: self.numbers.stribeck_velocity_mm_s,
                    exponent: 1.0,
                },
                // All of it is in the linear damping.
                viscous_v_s_per_mm: 0.0,
            }
        };
        let breakaway_v = volts(self.numbers.breakaway_n);
        let presliding_mm = 1e-3 * self.numbers.presliding_um;
        let mut gms = StageParameters::real().axes[0].gms.clone();
        gms.elements = if self.is_stiff() {
            let spring = GmsElement {
                stiffness_v_per_mm: breakaway_v / presliding_mm,
                weight: 1.0,
            };
            [spring].into_iter().collect()
        } else {
            virgin_curve_elements(breakaway_v, presliding_mm, PLANT_ELEMENTS)
        };
        // As fast as on the simulated stage's x axis.
        gms.attraction_v_s = breakaway_v / 0.03;
        AxisParameters {
            gain_mm_per_v_s2,
            damping_per_s: self.numbers.viscous_n_s_per_m / self.numbers.mass_kg,
            stiffness_per_s2: 0.0,
            delay_s: 1e-3 * self.numbers.delay_ms,
            friction: PerDirection {
                positive: directed(1.0),
                negative: directed(-1.0),
            },
            gms,
            model: self.model(breakaway_v, presliding_mm),
            resolution_mm: 1e-3 * self.numbers.resolution_um,
            full_scale_v: self.numbers.full_scale_v,
            imperfections: Imperfections {
                gravity_v: volts(self.numbers.gravity_n),
                encoder_noise_mm: 1e-3 * self.numbers.noise_um,
                offset_v: 1e-3 * self.numbers.offset_mv,
                ripple_v: volts(self.numbers.ripple_n),
                lead_mm: self.numbers.screw_lead_mm,
                friction_variation: 0.01 * self.numbers.friction_variation_percent,
                friction_period_mm: self.numbers.friction_period_mm,
                ..Imperfections::default()
            },
            drive: self.drive(gain_mm_per_v_s2),
            velocity_drive: (self.numbers.drive_lag_ms > 0.0).then(|| {
                VelocityDrive::with_lag(
                    1e-3 * self.numbers.drive_lag_ms,
                    self.numbers.drive_velocity_mm_s_per_v,
                    self.numbers.full_scale_v,
                    gain_mm_per_v_s2,
                )
            }),
        }
    }

    fn data_sheet(&self) -> DataSheet {
        DataSheet {
            travel_mm: self.travel_mm,
            max_velocity_mm_s: self.numbers.max_velocity_mm_s,
            max_acceleration_mm_s2: self.numbers.max_acceleration_mm_s2,
        }
    }

    /// Limit switches beyond the ends of the travel, home switch and index pulse within it.
    fn marks(&self) -> MarkParameters {
        let [negative_mm, positive_mm] = self.travel_mm;
        let home_mm = HOME_SHARE * negative_mm;
        let beside_mm = (INDEX_SHARE * self.numbers.screw_lead_mm)
            .min(INDEX_TRAVEL_SHARE * (positive_mm - negative_mm));
        let counts = |mm: f64| (mm / (1e-3 * self.numbers.resolution_um)).round() as i64;
        MarkParameters {
            negative_limit_mm: negative_mm - LIMIT_BEYOND_MM,
            positive_limit_mm: positive_mm + LIMIT_BEYOND_MM,
            home_mm,
            index_count: counts(home_mm + beside_mm),
            counts_per_index: counts(self.numbers.screw_lead_mm).max(LEAST_INDEX_COUNTS),
            ..MarkParameters::default()
        }
    }

    fn model(&self, breakaway_v: f64, presliding_mm: f64) -> FrictionParameters {
        let stiffness_v_per_mm = BRISTLE_SLOPE * breakaway_v / presliding_mm;
        match self.friction {
            Friction::Coulomb | Friction::Static | Friction::Gms => FrictionParameters::Gms,
            Friction::SmoothedGms => FrictionParameters::Smoothed(SmoothedGmsParameters::default()),
            Friction::Lugre => FrictionParameters::Lugre(LugreParameters {
                stiffness_v_per_mm,
                damping_v_s_per_mm: 1e-3 * self.numbers.viscous_n_s_per_m
                    / self.numbers.force_n_per_v,
            }),
            Friction::Dahl => FrictionParameters::Dahl(DahlParameters {
                stiffness_v_per_mm,
                exponent: 1.0,
            }),
        }
    }

    fn drive(&self, gain_mm_per_v_s2: f64) -> Drive {
        if self.numbers.resonance_hz == 0.0 && self.numbers.backlash_um == 0.0 {
            return Drive::BallScrew;
        }
        let frequency_hz = if self.numbers.resonance_hz > 0.0 {
            self.numbers.resonance_hz
        } else {
            TEETH_HZ
        };
        let encoder = match self.encoder {
            EncoderPlace::Table => EncoderSide::Load,
            EncoderPlace::Motor => EncoderSide::Motor,
        };
        Drive::RackAndPinion(Backlash {
            width_mm: 1e-3 * self.numbers.backlash_um,
            ..Backlash::resonating(
                frequency_hz,
                self.numbers.resonance_damping,
                self.numbers.motor_share,
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
    fn a_stage_is_known_by_the_tables_of_its_axes() {
        for text in [
            include_str!("../../../examples/stage.toml"),
            "# mine\n[ y ] # slide\nmass_kg = 1\n",
            "\t[z]",
        ] {
            assert!(StageFile::has_axes(text), "{text}");
        }
        for text in [
            include_str!("../../data/identified-stage.toml"),
            "# [x]\nform = 1\n[[stage.axes]]\n[xy]\n[",
            "",
        ] {
            assert!(!StageFile::has_axes(text), "{text}");
        }
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
        assert_eq!(file.known[..2], [None; 2]);
        assert_eq!(file.known[2].unwrap().travel_mm, TRAVEL_MM);
        assert_eq!(file.marks, [MarkParameters::default(); 3]);
    }

    #[test]
    fn data_sheet_units_become_those_of_the_plant() {
        let text = "[x]\nmass_kg = 50\nforce_n_per_v = 100\ncoulomb_n = 40\nbreakaway_n = 60\nfriction_asymmetry_percent = 0\n\
                    delay_ms = 2\nresolution_um = 1\nbacklash_um = 5\nresonance_hz = 80\nencoder = \"motor\"\nfriction = \"lugre\"\n\
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
        assert_eq!(file.known[0].unwrap().span_mm(), 40.0);
    }

    #[test]
    fn what_follows_from_what_is_written_need_not_be_written() {
        let of = |text: &str| parse(text).unwrap().truth.axes[0].clone();
        let curve = |text: &str| of(text).friction.positive.curve;
        let ratio = |text: &str| curve(text).breakaway_v / curve(text).coulomb_v;
        for text in ["[x]\ncoulomb_n = 200\n", "[x]\nbreakaway_n = 50\n"] {
            assert!((ratio(text) - 1.25).abs() < 1e-9, "{text}");
        }
        let noise_mm = |text: &str| of(text).imperfections.encoder_noise_mm;
        assert!((noise_mm("[x]\nresolution_um = 0.01\n") - 3e-6).abs() < 1e-12);
        assert_eq!(noise_mm("[x]\nresolution_um = 0.01\nnoise_um = 0\n"), 0.0);
    }

    #[test]
    fn coulomb_and_static_friction_hold_by_one_short_spring() {
        let of = |text: &str| parse(text).unwrap().truth.axes[0].clone();
        for (text, ratio) in [
            ("[x]\nfriction = \"coulomb\"\ncoulomb_n = 60\n", 1.0),
            ("[x]\nfriction = \"coulomb\"\nbreakaway_n = 60\n", 1.0),
            ("[x]\nfriction = \"static\"\n", 1.25),
        ] {
            let axis = of(text);
            assert_eq!(axis.model, FrictionParameters::Gms);
            let curve = axis.friction.positive.curve;
            assert!((curve.breakaway_v / curve.coulomb_v - ratio).abs() < 1e-9);
            let [spring] = axis.gms.elements[..] else {
                panic!("{:?}", axis.gms);
            };
            let levels = [axis.friction.positive, axis.friction.negative];
            let mean_v = 0.5
                * levels
                    .iter()
                    .map(|side| side.curve.breakaway_v)
                    .sum::<f64>();
            assert!(
                (spring.stiffness_v_per_mm * 1e-3 / mean_v - 1.0).abs() < 1e-9,
                "{text}"
            );
            assert_eq!(spring.weight, 1.0);
        }
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
            ("[x]\nfriction = \"sticky\"\n", ["sticky", "`lugre`"]),
            ("[x]\ntravel_mm = [5, 40]\n", ["travel_mm", "[-200, 200]"]),
            ("[x]\nmass_kg = 100000\n", ["mm/s²", "mass_kg"]),
            ("[x]\ncoulomb_n = 9000\n", ["hold it", "full_scale_v"]),
            ("[x]\ngravity_n = -90\n", ["gravity of -90 N", "80.77 N"]),
            (
                "[x]\ncoulomb_n = 50\nbreakaway_n = 40\n",
                ["breakaway_n = 40", "coulomb_n = 50"],
            ),
            (
                "[x]\nfriction = \"coulomb\"\ncoulomb_n = 50\nbreakaway_n = 60\n",
                ["one level", "static"],
            ),
            (
                "[x]\nmass_kg = 0.1\nforce_n_per_v = 10\nfriction = \"static\"\ncoulomb_n = 8\npresliding_um = 0.1\n",
                ["presliding_um = 0.3 or more", "it is 0.1"],
            ),
        ] {
            let said = refused(text);
            for part in parts {
                assert!(said.contains(part), "{text:?}: {said}");
            }
        }
    }

    #[test]
    fn the_example_has_every_number_once_and_says_the_value_of_one_that_is_left_out() {
        let text = include_str!("../../../examples/stage.toml");
        let mut commented = String::new();
        for line in text.lines() {
            let line = line
                .strip_prefix("# ")
                .filter(|line| line.contains(" = "))
                .unwrap_or(line);
            commented += &format!("{line}\n");
        }
        for field in FIELDS {
            let line = format!("\n{} = ", field.name);
            assert_eq!(commented.matches(&line).count(), 1, "{}", field.name);
        }
        assert_eq!(parse(text).unwrap(), parse(&commented).unwrap());
    }

    #[test]
    fn the_page_has_a_row_for_every_number() {
        let page = include_str!("../../../docs/own-stage.md");
        for field in FIELDS {
            let (least, most) = field.range;
            let row = format!(
                "| `{}` | {least} to {most} | {} | {} |",
                field.name, field.default, field.help
            );
            assert!(page.contains(&row), "docs/own-stage.md lacks\n{row}");
        }
    }
}
