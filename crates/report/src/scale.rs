//! Scales of axes.

use serde::Serialize;

/// The scale of an axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub enum Scale {
    /// Even.
    #[default]
    Linear,
    /// Decades; samples of zero and below are gaps.
    Logarithmic,
}

impl Scale {
    /// Returns a value's place on the axis, in any even unit; not finite if it has none.
    pub(super) fn place(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic if value > 0.0 => value.log10(),
            Self::Logarithmic => f64::NAN,
        }
    }

    /// The value at a place.
    pub(super) fn value(self, place: f64) -> f64 {
        match self {
            Self::Linear => place,
            Self::Logarithmic => 10f64.powf(place),
        }
    }

    /// Returns the places of all values.
    pub(super) fn places(self, values: &[f64]) -> Vec<f64> {
        values.iter().map(|&value| self.place(value)).collect()
    }

    /// The lowest and the highest place of values that have one.
    pub(super) fn reach(self, values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
        values
            .map(|value| self.place(value))
            .filter(|place| place.is_finite())
            .fold(None, |reach, place| {
                let (low, high) = reach.unwrap_or((place, place));
                Some((low.min(place), high.max(place)))
            })
    }

    /// Returns the span of the values.
    pub(super) fn span(self, values: impl Iterator<Item = f64>) -> f64 {
        self.reach(values).map_or(0.0, |(low, high)| high - low)
    }

    /// The values with no more digits than a drawing needs that resolves `step` of the axis.
    pub(super) fn shortened(self, values: &[f64], step: f64) -> Vec<f64> {
        let short = |&value: &f64| match self {
            Self::Linear => rounded(value, step),
            // On decades a step is a share of the value.
            Self::Logarithmic if value > 0.0 => rounded(value, step * value),
            Self::Logarithmic => f64::NAN,
        };
        values.iter().map(short).collect()
    }
}

/// `value` rounded to a decimal grid no coarser than `step`: shorter on the page, and the same to the eye.
pub(super) fn rounded(value: f64, step: f64) -> f64 {
    let digits = -step.log10().floor();
    if digits > 0.0 && digits < 300.0 {
        // Scaling by a whole power of ten and back yields the double nearest to the short decimal.
        let scale = 10f64.powf(digits).round();
        (value * scale).round() / scale
    } else {
        value
    }
}

#[cfg(test)]
mod tests {
    use super::{Scale, rounded};

    #[test]
    fn rounding_shortens_without_moving() {
        assert_eq!(rounded(0.123_456_789, 1e-4), 0.1235);
        assert_eq!(rounded(1234.567, 1.0), 1234.567);
        assert_eq!(rounded(0.5, 0.0), 0.5);
        assert!(rounded(f64::NAN, 1e-3).is_nan());
    }

    #[test]
    fn values_without_a_place_do_not_count() {
        let values = [f64::NAN, -1.0, 0.0, 10.0, 1000.0, f64::INFINITY];
        assert_eq!(
            Scale::Linear.reach(values.into_iter()),
            Some((-1.0, 1000.0))
        );
        assert_eq!(
            Scale::Logarithmic.reach(values.into_iter()),
            Some((1.0, 3.0))
        );
        assert_eq!(Scale::Logarithmic.reach([-1.0].into_iter()), None);
    }
}
