//! A setting's value in bytes, as it crosses the link, and as JSON; and what differs between settings.

use heapless::Vec as Bounded;
use quadrant_law::axes::AxisName;
use quadrant_settings::tree::{TreeError, is_part};
use quadrant_settings::{MAX_VALUE_BYTES, StageSettings};

/// Room for every value as JSON.
const JSON_BYTES: usize = 2048;

/// A value: the number of its kind, and its bytes.
pub type Encoded = (u8, Bounded<u8, MAX_VALUE_BYTES>);

/// The value at a path of some settings, or whether a part that may be left out is there.
///
/// # Errors
/// A path that there is not, or one in a part that is left out.
pub fn of(settings: &StageSettings, path: &str) -> Result<Encoded, TreeError> {
    let mut bytes = Bounded::new();
    // Cannot fail: that is its capacity.
    let _ = bytes.resize_default(MAX_VALUE_BYTES);
    let (kind, length) = settings.get_bytes(path, &mut bytes)?;
    bytes.truncate(length);
    Ok((kind, bytes))
}

/// A value of this path as JSON.
///
/// # Errors
/// A path that there is not, or a value that is none of it.
pub fn to_json(path: &str, kind: u8, bytes: &[u8]) -> Result<String, TreeError> {
    let mut own = with_parts_of(path)?;
    own.set_bytes(path, kind, bytes)?;
    let mut json = [0; JSON_BYTES];
    let length = own.get_json(path, &mut json)?;
    Ok(String::from_utf8_lossy(&json[..length]).into_owned())
}

/// The value of this path that JSON says.
///
/// # Errors
/// A path that there is not, or a value that is none of it.
pub fn from_json(path: &str, json: &str) -> Result<Encoded, TreeError> {
    let mut own = with_parts_of(path)?;
    own.set_json(path, json.as_bytes())?;
    of(&own, path)
}

/// Settings that have every part in which a path lies.
fn with_parts_of(path: &str) -> Result<StageSettings, TreeError> {
    let mut own = StageSettings::simulated();
    for (end, _) in path.match_indices('/') {
        let above = &path[..end];
        if is_part(above) {
            own.set_json(above, b"\"present\"")?;
        }
    }
    Ok(own)
}

/// The path as it is shown: `x/feedback/law` for `/axes/0/feedback/law`, `rate_hz` for `/rate_hz`.
pub fn short(path: &str) -> String {
    let bare = path.strip_prefix('/').unwrap_or(path);
    let of_axis = AxisName::ALL.iter().enumerate().find_map(|(index, axis)| {
        let below = bare.strip_prefix("axes/")?;
        let below = below.strip_prefix(&index.to_string())?;
        (below.is_empty() || below.starts_with('/')).then(|| format!("{axis}{below}"))
    });
    of_axis.unwrap_or_else(|| bare.to_owned())
}

/// The path that is meant by one that there is not, or is not above one: of all paths the most similar. `None` for one that there is.
pub fn meant(shown: &str) -> Option<String> {
    let mut full = StageSettings::simulated();
    let mut paths = Vec::new();
    // An empty prefix names all of them.
    let _ = full.list("", &mut |path| paths.push(path.to_owned()));
    for part in std::mem::take(&mut paths)
        .iter()
        .filter(|path| is_part(path))
    {
        // A part is made without a refusal.
        let _ = full.set_json(part, b"\"present\"");
    }
    let _ = full.list("", &mut |path| paths.push(short(path)));
    let is_there = |path: &String| {
        let rest = path.strip_prefix(shown.trim_end_matches('/'));
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    };
    if paths.iter().any(is_there) {
        return None;
    }
    // One that ends too early is the beginning of what is meant.
    let rank = |path: &String| (!path.starts_with(shown), distance(shown, path));
    paths.into_iter().min_by_key(rank)
}

/// The number of characters by which two texts differ (Levenshtein).
fn distance(one: &str, other: &str) -> usize {
    let mut row: Vec<usize> = (0..=other.chars().count()).collect();
    for (index, sign) in one.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = index + 1;
        for (place, found) in other.chars().enumerate() {
            let replaced = diagonal + usize::from(sign != found);
            diagonal = row[place + 1];
            row[place + 1] = replaced.min(diagonal + 1).min(row[place] + 1);
        }
    }
    row.last().copied().unwrap_or_default()
}

/// A setting that differs between two stages' settings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// Its path, as it is shown.
    pub path: String,
    /// Its value before, as JSON; `-` in a part that was left out.
    pub old: String,
    /// Its value after.
    pub new: String,
}

impl core::fmt::Display for Change {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { path, old, new } = self;
        let [old, new] = shown(old, new);
        write!(f, "{path}: {old} -> {new}")
    }
}

/// Two values of a setting, as JSON, for a person: numbers in seven digits, or in all where those do not differ.
pub fn shown(old: &str, new: &str) -> [String; 2] {
    let brief = [old, new].map(brief);
    match brief[0] == brief[1] {
        true => [old, new].map(str::to_owned),
        false => brief,
    }
}

