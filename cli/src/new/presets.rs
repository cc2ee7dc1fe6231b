//! Usual encoders and amplifiers.

use std::str::FromStr;

/// An encoder, by the length or the number of its counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoder {
    /// On the table: length of a count, mm.
    Linear {
        /// Length of a count, mm.
        count_mm: f64,
    },
    /// On the screw or the motor: counts in a turn, four for each line.
    Rotary {
        /// Counts in a turn.
        counts: u32,
    },
}

impl Encoder {
    /// Length of a count of an encoder on a screw with this lead, mm.
    pub(super) fn count_mm(self, lead_mm: f64) -> f64 {
        match self {
            Self::Linear { count_mm } => count_mm,
            Self::Rotary { counts } => lead_mm / f64::from(counts),
        }
    }
}

const fn rotary(counts: u32) -> Encoder {
    Encoder::Rotary { counts }
}

const fn linear(count_mm: f64) -> Encoder {
    Encoder::Linear { count_mm }
}

/// Encoders by name.
pub(super) const ENCODERS: [(&str, Encoder, &str); 11] = [
    (
        "rotary-1000",
        rotary(4_000),
        "1000 lines in a turn, 4000 counts",
    ),
    (
        "rotary-1024",
        rotary(4_096),
        "1024 lines in a turn, 4096 counts",
    ),
    (
        "rotary-2500",
        rotary(10_000),
        "2500 lines in a turn, 10 000 counts",
    ),
    (
        "rotary-5000",
        rotary(20_000),
        "5000 lines in a turn, 20 000 counts",
    ),
    ("rotary-17bit", rotary(131_072), "131 072 counts in a turn"),
    (
        "rotary-20bit",
        rotary(1_048_576),
        "1 048 576 counts in a turn",
    ),
    ("linear-5um", linear(5e-3), "scale, 5 um a count"),
    ("linear-1um", linear(1e-3), "scale, 1 um a count"),
    ("linear-0.5um", linear(5e-4), "scale, 0.5 um a count"),
    ("linear-0.1um", linear(1e-4), "scale, 0.1 um a count"),
    ("linear-0.05um", linear(5e-5), "scale, 0.05 um a count"),
];

/// An amplifier's input, V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Amplifier {
    /// Voltage of the converter's largest code.
    pub(super) full_scale_v: f64,
    /// Largest output.
    pub(super) output_limit_v: f64,
}

const fn amplifier(full_scale_v: f64, output_limit_v: f64) -> Amplifier {
    Amplifier {
        full_scale_v,
        output_limit_v,
    }
}

/// Amplifiers by name.
pub(super) const AMPLIFIERS: [(&str, Amplifier, &str); 4] = [
    (
        "analog-10v",
        amplifier(10.0, 10.0),
        "input of +-10 V, all of it used",
    ),
    (
        "analog-10v-limited",
        amplifier(10.0, 3.0),
        "input of +-10 V, 3 V of it used: for a first start",
    ),
    ("analog-5v", amplifier(5.0, 5.0), "input of +-5 V"),
    ("analog-2.5v", amplifier(2.5, 2.5), "input of +-2.5 V"),
];

/// A preset of this name.
fn named<T: Copy>(presets: &[(&str, T, &str)], text: &str) -> Option<T> {
    let preset = presets.iter().find(|(name, _, _)| *name == text);
    preset.map(|(_, value, _)| *value)
}

/// The names of presets, for a refusal.
fn names<T>(presets: &[(&str, T, &str)]) -> String {
    let names: Vec<&str> = presets.iter().map(|(name, _, _)| *name).collect();
    names.join(", ")
}

impl FromStr for Encoder {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named(&ENCODERS, text).ok_or_else(|| {
            format!(
                "no encoder is named so; there are {}. Another one is given by --lines-per-turn, --counts-per-turn or --count-um",
                names(&ENCODERS)
            )
        })
    }
}

impl FromStr for Amplifier {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        named(&AMPLIFIERS, text).ok_or_else(|| {
            format!(
                "no amplifier is named so; there are {}. Another one is given by --full-scale-v and --output-limit-v",
                names(&AMPLIFIERS)
            )
        })
    }
}

/// Both lists, a line each.
pub(super) fn list() -> String {
    let encoders = ENCODERS.iter().map(|(name, _, help)| (*name, *help));
    let amplifiers = AMPLIFIERS.iter().map(|(name, _, help)| (*name, *help));
    let lines = |head: &str, presets: &mut dyn Iterator<Item = (&str, &str)>| {
        presets.fold(format!("{head}\n"), |text, (name, help)| {
            format!("{text}  {name:<20} {help}\n")
        })
    };
    lines("--encoder", &mut { encoders }) + &lines("--amplifier", &mut { amplifiers })
}
