//! The parts of an axis' settings that may be left out.

use super::AxisSettings;

/// A part of an axis that may be left out.
pub(crate) struct Part {
    /// Its path below the axis.
    pub(crate) path: &'static str,
    /// Whether an axis has it.
    pub(crate) is_present: fn(&AxisSettings) -> bool,
    /// Makes it as another axis has it, or removes it.
    pub(crate) copy: fn(&mut AxisSettings, Option<&AxisSettings>),
}

macro_rules! part {
    ($path:literal, $($field:ident).+) => {
        Part {
            path: $path,
            is_present: |axis| axis.$($field).+.is_some(),
            copy: |axis, from| axis.$($field).+ = from.and_then(|from| from.$($field).+.clone()),
        }
    };
}

/// Every part that may be left out.
pub(crate) const PARTS: [Part; 11] = [
    part!("/encoder/counts_per_index", encoder.counts_per_index),
    part!("/feedback/nonlinear", feedback.nonlinear),
    part!("/feedback/schedule", feedback.schedule),
    part!("/feedback/cascade", feedback.cascade),
    part!("/feedback/sliding_mode", feedback.sliding_mode),
    part!("/feedback/nctf", feedback.nctf),
    part!("/friction/dahl", friction.dahl),
    part!("/friction/lugre", friction.lugre),
    part!("/limits/travel_mm", limits.travel_mm),
    part!("/homing", homing),
    part!("/plant", plant),
];

/// The part with exactly this path below an axis.
pub(crate) fn part_below_axis(path: &str) -> Option<&'static Part> {
    PARTS.iter().find(|part| part.path == path)
}

/// The part that may be left out in which a leaf below an axis is, or which it is.
pub(crate) fn part_of(below: &str) -> Option<&'static Part> {
    PARTS.iter().find(|part| {
        below
            .strip_prefix(part.path)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
    })
}

impl Part {
    /// Makes the part as the default axis `index` has it.
    pub(crate) fn make_default(&self, axis: &mut AxisSettings, index: usize) {
        let default = match index {
            0 => super::x_axis(),
            1 => super::y_axis(),
            _ => super::z_axis(),
        };
        (self.copy)(axis, Some(&default));
    }
}
