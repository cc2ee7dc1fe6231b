//! Values by category, with their spread: means over seeds, say, of several configurations.

use super::drawing::{Axis, Curve, Drawing, Shape};
use super::mark::Mark;
use super::wrap::wrapped;
use super::{Colour, ReportError, Scale};
use serde::{Deserialize, Serialize};

/// Share of a category's height over which its series are spread.
const DODGE: f64 = 0.62;
/// Characters in one line of a category's name.
const NAME_WIDTH: usize = 26;

/// Values by category, drawn as dots with error bars, categories from top to bottom.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Dots {
    /// The horizontal axis, with its unit.
    pub value_label: String,
    /// Names of the categories, from top to bottom.
    pub categories: Vec<String>,
    /// The series; each has a value for every category.
    pub series: Vec<DotSeries>,
    /// Scale of the horizontal axis. On an even one, zero is always shown.
    pub scale: Scale,
}

/// One value for each category.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DotSeries {
    /// For the legend.
    pub name: String,
    /// In the order of the categories.
    pub values: Vec<Spread>,
    /// Colour of dots and bars. The mark follows from the series' place.
    pub colour: Colour,
}

/// A value and how far it spreads. A mean that is not finite is left out of the drawing.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Value of the dot.
    #[serde(with = "super::number")]
    pub mean: f64,
    /// Beginning of the bar; not above the mean.
    #[serde(with = "super::number")]
    pub low: f64,
    /// End of the bar; not below the mean.
    #[serde(with = "super::number")]
    pub high: f64,
}

impl Spread {
    /// A single value: a dot without a bar.
    #[must_use]
    pub const fn exact(value: f64) -> Self {
        Self {
            mean: value,
            low: value,
            high: value,
        }
    }

    /// Mean, least and greatest of several values: of the same run with several seeds. Of none, a gap.
    #[must_use]
    pub fn over(values: &[f64]) -> Self {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Self {
            mean,
            low: values.iter().copied().fold(mean, f64::min),
            high: values.iter().copied().fold(mean, f64::max),
        }
    }

    fn is_in_order(self) -> bool {
        !self.mean.is_finite() || (self.low <= self.mean && self.mean <= self.high)
    }
}

impl Dots {
    pub(super) fn check(&self, figure: &str) -> Result<(), ReportError> {
        for series in &self.series {
            if series.values.len() != self.categories.len() {
                return Err(ReportError::SeriesLength {
                    figure: figure.to_owned(),
                    series: series.name.clone(),
                    x: self.categories.len(),
                    y: series.values.len(),
                });
            }
            for (value, category) in series.values.iter().zip(&self.categories) {
                if !value.is_in_order() {
                    return Err(ReportError::Spread {
                        figure: figure.to_owned(),
                        series: series.name.clone(),
                        category: category.clone(),
                        low: value.low,
                        mean: value.mean,
                        high: value.high,
                    });
                }
            }
        }
        Ok(())
    }

    /// Returns the distance of a series' dot below the top category's middle, in categories.
    fn place(&self, category: usize, series: usize) -> f64 {
        let count = self.series.len() as f64;
        category as f64 + ((series as f64 + 0.5) / count - 0.5) * DODGE
    }

    /// Height of the drawing, in lines of text: enough for dots of all series to stand apart.
    pub(super) fn rows(&self) -> f64 {
        self.categories.len() as f64 * (0.7 + 0.4 * self.series.len() as f64).max(1.3)
    }

    /// Everything that must lie within the horizontal axis.
    fn extent(&self) -> impl Iterator<Item = f64> {
        let zero = (self.scale == Scale::Linear).then_some(0.0);
        let values = self.series.iter().flat_map(|series| &series.values);
        values
            .flat_map(|value| [value.low, value.mean, value.high])
            .chain(zero)
    }

    pub(super) fn drawing(&self) -> Drawing {
        let step = 1e-6 * self.scale.span(self.extent());
        let curves = self.series.iter().enumerate().map(|(index, series)| {
            let ends = |end: fn(&Spread) -> f64| {
                let values: Vec<f64> = series.values.iter().map(end).collect();
                self.scale.shortened(&values, step)
            };
            let shape = Shape::Spread {
                mark: Mark::nth(index).outline(4.0),
                index,
                low: ends(|value| value.low),
                high: ends(|value| value.high),
            };
            let x = ends(|value| value.mean);
            let y = (0..x.len()).map(|c| -self.place(c, index)).collect();
            Curve::new(&series.name, series.colour, shape, (x, y))
        });
        let x = Axis {
            range: self.range(),
            grid: true,
            ..Axis::new(&self.value_label, self.scale)
        };
        let names = self.categories.iter().enumerate();
        let y = Axis {
            range: Some((0.5 - self.categories.len() as f64, 0.5)),
            ticks: names
                .map(|(i, name)| (-(i as f64), wrapped(name, NAME_WIDTH).join("\n")))
                .collect(),
            zero: false,
            ..Axis::new("", Scale::Linear)
        };
        Drawing {
            caption: String::new(),
            x,
            y,
            equal: false,
            curves: curves.collect(),
            circles: Vec::new(),
            texts: Vec::new(),
        }
    }

    /// Ends of the horizontal axis: everything that must lie within it, and room for the marks.
    fn range(&self) -> Option<(f64, f64)> {
        let (low, high) = self
            .scale
            .reach(self.extent())
            .filter(|(low, high)| low < high)?;
        let pad = 0.04 * (high - low);
        // Zero is an end where all values are on one side of it.
        let is_zero = |end: f64| self.scale == Scale::Linear && end == 0.0;
        let low = if is_zero(low) { low } else { low - pad };
        let high = if is_zero(high) { high } else { high + pad };
        Some((self.scale.value(low), self.scale.value(high)))
    }
}
