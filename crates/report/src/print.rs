//! Figures as SVG files for print, always in light colours.

use std::fmt::Write as _;

use maud::{Markup, PreEscaped, html};
use quadrant_written::fixed;

use super::drawing::{Axis, Curve, Drawing, Shape};
use super::{Figure, ReportError};

/// Width of an image, px: at 96 px to the inch that of a printed page's text.
const WIDTH: f64 = 680.0;
/// Samples of one curve: more than a printer resolves on this width.
const POINTS: usize = 2_000;
/// Mean width of a character of the axes' labels, px: images are written without the font that shows them.
const CHARACTER: f64 = 6.3;
/// Fonts of all text.
const FONT: &str = "system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif";
/// Colour of text.
const INK: &str = "#1b1b1b";
/// Colour of the grid.
const GRID: &str = "#e6e6e3";
/// Colour of axes and rules.
const RULE: &str = "#a9a9a5";
/// Space above, right of and below the curves, px.
const MARGINS: (f64, f64, f64) = (6.0, 16.0, 46.0);
/// Ticks of the axes, about.
const TICKS: (f64, f64) = (8.0, 7.0);

impl Figure {
    /// The figure as a stand-alone SVG image. The same data give the same bytes.
    ///
    /// # Errors
    /// Data that do not fit together.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        stacked_svg(std::slice::from_ref(self))
    }
}

/// Figures one below the other, as one stand-alone SVG image: what has several units over one time.
///
/// # Errors
/// As for [`Figure::to_svg`].
pub fn stacked_svg(figures: &[Figure]) -> Result<String, ReportError> {
    let mut images = Vec::with_capacity(figures.len());
    let mut height = 0.0;
    for figure in figures {
        figure.check()?;
        let (image, own) = draw(&figure.decimated(POINTS).drawing());
        images.push((height, image));
        height += own;
    }
    let image = html! {
        svg xmlns="http://www.w3.org/2000/svg" width=(WIDTH) height=(px(height)) font-family=(FONT) fill=(INK) {
            rect width="100%" height="100%" fill="#ffffff" {}
            @for (above, image) in images { g transform={ "translate(0 " (px(above)) ")" } { (image) } }
        }
    };
    Ok(image.into_string() + "\n")
}

/// A length, px, in tenths.
fn px(length: f64) -> String {
    format!("{length:.1}")
}

/// An axis on the image.
struct Placed<'a> {
    axis: &'a Axis,
    /// Ends, in places.
    ends: (f64, f64),
    /// Where they are, px.
    at: (f64, f64),
}

impl Placed<'_> {
    /// Where a value is, px.
    fn px(&self, value: f64) -> f64 {
        let share = (self.axis.scale().place(value) - self.ends.0) / (self.ends.1 - self.ends.0);
        self.at.0 + share * (self.at.1 - self.at.0)
    }

    /// The ticks within the axis, with their names.
    fn ticks(&self, count: f64) -> Vec<(f64, String)> {
        if !self.axis.ticks.is_empty() {
            return self.axis.ticks.clone();
        }
        let (low, high) = self.ends;
        let values = match self.axis.log {
            true if high - low >= 0.3 => decade_ticks(low, high, count),
            true => even_ticks(10f64.powf(low), 10f64.powf(high), count),
            false => even_ticks(low, high, count),
        };
        let span = self.axis.scale().value(high) - self.axis.scale().value(low);
        let named = |value: f64| (value, self.label(value, span));
        values.into_iter().map(named).collect()
    }

    /// The name of a tick of an axis that spans `span`.
    fn label(&self, value: f64, span: f64) -> String {
        let magnitude = value.abs();
        let text = if magnitude < 1e-9 * span {
            "0".to_owned()
        } else if (1e-3..1e5).contains(&magnitude) {
            let step = if self.axis.log { magnitude } else { span / 6.0 };
            fixed(value, (-step.log10().floor()).max(0.0) as usize)
        } else {
            format!("{value:.1e}").replace(".0e", "e")
        };
        text.replace('-', "\u{2212}")
    }

    /// Where the line at zero is, px, if one is wanted and within the axis.
    fn zero(&self) -> Option<f64> {
        let within = self.ends.0 <= 0.0 && 0.0 <= self.ends.1;
        (self.axis.zero && !self.axis.log && within).then(|| self.px(0.0))
    }
}

