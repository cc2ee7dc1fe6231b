//! Figures as SVG files for print, drawn by `plotters`, always in light colours.

use std::error::Error;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::combinators::LogCoord;
use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use plotters::coord::types::RangedCoordf64;
use plotters::element::{Circle, DashedPathElement, EmptyElement, PathElement, Text};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use quadrant_written::fixed;

use super::drawing::{Axis, Curve, Drawing, Shape};
use super::{Figure, ReportError};

/// Width of an image, px: at 96 px to the inch that of a printed page's text.
const WIDTH: f64 = 680.0;
/// Steps to a pixel: `plotters` places everything at whole ones.
const STEPS: f64 = 10.0;
/// Samples of one curve: more than a printer resolves on this width.
const POINTS: usize = 2_000;
/// Mean width of a character of the axes' labels, px: images are written without the font that shows them.
const CHARACTER: f64 = 6.3;
/// Fonts of the axes' labels.
const FONT: &str = "system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif";
/// The library writes a font's em for its size, this much smaller.
const FONT_SIZE: f64 = 1.24 * STEPS;
/// Colour of text and axes.
const INK: RGBColor = RGBColor(0x1b, 0x1b, 0x1b);
/// Colour of the grid.
const GRID: RGBColor = RGBColor(0xe6, 0xe6, 0xe3);
/// Colour of rules.
const RULE: RGBColor = RGBColor(0xa9, 0xa9, 0xa5);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<Coordinate, Coordinate>>;

impl Figure {
    /// The figure as a stand-alone SVG image. The same data give the same bytes.
    ///
    /// # Errors
    /// Data that do not fit together.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        Ok(self.print()?.0)
    }

    /// The image, and its height, px.
    fn print(&self) -> Result<(String, f64), ReportError> {
        self.check()?;
        let drawing = self.decimated(POINTS).drawing();
        let height = if drawing.equal { 650.0 } else { 370.0 };
        draw(&drawing, height).map_err(ReportError::image)
    }
}

/// Figures one below the other, as one stand-alone SVG image: what has several units over one time.
///
/// # Errors
/// As for [`Figure::to_svg`].
pub fn stacked_svg(figures: &[Figure]) -> Result<String, ReportError> {
    let mut below = String::new();
    let mut height = 0.0;
    for figure in figures {
        let (image, own) = figure.print()?;
        below.push_str(&image.replacen("<svg ", &format!("<svg y=\"{height:.1}\" "), 1));
        height += own;
    }
    Ok(format!(
        "<svg width=\"{WIDTH}\" height=\"{height:.1}\" xmlns=\"http://www.w3.org/2000/svg\">\n{below}</svg>\n"
    ))
}

/// The image of a drawing, and its height, px.
fn draw(drawing: &Drawing, chart_height: f64) -> Result<(String, f64), Box<dyn Error>> {
    let entries = legend_places(&drawing.curves);
    let legend_height = entries.last().map_or(6.0, |&(_, y)| y + 14.0);
    let height = legend_height + chart_height;
    let mut image = String::new();
    {
        let size = (steps(WIDTH) as u32, steps(height) as u32);
        let area = SVGBackend::with_string(&mut image, size).into_drawing_area();
        area.fill(&WHITE)?;
        let (above, below) = area.split_vertically(steps(legend_height));
        for (curve, &(x, y)) in drawing.curves.iter().zip(&entries) {
            draw_entry(&above, curve, x, y)?;
        }
        draw_chart(&below, drawing, chart_height)?;
        area.present()?;
    }
    let in_steps = format!("width=\"{}\" height=\"{}\"", steps(WIDTH), steps(height));
    let in_px = format!("width=\"{WIDTH}\" height=\"{height:.1}\"");
    Ok((image.replacen(&in_steps, &in_px, 1), height))
}

fn steps(px: f64) -> i32 {
    (STEPS * px).round() as i32
}

/// Returns an axis that the library scales and finds the ticks of, unless the figure names them.
fn coordinate(axis: &Axis, (low, high): (f64, f64)) -> Coordinate {
    Coordinate {
        scale: if axis.log {
            let range = axis.scale().value(low)..axis.scale().value(high);
            Even::Decades(range.log_scale().into())
        } else {
            Even::Linear((low..high).into())
        },
        ticks: axis.ticks.iter().map(|(at, _)| *at).collect(),
    }
}

/// An axis of any scale.
struct Coordinate {
    scale: Even,
    ticks: Vec<f64>,
}

enum Even {
    Linear(RangedCoordf64),
    Decades(LogCoord<f64>),
}

