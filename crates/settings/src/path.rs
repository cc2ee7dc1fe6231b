//! Paths of settings: `/rate_hz`, or `/axes/<axis>/…` with the axis as `x`, `y`, `z`, or as 0 to 2.
//!
//! A canonical path has the axis as a number; the path of a stored record, or of a row of the table, has `*` for it.

use heapless::String;

/// The longest path, in bytes.
pub const MAX_PATH: usize = 96;

/// A path, or a part of one.
pub type Path = String<MAX_PATH>;

/// The beginning of a path that holds for every axis.
pub const ANY_AXIS: &str = "/axes/*";

/// The beginning of every axis' path, without the axis.
const AXES: &str = "/axes/";

/// The axes, as letters and as numbers.
const NAMES: [[&str; 2]; 3] = [["x", "0"], ["y", "1"], ["z", "2"]];

/// Paths below an axis under their former names, and what they are now: what is stored or kept in a file stays readable.
pub const RENAMED: [(&str, &str); 1] =
    [("/feedforward/gains/gms", "/feedforward/gains/presliding")];

/// The present name of a path below an axis, which may be given under a former one.
pub fn present_name(below: &str) -> &str {
    let renamed = RENAMED.iter().find(|(former, _)| *former == below);
    renamed.map_or(below, |(_, present)| present)
}

/// The number of an axis in a path.
fn number(index: usize) -> &'static str {
    NAMES.get(index).map_or("", |&[_, number]| number)
}

fn joined(parts: [&str; 3]) -> Option<Path> {
    let mut path = Path::new();
    for part in parts {
        path.push_str(part).ok()?;
    }
    Some(path)
}

/// The path with its axis as a number; `None` if it does not begin with `/`, or has an axis that there is not.
pub(crate) fn canonical(path: &str) -> Option<Path> {
    let Some(rest) = path.strip_prefix(AXES) else {
        return joined([path.starts_with('/').then_some(path)?, "", ""]);
    };
    let end = rest.find('/').unwrap_or(rest.len());
    // By `get`: slicing, should it fail, would want to print the text.
    let (name, below) = rest.split_at_checked(end).unwrap_or((rest, ""));
    let [_, index] = NAMES.iter().find(|names| names.contains(&name))?;
    joined([AXES, index, present_name(below)])
}

/// The canonical path of what a person may write: `x/limits/max_velocity_mm_s` for `/axes/0/limits/max_velocity_mm_s`.
/// A path that begins with no axis is taken for one of the stage.
pub fn expand(written: &str) -> Option<Path> {
    let bare = written.strip_prefix('/').unwrap_or(written);
    let of_axis = joined([AXES, bare.strip_prefix("axes/").unwrap_or(bare), ""])?;
    canonical(&of_axis).or_else(|| joined(["/", bare, ""]))
}

/// The axis of a canonical path, and what follows it.
pub fn below_axis(path: &str) -> Option<(usize, &str)> {
    let rest = path.strip_prefix(AXES)?;
    let below = rest.get(1..)?;
    let axis = NAMES
        .iter()
        .position(|[_, index]| rest.starts_with(index))?;
    (below.is_empty() || below.starts_with('/')).then_some((axis, below))
}

/// The path for every axis of something below one.
pub fn of_any_axis(below: &str) -> Option<Path> {
    joined([ANY_AXIS, below, ""])
}

/// The canonical path for one axis of a path for every axis; others stay as they are.
pub fn of_axis(path: &str, index: usize) -> Path {
    let path = match path.strip_prefix(ANY_AXIS) {
        Some(below) => joined([AXES, number(index), below]),
        None => joined([path, "", ""]),
    };
    // A number is no longer than the star.
    path.unwrap_or_default()
}
