//! The part of the table that the firmware carries: fields and ranges of all numbers.

use super::row::{LeafInfo, Limit, Place, PointNumber, Range};
use super::stage;
use super::table::OF_AXIS;

/// The range of a number.
#[derive(Clone, Copy, Debug)]
pub(in crate::settings) struct Rule {
    /// The number's name in messages, and with its points its way below the axis.
    pub(in crate::settings) field: &'static str,
    /// Smallest allowed value.
    pub(in crate::settings) least: Limit,
    /// Largest allowed value.
    pub(in crate::settings) most: Limit,
    /// Default.
    pub(in crate::settings) default: f64,
    /// Reads the number of a list's point; `None` for a leaf.
    pub(in crate::settings) point: Option<PointNumber>,
}

/// The numbers of the stage.
pub(in crate::settings) static OF_THE_STAGE: [Rule; numbers(&[stage::OF_STAGE])] =
    rules(&[stage::OF_STAGE]);

/// The numbers of an axis.
pub(in crate::settings) static OF_AN_AXIS: [Rule; numbers(&OF_AXIS)] = rules(&OF_AXIS);

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
        default: 0.0,
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
                    default: leaf.default,
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
