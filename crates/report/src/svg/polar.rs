//! Radial deviation from a circle, magnified.

use super::frame::{ABOVE, BELOW, Frame, Span};
use super::{Drawing, TICK_SIZE, path, px};
use crate::polar::{LABEL_ANGLE, division_label};
use crate::{PolarDeviation, Scale, palette};
use maud::html;

const HEIGHT: f64 = 580.0;

pub(super) fn draw(circle: &PolarDeviation) -> Drawing {
    let scale = circle.magnification();
    let divisions = circle.divisions(scale);
    let reach = circle.reach_mm(scale);
    let span = Span {
        scale: Scale::Linear,
        low: -reach,
        high: reach,
    };
    let frame = Frame::new(HEIGHT, span, span, true);
    let ((x, y), (right, _)) = (frame.place(0.0, 0.0), frame.place(1.0, 0.0));
    let px_per_mm = right - x;
    let markup = html! {
        (frame.vertical(&circle.y_label))
        (frame.horizontal(&circle.x_label, false))
        @for (radius, um) in &divisions {
            @let is_nominal = *um == 0.0;
            circle cx=(px(x)) cy=(px(y)) r=(px(radius * px_per_mm)) fill="none"
                stroke=(if is_nominal { palette::LABEL.0 } else { palette::RULE.0 }) stroke-width=(if is_nominal { "1" } else { "0.6" })
                stroke-dasharray=[is_nominal.then_some("6 4")] {}
        }
        @for (radius, um) in divisions.first().into_iter().chain(divisions.last()) {
            @let place = frame.place(radius * LABEL_ANGLE.cos(), radius * LABEL_ANGLE.sin());
            @let (dx, dy, anchor) = if *um < 0.0 { (-4.0, 12.0, "end") } else { (4.0, -4.0, "start") };
            text x=(px(place.0 + dx)) y=(px(place.1 + dy)) font-size=(TICK_SIZE) fill=(palette::LABEL.0) text-anchor=(anchor) {
                (division_label(*um))
            }
        }
        @for (line, dy) in scale.lines().iter().zip([-4.0, 13.0]) {
            text x=(px(x)) y=(px(y + dy)) font-size="12" fill=(palette::LABEL.0) text-anchor="middle" { (line) }
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
