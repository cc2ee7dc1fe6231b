//! Figures 5.1 to 5.18. Figures that are compared have one range.

use std::f64::consts::TAU;

use FeedforwardKind::{Combined, None as Without};
use ModelKnowledge::Identified;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::compare::comparison::{AMPLITUDES_MM, Entry};
use quadrant_pages::compare::sine::{VELOCITIES_MM_S, cycle_s};
use quadrant_pages::experiment::run_configuration::ModelKnowledge;
use quadrant_pages::parts::UM_PER_MM;
use quadrant_report::{Block, Figure, Lines, Plot, Series, Style, decimate};
use quadrant_sim::metrics::GLITCH_WINDOW;

use crate::thesis::chapter5::{CONTROLLERS, Chapter, knowledge_name};

/// Points of a curve that are kept; their extremes are those of the trace.
const POINTS: usize = 1500;
/// Part of the cycle on either side of the reversal that Figure 5.5 shows.
const ZOOM: f64 = 2.0 * GLITCH_WINDOW;
/// Points of a reference velocity.
const VELOCITY_POINTS: usize = 200;
/// Length of a drawn axis over the largest value on it.
const ROOM: f64 = 1.05;
/// Velocity of Figure 5.18, mm/s: the middle one.
const AMPLITUDE_VELOCITY_MM_S: f64 = VELOCITIES_MM_S[1];

/// The abscissa of a curve.
#[derive(Clone, Copy)]
enum Over {
    /// Time, s.
    Seconds,
    /// Time over that of a cycle.
    Cycles,
    /// Time from the reversal in the middle of the cycle, s, near it only.
    Reversal,
}

/// The error of an entry's last cycle.
fn error_series(name: String, entry: &Entry, over: Over, style: Style) -> Series {
    let errors = &entry.last_cycle.error_mm;
    let period_s = cycle_s(entry.amplitude_mm, entry.velocity_mm_s);
    let share = |index: usize| index as f64 / errors.len() as f64;
    let (x, y): (Vec<f64>, Vec<f64>) = errors
        .iter()
        .enumerate()
        .filter(|(index, _)| !matches!(over, Over::Reversal) || (share(*index) - 0.5).abs() <= ZOOM)
        .map(|(index, error)| {
            let x = match over {
                Over::Seconds => share(index) * period_s,
                Over::Cycles => share(index),
                Over::Reversal => (share(index) - 0.5) * period_s,
            };
            (x, UM_PER_MM * error)
        })
        .unzip();
    let kept = decimate(&x, &y, POINTS);
    Series {
        name,
        x: kept.iter().map(|&index| x[index]).collect(),
        y: kept.iter().map(|&index| y[index]).collect(),
        style,
    }
}

/// The largest error of these entries' last cycles, um, with room above it.
fn reach_um<'a>(entries: impl Iterator<Item = &'a Entry>) -> f64 {
    let largest = entries
        .flat_map(|entry| &entry.last_cycle.error_mm)
        .fold(0.0, |most: f64, error| most.max(error.abs()));
    ROOM * UM_PER_MM * largest
}

/// An error figure under the thesis' number; `part` distinguishes several of one number.
fn figure(
    (number, part): (usize, &str),
    caption: String,
    x_label: &str,
    series: Vec<Series>,
    reach_um: f64,
) -> Block {
    Block::Figure(Figure {
        id: format!("figure-5-{number}{part}"),
        caption,
        plot: Plot::Lines(Lines {
            x_label: x_label.to_owned(),
            y_label: "tracking error (um)".to_owned(),
            series,
            y_range: Some((-reach_um, reach_um)),
            ..Lines::default()
        }),
    })
    .labelled(format!("Figure 5.{number}{part}"))
}

/// Returns the figure of the reference's velocity in the cycle that is drawn, which begins at a reversal.
fn velocity_figure((number, part): (usize, &str), velocity_mm_s: f64) -> Block {
    let period_s = cycle_s(AMPLITUDES_MM[0], velocity_mm_s);
    let shares = || (0..=VELOCITY_POINTS).map(|point| point as f64 / VELOCITY_POINTS as f64);
    let fastest = ROOM * VELOCITIES_MM_S[2];
    Block::Figure(Figure {
        id: format!("figure-5-{number}{part}"),
        caption: format!("Reference velocity over the cycle of Figure 5.{number}b"),
        plot: Plot::Lines(Lines {
            x_label: "time (s)".to_owned(),
            y_label: "reference velocity (mm/s)".to_owned(),
            series: vec![Series {
                name: "reference velocity".to_owned(),
                x: shares().map(|share| share * period_s).collect(),
                y: shares()
                    .map(|share| -velocity_mm_s * (TAU * share).sin())
                    .collect(),
                style: Style::nth(0),
            }],
            y_range: Some((-fastest, fastest)),
            ..Lines::default()
        }),
    })
    .labelled(format!("Figure 5.{number}{part}"))
}

