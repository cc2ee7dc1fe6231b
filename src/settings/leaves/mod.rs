//! What every leaf of the settings means, in which unit, and within which range.
//!
//! For people: the documentation and the host's commands are made from it, the firmware does not carry it. Tests hold it
//! against the tree (every leaf has its entry) and against [`StageSettings::validate`] (each end of each range is provoked).

mod feedback;
mod friction;
mod limits;
mod stage;

use super::StageSettings;

/// A leaf of the settings, or a number of a list's points.
#[derive(Clone, Copy, Debug)]
pub struct LeafInfo {
    /// Its path, with `*` for the axis and for the point of a list.
    pub path: &'static str,
    /// Its unit; empty for a pure number, a flag, a name, a list.
    pub unit: &'static str,
    /// What it may be.
    pub range: Range,
    /// What it means.
    pub meaning: &'static str,
}

/// What a leaf may be.
#[derive(Clone, Copy, Debug)]
pub enum Range {
    /// A number from one bound to the other, both allowed.
    Number(Bound, Bound),
    /// True or false.
    Flag,
    /// One of these names.
    Name(&'static [&'static str]),
    /// A list of one to so many points.
    List(usize),
}

/// An end of a range.
#[derive(Clone, Copy, Debug)]
pub enum Bound {
    /// A number.
    At(f64),
    /// What other settings of the same axis say, in words and as a number.
    Of(&'static str, fn(&StageSettings, usize) -> f64),
}

impl Bound {
    /// The bound in a set of settings, for an axis, 0 to 2.
    pub fn value(&self, settings: &StageSettings, axis: usize) -> f64 {
        match self {
            Self::At(value) => *value,
            Self::Of(_, value) => value(settings, axis),
        }
    }
}

const fn at(value: f64) -> Bound {
    Bound::At(value)
}

/// Rows of the table: `path` `unit` range; then the meaning.
macro_rules! leaves {
    ($($path:literal $unit:literal $range:expr; $meaning:literal)+) => {
        &[$(LeafInfo { path: $path, unit: $unit, range: $range, meaning: $meaning }),+]
    };
}
use leaves;

/// Every leaf, in the order of the tree's fields within each group: stage, encoder, amplifier and plant; limits and
/// homing; feedback;
/// friction and feedforward.
pub fn all() -> impl Iterator<Item = &'static LeafInfo> {
    stage::LEAVES
        .iter()
        .chain(limits::LEAVES)
        .chain(feedback::LEAVES)
        .chain(friction::LEAVES)
}

/// The entry of a leaf, by its path with the axis and a list's point as `*`, as a number or, the axis, as a letter.
pub fn find(path: &str) -> Option<&'static LeafInfo> {
    let same = |entry: &str, part: &str| {
        entry == part || (entry == "*" && (part.len() == 1 || part.parse::<u8>().is_ok()))
    };
    all().find(|leaf| {
        let mut parts = path.split('/');
        leaf.path
            .split('/')
            .all(|entry| parts.next().is_some_and(|part| same(entry, part)))
            && parts.next().is_none()
    })
}
