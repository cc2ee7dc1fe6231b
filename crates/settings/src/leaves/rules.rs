//! The part of the table that the firmware carries: fields and ranges of all numbers, and the fields that change only
//! while the outputs are off.

pub(crate) use super::row::Limit;
use super::row::{Exchange, LeafInfo, Place, PointNumber, Range};
use super::stage;
use super::table::OF_AXIS;

/// The range of a number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rule {
    /// The number's name in messages, and with its points its way below the axis.
    pub(crate) field: &'static str,
    /// Smallest allowed value.
    pub(crate) least: Limit,
    /// Largest allowed value.
    pub(crate) most: Limit,
    /// Reads the number of a list's point; `None` for a leaf.
    pub(crate) point: Option<PointNumber>,
}

/// The numbers of the stage.
pub(crate) static OF_THE_STAGE: [Rule; numbers(&[stage::OF_STAGE])] = rules(&[stage::OF_STAGE]);

/// The numbers of an axis.
pub(crate) static OF_AN_AXIS: [Rule; numbers(&OF_AXIS)] = rules(&OF_AXIS);

const fn numbers(groups: &[&[LeafInfo]]) -> usize {
    let (mut count, mut group) = (0, 0);
    while group < groups.len() {
        let mut row = 0;
        while row < groups[group].len() {
            if matches!(groups[group][row].range, Range::Number(..)) {
                count += 1;
            }
            row += 1;
        }
        group += 1;
    }
    count
}

const fn rules<const N: usize>(groups: &[&[LeafInfo]]) -> [Rule; N] {
    let blank = Rule {
        field: "",
        least: Limit::At(0.0),
        most: Limit::At(0.0),
        point: None,
    };
    let mut rules = [blank; N];
    let (mut count, mut group) = (0, 0);
    while group < groups.len() {
        let mut row = 0;
        while row < groups[group].len() {
            let leaf = groups[group][row];
            if let Range::Number(least, most) = leaf.range {
                rules[count] = Rule {
                    field: leaf.field,
                    least: least.limit(),
                    most: most.limit(),
                    point: match leaf.place {
                        Place::Points(read) => Some(read),
                        Place::Stage | Place::Axis => None,
                    },
                };
                count += 1;
            }
            row += 1;
        }
        group += 1;
    }
    rules
}

/// The fields of the stage that change only while the outputs are off.
pub(crate) static SAFETY_OF_THE_STAGE: [&str; safety(&[stage::OF_STAGE])] =
    safety_fields(&[stage::OF_STAGE]);

/// The fields of an axis that change only while the outputs are off.
pub(crate) static SAFETY_OF_AN_AXIS: [&str; safety(&OF_AXIS)] = safety_fields(&OF_AXIS);

const fn safety(groups: &[&[LeafInfo]]) -> usize {
    let (mut count, mut group) = (0, 0);
    while group < groups.len() {
        let mut row = 0;
        while row < groups[group].len() {
            if matches!(groups[group][row].exchange, Exchange::Disabled) {
                count += 1;
            }
            row += 1;
        }
        group += 1;
    }
    count
}

const fn safety_fields<const N: usize>(groups: &[&[LeafInfo]]) -> [&'static str; N] {
    let mut fields = [""; N];
    let (mut count, mut group) = (0, 0);
    while group < groups.len() {
        let mut row = 0;
        while row < groups[group].len() {
            if matches!(groups[group][row].exchange, Exchange::Disabled) {
                fields[count] = groups[group][row].field;
                count += 1;
            }
            row += 1;
        }
        group += 1;
    }
    fields
}
