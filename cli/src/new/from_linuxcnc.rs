//! Settings from a configuration of LinuxCNC: what its INI file and its HAL files say of each axis, and where.

use std::fs;
use std::path::Path;

use anyhow::{Context, ensure};
use ini::{Ini, ParseOption};
use quadrant_law::axes::AxisName;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::settings_file::{defaults_at, without_law};
use quadrant_sim::stage_file::DataSheet;
use quadrant_sim::stage_setup::enter_limits;

use super::hal_files::{Found, Hal};

/// Width of LinuxCNC's counts, bits.
const COUNTER_BITS: u8 = 32;
/// Travel where there is none, mm.
const TRAVEL_MM: [f64; 2] = [-200.0, 200.0];
/// Parts of a millimetre to which limits are rounded: inches leave no tail of digits.
const PER_MM: f64 = 1e6;
/// Full scale of the outputs of cards for servo amplifiers, V.
const FULL_SCALE_V: f64 = 10.0;
/// Largest following error that settings allow, mm.
const MOST_ERROR_MM: f64 = 20.0;
/// Largest growth of that error with the speed, s.
const MOST_LAG_S: f64 = 1.0;

/// The settings that a configuration gave.
pub(super) struct Taken {
    pub(super) stage: StageSettings,
    pub(super) axes: Vec<AxisName>,
    /// A line for each value and its origin, and for each that was not found.
    pub(super) lines: Vec<String>,
}

/// Reads a configuration.
///
/// # Errors
/// A file that is no INI file, or has no linear joint x, y or z.
pub(super) fn read(path: &Path) -> anyhow::Result<Taken> {
    let shown = path.display();
    let option = ParseOption {
        enabled_quote: false,
        enabled_escape: false,
        ..ParseOption::default()
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let text = fs::read_to_string(path).with_context(|| format!("{shown}"))?;
    let text = with_included(&text, folder);
    let ini = Ini::load_from_str_opt(&text, option).with_context(|| format!("{shown}"))?;
    let hal = Hal::of(&ini, folder);
    let text = |section, key| ini.get_from(Some(section), key).map(str::trim);
    let kinematics = text("KINS", "KINEMATICS").unwrap_or("trivkins");
    let coordinates = kinematics
        .split_once("coordinates=")
        .and_then(|(_, rest)| rest.split_whitespace().next())
        .or(text("TRAJ", "COORDINATES"))
        .unwrap_or("XYZ");
    let units = text("TRAJ", "LINEAR_UNITS").unwrap_or("mm");
    let unit_mm = match units.to_lowercase().as_str() {
        "inch" | "in" | "imperial" => 25.4,
        _ => 1.0,
    };
    let period_ns = text("EMCMOT", "SERVO_PERIOD").and_then(number);
    let rate_hz = 1e9 / period_ns.unwrap_or(1e6);
    let mut stage = defaults_at(rate_hz);
    stage.rate_hz = rate_hz;
    let mut lines = vec![match period_ns {
        Some(period_ns) => format!("rate_hz = {rate_hz}: [EMCMOT]SERVO_PERIOD = {period_ns}"),
        None => format!("rate_hz = {rate_hz}: LinuxCNC's usual; there is no [EMCMOT]SERVO_PERIOD"),
    }];
    lines.push(format!("units: [TRAJ]LINEAR_UNITS = {units}"));
    if !kinematics.starts_with("trivkins") {
        lines.push(format!(
            "[KINS]KINEMATICS = {kinematics}: joints are not axes; the names below are those of joints"
        ));
    }
    for file in &hal.missing {
        lines.push(format!("not read: [HAL]HALFILE = {file}"));
    }
    let mut axes: Vec<AxisName> = Vec::new();
    let letters = coordinates.chars().filter(|letter| !letter.is_whitespace());
    for (number, letter) in letters.enumerate() {
        let letter = letter.to_ascii_lowercase().to_string();
        let name = AxisName::ALL
            .into_iter()
            .find(|axis| axis.as_str() == letter);
        let joint = Joint::find(&ini, &hal, number, unit_mm);
        match (name, joint) {
            (Some(name), Some(joint)) if !axes.contains(&name) => {
                let axis = &mut stage.axes[name as usize];
                let before = lines.len();
                joint.enter(axis, rate_hz, &mut lines);
                for line in &mut lines[before..] {
                    *line = format!("{name}: {line}");
                }
                axes.push(name);
            }
            _ => lines.push(format!("joint {number} ({letter}): left out")),
        }
    }
    ensure!(
        !axes.is_empty(),
        "{shown}: no linear joint is called x, y or z: [KINS]KINEMATICS = {kinematics}, coordinates {coordinates}"
    );
    Ok(Taken { stage, axes, lines })
}

/// The text of an INI file with those that it includes; one that cannot be read is left out.
fn with_included(text: &str, folder: &Path) -> String {
    let lines = text
        .lines()
        .map(|line| match line.strip_prefix("#INCLUDE ") {
            Some(file) => fs::read_to_string(folder.join(file.trim())).unwrap_or_default(),
            None => line.to_owned(),
        });
    lines.collect::<Vec<_>>().join("\n")
}

/// The first word of a value as a number.
fn number(text: &str) -> Option<f64> {
    text.split_whitespace().next()?.parse().ok()
}

/// A joint of a configuration.
struct Joint<'a> {
    ini: &'a Ini,
    hal: &'a Hal,
    number: usize,
    /// Its section: of the joint, or of the axis in LinuxCNC before 2.8.
    section: String,
    unit_mm: f64,
}

