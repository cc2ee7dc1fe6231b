//! Settings that a file leaves out: they are the defaults. Reading replaces defaults by the file's values; writing drops what equals them.
//!
//! A part that a stage has by default only if it is named (`nonlinear`, `homing`, `plant`) begins at its own defaults where a file names it.

use std::fmt::Write as _;
use std::path::Path;

use quadrant_law::axes::AxisName;
use quadrant_settings::path::{RENAMED, present_name};
use quadrant_settings::tree::is_part;
use quadrant_settings::{StageSettings, leaves};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::error::{self, SettingsFileError};
use crate::setting_value::meant;
use crate::toml_file::TomlFileError;

/// Key of a file's form.
const FORM: &str = "form";
/// Key of a file's provenance.
const PROVENANCE: &str = "provenance";
/// Key of the settings of the stage.
const STAGE: &str = "stage";
/// Key of the settings of its axes, below it.
const AXES: &str = "axes";

/// The settings that a file of this control rate may leave out: [`StageSettings::default`], with a filter of the derivative that
/// is allowed at that rate.
pub fn defaults_at(rate_hz: f64) -> StageSettings {
    let mut stage = StageSettings::default();
    if rate_hz.is_finite() && rate_hz > 0.0 {
        for axis in &mut stage.axes {
            let filter_s = &mut axis.feedback.pid.derivative_filter_s;
            *filter_s = filter_s.max(1.0 / rate_hz);
        }
    }
    stage
}

/// The trees that a file is laid over.
struct Defaults {
    /// The defaults.
    plain: Table,
    /// The same with every part that may be left out.
    full: Table,
}

impl Defaults {
    fn at(rate_hz: f64) -> Result<Self, toml::ser::Error> {
        let plain = defaults_at(rate_hz);
        let mut full = plain.clone();
        let mut paths = Vec::new();
        // An empty prefix names all of them.
        let _ = full.list("", &mut |path| paths.push(path.to_owned()));
        for part in paths.iter().filter(|path| is_part(path)) {
            // A part is made without a refusal.
            let _ = full.set_json(part, b"\"present\"");
        }
        Ok(Self {
            plain: Table::try_from(&plain)?,
            full: Table::try_from(&full)?,
        })
    }

    /// The settings of a file, `written`, with those that it leaves out.
    fn under(&self, written: &Table) -> Table {
        overlaid(Some(&self.plain), &self.full, written)
    }
}

/// `written` over `plain`, or over `full` where a part of it is not there by default.
fn overlaid(plain: Option<&Table>, full: &Table, written: &Table) -> Table {
    let mut table = plain.unwrap_or(full).clone();
    for (key, value) in written {
        let below = plain.map(|plain| plain.get(key));
        let laid = match (value, full.get(key)) {
            (Value::Table(value), Some(Value::Table(full))) => {
                let plain = below.map_or(Some(full), |below| below.and_then(Value::as_table));
                Value::Table(overlaid(plain, full, value))
            }
            (Value::Array(value), Some(Value::Array(full))) if key == AXES => {
                Value::Array(axes_overlaid(below.flatten(), full, value))
            }
            _ => value.clone(),
        };
        table.insert(key.clone(), laid);
    }
    table
}

/// The axes of a file over their defaults; those that it leaves out are the defaults.
fn axes_overlaid(plain: Option<&Value>, full: &[Value], written: &[Value]) -> Vec<Value> {
    let default = |index: usize| plain?.as_array()?.get(index);
    let axes = full.iter().enumerate().map(|(index, full)| {
        let plain = default(index);
        match (written.get(index), full) {
            (Some(Value::Table(written)), Value::Table(full)) => {
                Value::Table(overlaid(plain.and_then(Value::as_table), full, written))
            }
            (Some(other), _) => other.clone(),
            (None, full) => plain.unwrap_or(full).clone(),
        }
    });
    axes.collect()
}

/// Gives a stage's settings their present names where a file has former ones.
fn rename(stage: &mut Table) {
    fn below<'a>(table: &'a mut Table, parts: &[&str]) -> Option<&'a mut Table> {
        let next = |table: &'a mut Table, part: &&str| table.get_mut(*part)?.as_table_mut();
        parts.iter().try_fold(table, next)
    }
    let axes = stage.get_mut(AXES).and_then(Value::as_array_mut);
    for axis in axes.into_iter().flatten().filter_map(Value::as_table_mut) {
        for (former, present) in RENAMED {
            let [former, present] = [former, present].map(|path| path[1..].rsplit_once('/'));
            let (Some((part, former)), Some((_, present))) = (former, present) else {
                continue;
            };
            let part: Vec<&str> = part.split('/').collect();
            // Beside its present name a former one is unknown.
            if let Some(table) = below(axis, &part)
                && !table.contains_key(present)
                && let Some(value) = table.remove(former)
            {
                table.insert(present.to_owned(), value);
            }
        }
    }
}

