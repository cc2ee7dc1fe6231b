//! The HAL files of a LinuxCNC configuration, as far as they say which card's pins belong to a joint.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use ini::Ini;

/// Folder of LinuxCNC's own HAL files.
const LIBRARY: &str = "/usr/share/linuxcnc/hallib";

/// Pins by signal, and values that are set.
#[derive(Default)]
pub(super) struct Hal {
    signals: HashMap<String, Vec<String>>,
    values: HashMap<String, String>,
    /// Files that could not be read.
    pub(super) missing: Vec<String>,
}

/// A value that is set, with what it is written as.
pub(super) struct Found {
    pub(super) value: f64,
    pub(super) from: String,
}

impl Hal {
    /// The files that an INI file in `folder` names; those in Tcl are left out.
    pub(super) fn of(ini: &Ini, folder: &Path) -> Self {
        let mut hal = Self::default();
        let files = ini
            .section(Some("HAL"))
            .into_iter()
            .flat_map(|hal| hal.get_all("HALFILE"));
        for line in files {
            let file = line.split_whitespace().next().unwrap_or_default();
            let library = Path::new(LIBRARY).join(file.trim_start_matches("LIB:"));
            let text =
                fs::read_to_string(folder.join(file)).or_else(|_| fs::read_to_string(library));
            match text {
                Ok(text) if !file.ends_with(".tcl") => hal.add(&text, ini),
                _ => hal.missing.push(file.to_owned()),
            }
        }
        hal
    }

    fn add(&mut self, text: &str, ini: &Ini) {
        for line in text.replace("\\\n", " ").lines() {
            let line = with_values(line.split('#').next().unwrap_or_default(), ini);
            let mut words = line.split_whitespace();
            match (words.next(), words.next()) {
                (Some("net"), Some(signal)) => {
                    let pins = words.filter(|word| !matches!(*word, "=>" | "<=" | "<=>"));
                    let known = self.signals.entry(signal.to_owned()).or_default();
                    known.extend(pins.map(str::to_owned));
                }
                (Some("setp"), Some(pin)) => {
                    let value = words.next().unwrap_or_default();
                    self.values.insert(pin.to_owned(), value.to_owned());
                }
                _ => {}
            }
        }
    }

    /// The pins on the same signal.
    pub(super) fn beside(&self, pin: &str) -> impl Iterator<Item = &str> {
        let signals = self.signals.values();
        let own = signals.filter(move |pins| pins.iter().any(|one| one == pin));
        own.flatten().map(String::as_str)
    }

    /// The first of these that is set to a number.
    pub(super) fn value(&self, names: &[String]) -> Option<Found> {
        names.iter().find_map(|name| {
            let value = self.values.get(name)?.parse().ok()?;
            let from = format!("setp {name}");
            Some(Found { value, from })
        })
    }
}

/// A line in which `[SECTION]KEY` and `[SECTION](KEY)` are the INI file's values.
fn with_values(line: &str, ini: &Ini) -> String {
    let mut out = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once('[') {
        out += before;
        let Some((section, after)) = after.split_once(']') else {
            rest = after;
            break;
        };
        let bracket = after.starts_with('(');
        let after = after.strip_prefix('(').unwrap_or(after);
        let end = after.find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '-')));
        let (key, after) = after.split_at(end.unwrap_or(after.len()));
        let after = after.strip_prefix(')').filter(|_| bracket).unwrap_or(after);
        let value = ini.get_from(Some(section), key).unwrap_or_default();
        out += value.split_whitespace().next().unwrap_or_default();
        rest = after;
    }
    out + rest
}
