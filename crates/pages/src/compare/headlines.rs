//! The thesis' headline figures, for comparison. They are printed results of its measurements on its own stage
//! (front matter); ours are simulated on ours.

use quadrant_report::{Cell, Column, Table};
use quadrant_sim::metrics::Metric;

use crate::compare::comparison::Comparison;
use crate::compare::sine::VELOCITIES_MM_S;
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::ModelKnowledge;
use crate::parts::statistic_cells;

/// One headline: what is compared, and its figure.
#[derive(Clone, Copy, Debug)]
struct Headline {
    /// Its name in the table.
    comparison: &'static str,
    /// The metrics: tracking error as largest magnitude and as RMS, because the thesis does not say which it means; or the
    /// glitch.
    metrics: &'static [Metric],
    /// Change, %.
    change_percent: f64,
    /// Configuration that the change is counted from.
    from: Configuration,
    /// Configuration that has changed.
    to: Configuration,
}

/// The headlines, in the order of the abstract.
const HEADLINES: [Headline; 7] = {
    use quadrant_law::control::feedback::LawKind::{self, NPid, Pid};
    use quadrant_law::feedforward::FeedforwardKind as F;
    const fn c(controller: LawKind, feedforward: F) -> Configuration {
        Configuration {
            controller,
            feedforward,
            ..Configuration::PID
        }
    }
    const fn headline(
        comparison: &'static str,
        metrics: &'static [Metric],
        change_percent: f64,
        from: Configuration,
        to: Configuration,
    ) -> Headline {
        Headline {
            comparison,
            metrics,
            change_percent,
            from,
            to,
        }
    }
    [
        headline(
            "N-PID against PID",
            &[Metric::GLITCH],
            -25.0,
            c(Pid, F::None),
            c(NPid, F::None),
        ),
        headline(
            "static feedforward, PID",
            &Metric::TRACKING,
            -95.9,
            c(Pid, F::None),
            c(Pid, F::Static),
        ),
        headline(
            "static feedforward, N-PID",
            &Metric::TRACKING,
            -95.8,
            c(NPid, F::None),
            c(NPid, F::Static),
        ),
        headline(
            "GMS feedforward, PID",
            &[Metric::GLITCH],
            -33.3,
            c(Pid, F::None),
            c(Pid, F::Gms),
        ),
        headline(
            "GMS feedforward, N-PID",
            &[Metric::GLITCH],
            -30.0,
            c(NPid, F::None),
            c(NPid, F::Gms),
        ),
        headline(
            "static + GMS + N-PID against PID",
            &Metric::TRACKING,
            -96.5,
            c(Pid, F::None),
            c(NPid, F::Combined),
        ),
        headline(
            "static + GMS + N-PID against PID",
            &[Metric::GLITCH],
            -50.0,
            c(Pid, F::None),
            c(NPid, F::Combined),
        ),
    ]
};

/// Name of the full law's changes against the best PID.
const AGAINST_BEST_PID: &str = "static + GMS + N-PID against the best PID";

/// The thesis' headline changes beside ours, sine of the first amplitude, mean over the velocities; below them that of the full
/// law against the best PID, which the thesis does not have.
pub fn headline_table(comparison: &Comparison) -> Table {
    let row = |name: &str, thesis: Cell, headline: &Headline| {
        let cells = |knowledge, metric| {
            let pair = [headline.from, headline.to];
            let changes = comparison.changes_percent(knowledge, metric, pair, &VELOCITIES_MM_S);
            statistic_cells(changes, 1.0, 1)
        };
        let measured = if headline.metrics.len() == 1 {
            "quadrant glitch"
        } else {
            "tracking error"
        };
        let mut row = vec![Cell::text(name), Cell::text(measured), thesis];
        for &metric in headline.metrics {
            let [exact, _] = cells(ModelKnowledge::Exact, metric);
            row.push(exact);
            row.extend(cells(ModelKnowledge::Identified, metric));
        }
        row.resize(9, Cell::Missing);
        row
    };
    let mut rows: Vec<_> = HEADLINES
        .iter()
        .map(|headline| {
            let thesis = Cell::number(headline.change_percent, 1);
            row(headline.comparison, thesis, headline)
        })
        .collect();
    let full = HEADLINES
        .iter()
        .filter(|headline| headline.to == Configuration::BEST);
    rows.extend(full.map(|headline| {
        let against_best = Headline {
            from: Configuration::BEST_PID,
            ..*headline
        };
        row(AGAINST_BEST_PID, Cell::Missing, &against_best)
    }));
    Table {
        id: "headlines".to_owned(),
        caption: "The thesis' headline changes beside ours; tracking error as largest magnitude, and again as RMS"
            .to_owned(),
        columns: vec![
            Column::new("Comparison"),
            Column::new("Metric"),
            Column::with_unit("Thesis", "%"),
            Column::with_unit("Friction known", "%"),
            Column::with_unit("Friction identified", "%"),
            Column::with_unit("±", "%"),
            Column::with_unit("RMS, friction known", "%"),
            Column::with_unit("RMS, friction identified", "%"),
            Column::with_unit("±", "%"),
        ],
        rows,
    }
}

/// Said with the table wherever it is shown.
pub const HEADLINE_PROSE: &str = "The thesis measured its own stage; ours are simulated on ours, sine of 30 mm, mean over the three velocities. \
     Friction known: the feedforward has the plant's own friction, and the plant no noise, offset or ripple. Friction identified: the \
     plant has all of them, and the law knows what commissioning found; ± is one standard deviation over the seeds of the \
     noise. The controllers are the same in both. Neither plant nor gains were tuned to meet the figures.";