fn brief(json: &str) -> String {
    match (json, json.parse::<f64>()) {
        ("null", _) => "absent".to_owned(),
        ("\"present\"", _) => "present".to_owned(),
        (_, Ok(number)) => match format!("{number:.6e}").parse::<f64>() {
            Ok(rounded) => rounded.to_string(),
            Err(_) => json.to_owned(),
        },
        _ => json.to_owned(),
    }
}

/// The value at a path as JSON; `None` in a part that is left out.
fn json_at(settings: &StageSettings, path: &str) -> Option<String> {
    let mut json = [0; JSON_BYTES];
    let length = settings.get_json(path, &mut json).ok()?;
    Some(String::from_utf8_lossy(&json[..length]).into_owned())
}

/// Every setting that differs.
pub fn changes(before: &StageSettings, after: &StageSettings) -> Vec<Change> {
    let mut paths = Vec::new();
    // An empty prefix names all of them.
    let _ = before.list("", &mut |path| paths.push(path.to_owned()));
    let _ = after.list("", &mut |path| {
        if !paths.iter().any(|known| known == path) {
            paths.push(path.to_owned());
        }
    });
    let differing = paths.into_iter().filter_map(|path| {
        let [old, new] = [before, after].map(|settings| json_at(settings, &path));
        (old != new).then(|| {
            let shown = |value: Option<String>| value.unwrap_or_else(|| "-".to_owned());
            Change {
                path: short(&path),
                old: shown(old),
                new: shown(new),
            }
        })
    });
    differing.collect()
}

/// Settings of `there` that writing `after` over them would lose: they are not those of `start`, and `after` takes them from it.
pub fn lost(there: &StageSettings, start: &StageSettings, after: &StageSettings) -> Vec<Change> {
    let changed = changes(start, after);
    let mut lost = changes(there, start);
    lost.retain(|Change { path, .. }| !changed.iter().any(|change| change.path == *path));
    lost
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_crosses_the_link_though_its_part_is_left_out_elsewhere() {
        let mut full = StageSettings::simulated();
        let mut parts = Vec::new();
        full.list("", &mut |path| {
            if is_part(path) {
                parts.push(path.to_owned());
            }
        })
        .unwrap();
        for part in &parts {
            full.set_json(part, b"\"present\"").unwrap();
        }
        let mut paths = Vec::new();
        full.list("", &mut |path| paths.push(path.to_owned()))
            .unwrap();
        for path in paths {
            let value = of(&full, &path).unwrap();
            let json = to_json(&path, value.0, &value.1).unwrap();
            assert_eq!(from_json(&path, &json).unwrap(), value, "{path}");
        }
    }

    #[test]
    fn numbers_are_shown_in_as_many_digits_as_they_differ_in() {
        assert_eq!(shown("0.1", "1.3301234567890123"), ["0.1", "1.330123"]);
        let close = ["1.3301234567890123", "1.3301234567890125"];
        assert_eq!(shown(close[0], close[1]), close);
        assert_eq!(shown("-", "[1.0,2.0]"), ["-", "[1.0,2.0]"]);
    }

    #[test]
    fn what_differs_is_shown_by_the_short_path_with_both_values() {
        let before = StageSettings::simulated();
        let mut after = before.clone();
        after.rate_hz = 5e3;
        after.axes[1].plant = None;
        after.axes[2].feedback.pid.kp_v_per_mm = 0.5;
        let shown: Vec<String> = changes(&before, &after)
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(shown[0], "rate_hz: 10000 -> 5000");
        assert!(
            shown.contains(&"y/plant: present -> absent".to_owned()),
            "{shown:?}"
        );
        assert!(
            shown
                .iter()
                .any(|line| line.starts_with("z/feedback/pid/kp_v_per_mm: "))
        );
        assert_eq!(changes(&after, &after), []);
        let lost = lost(&after, &before, &before);
        assert_eq!(lost.len(), shown.len());
    }

    #[test]
    fn what_is_meant_by_a_path_that_there_is_not_is_the_most_similar_one() {
        for (shown, path) in [
            ("x/feedback/pid/kp", "x/feedback/pid/kp_v_per_mm"),
            ("x.feedback.law", "x/feedback/law"),
            (
                "y/feedforward/learning/memory",
                "y/feedforward/learning/memory_s",
            ),
            ("rate", "rate_hz"),
        ] {
            assert_eq!(meant(shown).as_deref(), Some(path), "{shown}");
        }
        for shown in [
            "rate_hz",
            "x/feedback",
            "z/feedforward/cancelling/teeth",
            "x/",
        ] {
            assert_eq!(meant(shown), None, "{shown}");
        }
    }

    #[test]
    fn a_value_is_the_same_after_it_has_crossed_the_link() {
        for (path, json) in [
            ("/axes/0/feedback/pid/kp_v_per_mm", "0.9"),
            ("/axes/1/feedback/law", "\"n-pid\""),
            ("/axes/2/feedback/nonlinear", "null"),
        ] {
            let (kind, bytes) = from_json(path, json).unwrap();
            assert_eq!(to_json(path, kind, &bytes).unwrap(), json, "{path}");
        }
        assert!(from_json("/axes/0/feedback/pid/kp_v_per_mm", "\"much\"").is_err());
        assert!(from_json("/axes/0/nothing", "1").is_err());
    }
}
