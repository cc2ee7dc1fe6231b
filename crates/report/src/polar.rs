//! The circle test, drawn as a ball-bar instrument draws it.

use super::drawing::{Axis, Circle, Curve, Drawing, Shape, Text};
use super::samples::{pick, same_length};
use super::scale::rounded;
use super::{ReportError, Scale, Style, decimate};
use serde::Serialize;
use std::f64::consts::TAU;

/// Largest share of the radius that the magnified deviation may take.
const DEVIATION_SHARE: f64 = 0.3;
/// Most division circles on either side of the nominal circle.
const DIVISIONS: f64 = 3.0;
/// Angle at which divisions are labelled: on the diagonal, away from the axes, where the quadrant glitches are; rad.
const LABEL_ANGLE: f64 = TAU / 8.0;

/// Radial deviation from a circle, magnified.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolarDeviation {
    /// Radius of the nominal circle, mm.
    pub radius_mm: f64,
    /// Horizontal axis, with its unit.
    pub x_label: String,
    /// Vertical axis, with its unit.
    pub y_label: String,
    /// The measured circles.
    pub traces: Vec<DeviationTrace>,
}

/// One measured circle.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DeviationTrace {
    /// For the legend.
    pub name: String,
    /// Angle of each sample from the horizontal axis, rad.
    #[serde(serialize_with = "super::number::list")]
    pub angle_rad: Vec<f64>,
    /// Radius less the nominal one, um.
    #[serde(serialize_with = "super::number::list")]
    pub deviation_um: Vec<f64>,
    /// Style of the trace.
    pub style: Style,
}

/// Magnification of a polar figure, in round numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Magnification {
    /// Drawn deviation over true deviation.
    pub factor: f64,
    /// Distance between two division circles, um.
    pub division_um: f64,
    /// Division circles inside and outside of the nominal one.
    pub divisions: usize,
}

impl PolarDeviation {
    /// The largest round magnification (1, 2, 5 times a power of ten) that leaves the circle a circle.
    #[must_use]
    pub fn magnification(&self) -> Magnification {
        let largest_um = self
            .traces
            .iter()
            .flat_map(|trace| &trace.deviation_um)
            .filter(|d| d.is_finite())
            .fold(0.0_f64, |largest, d| largest.max(d.abs()))
            // A perfect circle still needs a scale: that of a nanometre.
            .max(1e-3);
        // Rounding to the next step down wins back what rounding to the next division takes.
        let division_um = round_up(largest_um / DIVISIONS);
        let divisions = (largest_um / division_um).ceil().max(1.0);
        let factor = round_down(DEVIATION_SHARE * self.radius_mm * 1e3 / (divisions * division_um));
        Magnification {
            factor,
            division_um,
            divisions: divisions as usize,
        }
    }

    pub(super) fn check(&self, figure: &str) -> Result<(), ReportError> {
        if !(self.radius_mm.is_finite() && self.radius_mm > 0.0) {
            return Err(ReportError::Radius {
                figure: figure.to_owned(),
                radius_mm: self.radius_mm,
            });
        }
        self.traces.iter().try_for_each(|trace| {
            same_length(
                figure,
                &trace.name,
                trace.angle_rad.len(),
                trace.deviation_um.len(),
            )
        })
    }

    /// The same with at most `points` samples of each circle.
    pub(super) fn decimated(&self, points: usize) -> Self {
        let traces = self.traces.iter().map(|trace| {
            let kept = decimate(&trace.angle_rad, &trace.deviation_um, points);
            DeviationTrace {
                name: trace.name.clone(),
                angle_rad: pick(&trace.angle_rad, &kept),
                deviation_um: pick(&trace.deviation_um, &kept),
                style: trace.style,
            }
        });
        Self {
            traces: traces.collect(),
            ..self.clone()
        }
    }

    /// Returns the note on the scale that the reader needs.
    pub(super) fn scale_note(&self) -> String {
        let Magnification {
            factor,
            division_um,
            ..
        } = self.magnification();
        format!(
            "Radial deviation magnified {factor} times, {division_um}\u{a0}µm per division; the darkest of the circles is the \
             nominal one, radius {}\u{a0}mm.",
            self.radius_mm
        )
    }

    pub(super) fn drawing(&self) -> Drawing {
        let scale = self.magnification();
        let curves = self.traces.iter().map(|trace| {
            let samples = trace.angle_rad.iter().zip(&trace.deviation_um);
            let short = |place| rounded(place, self.radius_mm * 1e-5);
            let places = samples
                .map(|(&angle, &deviation)| self.drawn(scale, angle, deviation))
                .map(|(x, y)| (short(x), short(y)))
                .unzip();
            let deviation = Scale::Linear.shortened(&trace.deviation_um, scale.division_um * 1e-3);
            let shape = Shape::Line {
                dash: trace.style.dash.pattern(),
                deviation: Some(deviation),
            };
            Curve::new(&trace.name, trace.style.colour, shape, places)
        });
        let divisions = self.divisions(scale);
        let circles = divisions.iter().map(|&(radius, um)| Circle {
            radius,
            nominal: um == 0.0,
        });
        // The scale stands where ball-bar plots have it: in the empty centre.
        let centre = scale.lines().into_iter().zip([-5.0, 14.0]);
        let centre = centre.map(|(text, dy)| Text {
            x: 0.0,
            y: 0.0,
            dy,
            anchor: "middle",
            text,
        });
        let ends = [divisions.first(), divisions.last()].into_iter().flatten();
        let labels = ends.map(|&(radius, um)| {
            let is_inside = um < 0.0;
            Text {
                x: radius * LABEL_ANGLE.cos(),
                y: radius * LABEL_ANGLE.sin(),
                dy: if is_inside { 12.0 } else { -4.0 },
                anchor: if is_inside { "end" } else { "start" },
                text: division_label(um),
            }
        });
        let reach = self.reach_mm(scale);
        let axis = |label: &str| Axis {
            range: Some((-reach, reach)),
            ticks: [-self.radius_mm, 0.0, self.radius_mm]
                .map(|at| (at, at.to_string().replace('-', "\u{2212}")))
                .into(),
            zero: false,
            ..Axis::new(label, Scale::Linear)
        };
        Drawing {
            caption: String::new(),
            x: axis(&self.x_label),
            y: axis(&self.y_label),
            equal: true,
            curves: curves.collect(),
            circles: circles.collect(),
            texts: centre.chain(labels).collect(),
        }
    }

