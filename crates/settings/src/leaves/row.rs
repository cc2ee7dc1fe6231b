//! A row of the table.

use crate::axis::AxisSettings;
use crate::path::{ANY_AXIS, Path};
use crate::stage::StageSettings;

/// A leaf of the settings, or a number of a list's points.
#[derive(Clone, Copy, Debug)]
pub struct LeafInfo {
    /// Its name in messages: below its axis, or below the stage.
    pub field: &'static str,
    /// Its unit; empty for a pure number, a flag, a name, a list.
    pub unit: &'static str,
    /// The values it may have.
    pub range: Range,
    /// Its default, if it is a number; [`UNSET`] if it must be given.
    pub default: f64,
    /// Its meaning, in one sentence.
    pub meaning: &'static str,
    /// The state of the machine in which it may be exchanged.
    pub exchange: Exchange,
    /// Its place.
    pub(super) place: Place,
}

/// The state of the machine in which a leaf may be exchanged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exchange {
    /// Any: the output goes over without a jump.
    Driven,
    /// The outputs are off: it decides on the safety of the axis.
    Disabled,
    /// None: it changes with a restart.
    Restart,
}

/// The place of a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    Stage,
    Axis,
    /// In each point of an axis' list: reads the number of a point, `None` beyond the last.
    Points(PointNumber),
}

/// Reads a number of a list's point; `None` beyond the last.
pub(crate) type PointNumber = fn(&AxisSettings, usize) -> Option<f64>;

/// The values that a leaf may have.
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
    /// So many times a quantity of the same axis, in words and as a number.
    Times(f64, &'static str, Quantity),
    /// A quantity of the same axis, but at most a number.
    AtMost(f64, &'static str, Quantity),
}

/// A quantity of an axis' settings at a control period, s.
type Quantity = fn(&AxisSettings, f64) -> f64;

/// Default of a number that must be given: outside its range, so that settings are refused by its name until it is.
pub const UNSET: f64 = 0.0;

impl Bound {
    /// The bound in a set of settings, for an axis, 0 to 2.
    pub fn value(&self, settings: &StageSettings, axis: usize) -> f64 {
        self.limit()
            .value(&settings.axes[axis], 1.0 / settings.rate_hz)
    }

    /// The bound without its words.
    pub(super) const fn limit(self) -> Limit {
        match self {
            Self::At(value) => Limit::At(value),
            Self::Times(factor, _, quantity) => Limit::Times(factor, quantity),
            Self::AtMost(most, _, quantity) => Limit::AtMost(most, quantity),
        }
    }
}

pub(super) const fn at(value: f64) -> Bound {
    Bound::At(value)
}

pub(super) const fn times(factor: f64, words: &'static str, quantity: Quantity) -> Bound {
    Bound::Times(factor, words, quantity)
}

pub(super) const fn at_most(most: f64, words: &'static str, quantity: Quantity) -> Bound {
    Bound::AtMost(most, words, quantity)
}

/// The control period, s.
pub(super) fn period_s(_: &AxisSettings, period_s: f64) -> f64 {
    period_s
}

/// A number of an axis.
pub(super) const fn number(
    field: &'static str,
    unit: &'static str,
    least: Bound,
    most: Bound,
    default: f64,
    meaning: &'static str,
) -> LeafInfo {
    LeafInfo {
        field,
        unit,
        range: Range::Number(least, most),
        default,
        meaning,
        exchange: Exchange::Driven,
        place: Place::Axis,
    }
}

/// A number of each point of an axis' list.
pub(super) const fn point(
    field: &'static str,
    unit: &'static str,
    least: Bound,
    most: Bound,
    default: f64,
    read: PointNumber,
    meaning: &'static str,
) -> LeafInfo {
    LeafInfo {
        place: Place::Points(read),
        ..number(field, unit, least, most, default, meaning)
    }
}

/// A leaf of an axis that is no number.
const fn other(field: &'static str, range: Range, meaning: &'static str) -> LeafInfo {
    LeafInfo {
        field,
        unit: "",
        range,
        default: f64::NAN,
        meaning,
        exchange: Exchange::Driven,
        place: Place::Axis,
    }
}

pub(super) const fn name(
    field: &'static str,
    names: &'static [&'static str],
    meaning: &'static str,
) -> LeafInfo {
    other(field, Range::Name(names), meaning)
}

pub(super) const fn flag(field: &'static str, meaning: &'static str) -> LeafInfo {
    other(field, Range::Flag, meaning)
}

pub(super) const fn list(field: &'static str, most: usize, meaning: &'static str) -> LeafInfo {
    other(field, Range::List(most), meaning)
}

pub(super) const fn of_stage(leaf: LeafInfo) -> LeafInfo {
    LeafInfo {
        place: Place::Stage,
        ..leaf
    }
}

/// The same rows, to be exchanged in another state.
pub(super) const fn exchanged<const N: usize>(
    exchange: Exchange,
    mut rows: [LeafInfo; N],
) -> [LeafInfo; N] {
    let mut row = 0;
    while row < N {
        rows[row].exchange = exchange;
        row += 1;
    }
    rows
}

impl LeafInfo {
    /// Its path, with `*` for the axis and for the point of a list.
    pub fn path(&self) -> Path {
        let mut path = Path::new();
        // There is room: a test reads the longest.
        let mut push = |text: &str| path.push_str(text).unwrap_or(());
        if !matches!(self.place, Place::Stage) {
            push(ANY_AXIS);
        }
        let last = self.field.split('.').count() - 1;
        for (place, part) in self.field.split('.').enumerate() {
            if place == last && matches!(self.place, Place::Points(_)) {
                push("/*");
            }
            push("/");
            push(part);
        }
        path
    }
}

/// An end of a range, without its words.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Limit {
    /// A number.
    At(f64),
    /// So many times a quantity of the axis.
    Times(f64, Quantity),
    /// A quantity of the axis, but at most a number.
    AtMost(f64, Quantity),
}

impl Limit {
    /// The limit, if no other setting decides it.
    pub(crate) const fn constant(&self) -> Option<f64> {
        match *self {
            Self::At(value) => Some(value),
            Self::Times(..) | Self::AtMost(..) => None,
        }
    }

    /// The limit for an axis at a control period.
    pub(crate) fn value(&self, axis: &AxisSettings, period_s: f64) -> f64 {
        match *self {
            Self::At(value) => value,
            Self::Times(factor, quantity) => factor * quantity(axis, period_s),
            Self::AtMost(most, quantity) => quantity(axis, period_s).min(most),
        }
    }
}
