//! The robustness experiment's figures.

use quadrant_pages::parts::{UM_PER_MM, dot, error_curve};
use quadrant_report::{DotSeries, Dots, Figure, Lines, Plot, Scale, Series, Spread, Style};

use crate::robustness::compliance::{Compliance, FREQUENCIES_HZ, LOAD_V};
use crate::robustness::study::RobustnessReport;
use crate::robustness::{Scenario, find};

/// Control period of the outcomes' traces, s.
const PERIOD_S: f64 = 1e-4;

/// The largest error of each law in each scenario.
pub(super) fn dots(report: &RobustnessReport) -> Figure {
    let series = report
        .competitors()
        .into_iter()
        .enumerate()
        .map(|(index, competitor)| {
            let errors = report.scenarios.iter().map(|scenario| {
                find(&report.outcomes, &scenario.name, competitor)
                    .and_then(|outcome| outcome.statistic(|score| score.largest_mm))
                    .map_or(Spread::exact(f64::NAN), |statistic| {
                        dot(statistic, UM_PER_MM)
                    })
            });
            DotSeries {
                name: competitor.to_owned(),
                values: errors.collect(),
                colour: Style::nth(index).colour,
            }
        })
        .collect();
    Figure {
        id: "robustness-largest-dots".to_owned(),
        caption: "Largest tracking error in each scenario, mean over the seeds; bars: one standard deviation".to_owned(),
        plot: Plot::Dots(Dots {
            value_label: "largest tracking error (um)".to_owned(),
            categories: report.scenarios.iter().map(|it| it.name.clone()).collect(),
            series,
            scale: Scale::Logarithmic,
        }),
    }
}

/// The error of the first law and of the last, over time.
pub(super) fn error_figure(report: &RobustnessReport, scenario: &Scenario) -> Figure {
    let competitors = report.competitors();
    let ends = [competitors.first(), competitors.last()];
    let series = ends
        .into_iter()
        .flatten()
        .enumerate()
        .filter_map(|(index, competitor)| {
            let trace = find(&report.outcomes, &scenario.name, competitor)?
                .trace
                .as_ref()?;
            let name = (*competitor).to_owned();
            Some(error_curve(
                name,
                &trace.error_mm,
                PERIOD_S,
                Style::nth(index),
            ))
        })
        .collect();
    Figure {
        id: format!(
            "robustness-error-{}",
            scenario.name.replace([' ', ','], "-")
        ),
        caption: format!("Tracking error, {}: {}", scenario.name, scenario.what),
        plot: Plot::Lines(Lines {
            x_label: "time (s)".to_owned(),
            y_label: "tracking error (um)".to_owned(),
            series,
            ..Lines::default()
        }),
    }
}

pub(super) fn compliance_figure(compliances: &[Compliance]) -> Figure {
    let series = compliances
        .iter()
        .enumerate()
        .map(|(index, compliance)| {
            let style = Style::nth(index);
            Series {
                name: compliance.name.clone(),
                x: FREQUENCIES_HZ.to_vec(),
                y: compliance
                    .mm_per_v
                    .iter()
                    .map(|value| value.map_or(f64::NAN, |mm| mm * UM_PER_MM))
                    .collect(),
                style: if index == 0 {
                    style
                } else {
                    Style::points(style.colour)
                },
            }
        })
        .collect();
    Figure {
        id: "robustness-compliance-figure".to_owned(),
        caption: format!("Largest error at rest over a sinusoidal load of {LOAD_V} V"),
        plot: Plot::Lines(Lines {
            x_label: "frequency (Hz)".to_owned(),
            y_label: "error over load (um/V)".to_owned(),
            series,
            x_scale: Scale::Logarithmic,
            y_scale: Scale::Logarithmic,
            ..Lines::default()
        }),
    }
}
