//! Axes: from values to places on the image, with ticks, labels and grid.

use super::ticks::{Tick, ticks};
use super::{LABEL_SIZE, TICK_SIZE, WIDTH, px, text_width};
use crate::figure::typeset;
use crate::{Scale, palette};
use maud::{Markup, html};

/// Room for ticks' names and the label below the drawing, px.
pub(super) const BELOW: f64 = 48.0;
pub(super) const ABOVE: f64 = 6.0;
const RIGHT: f64 = 16.0;
/// Length of a tick, px.
const TICK: f64 = 4.0;

/// One axis' places, before they are placed on the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) scale: Scale,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Span {
    /// The span of values with `margin`, a share of it, at both ends. Values that are all one get a span around them.
    pub(super) fn over(scale: Scale, values: impl Iterator<Item = f64>, margin: f64) -> Self {
        let (low, high) = scale.reach(values).unwrap_or((0.0, 1.0));
        let spread = (high - low).max(1e-9 * high.abs().max(low.abs()));
        let pad = if high > low {
            margin * spread
        } else {
            0.5 * high.abs().max(1.0)
        };
        Self {
            scale,
            low: low - pad,
            high: high + pad,
        }
    }

    fn length(self) -> f64 {
        self.high - self.low
    }
}

/// The rectangle curves are drawn in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Frame {
    left: f64,
    width: f64,
    height: f64,
    x: Span,
    y: Span,
}

impl Frame {
    /// A frame of `height` beside the names of the vertical axis' ticks; with `equal_units` one unit is as long on both.
    pub(super) fn new(height: f64, x: Span, y: Span, equal_units: bool) -> Self {
        let names = ticks(y.scale, y.low, y.high, y_count(height));
        let widest = names
            .iter()
            .filter_map(|tick| tick.label.as_deref())
            .map(|name| text_width(name, TICK_SIZE))
            .fold(0.0, f64::max);
        Self::beside(34.0 + widest, height, x, y).with_equal_units(equal_units)
    }

    /// A frame with `left` px beside it.
    pub(super) fn beside(left: f64, height: f64, x: Span, y: Span) -> Self {
        Self {
            left,
            width: WIDTH - RIGHT - left,
            height,
            x,
            y,
        }
    }

    fn with_equal_units(mut self, equal_units: bool) -> Self {
        if equal_units {
            let unit = (self.x.length() / self.width).max(self.y.length() / self.height);
            let widen = |span: &mut Span, size: f64| {
                let more = 0.5 * (unit * size - span.length());
                span.low -= more;
                span.high += more;
            };
            widen(&mut self.x, self.width);
            widen(&mut self.y, self.height);
        }
        self
    }

    /// Where a point is on the image, px; not finite where it has no place.
    pub(super) fn place(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.across(self.x.scale.place(x)),
            self.down(self.y.scale.place(y)),
        )
    }

    fn across(&self, place: f64) -> f64 {
        self.left + (place - self.x.low) / self.x.length() * self.width
    }

    fn down(&self, place: f64) -> f64 {
        ABOVE + (self.y.high - place) / self.y.length() * self.height
    }

    fn bottom(&self) -> f64 {
        ABOVE + self.height
    }

    fn right(&self) -> f64 {
        self.left + self.width
    }

    /// The frame's rectangle, outside of which nothing is drawn.
    pub(super) fn clip(&self, id: &str) -> Markup {
        html! {
            clipPath id=(id) {
                rect x=(px(self.left)) y=(px(ABOVE)) width=(px(self.width)) height=(px(self.height)) {}
            }
        }
    }

    /// The horizontal axis with its grid.
    pub(super) fn horizontal(&self, label: &str, has_grid: bool) -> Markup {
        let bottom = self.bottom();
        // Names must not run into each other.
        let count = ((self.width / 80.0) as usize).max(2);
        let ticks = ticks(self.x.scale, self.x.low, self.x.high, count);
        html! {
            @for Tick { place, label } in &ticks {
                @let x = px(self.across(*place));
                @let is_zero = self.x.scale == Scale::Linear && *place == 0.0;
                @if is_zero || (has_grid && label.is_some()) {
                    path d={ "M" (x) " " (px(ABOVE)) "V" (px(bottom)) }
                        stroke=(if is_zero { palette::RULE.0 } else { palette::GRID.0 }) {}
                }
                path d={ "M" (x) " " (px(bottom)) "v" (if label.is_some() { TICK } else { TICK / 2.0 }) } stroke=(palette::RULE.0) {}
                @if let Some(label) = label {
                    text x=(x) y=(px(bottom + 17.0)) font-size=(TICK_SIZE) fill=(palette::LABEL.0) text-anchor="middle" { (label) }
                }
            }
            path d={ "M" (px(self.left)) " " (px(bottom)) "H" (px(self.right())) } stroke=(palette::RULE.0) {}
            text x=(px(self.left + self.width / 2.0)) y=(px(bottom + 38.0)) font-size=(LABEL_SIZE) text-anchor="middle" {
                (typeset(label))
            }
        }
    }

    /// The vertical axis with its grid.
    pub(super) fn vertical(&self, label: &str) -> Markup {
        let ticks = ticks(self.y.scale, self.y.low, self.y.high, y_count(self.height));
        let middle = ABOVE + self.height / 2.0;
        html! {
            @for Tick { place, label } in &ticks {
                @let y = self.down(*place);
                @let is_zero = self.y.scale == Scale::Linear && *place == 0.0;
                @if label.is_some() {
                    path d={ "M" (px(self.left)) " " (px(y)) "H" (px(self.right())) }
                        stroke=(if is_zero { palette::RULE.0 } else { palette::GRID.0 }) {}
                }
                @if let Some(label) = label {
                    text x=(px(self.left - 7.0)) y=(px(y + 4.0)) font-size=(TICK_SIZE) fill=(palette::LABEL.0) text-anchor="end" {
                        (label)
                    }
                }
            }
            path d={ "M" (px(self.left)) " " (px(ABOVE)) "V" (px(self.bottom())) } stroke=(palette::RULE.0) {}
            text transform={ "translate(18 " (px(middle)) ") rotate(-90)" } font-size=(LABEL_SIZE) text-anchor="middle" {
                (typeset(label))
            }
        }
    }
}

fn y_count(height: f64) -> usize {
    ((height / 45.0) as usize).max(2)
}