impl Ranged for Coordinate {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        match &self.scale {
            Even::Linear(axis) => axis.map(value, limit),
            Even::Decades(axis) => axis.map(value, limit),
        }
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match &self.scale {
            _ if !self.ticks.is_empty() => self.ticks.clone(),
            Even::Linear(axis) => axis.key_points(hint),
            Even::Decades(axis) => axis.key_points(hint),
        }
    }

    fn range(&self) -> Range<f64> {
        match &self.scale {
            Even::Linear(axis) => axis.range(),
            Even::Decades(axis) => axis.range(),
        }
    }
}

/// Returns the name of a tick of an axis that spans `span`.
fn label(axis: &Axis, value: f64, span: f64) -> String {
    if let Some((_, name)) = axis.ticks.iter().find(|(at, _)| *at == value) {
        return name.clone();
    }
    let magnitude = value.abs();
    let text = if magnitude < 1e-9 * span {
        "0".to_owned()
    } else if (1e-3..1e5).contains(&magnitude) {
        let decimals = if axis.log { magnitude } else { span / 6.0 };
        let decimals = (-decimals.log10().floor()).max(0.0) as usize;
        fixed(value, decimals)
    } else {
        format!("{value:.1e}").replace(".0e", "e")
    };
    text.replace('-', "\u{2212}")
}

/// Returns the ends of an axis, in places: those it names, or those of its curves with room beyond them.
fn ends(axis: &Axis, values: impl Iterator<Item = f64>) -> (f64, f64) {
    let scale = axis.scale();
    if let Some((low, high)) = axis.range {
        return (scale.place(low), scale.place(high));
    }
    let (low, high) = scale.reach(values).unwrap_or((0.0, 1.0));
    let pad = if high > low {
        axis.margin * (high - low)
    } else {
        0.5 * high.abs().max(1.0)
    };
    (low - pad, high + pad)
}

fn draw_chart(area: &Area<'_>, drawing: &Drawing, height: f64) -> Result<(), Box<dyn Error>> {
    let abscissas = drawing.curves.iter().flat_map(|curve| &curve.x).copied();
    let ordinates = drawing.curves.iter().flat_map(|curve| &curve.y).copied();
    let mut x = ends(&drawing.x, abscissas);
    let mut y = ends(&drawing.y, ordinates);
    let names = drawing.y.ticks.iter();
    let widest = names
        .map(|(_, name)| name.chars().count())
        .fold(6, usize::max);
    let (left, right, below) = (CHARACTER * widest as f64 + 26.0, 16.0, 46.0);
    if drawing.equal {
        let size = (WIDTH - left - right - 4.0, height - below - 6.0);
        let unit = ((x.1 - x.0) / size.0).max((y.1 - y.0) / size.1);
        let widen = |(low, high): (f64, f64), length: f64| {
            let middle = (low + high) / 2.0;
            (middle - unit * length / 2.0, middle + unit * length / 2.0)
        };
        (x, y) = (widen(x, size.0), widen(y, size.1));
    }
    let mut chart = ChartBuilder::on(area)
        .margin_top(steps(6.0))
        .margin_left(steps(4.0))
        .margin_right(steps(right))
        .x_label_area_size(steps(below))
        .y_label_area_size(steps(left))
        .build_cartesian_2d(coordinate(&drawing.x, x), coordinate(&drawing.y, y))?;
    draw_axes(&mut chart, drawing)?;
    draw_circles(&chart, drawing)?;
    for curve in &drawing.curves {
        draw_curve(&chart, curve)?;
    }
    Ok(())
}

fn draw_axes(chart: &mut Chart<'_, '_>, drawing: &Drawing) -> Result<(), Box<dyn Error>> {
    let (x, y) = (chart.x_range(), chart.y_range());
    let (x_span, y_span) = (x.end - x.start, y.end - y.start);
    let x_name = |value: &f64| label(&drawing.x, *value, x_span);
    let y_name = |value: &f64| label(&drawing.y, *value, y_span);
    let mut mesh = chart.configure_mesh();
    mesh.bold_line_style(GRID.stroke_width(STEPS as u32))
        .light_line_style(TRANSPARENT)
        .axis_style(RULE.stroke_width(STEPS as u32))
        .x_desc(&drawing.x.label)
        .y_desc(&drawing.y.label)
        .axis_desc_style((FONT, 13.0 * FONT_SIZE, &INK))
        .label_style((FONT, 11.0 * FONT_SIZE, &INK))
        .set_all_tick_mark_size(steps(4.0))
        .x_labels(8)
        .y_labels(7)
        .x_label_formatter(&x_name)
        .y_label_formatter(&y_name);
    if !drawing.x.grid {
        mesh.disable_x_mesh();
    }
    if !drawing.y.grid {
        mesh.disable_y_mesh();
    }
    mesh.draw()?;
    let rule = RULE.stroke_width(STEPS as u32);
    if drawing.y.zero && !drawing.y.log && y.contains(&0.0) {
        chart.draw_series([PathElement::new([(x.start, 0.0), (x.end, 0.0)], rule)])?;
    }
    if drawing.x.zero && !drawing.x.log && x.contains(&0.0) {
        chart.draw_series([PathElement::new([(0.0, y.start), (0.0, y.end)], rule)])?;
    }
    Ok(())
}

