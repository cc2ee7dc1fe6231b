//! "A well-tuned PID is as good": the answer, in tables and figures.

use quadrant_pages::parts::{UM_PER_MM, columns, lines, series};
use quadrant_report::{Block, Cell, Column, Figure, Section, Series, Style, Table};
use quadrant_sim::sine_test::SineTestOutcome;

use crate::wrong_model::{Competitor, SHARES, Wrong, WrongOutcome};

/// A reading, in mm.
type Reading = (&'static str, &'static str, fn(&SineTestOutcome) -> f64);

const READINGS: [Reading; 2] = [
    ("largest", "Largest error", |outcome| {
        outcome.score.largest_mm
    }),
    ("rms", "RMS error", |outcome| outcome.score.rms_mm),
];

/// Returns the scores of a competitor in the cases that fit.
fn scores(
    outcomes: &[WrongOutcome],
    competitor: Competitor,
    read: fn(&SineTestOutcome) -> f64,
    fits: impl Fn(Wrong) -> bool,
) -> Vec<f64> {
    outcomes
        .iter()
        .filter(|outcome| outcome.competitor == competitor && fits(outcome.wrong))
        .map(|outcome| read(&outcome.mean) * UM_PER_MM)
        .collect()
}

/// Every parameter off by a share: mean and worst over the draws.
fn shares_table(outcomes: &[WrongOutcome], (id, name, read): Reading) -> Table {
    let mut heads = columns(&[("Feedback", ""), ("No feedforward", "um")]);
    for share in SHARES {
        let percent = 100.0 * share;
        heads.push(Column::with_unit(format!("off by {percent:.0} %"), "um"));
        if share > 0.0 {
            heads.push(Column::with_unit(format!("worst of {percent:.0} %"), "um"));
        }
    }
    let rows = Competitor::ALL.map(|competitor| {
        let of = |fits: &dyn Fn(Wrong) -> bool| scores(outcomes, competitor, read, fits);
        let alone = of(&|wrong| wrong == Wrong::NoFeedforward);
        let mut row = vec![
            Cell::text(competitor.name()),
            alone
                .first()
                .map_or(Cell::Missing, |um| Cell::number(*um, 2)),
        ];
        for share in SHARES {
            let drawn =
                of(&|wrong| matches!(wrong, Wrong::Everything { share: s, .. } if s == share));
            let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
            row.push(Cell::number(mean, 2));
            if share > 0.0 {
                row.push(Cell::number(drawn.into_iter().fold(0.0, f64::max), 2));
            }
        }
        row
    });
    Table {
        id: format!("wrong-model-{id}"),
        caption: format!(
            "{name} with combined feedforward whose every parameter (levels, Stribeck velocity, viscous friction, stiffnesses, weights, \
             attraction, inertia, preview) is off by a share, up or down at random: mean and worst of eight draws. Sines of 15 mm at 5, \
             10 and 15 mm/s, mean of the three; simulated, identified model"
        ),
        columns: heads,
        rows: rows.into(),
    }
}

/// The factor of a wrong model that is a number on an axis.
fn force(wrong: Wrong) -> Option<f64> {
    match wrong {
        Wrong::NoFeedforward => Some(0.0),
        Wrong::Force(factor) => Some(factor),
        _ => None,
    }
}

fn range(wrong: Wrong) -> Option<f64> {
    match wrong {
        Wrong::Range(factor) => Some(factor),
        _ => None,
    }
}

fn curve(
    outcomes: &[WrongOutcome],
    competitor: Competitor,
    place: fn(Wrong) -> Option<f64>,
    read: fn(&SineTestOutcome) -> f64,
) -> (Vec<f64>, Vec<f64>) {
    outcomes
        .iter()
        .filter(|outcome| outcome.competitor == competitor)
        .filter_map(|outcome| Some((place(outcome.wrong)?, read(&outcome.mean) * UM_PER_MM)))
        .unzip()
}

