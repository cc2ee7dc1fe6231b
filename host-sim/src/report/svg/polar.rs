//! Radial deviation from a circle, magnified.

use super::frame::{ABOVE, BELOW, Frame, Span};
use super::{Drawing, TICK_SIZE, path, px};
use crate::report::{PolarDeviation, Scale, palette};
use maud::html;
use std::f64::consts::TAU;

const HEIGHT: f64 = 580.0;

pub(super) fn draw(circle: &PolarDeviation) -> Drawing {
    let scale = circle.magnification();
    let divisions = circle.divisions(scale);
    let reach = divisions
        .last()
        .map_or(circle.radius_mm, |(radius, _)| *radius)
        * 1.06;
    let span = Span {
        scale: Scale::Linear,
        low: -reach,
        high: reach,
    };
    let frame = Frame::new(HEIGHT, span, span, true);
    let ((x, y), (right, _)) = (frame.place(0.0, 0.0), frame.place(1.0, 0.0));
    let px_per_mm = right - x;
    let outermost = scale.divisions as f64 * scale.division_um;
    let markup = html! {
        (frame.vertical(&circle.y_label))
        (frame.horizontal(&circle.x_label, false))
        @for (radius, um) in &divisions {
            @let is_nominal = *um == 0.0;
            circle cx=(px(x)) cy=(px(y)) r=(px(radius * px_per_mm)) fill="none"
                stroke=(if is_nominal { palette::LABEL.0 } else { palette::RULE.0 }) stroke-width=(if is_nominal { "1" } else { "0.6" })
                stroke-dasharray=[is_nominal.then_some("6 4")] {}
            // On the diagonal, away from the axes, where the quadrant glitches are.
            @if um.abs() == outermost {
                @let place = frame.place(radius * (TAU / 8.0).cos(), radius * (TAU / 8.0).sin());
                @let is_inside = *um < 0.0;
                text x=(px(place.0 + if is_inside { -4.0 } else { 4.0 })) y=(px(place.1 + if is_inside { 12.0 } else { -4.0 }))
                    font-size=(TICK_SIZE) fill=(palette::LABEL.0) text-anchor=(if is_inside { "end" } else { "start" }) {
                    (format!("{um:+} µm").replace('-', "\u{2212}"))
                }
            }
        }
        text x=(px(x)) y=(px(y - 4.0)) font-size="12" fill=(palette::LABEL.0) text-anchor="middle" {
            "magnified " (scale.factor) " times"
        }
        text x=(px(x)) y=(px(y + 14.0)) font-size="12" fill=(palette::LABEL.0) text-anchor="middle" {
            (scale.division_um) " µm per division"
        }
        @for trace in &circle.traces {
            @let points = trace.angle_rad.iter().zip(&trace.deviation_um).map(|(&angle, &deviation)| {
                let (x, y) = circle.drawn(scale, angle, deviation);
                frame.place(x, y)
            });
            path d=(path(points)) fill="none" stroke=(trace.style.colour.light()) stroke-width="1.4" stroke-linejoin="round"
                stroke-dasharray=[trace.style.dash.pattern()] {}
        }
    };
    Drawing {
        height: ABOVE + HEIGHT + BELOW,
        markup,
    }
}