/// The present key of a value that is shown as `shown`: `x/feedforward/gains/presliding` is `presliding`.
fn present_key(shown: &str) -> &str {
    let below = shown.find('/').map_or(shown, |axis| &shown[axis..]);
    let present = present_name(below);
    present.rsplit_once('/').map_or(present, |(_, key)| key)
}

/// The part of `value` that differs from `plain`, or from `full` where a part of it is not there by default.
fn differing(value: &Table, plain: Option<&Table>, full: &Table) -> Table {
    let base = plain.unwrap_or(full);
    let mut table = Table::new();
    for (key, value) in value {
        match (value, full.get(key)) {
            (Value::Table(value), Some(Value::Table(full))) => {
                let plain = base.get(key).and_then(Value::as_table);
                let rest = differing(value, plain, full);
                // A part that is named is there, also with nothing but its defaults.
                if plain.is_none() || !rest.is_empty() {
                    table.insert(key.clone(), Value::Table(rest));
                }
            }
            _ if base.get(key) == Some(value) => {}
            _ => {
                table.insert(key.clone(), value.clone());
            }
        }
    }
    table
}

/// A value of a file, and the line where it stands.
struct Leaf {
    /// Path as it is shown: `x/feedback/pid/kp_v_per_mm`.
    shown: String,
    line: usize,
    /// The file with nothing but this value.
    alone: Table,
}

/// The line of a place in a text, from 1.
fn line(text: &str, at: usize) -> usize {
    1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count()
}

/// A walk through the values of a file.
struct Walk<'a> {
    text: &'a str,
    path: &'a Path,
    leaves: Vec<Leaf>,
}

impl Walk<'_> {
    /// Notes the values of a table, and refuses a key that `full` has not. `shown` is its path and a `/` behind it; `wrap` makes the
    /// stage's table of one at this place.
    fn table(
        &mut self,
        spans: &DeTable<'_>,
        values: &Table,
        full: &Table,
        shown: &str,
        wrap: &dyn Fn(Table) -> Table,
    ) -> Result<(), SettingsFileError> {
        for (key, value) in spans {
            let (name, line) = (key.get_ref().as_ref(), line(self.text, key.span().start));
            let shown = format!("{shown}{name}");
            let Some(known) = full.get(present_key(&shown)) else {
                return Err(SettingsFileError::Unknown {
                    path: self.path.to_owned(),
                    line,
                    meant: meant(&shown).unwrap_or_else(|| STAGE.to_owned()),
                    setting: shown,
                });
            };
            let Some(own) = values.get(name) else {
                continue;
            };
            let around = |below: Value| wrap(Table::from_iter([(name.to_owned(), below)]));
            match (value.get_ref(), own, known) {
                (DeValue::Table(spans), Value::Table(own), Value::Table(full)) => {
                    self.table(spans, own, full, &format!("{shown}/"), &|below| {
                        around(Value::Table(below))
                    })?;
                }
                (DeValue::Array(spans), Value::Array(own), Value::Array(full)) if name == AXES => {
                    for (index, ((spans, own), full)) in spans.iter().zip(own).zip(full).enumerate()
                    {
                        if let (DeValue::Table(spans), Value::Table(own), Value::Table(full)) =
                            (spans.get_ref(), own, full)
                        {
                            let shown = format!("{}/", AxisName::ALL[index]);
                            self.table(spans, own, full, &shown, &|below| {
                                let mut axes = vec![Value::Table(Table::new()); index];
                                axes.push(Value::Table(below));
                                around(Value::Array(axes))
                            })?;
                        }
                    }
                }
                _ => self.leaves.push(Leaf {
                    shown,
                    line,
                    alone: around(own.clone()),
                }),
            }
        }
        Ok(())
    }
}

