//! The reference of all settings, from the library's own table: what each means, its unit, range and default.

use std::collections::BTreeSet;
use std::fmt::Write;

use quadrant_settings::StageSettings;
use quadrant_settings::leaves::{Bound, Exchange, LeafInfo, Range, UNSET, all};
use quadrant_settings::tree::is_part;
use serde_json::Value;

/// A row of the reference: a leaf, or a number of a list's points.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Row {
    /// Its path, with `*` for the axis and for the point of a list.
    pub path: String,
    /// Its unit; empty for none.
    pub unit: &'static str,
    /// Its range, in words.
    pub range: String,
    /// Its default; of a list's points, of each point. Of a number that has none: that it must be given.
    pub default: String,
    /// The state in which it changes, in words.
    pub changes: &'static str,
    pub meaning: &'static str,
}

/// Every setting whose path, unit or meaning contains each word of `asked`, in the order of the table; capitals or not.
pub fn rows(asked: &str) -> Vec<Row> {
    let settings = with_every_part();
    let asked = asked.to_lowercase();
    let is_asked = |leaf: &LeafInfo, path: &str| {
        let text = format!("{path} {} {}", leaf.unit, leaf.meaning).to_lowercase();
        asked.split_whitespace().all(|word| text.contains(word))
    };
    all()
        .map(|leaf| (leaf, leaf.path().as_str().to_owned()))
        .filter(|(leaf, path)| is_asked(leaf, path))
        .map(|(leaf, path)| Row {
            unit: leaf.unit,
            range: range(leaf),
            default: default(&settings, leaf, &path),
            changes: match leaf.exchange {
                Exchange::Driven => "at any time",
                Exchange::Disabled => "outputs off",
                Exchange::Restart => "restart",
            },
            meaning: leaf.meaning,
            path,
        })
        .collect()
}

/// The default settings, with the parts that may be left out made.
fn with_every_part() -> StageSettings {
    let mut settings = StageSettings::default();
    for part in parts() {
        // Every part can be made.
        let made = settings.set_json(&part.replacen('*', "0", 1), b"\"present\"");
        debug_assert!(made.is_ok());
    }
    settings
}

/// A number as briefly as it goes.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e5).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

fn bound(bound: Bound) -> String {
    match bound {
        Bound::At(value) => number(value),
        Bound::Times(1.0, words, _) => words.to_owned(),
        Bound::Times(factor, words, _) => format!("{} x {words}", number(factor)),
        Bound::AtMost(most, words, _) => format!("{} or {words}, the smaller", number(most)),
    }
}

fn range(leaf: &LeafInfo) -> String {
    match leaf.range {
        Range::Number(least, most) => format!("{} to {}", bound(least), bound(most)),
        Range::Flag => "true, false".to_owned(),
        Range::Name(names) => names.join(", "),
        Range::List(most) => format!("1 to {most} points"),
    }
}

/// The default of a leaf in words.
fn default(settings: &StageSettings, leaf: &LeafInfo, path: &str) -> String {
    if let Range::Number(least, _) = leaf.range
        && leaf.default == UNSET
        && least.value(settings, 0) > UNSET
    {
        return "must be given".to_owned();
    }
    let path = path.replacen('*', "0", 1);
    match path.split_once("/*/") {
        Some((list, name)) => spoken(&json(settings, list), Some(name)),
        None => spoken(&json(settings, &path), None),
    }
}

fn json(settings: &StageSettings, path: &str) -> Value {
    let mut buffer = [0; 1024];
    let length = settings.get_json(path, &mut buffer);
    length
        .ok()
        .and_then(|length| serde_json::from_slice(&buffer[..length]).ok())
        .unwrap_or_default()
}

fn spoken(value: &Value, name: Option<&str>) -> String {
    match (value, name) {
        (Value::Array(points), Some(name)) => {
            let each = points.iter().map(|point| spoken(&point[name], None));
            each.collect::<Vec<_>>().join(", ")
        }
        (Value::Array(points), None) => match points.len() {
            1 => "1 point".to_owned(),
            count => format!("{count} points"),
        },
        (Value::Number(value), _) => value.as_f64().map_or_else(String::new, number),
        (Value::String(name), _) => name.clone(),
        (Value::Null, _) => "left out".to_owned(),
        (other, _) => other.to_string(),
    }
}

/// The parts of an axis that may be left out, with `*` for the axis.
fn parts() -> BTreeSet<String> {
    let mut parts = BTreeSet::new();
    let listed = StageSettings::default().list("/axes/x", &mut |path| {
        if is_part(path) {
            parts.insert(path.replacen("/axes/0", "/axes/*", 1));
        }
    });
    // Every axis has leaves.
    debug_assert!(listed.is_ok());
    parts
}