fn figure(
    outcomes: &[WrongOutcome],
    (kind, label, what): (&str, &str, &str),
    place: fn(Wrong) -> Option<f64>,
    (id, name, read): Reading,
) -> Figure {
    let mut curves: Vec<Series> = Vec::new();
    for (index, competitor) in Competitor::ALL.into_iter().enumerate() {
        let (x, y) = curve(outcomes, competitor, place, read);
        let style = Style::solid(Style::nth(index).colour);
        let alone = scores(outcomes, competitor, read, |wrong| {
            wrong == Wrong::NoFeedforward
        });
        let ends = [x.first(), x.last()].map(|end| end.copied().unwrap_or(0.0));
        curves.push(series(competitor.name(), x, y, style));
        let level = alone.first().copied().unwrap_or(f64::NAN);
        curves.push(series(
            &format!("{}, no feedforward", competitor.name()),
            ends.to_vec(),
            vec![level; 2],
            Style::dashed(style.colour),
        ));
    }
    let quantity = name.replacen('L', "l", 1);
    lines(
        &format!("wrong-{kind}-{id}"),
        &format!("{name} over {what}; dashed, without feedforward"),
        (label, &format!("{quantity} (um)")),
        curves,
    )
}

/// The factors on the force between which feedforward is better than none: below one it always is, until it crosses.
fn break_even(
    outcomes: &[WrongOutcome],
    competitor: Competitor,
    read: fn(&SineTestOutcome) -> f64,
) -> Option<f64> {
    let (factors, errors) = curve(outcomes, competitor, force, read);
    let alone = *errors.first()?;
    let pairs = factors
        .iter()
        .zip(&errors)
        .zip(factors.iter().zip(&errors).skip(1));
    pairs
        .filter(|((from, _), _)| **from >= 1.0)
        .find(|((_, below), (_, above))| **below < alone && **above >= alone)
        .map(|((from, below), (to, above))| from + (to - from) * (alone - below) / (above - below))
}

fn break_even_table(outcomes: &[WrongOutcome]) -> Table {
    let rows = Competitor::ALL.map(|competitor| {
        let mut row = vec![Cell::text(competitor.name())];
        for (_, _, read) in READINGS {
            row.push(
                break_even(outcomes, competitor, read)
                    .map_or_else(|| Cell::text("beyond 2"), |factor| Cell::number(factor, 2)),
            );
        }
        row
    });
    Table {
        id: "break-even".to_owned(),
        caption: "The factor on the feedforward's force from which it does harm: up to there, no feedforward is worse".to_owned(),
        columns: columns(&[
            ("Feedback", ""),
            ("By largest error", ""),
            ("By RMS error", ""),
        ]),
        rows: rows.into(),
    }
}

pub fn wrong_model_section(outcomes: &[WrongOutcome]) -> Section {
    let force_axis = (
        "force",
        "fed-forward force / identified (1)",
        "the force that is fed forward",
    );
    let range_axis = (
        "range",
        "pre-sliding range / identified (1)",
        "the pre-sliding range of the model",
    );
    let [largest, rms] = READINGS;
    Section {
        provenance: None,
        id: "wrong-model".to_owned(),
        heading: "\u{201c}A well-tuned PID is as good\u{201d}".to_owned(),
        prose: vec![
            "The usual objection to friction feedforward. All competitors keep the same bounds on sensitivity: the PID, whose share of \
             integral action was tuned; the N-PID on it, which keeps the bounds at small errors and the slope of k(e) e within three \
             quarters of the Popov bound beyond; and a cautious N-PID, half as stiff at small errors, that keeps the bounds at every gain of its sector. \
             Then the feedforward's model is made wrong on purpose."
                .to_owned(),
        ],
        blocks: vec![
            Block::Table(shares_table(outcomes, largest)),
            Block::Table(shares_table(outcomes, rms)),
            Block::Table(break_even_table(outcomes)),
            Block::Figure(figure(outcomes, force_axis, force, largest)),
            Block::Figure(figure(outcomes, force_axis, force, rms)),
            Block::Figure(figure(outcomes, range_axis, range, largest)),
        ],
    }
}