/// The file that a text says, with the settings that it leaves out; nothing of it is checked but names and types.
///
/// # Errors
/// A text that is no TOML, a setting that there is not, or a value of another type.
pub(super) fn parsed<File: DeserializeOwned>(
    text: &str,
    path: &Path,
) -> Result<File, SettingsFileError> {
    let syntax = |source| TomlFileError::syntax(path, source);
    let mut written: Table = toml::from_str(text).map_err(syntax)?;
    let spans = DeTable::parse(text).map_err(syntax)?;
    for (key, _) in spans.get_ref() {
        let name = key.get_ref().as_ref();
        if ![FORM, PROVENANCE, STAGE].contains(&name) {
            return Err(SettingsFileError::Unknown {
                path: path.to_owned(),
                line: line(text, key.span().start),
                setting: name.to_owned(),
                meant: meant(name).map_or_else(
                    || format!("{name} below [{STAGE}]"),
                    |setting| format!("{setting} below [{STAGE}]"),
                ),
            });
        }
    }
    let Some(Value::Table(stage)) = written.get_mut(STAGE) else {
        // Its message says what is missing.
        return Ok(toml::from_str(text).map_err(syntax)?);
    };
    rename(stage);
    if let Some(count) = axes_of(stage).filter(|count| *count > AxisName::ALL.len()) {
        return Err(SettingsFileError::Axes {
            path: path.to_owned(),
            count,
        });
    }
    let serialise = |source| SettingsFileError::Serialise {
        path: path.to_owned(),
        source,
    };
    let defaults = Defaults::at(rate_hz(stage)).map_err(serialise)?;
    let mut walk = Walk {
        text,
        path,
        leaves: Vec::new(),
    };
    if let Some(DeValue::Table(spans)) = spans.get_ref().get(STAGE).map(|stage| stage.get_ref()) {
        walk.table(spans, stage, &defaults.full, "", &|table| table)?;
    }
    let whole = Value::Table(defaults.under(stage));
    written.insert(STAGE.to_owned(), whole);
    written.entry(FORM).or_insert(error::FORM.into());
    written.try_into().map_err(|error: toml::de::Error| {
        let refused = |leaf: &&Leaf| {
            let alone = defaults.under(&leaf.alone);
            alone.try_into::<StageSettings>().is_err()
        };
        match walk.leaves.iter().find(refused) {
            Some(leaf) => SettingsFileError::Type {
                path: path.to_owned(),
                line: leaf.line,
                setting: leaf.shown.clone(),
                reason: error.message().to_owned(),
            },
            None => syntax(error).into(),
        }
    })
}

fn axes_of(stage: &Table) -> Option<usize> {
    stage.get(AXES)?.as_array().map(Vec::len)
}

/// The control rate that a file says, else the default, Hz.
fn rate_hz(stage: &Table) -> f64 {
    let written = stage.get("rate_hz");
    let number = written.and_then(|value| {
        let whole = value.as_integer().map(|whole| whole as f64);
        value.as_float().or(whole)
    });
    number.unwrap_or_else(|| StageSettings::default().rate_hz)
}

/// The text of a file with the settings that differ from the defaults alone, each with its unit and meaning.
///
/// # Errors
/// Settings that TOML cannot express.
pub(super) fn text(
    file: &impl Serialize,
    settings: &StageSettings,
) -> Result<String, toml::ser::Error> {
    let defaults = Defaults::at(settings.rate_hz)?;
    let stage = Table::try_from(settings)?;
    // Form and origin as they are.
    let mut rest = Table::try_from(file)?;
    rest.remove(STAGE);
    let is_empty = |value: &Value| value.as_array().is_some_and(Vec::is_empty);
    rest.retain(|_, value| !is_empty(value));
    let mut text = toml::to_string(&rest)?;
    let mut of_stage = differing(&stage, Some(&defaults.plain), &defaults.full);
    of_stage.remove(AXES);
    write_table(&mut text, &of_stage, STAGE, "", &format!("[{STAGE}]"));
    let of = |table: &Table| table.get(AXES).and_then(Value::as_array).cloned();
    let all = [&stage, &defaults.plain, &defaults.full].map(|table| of(table).unwrap_or_default());
    let [axes, plain, full] = &all;
    let rest: Vec<Table> = (axes.iter().zip(plain).zip(full))
        .filter_map(|((axis, plain), full)| {
            Some(differing(
                axis.as_table()?,
                plain.as_table(),
                full.as_table()?,
            ))
        })
        .collect();
    let last = rest.iter().rposition(|axis| !axis.is_empty());
    for (axis, name) in rest
        .iter()
        .zip(AxisName::ALL)
        .take(last.map_or(0, |last| last + 1))
    {
        let head = format!("[[{STAGE}.{AXES}]] # {name}");
        write_table(
            &mut text,
            axis,
            &format!("{STAGE}.{AXES}"),
            &format!("axes/{}/", name as usize),
            &head,
        );
    }
    Ok(text)
}

/// Writes a table with `head` above it: its values, each with unit and meaning, then its tables.
fn write_table(text: &mut String, table: &Table, name: &str, shown: &str, head: &str) {
    let _ = write!(text, "\n{head}\n");
    for (key, value) in table.iter().filter(|(_, value)| !value.is_table()) {
        let _ = write!(text, "{key} = {value}");
        if let Some(leaf) = leaves::find(&format!("/{shown}{key}")) {
            let unit = match leaf.unit {
                "" => String::new(),
                unit => format!("{unit}: "),
            };
            let _ = write!(text, " # {unit}{}", leaf.meaning);
        }
        text.push('\n');
    }
    for (key, value) in table {
        if let Value::Table(below) = value {
            let name = format!("{name}.{key}");
            let head = format!("[{name}]");
            write_table(text, below, &name, &format!("{shown}{key}/"), &head);
        }
    }
}