fn draw_circles(chart: &Chart<'_, '_>, drawing: &Drawing) -> Result<(), Box<dyn Error>> {
    let area = chart.plotting_area();
    for circle in &drawing.circles {
        let centre = area.map_coordinate(&(0.0, 0.0));
        let radius = area.map_coordinate(&(circle.radius, 0.0)).0 - centre.0;
        if circle.nominal {
            let style = INK.stroke_width(STEPS as u32);
            area.draw(&Circle::new((0.0, 0.0), radius, style))?;
        } else {
            let style = RULE.stroke_width((0.8 * STEPS) as u32);
            area.draw(&Circle::new((0.0, 0.0), radius, style))?;
        }
    }
    for text in &drawing.texts {
        let horizontal = match text.anchor {
            "end" => HPos::Right,
            "start" => HPos::Left,
            _ => HPos::Center,
        };
        let style = text_style(12.0, horizontal, VPos::Bottom);
        let place = EmptyElement::at((text.x, text.y));
        area.draw(&(place + Text::new(text.text.clone(), (0, steps(text.dy)), style)))?;
    }
    Ok(())
}

fn text_style(size: f64, horizontal: HPos, vertical: VPos) -> TextStyle<'static> {
    TextStyle::from((FONT, size * FONT_SIZE))
        .color(&INK)
        .pos(Pos::new(horizontal, vertical))
}

/// Reads a colour of the palette.
fn colour(curve: &Curve) -> RGBColor {
    let part = |at: usize| u8::from_str_radix(&curve.colour.0[at..at + 2], 16).unwrap_or_default();
    RGBColor(part(1), part(3), part(5))
}

fn line_style(colour: RGBColor) -> ShapeStyle {
    colour.stroke_width((1.4 * STEPS) as u32)
}

fn dashes(pattern: &str) -> (i32, i32) {
    let mut lengths = pattern
        .split(' ')
        .filter_map(|length| length.parse().ok())
        .map(steps);
    (lengths.next().unwrap_or(1), lengths.next().unwrap_or(1))
}

fn draw_curve(chart: &Chart<'_, '_>, curve: &Curve) -> Result<(), Box<dyn Error>> {
    let area = chart.plotting_area();
    let colour = colour(curve);
    let at = |i: usize| (curve.x[i], curve.y[i]);
    for run in curve.runs() {
        match &curve.shape {
            Shape::Line { dash: None, .. } => {
                let path: Vec<(f64, f64)> = run.into_iter().map(at).collect();
                area.draw(&PathElement::new(path, line_style(colour)))?;
            }
            Shape::Line {
                dash: Some(pattern),
                ..
            } => {
                let (dash, gap) = dashes(pattern);
                let path: Vec<(f64, f64)> = run.into_iter().map(at).collect();
                area.draw(&DashedPathElement::new(path, dash, gap, line_style(colour)))?;
            }
            Shape::Points { .. } => {
                for i in run {
                    area.draw(&Circle::new(at(i), steps(2.4), colour.filled()))?;
                }
            }
        }
    }
    Ok(())
}

/// Left end and middle of each entry of the legend, px, in as many lines as it takes.
fn legend_places(curves: &[Curve]) -> Vec<(f64, f64)> {
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
    places
}

fn draw_entry(area: &Area<'_>, curve: &Curve, x: f64, y: f64) -> Result<(), Box<dyn Error>> {
    let colour = colour(curve);
    let (from, to) = ((steps(x), steps(y)), (steps(x + 26.0), steps(y)));
    match &curve.shape {
        Shape::Line { dash: None, .. } => {
            area.draw(&PathElement::new([from, to], line_style(colour)))?
        }
        Shape::Line {
            dash: Some(pattern),
            ..
        } => {
            let (dash, gap) = dashes(pattern);
            area.draw(&DashedPathElement::new(
                [from, to],
                dash,
                gap,
                line_style(colour),
            ))?;
        }
        Shape::Points { .. } => area.draw(&Circle::new(
            (steps(x + 13.0), steps(y)),
            steps(2.4),
            colour.filled(),
        ))?,
    }
    let style = text_style(12.0, HPos::Left, VPos::Center);
    area.draw(&Text::new(
        curve.name.clone(),
        (steps(x + 33.0), steps(y)),
        style,
    ))?;
    Ok(())
}