/// About `count` round numbers between two others.
fn even_ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
    let rough = (high - low) / count;
    let decade = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * decade);
    let step = step.into_iter().find(|step| *step >= rough * (1.0 - 1e-9));
    let step = step.unwrap_or(10.0 * decade);
    let first = (low / step - 1e-6).ceil() as i64;
    let last = (high / step + 1e-6).floor() as i64;
    (first..=last).map(|index| index as f64 * step).collect()
}

/// Powers of ten between two others; fewer if they are many, and with numbers between them if they are few.
fn decade_ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
    let digits: &[f64] = if high - low < 2.2 {
        &[1.0, 2.0, 5.0]
    } else {
        &[1.0]
    };
    let every = ((high - low) / count).ceil().max(1.0) as usize;
    (low.floor() as i32..=high.floor() as i32)
        .step_by(every)
        .flat_map(|decade| digits.iter().map(move |digit| digit * 10f64.powi(decade)))
        .filter(|value| (low - 1e-9..=high + 1e-9).contains(&value.log10()))
        .collect()
}

/// Returns the ends of an axis, in places: those it names, or those of its curves with room beyond them.
fn ends<'a>(axis: &Axis, values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    let scale = axis.scale();
    if let Some((low, high)) = axis.range.filter(|(low, high)| low < high) {
        return (scale.place(low), scale.place(high));
    }
    let (low, high) = scale.reach(values.copied()).unwrap_or((0.0, 1.0));
    let pad = if high > low {
        axis.margin * (high - low)
    } else {
        0.5 * high.abs().max(1.0)
    };
    (low - pad, high + pad)
}

/// A drawing below its legend, and its height, px.
fn draw(drawing: &Drawing) -> (Markup, f64) {
    let (legend, legend_height) = legend(&drawing.curves);
    let height = legend_height + if drawing.equal { 650.0 } else { 370.0 };
    let (above, right, below) = MARGINS;
    let mut y = Placed {
        axis: &drawing.y,
        ends: ends(&drawing.y, drawing.curves.iter().flat_map(|curve| &curve.y)),
        at: (height - below, legend_height + above),
    };
    let names = y.ticks(TICKS.1).into_iter();
    let widest = names
        .map(|(_, name)| name.chars().count())
        .fold(6, usize::max);
    let left = 30.0 + CHARACTER * widest as f64;
    let mut x = Placed {
        axis: &drawing.x,
        ends: ends(&drawing.x, drawing.curves.iter().flat_map(|curve| &curve.x)),
        at: (left, WIDTH - right),
    };
    if drawing.equal {
        let length = |of: &Placed<'_>| (of.at.1 - of.at.0).abs();
        let unit = |of: &Placed<'_>| (of.ends.1 - of.ends.0) / length(of);
        let unit = unit(&x).max(unit(&y));
        for of in [&mut x, &mut y] {
            let middle = (of.ends.0 + of.ends.1) / 2.0;
            let half = unit * length(of) / 2.0;
            of.ends = (middle - half, middle + half);
        }
    }
    let (width, room) = (x.at.1 - x.at.0, y.at.0 - y.at.1);
    let image = html! {
        (legend)
        (axes(&x, &y))
        // One within another ends at its own frame.
        svg x=(px(left)) y=(px(y.at.1)) width=(px(width)) height=(px(room))
            viewBox={ (px(left)) " " (px(y.at.1)) " " (px(width)) " " (px(room)) } {
            @for circle in &drawing.circles {
                @let stroke = if circle.nominal { INK } else { RULE };
                circle cx=(px(x.px(0.0))) cy=(px(y.px(0.0))) r=(px(x.px(circle.radius) - x.px(0.0)))
                    fill="none" stroke=(stroke) {}
            }
            @for text in &drawing.texts {
                text x=(px(x.px(text.x))) y=(px(y.px(text.y) + text.dy)) text-anchor=(text.anchor) font-size="12" {
                    (text.text)
                }
            }
            @for curve in &drawing.curves { (path(curve, &curve_path(curve, &x, &y))) }
        }
    };
    (image, height)
}

