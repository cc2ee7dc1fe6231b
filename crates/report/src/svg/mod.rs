//! Figures as images for print: SVG written from the same data as the page, text as text, always in light colours.

mod dots;
mod frame;
mod lines;
mod polar;
mod ticks;

use super::mark::{Entry, SAMPLE};
use super::{Figure, Plot, ReportError, palette};
use maud::{Markup, html};

/// Width of an image, px: at 96 px to the inch that of a printed page's text.
const WIDTH: f64 = 680.0;
/// Samples of one curve: more than a printer resolves on this width.
const POINTS: usize = 2_000;
/// Sizes of texts, px.
const LABEL_SIZE: f64 = 13.0;
const TICK_SIZE: f64 = 11.0;
/// Mean width of a character over its size: images are written without the font that shows them.
const CHARACTER: f64 = 0.56;
const LEGEND_LINE: f64 = 18.0;

/// A drawing without its legend.
struct Drawing {
    height: f64,
    markup: Markup,
}

impl Figure {
    /// The figure as a stand-alone SVG image. The same data give the same bytes.
    ///
    /// # Errors
    /// Data that do not fit together.
    pub fn to_svg(&self) -> Result<String, ReportError> {
        self.check()?;
        let figure = self.decimated(POINTS);
        let (legend_height, legend) = legend(&figure.legend());
        let drawing = match &figure.plot {
            Plot::Lines(lines) => lines::draw(lines),
            Plot::PolarDeviation(circle) => polar::draw(circle),
            Plot::Dots(dots) => dots::draw(dots),
        };
        let height = legend_height + drawing.height;
        let note = figure
            .note()
            .map_or_else(String::new, |note| format!(" {note}"));
        let image = html! {
            svg xmlns="http://www.w3.org/2000/svg" width=(px(WIDTH)) height=(px(height))
                viewBox={ "0 0 " (px(WIDTH)) " " (px(height)) } role="img"
                font-family="system-ui, 'Segoe UI', Roboto, 'DejaVu Sans', Arial, sans-serif" fill=(palette::INK.0) {
                title { (figure.caption) (note) }
                rect width="100%" height="100%" fill=(palette::PAPER.0) {}
                (legend)
                g transform={ "translate(0 " (px(legend_height)) ")" } { (drawing.markup) }
            }
        };
        Ok(image.into_string() + "\n")
    }
}

/// The legend in as many lines as it takes, and their height.
fn legend(entries: &[Entry<'_>]) -> (f64, Markup) {
    const LEFT: f64 = 16.0;
    let (sample_width, sample_height) = SAMPLE;
    let (mut x, mut y) = (LEFT, 16.0);
    let mut placed = Vec::with_capacity(entries.len());
    for entry in entries {
        let width = sample_width + 7.0 + text_width(entry.name, 12.0);
        if x > LEFT && x + width > WIDTH - 8.0 {
            (x, y) = (LEFT, y + LEGEND_LINE);
        }
        placed.push((x, y, entry));
        x += width + 18.0;
    }
    let markup = html! {
        g font-size="12" {
            @for (x, y, entry) in placed {
                g transform={ "translate(" (px(x)) " " (px(y - sample_height / 2.0)) ")" } {
                    (entry.sample.markup(entry.colour.light()))
                }
                text x=(px(x + sample_width + 7.0)) y=(px(y + 4.0)) { (entry.name) }
            }
        }
    };
    if entries.is_empty() {
        (6.0, html! {})
    } else {
        (y + LEGEND_LINE, markup)
    }
}

/// About how wide a text is.
fn text_width(text: &str, size: f64) -> f64 {
    CHARACTER * size * text.chars().count() as f64
}

/// A length in px, to a hundredth.
fn px(length: f64) -> String {
    let text = format!("{length:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

/// A path through points that have a place; a gap breaks it.
fn path(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut path = String::new();
    let mut pen_is_down = false;
    for (x, y) in points {
        if x.is_finite() && y.is_finite() {
            path.push(if pen_is_down { 'L' } else { 'M' });
            path.push_str(&px(x));
            path.push(' ');
            path.push_str(&px(y));
        }
        pen_is_down = x.is_finite() && y.is_finite();
    }
    path
}
