//! Senses of motion, and what there is one of for each.

use crate::scalar::Scalar;

/// A sense of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(
    feature = "names",
    derive(strum::AsRefStr, strum::EnumString, strum::VariantNames),
    strum(serialize_all = "kebab-case")
)]
pub enum Direction {
    /// Motion towards larger positions.
    Positive,
    /// Motion towards smaller positions.
    Negative,
}

impl Direction {
    /// The sense of a velocity or a displacement; positive at rest.
    #[inline(always)]
    pub fn of<S: Scalar>(velocity: S) -> Self {
        if velocity < S::ZERO {
            Self::Negative
        } else {
            Self::Positive
        }
    }
}

/// A pair of things, one for each sense of motion: friction is rarely the same both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct PerDirection<T> {
    /// For motion towards larger positions.
    pub positive: T,
    /// For motion towards smaller positions.
    pub negative: T,
}

impl<T> PerDirection<T> {
    /// The same thing both ways.
    pub fn both(value: T) -> Self
    where
        T: Clone,
    {
        Self {
            positive: value.clone(),
            negative: value,
        }
    }

    /// The thing for one sense of motion.
    #[inline(always)]
    pub fn of(&self, direction: Direction) -> &T {
        match direction {
            Direction::Positive => &self.positive,
            Direction::Negative => &self.negative,
        }
    }

    /// The thing for one sense of motion, to be changed.
    pub(crate) fn of_mut(&mut self, direction: Direction) -> &mut T {
        match direction {
            Direction::Positive => &mut self.positive,
            Direction::Negative => &mut self.negative,
        }
    }

    /// Each thing turned into another.
    pub fn map<U>(&self, mut change: impl FnMut(&T) -> U) -> PerDirection<U> {
        PerDirection {
            positive: change(&self.positive),
            negative: change(&self.negative),
        }
    }
}