fn axes(x: &Placed<'_>, y: &Placed<'_>) -> Markup {
    let (left, right, bottom, top) = (x.at.0, x.at.1, y.at.0, y.at.1);
    let (mut grid, mut rules) = (String::new(), String::new());
    let (x_ticks, y_ticks) = (x.ticks(TICKS.0), y.ticks(TICKS.1));
    let down = |at: f64, length: f64| format!("M{at:.1} {bottom:.1}v{length:.1}");
    let across = |at: f64, length: f64| format!("M{left:.1} {at:.1}h{length:.1}");
    for (value, _) in &x_ticks {
        rules += &down(x.px(*value), 4.0);
        if x.axis.grid {
            grid += &down(x.px(*value), top - bottom);
        }
    }
    for (value, _) in &y_ticks {
        rules += &across(y.px(*value), -4.0);
        if y.axis.grid {
            grid += &across(y.px(*value), right - left);
        }
    }
    rules += &down(left, top - bottom);
    rules += &across(bottom, right - left);
    rules.extend(x.zero().map(|at| down(at, top - bottom)));
    rules.extend(y.zero().map(|at| across(at, right - left)));
    html! {
        path d=(grid) fill="none" stroke=(GRID) {}
        path d=(rules) fill="none" stroke=(RULE) {}
        g font-size="11" text-anchor="middle" {
            @for (value, name) in x_ticks { text x=(px(x.px(value))) y=(px(bottom + 17.0)) { (name) } }
        }
        g font-size="11" text-anchor="end" {
            @for (value, name) in y_ticks { text x=(px(left - 7.0)) y=(px(y.px(value) + 4.0)) { (name) } }
        }
        g font-size="13" text-anchor="middle" {
            text x=(px((left + right) / 2.0)) y=(px(bottom + 37.0)) { (x.axis.label) }
            text transform={ "translate(16 " (px((top + bottom) / 2.0)) ") rotate(-90)" } { (y.axis.label) }
        }
    }
}

/// A curve's outline, or its marks.
fn curve_path(curve: &Curve, x: &Placed<'_>, y: &Placed<'_>) -> String {
    let mut path = String::new();
    for run in curve.runs() {
        for (index, &sample) in run.iter().enumerate() {
            let (command, mark) = match &curve.shape {
                Shape::Points { mark } => ('M', *mark),
                Shape::Line { .. } if index == 0 => ('M', ""),
                Shape::Line { .. } => ('L', ""),
            };
            let (x, y) = (x.px(curve.x[sample]), y.px(curve.y[sample]));
            // Writing into a text cannot fail.
            let _ = write!(path, "{command}{x:.1} {y:.1}{mark}");
        }
    }
    path
}

/// A path in a curve's colour, with its dashes.
fn path(curve: &Curve, path: &str) -> Markup {
    let colour = curve.colour.0;
    let path = PreEscaped(path);
    match curve.shape {
        Shape::Points { .. } => html! { path d=(path) fill=(colour) {} },
        Shape::Line { dash, .. } => html! {
            path d=(path) fill="none" stroke=(colour) stroke-width="1.4" stroke-linejoin="round"
                stroke-dasharray=[dash] {}
        },
    }
}

/// The curves' names beside a sample of each, in as many lines as it takes; and their height, px.
fn legend(curves: &[Curve]) -> (Markup, f64) {
    const LEFT: f64 = 16.0;
    let (mut x, mut y) = (LEFT, 14.0);
    let mut places = Vec::with_capacity(curves.len());
    for curve in curves {
        let width = 33.0 + 1.1 * CHARACTER * curve.name.chars().count() as f64;
        if x > LEFT && x + width > WIDTH - 8.0 {
            (x, y) = (LEFT, y + 18.0);
        }
        places.push((x, y));
        x += width + 18.0;
    }
    let height = places.last().map_or(6.0, |(_, y)| y + 14.0);
    let entries = html! {
        g font-size="12" {
            @for (curve, (x, y)) in curves.iter().zip(places) {
                @match curve.shape {
                    Shape::Line { .. } => (path(curve, &format!("M{x:.1} {y:.1}h26"))),
                    Shape::Points { mark } => (path(curve, &format!("M{:.1} {y:.1}{mark}", x + 13.0))),
                }
                text x=(px(x + 33.0)) y=(px(y + 4.0)) { (curve.name) }
            }
        }
    };
    (entries, height)
}