impl<'a> Joint<'a> {
    /// The joint of a number; none if it has no section, or turns.
    fn find(ini: &'a Ini, hal: &'a Hal, number: usize, unit_mm: f64) -> Option<Self> {
        let sections = ["JOINT", "AXIS"].map(|kind| format!("{kind}_{number}"));
        let section = sections
            .into_iter()
            .find(|section| ini.section(Some(section.as_str())).is_some())?;
        let joint = Self {
            ini,
            hal,
            number,
            section,
            unit_mm,
        };
        (joint.text("TYPE") != Some("ANGULAR")).then_some(joint)
    }

    fn text(&self, key: &str) -> Option<&'a str> {
        self.ini.get_from(Some(self.section.as_str()), key)
    }

    /// The first of these keys that is a number.
    fn key(&self, keys: &[&str]) -> Option<Found> {
        keys.iter().find_map(|key| {
            let value = number(self.text(key)?)?;
            let from = format!("[{}]{key}", self.section);
            Some(Found { value, from })
        })
    }

    /// The prefixes of pins on this joint's feedback that end so.
    fn feedback(&self, ending: &str) -> Option<String> {
        let pin = format!("joint.{}.motor-pos-fb", self.number);
        let mut found = self
            .hal
            .beside(&pin)
            .filter_map(|pin| pin.strip_suffix(ending));
        found.next().map(str::to_owned)
    }

    /// Counts a machine unit.
    fn encoder_scale(&self) -> Option<Found> {
        let names = self
            .feedback(".position")
            .map(|encoder| ["scale", "position-scale"].map(|name| format!("{encoder}.{name}")));
        let set = names.and_then(|names| self.hal.value(&names));
        set.or_else(|| self.key(&["ENCODER_SCALE", "INPUT_SCALE"]))
            .filter(|found| found.value != 0.0)
    }

    /// Scale of the analog output.
    fn output_scale(&self) -> Option<Found> {
        let pid = self.feedback(".feedback");
        let pins = pid.iter().flat_map(|pid| {
            let output = format!("{pid}.output");
            let pins = self.hal.beside(&output).filter(|pin| *pin != output);
            pins.map(str::to_owned).collect::<Vec<_>>()
        });
        let names = pins.flat_map(|pin| {
            let card = pin.rsplit_once('.').map_or("", |(card, _)| card);
            [format!("{pin}-scalemax"), format!("{card}.scale")]
        });
        let set = self.hal.value(&names.collect::<Vec<_>>());
        set.or_else(|| self.key(&["OUTPUT_SCALE"]))
    }

    /// Enters what is known, with a line for each value.
    fn enter(&self, axis: &mut AxisSettings, rate_hz: f64, lines: &mut Vec<String>) {
        let unit_mm = self.unit_mm;
        axis.encoder.counter_bits = COUNTER_BITS;
        axis.amplifier.full_scale_v = FULL_SCALE_V;
        axis.amplifier.output_limit_v = FULL_SCALE_V;
        let found = self.encoder_scale();
        if let Some(found) = &found {
            axis.encoder.resolution_mm = unit_mm / found.value.abs();
            axis.encoder.reversed = found.value < 0.0;
        }
        let resolution_mm = axis.encoder.resolution_mm;
        let path = format!("encoder.resolution_mm = {resolution_mm}");
        lines.push(origin(&path, found.as_ref()));
        if axis.encoder.reversed {
            lines.push(origin("encoder.reversed = true", found.as_ref()));
        }
        let found = self.output_scale();
        let path = format!("amplifier.full_scale_v = {FULL_SCALE_V}");
        let in_volts = found
            .as_ref()
            .is_some_and(|found| found.value.abs() == FULL_SCALE_V);
        lines.push(match &found {
            Some(found) if !in_volts => format!(
                "{path}: of a card of +-10 V; {} = {} is no voltage: set it to {}, as our output is one. P, I, D and MAX_OUTPUT are not taken",
                found.from,
                found.value,
                FULL_SCALE_V.copysign(found.value)
            ),
            found => origin(&path, found.as_ref()),
        });
        let limit = self.key(&["MAX_OUTPUT", "OUTPUT_MAX_LIMIT"]);
        if let Some(found) = limit.filter(|found| in_volts && found.value > 0.0) {
            let limit_v = found.value.min(FULL_SCALE_V);
            axis.amplifier.output_limit_v = limit_v;
            let path = format!("amplifier.output_limit_v = {limit_v}");
            lines.push(origin(&path, Some(&found)));
        }
        let mut known = DataSheet {
            travel_mm: TRAVEL_MM,
            max_velocity_mm_s: axis.limits.max_velocity_mm_s,
            max_acceleration_mm_s2: axis.limits.max_acceleration_mm_s2,
        };
        let [negative_mm, positive_mm] = &mut known.travel_mm;
        let velocity_mm_s = &mut known.max_velocity_mm_s;
        let acceleration_mm_s2 = &mut known.max_acceleration_mm_s2;
        for (key, path, value) in [
            ("MIN_LIMIT", "travel_mm.negative", negative_mm),
            ("MAX_LIMIT", "travel_mm.positive", positive_mm),
            ("MAX_VELOCITY", "max_velocity_mm_s", velocity_mm_s),
            (
                "MAX_ACCELERATION",
                "max_acceleration_mm_s2",
                acceleration_mm_s2,
            ),
        ] {
            let found = self.key(&[key]);
            if let Some(found) = &found {
                *value = (PER_MM * unit_mm * found.value).round() / PER_MM;
            }
            let path = format!("limits.{path} = {value}");
            lines.push(origin(&path, found.as_ref()));
        }
        enter_limits(&mut axis.limits, &known, resolution_mm);
        without_law(axis, rate_hz);
        let limits = &mut axis.limits;
        // LinuxCNC's error rises from MIN_FERROR to FERROR at the largest velocity.
        if let (Some(most), Some(least)) = (self.key(&["FERROR"]), self.key(&["MIN_FERROR"])) {
            let [most_mm, least_mm] =
                [&most, &least].map(|found| (unit_mm * found.value).min(MOST_ERROR_MM));
            let max_mm = most_mm.max(least_mm);
            limits.following_error_mm = least_mm;
            limits.following_error_max_mm = max_mm;
            limits.following_error_lag_s = (most_mm / limits.max_velocity_mm_s).min(MOST_LAG_S);
            let path = format!("limits.following_error_mm = {least_mm}");
            lines.push(origin(&path, Some(&least)));
            let path = format!("limits.following_error_max_mm = {max_mm}");
            lines.push(origin(&path, Some(&most)));
        }
        let pid = &mut axis.feedback.pid;
        for (key, path, gain) in [
            ("P", "kp_v_per_mm", &mut pid.kp_v_per_mm),
            ("I", "ki_v_per_mm_s", &mut pid.ki_v_per_mm_s),
            ("D", "kd_v_s_per_mm", &mut pid.kd_v_s_per_mm),
        ] {
            if let Some(found) = self.key(&[key]).filter(|_| in_volts) {
                *gain = found.value / unit_mm;
                let path = format!("feedback.pid.{path} = {gain}");
                lines.push(origin(&path, Some(&found)));
            }
        }
        for (key, what) in [
            (
                "FF1",
                "velocity is fed forward, as amplifiers in velocity mode need it: switch them to torque mode",
            ),
            ("BACKLASH", "backlash stays LinuxCNC's to compensate"),
            ("HOME_SEARCH_VEL", "homing stays LinuxCNC's"),
        ] {
            if let Some(found) = self.key(&[key]).filter(|found| found.value != 0.0) {
                lines.push(origin(what, Some(&found)));
            }
        }
    }
}

/// A line for a value, with where it was found.
fn origin(what: &str, found: Option<&Found>) -> String {
    match found {
        Some(found) => format!("{what}: {} = {}", found.from, found.value),
        None => format!("{what}: not found, the default"),
    }
}
