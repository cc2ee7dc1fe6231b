//! The table and page of a replayed record.

use quadrant_report::{
    Block, Cell, Colour, Column, Figure, Lines, Page, Plot, Provenance, Section, Style, Table,
};
use quadrant_sim::metrics::change_percent;

use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::ModelKnowledge;
use crate::parts::{UM_PER_MM, error_curve};
use crate::replay::recorded::{RecordedAxis, RecordedOutcome, SETTLING_S};

impl RecordedOutcome {
    fn name(&self) -> String {
        self.configuration
            .map_or_else(|| "recorded machine".to_owned(), |ours| ours.name())
    }

    /// Returns the source of the numbers, in words.
    fn source(&self) -> &'static str {
        if self.configuration.is_some() {
            "simulated"
        } else {
            "measured"
        }
    }
}

/// Tracking errors of our configurations beside the recorded machine's own.
pub fn recorded_table(outcomes: &[RecordedOutcome], title: &str) -> Table {
    let find = |configuration| {
        outcomes
            .iter()
            .find(|outcome| outcome.configuration == configuration)
    };
    let recorded = find(None);
    let baseline = recorded.or_else(|| find(Some(Configuration::BEST_PID)));
    let against = match recorded {
        Some(_) => "the recorded machine's own",
        None => "that of the best PID",
    };
    Table {
        id: "recorded-reference".to_owned(),
        caption: format!(
            "Tracking error over the recorded reference on {title}, from {SETTLING_S} s after its start; change against {against}"
        ),
        columns: vec![
            Column::new("Controller"),
            Column::new("Source"),
            Column::with_unit("Largest", "um"),
            Column::with_unit("RMS", "um"),
            Column::with_unit("Change of RMS", "%"),
        ],
        rows: outcomes
            .iter()
            .map(|outcome| {
                let change = baseline
                    .filter(|baseline| baseline.configuration != outcome.configuration)
                    .map(|from| change_percent(from.rms_mm, outcome.rms_mm));
                vec![
                    Cell::text(outcome.name()),
                    Cell::text(outcome.source()),
                    Cell::number(outcome.largest_mm * UM_PER_MM, 3),
                    Cell::number(outcome.rms_mm * UM_PER_MM, 3),
                    change.map_or(Cell::Missing, |percent| Cell::number(percent, 2)),
                ]
            })
            .collect(),
    }
}

/// The page of a replayed record.
pub fn recorded_page(
    outcomes: &[RecordedOutcome],
    axis: RecordedAxis,
    title: &str,
    knowledge: ModelKnowledge,
    provenance: Provenance,
) -> Page {
    let known = match (axis, knowledge) {
        (RecordedAxis::Emps, _) | (_, ModelKnowledge::Exact) => {
            "The law knows the friction of the axis exactly, so these errors are what the method can reach on this reference, not \
             what the machine would show."
        }
        (_, ModelKnowledge::Identified) => {
            "The law knows no more of the friction than commissioning the simulated axis found."
        }
    };
    let curves = |ours: bool| {
        outcomes
            .iter()
            .enumerate()
            .filter(move |(_, outcome)| outcome.configuration.is_some() == ours)
            .map(|(index, outcome)| {
                let style = if ours {
                    Style::nth(index)
                } else {
                    Style::solid(Colour::Ink)
                };
                error_curve(outcome.name(), &outcome.error_mm, outcome.period_s, style)
            })
            .collect::<Vec<_>>()
    };
    let figure = |id: &str, caption: &str, series| {
        Block::Figure(Figure {
            id: id.to_owned(),
            caption: caption.to_owned(),
            plot: Plot::Lines(Lines {
                x_label: "time (s)".to_owned(),
                y_label: "tracking error (um)".to_owned(),
                series,
                ..Lines::default()
            }),
        })
    };
    let mut blocks = vec![
        Block::Table(recorded_table(outcomes, title)),
        figure(
            "our-errors",
            "Tracking error of our configurations, simulated",
            curves(true),
        ),
    ];
    let measured = curves(false);
    if !measured.is_empty() {
        blocks.push(figure(
            "measured-error",
            "Tracking error of the recorded machine, measured",
            measured,
        ));
    }
    Page {
        title: "Our controllers over a recorded reference".to_owned(),
        subtitle: format!(
            "{title}, simulated; the recorded machine's own error, measured, beside it"
        ),
        provenance,
        sections: vec![Section {
            provenance: None,
            id: "result".to_owned(),
            heading: "Tracking error".to_owned(),
            prose: vec![format!(
                "{known} Errors are drawn from the end of the settling time."
            )],
            blocks,
        }],
    }
}
