//! Dots with error bars by category.

use super::frame::{ABOVE, BELOW, Frame, Span};
use super::{Drawing, LABEL_SIZE, path, px, text_width};
use crate::mark::Mark;
use crate::{Dots, Scale, palette};
use maud::html;

/// Height of a line of text, px.
const LINE: f64 = 21.0;
/// Size of the categories' names, px.
const NAME_SIZE: f64 = 12.0;
const NAME_LINE: f64 = 14.0;

pub(super) fn draw(dots: &Dots) -> Drawing {
    let count = dots.categories.len();
    let height = LINE * dots.rows().max(2.0);
    let names: Vec<Vec<String>> = dots
        .categories
        .iter()
        .map(|c| Dots::name_lines(c))
        .collect();
    let widest = names
        .iter()
        .flatten()
        .map(|line| text_width(line, NAME_SIZE));
    let left = 20.0 + widest.fold(LABEL_SIZE, f64::max);
    let x = Span::over(dots.scale, dots.extent(), 0.04);
    let y = Span {
        scale: Scale::Linear,
        low: 0.5 - count as f64,
        high: 0.5,
    };
    let frame = Frame::beside(left, height, x, y);
    let (_, bottom) = frame.place(1.0, y.low);
    let markup = html! {
        (frame.clip("frame"))
        (frame.horizontal(&dots.value_label, true))
        path d={ "M" (px(left)) " " (px(ABOVE)) "V" (px(bottom)) } stroke=(palette::RULE.0) {}
        @for (i, lines) in names.iter().enumerate() {
            @let (_, middle) = frame.place(1.0, -(i as f64));
            @let first = middle + 4.0 - NAME_LINE * (lines.len() as f64 - 1.0) / 2.0;
            @for (k, line) in lines.iter().enumerate() {
                text x=(px(left - 9.0)) y=(px(first + NAME_LINE * k as f64)) font-size=(NAME_SIZE) text-anchor="end" { (line) }
            }
        }
        g clip-path="url(#frame)" {
            @for (s, series) in dots.series.iter().enumerate() {
                @let colour = series.colour.light();
                @for (c, value) in series.values.iter().enumerate().filter(|(_, v)| v.mean.is_finite()) {
                    @let at = |x: f64| frame.place(x, -dots.place(c, s));
                    @let (x, y) = at(value.mean);
                    @let ends = [at(value.low), at(value.high)];
                    path d={
                        (path(ends.into_iter()))
                        @for (x, y) in ends.iter().filter(|(x, _)| x.is_finite()) { "M" (px(*x)) " " (px(y - 3.0)) "v6" }
                    } stroke=(colour) stroke-width="1.4" {}
                    @if x.is_finite() { path d=(Mark::nth(s).path(x, y, 4.0)) fill=(colour) {} }
                }
            }
        }
    };
    Drawing {
        height: ABOVE + height + BELOW,
        markup,
    }
}