    /// Returns the point at which a sample is drawn, mm from the centre.
    fn drawn(&self, scale: Magnification, angle_rad: f64, deviation_um: f64) -> (f64, f64) {
        let radius = self.radius_mm + scale.factor * deviation_um * 1e-3;
        (radius * angle_rad.cos(), radius * angle_rad.sin())
    }

    /// Returns the half width of the plane that is drawn, mm from the centre.
    fn reach_mm(&self, scale: Magnification) -> f64 {
        let reach_um = scale.divisions as f64 * scale.division_um;
        1.06 * (self.radius_mm + scale.factor * reach_um * 1e-3)
    }

    /// Radii of the division circles, mm as drawn, with the deviation they stand for, um; from the innermost.
    fn divisions(&self, scale: Magnification) -> Vec<(f64, f64)> {
        let reach = scale.divisions as isize;
        (-reach..=reach)
            .map(|division| {
                let um = division as f64 * scale.division_um;
                (self.radius_mm + scale.factor * um * 1e-3, um)
            })
            .collect()
    }
}

impl Magnification {
    /// Returns the text in the centre.
    fn lines(&self) -> [String; 2] {
        [
            format!("× {}", self.factor),
            format!("{} µm/div", self.division_um),
        ]
    }
}

/// Returns the label of a division circle.
fn division_label(um: f64) -> String {
    format!("{um:+} µm").replace('-', "\u{2212}")
}

/// The steps of a readable scale.
const STEPS: [f64; 4] = [1.0, 2.0, 5.0, 10.0];

fn decade(value: f64) -> f64 {
    10f64.powf(value.log10().floor())
}

/// The next 1, 2 or 5 times a power of ten at or above `value`.
fn round_up(value: f64) -> f64 {
    let decade = decade(value);
    let steps = STEPS.into_iter().map(|step| tidy(step * decade));
    steps
        .into_iter()
        .find(|step| *step >= value * (1.0 - 1e-12))
        .unwrap_or(10.0 * decade)
}

/// The next 1, 2 or 5 times a power of ten at or below `value`.
fn round_down(value: f64) -> f64 {
    let decade = decade(value);
    let steps = STEPS.into_iter().rev().map(|step| tidy(step * decade));
    steps
        .into_iter()
        .find(|step| *step <= value * (1.0 + 1e-12))
        .unwrap_or(decade)
}

/// The decimal number that `value` stands for, so that it prints as 0.2 and not as 0.20000000000000001.
fn tidy(value: f64) -> f64 {
    format!("{value:.0e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::{DeviationTrace, Magnification, PolarDeviation, Style, round_down, round_up};

    fn circle(radius_mm: f64, deviation_um: Vec<f64>) -> PolarDeviation {
        let angle_rad = (0..deviation_um.len()).map(|i| i as f64).collect();
        let trace = DeviationTrace {
            name: "PID".into(),
            angle_rad,
            deviation_um,
            style: Style::nth(0),
        };
        PolarDeviation {
            radius_mm,
            x_label: "x (mm)".into(),
            y_label: "y (mm)".into(),
            traces: vec![trace],
        }
    }

    #[test]
    fn scales_are_round() {
        assert_eq!((round_up(0.00031), round_down(0.00031)), (0.0005, 0.0002));
        assert_eq!((round_up(2.0), round_down(2.0)), (2.0, 2.0));
        assert_eq!((round_up(700.0), round_down(999.0)), (1000.0, 500.0));
    }

    #[test]
    fn the_magnified_trace_stays_within_its_share_of_the_radius() {
        for (radius, largest) in [
            (30.0, 4.1),
            (30.0, 14.9),
            (5.0, 0.3),
            (100.0, 2000.0),
            (0.01, 1.0),
        ] {
            let scale = circle(radius, vec![0.1 * largest, -largest]).magnification();
            let reach_um = scale.divisions as f64 * scale.division_um;
            assert!(reach_um >= largest && scale.divisions <= 3, "{scale:?}");
            let share = scale.factor * reach_um * 1e-3 / radius;
            assert!(
                share <= 0.3 + 1e-9 && share > 0.1,
                "{share} of the radius with {scale:?}"
            );
        }
    }

    #[test]
    fn perfect_and_broken_circles_have_a_scale_too() {
        let expected = Magnification {
            factor: 5e6,
            division_um: 5e-4,
            divisions: 2,
        };
        assert_eq!(circle(30.0, vec![0.0, f64::NAN]).magnification(), expected);
    }
}
