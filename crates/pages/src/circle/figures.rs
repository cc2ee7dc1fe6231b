//! The circle tests' figures: paths as a ball-bar draws them, and what grows with the feed.

use quadrant_law::reference::Sense;
use quadrant_report::{Dash, DeviationTrace, Figure, Lines, Plot, PolarDeviation, Series, Style};

use crate::circle::cases::{
    Circle, axes_of, configurations, deviation_mm, plane_name, planes, sense_name,
};
use crate::circle::request::CircleTest;
use crate::experiment::configuration::{Configuration, Gains};
use crate::parts::UM_PER_MM;

/// The values of a case, in rising order, once each.
fn distinct(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// The middle one of rising values, the upper of two.
fn middle(values: &[f64]) -> Option<f64> {
    values.get(values.len() / 2).copied()
}

/// The configurations that are drawn: the best PID, alone and with feedforward, beside whose errors the others' would hide them; all
/// where it was not run.
fn drawn<'a>(circles: &[Circle<'a>]) -> Vec<Configuration> {
    let all = configurations(circles);
    let best = |configuration: &Configuration| configuration.gains == Gains::BestPid;
    if all.iter().any(best) {
        all.into_iter().filter(best).collect()
    } else {
        all
    }
}

/// One for each plane, at its middle radius and feed: every configuration that is drawn, both senses.
pub(super) fn polar_figures(circles: &[Circle<'_>]) -> Vec<Figure> {
    let drawn = drawn(circles);
    planes(circles)
        .into_iter()
        .filter_map(|plane| {
            let own = || {
                circles.iter().filter(|circle| {
                    circle.case.plane == plane && drawn.contains(&circle.case.configuration)
                })
            };
            let radius_mm = middle(&distinct(own().map(|circle| circle.case.radius_mm)))?;
            let at_radius = || own().filter(|circle| circle.case.radius_mm == radius_mm);
            let feed = middle(&distinct(at_radius().map(|circle| circle.case.feed_mm_min)))?;
            let shown = at_radius().filter(|circle| circle.case.feed_mm_min == feed);
            let traces = shown
                .enumerate()
                .flat_map(|(index, circle)| traces(circle, index))
                .collect();
            let [first, second] = axes_of(plane);
            let name = plane_name(plane);
            Some(Figure {
                id: format!("circle-polar-{}", name.to_lowercase()),
                caption: format!(
                    "{name}, radius {radius_mm} mm at {feed} mm/min, simulated: the path around the nominal circle"
                ),
                plot: Plot::PolarDeviation(PolarDeviation {
                    radius_mm,
                    x_label: format!("{first} (mm)"),
                    y_label: format!("{second} (mm)"),
                    traces,
                }),
            })
        })
        .collect()
}

/// The first seed's paths of a circle; the colour shows the configuration, the dash the sense.
fn traces(circle: &Circle<'_>, index: usize) -> [DeviationTrace; 2] {
    circle.tests[0].turns().map(|(sense, turn)| DeviationTrace {
        name: format!(
            "{}, {}",
            circle.case.configuration.name(),
            sense_name(sense)
        ),
        angle_rad: turn.path.iter().map(|&(angle, _)| angle).collect(),
        deviation_um: turn
            .path
            .iter()
            .map(|&(_, deviation)| deviation * UM_PER_MM)
            .collect(),
        style: Style {
            colour: Style::nth(index).colour,
            dash: match sense {
                Sense::Clockwise => Dash::Dashed,
                Sense::CounterClockwise => Dash::Solid,
            },
        },
    })
}

/// Circular deviation and spikes against the feed, the largest of the planes; nothing of a single feed.
pub(super) fn feed_figures(circles: &[Circle<'_>]) -> Vec<Figure> {
    let figure = |id: &str, what: &str, y_label: &str, length: fn(&CircleTest) -> f64| Figure {
        id: id.to_owned(),
        caption: format!("{what} against the feed, largest of the planes, simulated"),
        plot: Plot::Lines(Lines {
            x_label: "feed (mm/min)".to_owned(),
            y_label: y_label.to_owned(),
            series: feed_series(circles, length),
            ..Lines::default()
        }),
    };
    // Of one feed nothing can be drawn against it.
    if distinct(circles.iter().map(|circle| circle.case.feed_mm_min)).len() < 2 {
        return Vec::new();
    }
    vec![
        figure(
            "circle-deviation-feed",
            "Bi-directional circular deviation",
            "G(b) (um)",
            deviation_mm,
        ),
        figure(
            "circle-spike-feed",
            "Mean height of the reversal spikes",
            "spike (um)",
            CircleTest::mean_spike_mm,
        ),
    ]
}

/// A curve for each configuration and radius; the colour shows the radius, the dash the configuration.
fn feed_series(circles: &[Circle<'_>], length: fn(&CircleTest) -> f64) -> Vec<Series> {
    let radii = distinct(circles.iter().map(|circle| circle.case.radius_mm));
    let dashes = [Dash::Solid, Dash::Dashed, Dash::Dotted];
    let mut series = Vec::new();
    for (nth, configuration) in drawn(circles).into_iter().enumerate() {
        for (index, &radius_mm) in radii.iter().enumerate() {
            let own = || {
                circles.iter().filter(move |circle| {
                    circle.case.configuration == configuration && circle.case.radius_mm == radius_mm
                })
            };
            let x = distinct(own().map(|circle| circle.case.feed_mm_min));
            let y = x
                .iter()
                .map(|&feed| {
                    own()
                        .filter(|circle| circle.case.feed_mm_min == feed)
                        .map(|circle| circle.mean_um(length))
                        .fold(0.0, f64::max)
                })
                .collect();
            series.push(Series {
                name: format!("{}, {radius_mm} mm", configuration.name()),
                x,
                y,
                style: Style {
                    colour: Style::nth(index).colour,
                    dash: dashes[nth % dashes.len()],
                },
            });
        }
    }
    series
}