/// Heading of the settings whose paths begin so.
const SECTIONS: [(&str, &str); 9] = [
    ("/rate_hz", "The stage"),
    ("/axes/*/commissioned", "Commissioning"),
    ("/axes/*/encoder/", "Encoder"),
    ("/axes/*/amplifier/", "Amplifier"),
    ("/axes/*/limits/", "Limits"),
    ("/axes/*/plant/", "Plant"),
    ("/axes/*/feedback/", "Feedback"),
    ("/axes/*/friction/", "Friction"),
    ("/axes/*/feedforward/", "Feedforward"),
];

/// The page `docs/settings.md`.
pub fn markdown() -> String {
    let mut page = String::from(INTRODUCTION);
    let parts: Vec<String> = parts().iter().map(|part| format!("`{part}`")).collect();
    let _ = writeln!(page, "\nThese parts may be left out: {}.", parts.join(", "));
    let mut rest = rows("");
    for (prefix, heading) in SECTIONS {
        let (section, others) = rest
            .into_iter()
            .partition(|row| row.path.starts_with(prefix));
        rest = others;
        table(&mut page, heading, &section);
    }
    if !rest.is_empty() {
        table(&mut page, "Others", &rest);
    }
    page
}

fn table(page: &mut String, heading: &str, rows: &[Row]) {
    let _ = write!(
        page,
        "\n## {heading}\n\n| path | unit | range | default | changes | meaning |\n|---|---|---|---|---|---|\n"
    );
    for row in rows {
        let _ = writeln!(
            page,
            "| `{}` | {} | {} | {} | {} | {} |",
            row.path, row.unit, row.range, row.default, row.changes, row.meaning
        );
    }
}

const INTRODUCTION: &str = "\
# Settings

Made by `quadrant settings --markdown` from the table in `crates/settings/src/leaves`; a test says when this page is stale.

Every setting has a path. `*` stands for the axis, `x`, `y` or `z` (or 0, 1, 2), and for a point of a list: a list is one
value, and its points' numbers are below it here only to be explained. Values are JSON.

The defaults are those of a board that nobody has commissioned: they hold no law, and the outputs are not enabled on them
(`quadrant commission` finds an axis' settings). The simulated stage's own settings are in
[parameters.md](parameters.md).

A set of settings is checked as a whole before it takes effect. Beyond the ranges below: the law that acts and the kind of
feedforward have their parameters; with a plant, the loop is stable at small errors and the nonlinear gain stays within its
Popov bound, and pre-sliding springs are resolved at the control rate; the weights of the GMS sum to 1 within 1e-6; the
points of lists rise; the Stribeck curve is smooth enough for its table. `rate_hz` and the encoders change with a
restart. What the safety of an axis depends on (*outputs off* below) is refused by name while the outputs are on.
How a set is stored is in [settings-storage.md](settings-storage.md).

A part that may be left out is left out by default. It reads `\"present\"` or `null` at its own path. `null` removes it;
`\"present\"` makes it, with the defaults below; a number that must be given is refused by name until it is.
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_up_to_date() {
        let page = include_str!("../../../docs/settings.md");
        assert!(
            page == markdown(),
            "docs/settings.md is stale: `cargo run -- settings --markdown > docs/settings.md`"
        );
    }

    #[test]
    fn every_setting_has_its_row_with_a_default() {
        let rows = rows("");
        assert_eq!(rows.len(), all().count());
        for row in &rows {
            assert!(!row.default.is_empty() && !row.range.is_empty(), "{row:?}");
            assert!(!row.default.contains("left out"), "{row:?}");
        }
    }

    #[test]
    fn a_row_says_what_the_table_and_the_defaults_say() {
        // Words of the meaning, and capitals, find it, too.
        let by_meaning = rows("Proportional GAIN pid");
        assert!(
            by_meaning
                .iter()
                .any(|row| row.path.ends_with("/pid/kp_v_per_mm"))
        );
        assert!(rows("proportional nonsense").is_empty());
        let found = rows("kp_v_per_mm");
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].range, "0 to 10000");
        assert_eq!(found[0].default, "0");
        assert_eq!(rows("plant/gain")[0].default, "must be given");
        assert_eq!(rows("elements/*/weight")[0].default, "1");
        assert_eq!(rows("/feedback/schedule")[0].default, "1 point");
        assert_eq!(rows("preview_s")[0].range, "0 to 30 x the control period");
        assert_eq!(rows("resolution_mm")[0].range, "1e-6 to 1");
    }
}
