//! Values by category, with their spread: means over seeds, say, of several configurations.

use super::mark::{Entry, Mark, Sample};

use super::{Colour, ReportError, Scale, figure, palette};
use plotly::common::{ErrorData, ErrorType, HoverInfo, Marker, Mode};
use plotly::layout::{DragMode, HoverMode, TicksDirection};
use plotly::{Plot as Plotly, Scatter};
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
    /// Where the dot is.
    #[serde(with = "super::number")]
    pub mean: f64,
    /// Where the bar begins; not above the mean.
    #[serde(with = "super::number")]
    pub low: f64,
    /// Where the bar ends; not below the mean.
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
    pub(super) fn legend(&self) -> Vec<Entry<'_>> {
        self.series
            .iter()
            .enumerate()
            .map(|(index, series)| Entry {
                name: &series.name,
                colour: series.colour,
                sample: Sample::Mark(Mark::nth(index)),
            })
            .collect()
    }

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

    /// Where the dot of a series lies below the top category's middle, in categories.
    pub(super) fn place(&self, category: usize, series: usize) -> f64 {
        let count = self.series.len() as f64;
        category as f64 + ((series as f64 + 0.5) / count - 0.5) * DODGE
    }

    /// Height of the drawing, in lines of text: enough for dots of all series to stand apart.
    pub(super) fn rows(&self) -> f64 {
        self.categories.len() as f64 * (0.7 + 0.4 * self.series.len() as f64).max(1.3)
    }

    /// Everything that must lie within the horizontal axis.
    pub(super) fn extent(&self) -> impl Iterator<Item = f64> {
        let zero = (self.scale == Scale::Linear).then_some(0.0);
        let values = self.series.iter().flat_map(|series| &series.values);
        values
            .flat_map(|value| [value.low, value.mean, value.high])
            .chain(zero)
    }

    /// A category's name in lines that fit beside the drawing.
    pub(super) fn name_lines(category: &str) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in category.split_whitespace() {
            match lines.last_mut() {
                Some(line) if line.chars().count() + 1 + word.chars().count() <= NAME_WIDTH => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    pub(super) fn to_plotly(&self) -> Plotly {
        let mut plot = Plotly::new();
        let step = 1e-6 * self.scale.span(self.extent());
        let short = |value: f64| self.scale.shortened(value, step);
        for (index, series) in self.series.iter().enumerate() {
            let mark = Mark::nth(index);
            let bar = |end: fn(&Spread) -> f64| -> Vec<f64> {
                let length = |value: &Spread| (short(end(value)) - short(value.mean)).abs();
                series.values.iter().map(length).collect()
            };
            let spread: Vec<String> = series
                .values
                .iter()
                .map(|v| format!("{} to {}", short(v.low), short(v.high)))
                .collect();
            let x: Vec<f64> = series.values.iter().map(|v| short(v.mean)).collect();
            let y: Vec<f64> = (0..x.len()).map(|c| -self.place(c, index)).collect();
            plot.add_trace(
                Scatter::new(x, y)
                    .name(&series.name)
                    .mode(Mode::Markers)
                    .marker(
                        Marker::new()
                            .size(8)
                            .symbol(mark.plotly())
                            .color(series.colour.light()),
                    )
                    .error_x(
                        ErrorData::new(ErrorType::Data)
                            .array(bar(|value| value.high))
                            .array_minus(bar(|value| value.low))
                            .symmetric(false)
                            .color(series.colour.light())
                            .thickness(1.4)
                            .width(3),
                    )
                    .custom_data(spread)
                    .hover_info(HoverInfo::All)
                    .hover_template("%{x} (%{customdata})"),
            );
        }
        let count = self.categories.len();
        let names = self.categories.iter().map(|name| {
            // The drawing takes markup in its texts.
            Self::name_lines(name).join("<br>").replace('&', "&amp;")
        });
        let value_axis = self.scale.apply(
            figure::axis(&self.value_label)
                .zero_line_color(palette::RULE.0)
                .show_grid(true)
                .ticks(TicksDirection::Outside),
        );
        let value_axis = match self.scale {
            Scale::Linear => value_axis.range_mode(plotly::layout::RangeMode::ToZero),
            Scale::Logarithmic => value_axis,
        };
        plot.set_layout(
            figure::layout()
                .x_axis(value_axis)
                .y_axis(
                    figure::axis("")
                        .show_grid(false)
                        .zero_line(false)
                        .range(vec![0.5 - count as f64, 0.5])
                        .tick_values((0..count).map(|c| -(c as f64)).collect())
                        .tick_text(names.collect()),
                )
                .drag_mode(DragMode::Zoom)
                .hover_mode(HoverMode::Closest),
        );
        plot
    }
}
