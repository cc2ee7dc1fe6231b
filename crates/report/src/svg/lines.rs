//! Curves and bands.

use super::frame::{ABOVE, BELOW, Frame, Span};
use super::{Drawing, path};
use crate::mark::{BAND_OPACITY, Mark};
use crate::{Dash, Lines, Scale};
use maud::html;

const HEIGHT: f64 = 320.0;
/// Height where both axes have one unit, as in a Nyquist plot.
const SQUARE: f64 = 520.0;

pub(super) fn draw(lines: &Lines) -> Drawing {
    // Curves over time begin at the axis; paths in a plane need room on all sides.
    let x_margin = if lines.equal_units { 0.04 } else { 0.0 };
    let x = Span::over(lines.x_scale, lines.abscissas(), x_margin);
    let y = match lines.y_range {
        Some((low, high)) => Span::over(lines.y_scale, [low, high].into_iter(), 0.0),
        None => Span::over(lines.y_scale, lines.ordinates(), 0.05),
    };
    let height = if lines.equal_units { SQUARE } else { HEIGHT };
    let frame = Frame::new(height, x, y, lines.equal_units);
    let places = |points: Vec<(f64, f64)>| points.into_iter().map(|(x, y)| frame.place(x, y));
    let markup = html! {
        (frame.clip("frame"))
        (frame.vertical(&lines.y_label))
        (frame.horizontal(&lines.x_label, lines.equal_units || lines.x_scale == Scale::Logarithmic))
        g clip-path="url(#frame)" {
            @for band in &lines.bands {
                @for outline in band.outlines(lines.x_scale, lines.y_scale) {
                    path d={ (path(places(outline))) "Z" } fill=(band.colour.light()) fill-opacity=(BAND_OPACITY) {}
                }
            }
            @for series in &lines.series {
                @let points = series.x.iter().copied().zip(series.y.iter().copied()).collect();
                @let colour = series.style.colour.light();
                @if series.style.dash == Dash::Points {
                    path d=(marks(places(points))) fill=(colour) {}
                } @else {
                    path d=(path(places(points))) fill="none" stroke=(colour) stroke-width="1.4" stroke-linejoin="round"
                        stroke-dasharray=[series.style.dash.pattern()] {}
                }
            }
        }
    };
    Drawing {
        height: ABOVE + height + BELOW,
        markup,
    }
}

/// A mark at every point that has a place, all in one path.
fn marks(points: impl Iterator<Item = (f64, f64)>) -> String {
    points
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .map(|(x, y)| Mark::Circle.path(x, y, 2.2))
        .collect()
}
