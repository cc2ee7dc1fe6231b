//! The rows of all groups as one table.

use super::row::{LeafInfo, Range};
use super::{feedback, friction, limits, pulses, stage};

/// The rows of an axis, by group.
pub(super) const OF_AXIS: [&[LeafInfo]; 6] = [
    stage::ENCODER,
    stage::AMPLIFIER_AND_PLANT,
    limits::LEAVES,
    pulses::LEAVES,
    feedback::LEAVES,
    friction::LEAVES,
];

/// Every leaf: stage, encoder, amplifier and plant; limits and homing; pulses; feedback; friction and feedforward.
pub fn all() -> impl Iterator<Item = &'static LeafInfo> {
    const STAGE: &[LeafInfo] = stage::OF_STAGE;
    const AXIS: [&[LeafInfo]; 6] = OF_AXIS;
    STAGE.iter().chain(AXIS.into_iter().flatten())
}

/// The entry of a leaf, by its path with the axis and a list's point as `*`, as a number or, the axis, as a letter.
pub fn find(path: &str) -> Option<&'static LeafInfo> {
    let same = |entry: &str, part: &str| {
        entry == part || (entry == "*" && (part.len() == 1 || part.parse::<u8>().is_ok()))
    };
    all().find(|leaf| {
        let entry = leaf.path();
        let mut parts = path.split('/');
        entry
            .split('/')
            .all(|entry| parts.next().is_some_and(|part| same(entry, part)))
            && parts.next().is_none()
    })
}

/// The default of the number with this field, a constant.
macro_rules! default {
    ($field:literal) => {
        const { $crate::leaves::default_of($field) }
    };
}
pub(crate) use default;

/// The default of the number `field`, while the program is compiled.
///
/// # Panics
/// Without such a number: the program does not compile then.
pub(crate) const fn default_of(field: &str) -> f64 {
    let mut group = 0;
    while group < OF_AXIS.len() {
        if let Some(default) = default_in(OF_AXIS[group], field) {
            return default;
        }
        group += 1;
    }
    match default_in(stage::OF_STAGE, field) {
        Some(default) => default,
        None => panic!("no number has this field"),
    }
}

const fn default_in(leaves: &[LeafInfo], field: &str) -> Option<f64> {
    let mut row = 0;
    while row < leaves.len() {
        let leaf = &leaves[row];
        if matches!(leaf.range, Range::Number(..)) && same(leaf.field, field) {
            return Some(leaf.default);
        }
        row += 1;
    }
    None
}

const fn same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut place = 0;
    while place < one.len() && place < other.len() && one[place] == other[place] {
        place += 1;
    }
    place == one.len() && place == other.len()
}