impl Chapter<'_> {
    /// Figures 5.1 to 5.5: the controllers alone.
    pub(super) fn controller_figures(&self) -> Vec<Block> {
        let alone = |controller, knowledge| {
            VELOCITIES_MM_S
                .into_iter()
                .filter_map(move |velocity| self.entry(controller, Without, knowledge, velocity))
        };
        let reach = reach_um(
            CONTROLLERS
                .into_iter()
                .flat_map(|controller| ModelKnowledge::ALL.map(|knowledge| (controller, knowledge)))
                .flat_map(|(controller, knowledge)| alone(controller, knowledge)),
        );
        let mut blocks = Vec::new();
        let pairs = CONTROLLERS
            .into_iter()
            .flat_map(|controller| ModelKnowledge::ALL.map(|knowledge| (controller, knowledge)));
        for ((controller, knowledge), number) in pairs.zip(1..) {
            let series = alone(controller, knowledge)
                .enumerate()
                .map(|(index, entry)| {
                    let name = format!("{} mm/s", entry.velocity_mm_s);
                    error_series(name, entry, Over::Cycles, Style::nth(index))
                })
                .collect();
            let caption = format!(
                "Tracking error over a cycle with {}, {}",
                controller.name(),
                knowledge_name(knowledge)
            );
            blocks.push(figure(
                (number, ""),
                caption,
                "time (cycles)",
                series,
                reach,
            ));
        }
        let measured = CONTROLLERS.into_iter().flat_map(|c| alone(c, Identified));
        let reach = reach_um(measured);
        for (velocity, part) in VELOCITIES_MM_S.into_iter().zip(["a", "b", "c"]) {
            let series = CONTROLLERS
                .into_iter()
                .enumerate()
                .filter_map(|(index, controller)| {
                    let entry = self.entry(controller, Without, Identified, velocity)?;
                    let name = controller.name().to_owned();
                    Some(error_series(name, entry, Over::Reversal, Style::nth(index)))
                })
                .collect();
            let caption = format!(
                "Quadrant glitch with PID and with N-PID at {velocity} mm/s, {}",
                knowledge_name(Identified)
            );
            let label = "time from the reversal (s)";
            blocks.push(figure((5, part), caption, label, series, reach));
        }
        blocks
    }

    /// Figures 5.6 to 5.11 with PID, 5.12 to 5.17 with N-PID: reference velocity, and the error with each feedforward.
    pub(super) fn feedforward_figures(&self, controller: LawKind, first: usize) -> Vec<Block> {
        let all = CONTROLLERS.into_iter().flat_map(|controller| {
            ModelKnowledge::ALL.into_iter().flat_map(move |knowledge| {
                VELOCITIES_MM_S.into_iter().filter_map(move |velocity| {
                    self.entry(controller, Without, knowledge, velocity)
                })
            })
        });
        let reach = reach_um(all);
        let mut blocks = Vec::new();
        let panels = ModelKnowledge::ALL
            .into_iter()
            .flat_map(|knowledge| VELOCITIES_MM_S.map(|velocity| (knowledge, velocity)));
        for ((knowledge, velocity), number) in panels.zip(first..) {
            let series = FeedforwardKind::THESIS
                .into_iter()
                .enumerate()
                .filter_map(|(index, feedforward)| {
                    let entry = self.entry(controller, feedforward, knowledge, velocity)?;
                    let name = feedforward.name().to_owned();
                    Some(error_series(name, entry, Over::Seconds, Style::nth(index)))
                })
                .collect();
            let caption = format!(
                "Tracking error with {} and each feedforward at {velocity} mm/s, {}",
                controller.name(),
                knowledge_name(knowledge)
            );
            blocks.push(velocity_figure((number, "a"), velocity));
            blocks.push(figure((number, "b"), caption, "time (s)", series, reach));
        }
        blocks
    }

    /// Figure 5.18: both amplitudes, without and with combined feedforward.
    pub(super) fn amplitude_figure(&self) -> Block {
        let entries: Vec<&Entry> = AMPLITUDES_MM
            .into_iter()
            .flat_map(|amplitude| [Without, Combined].map(|feedforward| (amplitude, feedforward)))
            .filter_map(|(amplitude, feedforward)| {
                let velocity = AMPLITUDE_VELOCITY_MM_S;
                self.at(amplitude, LawKind::NPid, feedforward, Identified, velocity)
            })
            .collect();
        let reach = reach_um(entries.iter().copied());
        let series = entries
            .into_iter()
            .enumerate()
            .map(|(index, entry)| {
                let feedforward = entry.configuration.feedforward.name();
                let name = format!("{} mm, {feedforward}", entry.amplitude_mm);
                error_series(name, entry, Over::Cycles, Style::nth(index))
            })
            .collect();
        let caption = format!(
            "Tracking error with N-PID at both amplitudes and {AMPLITUDE_VELOCITY_MM_S} mm/s, without feedforward and with \
             static and GMS feedforward, {}",
            knowledge_name(Identified)
        );
        figure((18, ""), caption, "time (cycles)", series, reach)
    }
}
