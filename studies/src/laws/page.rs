//! The feedback laws side by side: how they were tuned, and what they did.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_pages::parts::{UM_PER_MM, columns, dot, lines, series, statistic_cells};
use quadrant_report::{
    Block, Cell, Colour, DotSeries, Dots, Figure, Plot, Scale, Section, Spread, Style, Table,
};
use quadrant_sim::sine_test::SineTestOutcome;

use crate::laws::comparison::LawOutcome;
use crate::laws::tuning::{COMPLEMENTARY_PEAK, SENSITIVITY_PEAK, TunedLaw};

/// Returns the table of each law's tuning.
pub fn tuning_table(laws: &[TunedLaw]) -> Table {
    let rows = laws.iter().map(|tuned| {
        let best = tuned
            .tried
            .iter()
            .map(|(_, cost)| *cost)
            .fold(f64::INFINITY, f64::min);
        let gains = tuned.feedback.linear_gains();
        let gain = |read: fn(&quadrant_law::control::pid::PidGains) -> f64, decimals| {
            gains
                .first()
                .map_or(Cell::Missing, |gains| Cell::number(read(gains), decimals))
        };
        vec![
            Cell::text(tuned.law.name()),
            Cell::text(tuned.knob),
            if tuned.tried.len() > 1 {
                Cell::number(tuned.value, 3)
            } else {
                Cell::Missing
            },
            Cell::number(tuned.tried.len() as f64, 0),
            gain(|gains| gains.kp_v_per_mm, 3),
            gain(|gains| gains.ki_v_per_mm_s, 1),
            gain(|gains| 1e3 * gains.kd_v_s_per_mm, 3),
            Cell::number(tuned.margins.sensitivity_peak, 3),
            Cell::number(tuned.margins.complementary_peak, 3),
            Cell::number(tuned.margins.gain_margin_db, 1),
            Cell::number(tuned.margins.phase_margin_deg, 1),
            Cell::number(best * UM_PER_MM, 2),
        ]
    });
    Table {
        id: "laws-tuning".to_owned(),
        caption: format!(
            "The laws as tuned for |S| ≤ {SENSITIVITY_PEAK}, |T| ≤ {COMPLEMENTARY_PEAK} on the identified model, closed at the control \
             rate. Gains and margins are those of the PID that each is at small errors (the schedule: at rest); the last column is the \
             RMS error on the twin that it was trained on"
        ),
        columns: columns(&[
            ("Law", ""),
            ("Knob", ""),
            ("Best", ""),
            ("Tried", ""),
            ("Kp", "V/mm"),
            ("Ki", "V/(mm s)"),
            ("Kd", "mV s/mm"),
            ("|S|", ""),
            ("|T|", ""),
            ("Gain margin", "dB"),
            ("Phase margin", "deg"),
            ("Training RMS", "um"),
        ]),
        rows: rows.collect(),
    }
}

/// Returns the table of each law's results.
pub fn laws_table(outcomes: &[LawOutcome]) -> Table {
    let um = UM_PER_MM;
    let rows = outcomes.iter().map(|outcome| {
        let mut row = vec![
            Cell::text(outcome.law.name()),
            Cell::text(outcome.feedforward.name()),
        ];
        row.extend(statistic_cells(
            Some(outcome.statistic(|o| o.score.largest_mm)),
            um,
            2,
        ));
        row.extend(statistic_cells(
            Some(outcome.statistic(|o| o.score.rms_mm)),
            um,
            3,
        ));
        row.extend(statistic_cells(
            Some(outcome.statistic(|o| o.score.glitch_mm)),
            um,
            2,
        ));
        row.extend(statistic_cells(
            Some(outcome.statistic(|o| o.chatter_v)),
            1e3,
            2,
        ));
        row
    });
    Table {
        id: "laws".to_owned(),
        caption: format!(
            "The tuned laws on the simulated axis, identified model: sines of 30 mm at 5, 10 and 15 mm/s, mean over the three; ± is the \
             standard deviation over {} noise seeds. Chatter is the RMS change of the output from tick to tick",
            outcomes.first().map_or(0, |outcome| outcome.outcomes.len())
        ),
        columns: columns(&[
            ("Law", ""),
            ("Feedforward", ""),
            ("Largest error", "um"),
            ("±", "um"),
            ("RMS error", "um"),
            ("±", "um"),
            ("Glitch", "um"),
            ("±", "um"),
            ("Chatter", "mV"),
            ("±", "mV"),
        ]),
        rows: rows.collect(),
    }
}

/// Training error over each law's knob, for the laws whose knob is the integral's share.
fn tuning_figure(laws: &[TunedLaw]) -> Figure {
    let shared = laws
        .first()
        .map(|_| "share of the bounds left to the integral");
    let curves = laws
        .iter()
        .filter(|tuned| Some(tuned.knob) == shared)
        .enumerate()
        .map(|(index, tuned)| {
            let (x, y) = tuned.tried.iter().map(|(x, y)| (*x, y * UM_PER_MM)).unzip();
            series(tuned.law.name(), x, y, Style::nth(index))
        })
        .collect();
    lines(
        "laws-training",
        "RMS error in training over the share of the bounds that is left to integral action",
        ("share (1)", "RMS error (um)"),
        curves,
    )
}

/// RMS errors of the laws, without and with feedforward.
fn laws_figure(outcomes: &[LawOutcome]) -> Figure {
    let laws: Vec<&str> = LawKind::ALL.map(LawKind::name).into();
    let spread = |law: &str, kind| {
        let of = outcomes
            .iter()
            .find(|outcome| outcome.law.name() == law && outcome.feedforward == kind);
        let errors = of.map(|outcome| outcome.statistic(|o| o.score.rms_mm));
        errors.map_or(Spread::exact(f64::NAN), |errors| dot(errors, UM_PER_MM))
    };
    let series = [
        ("no feedforward", FeedforwardKind::None, Colour::Vermillion),
        ("static + GMS", FeedforwardKind::Combined, Colour::Blue),
    ];
    Figure {
        id: "laws-rms".to_owned(),
        caption: "RMS tracking error of the tuned laws, mean over three velocities; bars: one standard deviation over the seeds"
            .to_owned(),
        plot: Plot::Dots(Dots {
            value_label: "RMS error (um)".to_owned(),
            categories: laws.iter().map(|law| (*law).to_owned()).collect(),
            series: series
                .into_iter()
                .map(|(name, kind, colour)| DotSeries {
                    name: name.to_owned(),
                    values: laws.iter().map(|law| spread(law, kind)).collect(),
                    colour,
                })
                .collect(),
            scale: Scale::Logarithmic,
        }),
    }
}

/// All that there is to say of the laws.
pub fn laws_section(laws: &[TunedLaw], outcomes: &[LawOutcome]) -> Section {
    Section {
        provenance: None,
        id: "laws-compared".to_owned(),
        heading: "Feedback laws, fairly tuned".to_owned(),
        prose: vec![
            "Every law keeps the same bounds on sensitivity at small errors, on the same identified model, and uses them up. What the \
             bounds leave free in it was tried over a grid on a twin of the axis that is made of identified parameters alone; the \
             smallest RMS error without feedforward won. Then each ran on the axis itself, whose true parameters no law knew."
                .to_owned(),
            closeness(outcomes),
        ],
        blocks: vec![
            Block::Table(tuning_table(laws)),
            Block::Figure(tuning_figure(laws)),
            Block::Figure(laws_figure(outcomes)),
            Block::Table(laws_table(outcomes)),
        ],
    }
}

/// Describes the distance between the laws, with and without feedforward.
fn closeness(outcomes: &[LawOutcome]) -> String {
    let range = |kind: FeedforwardKind| {
        let of = outcomes
            .iter()
            .filter(|outcome| outcome.feedforward == kind);
        of.map(|outcome| outcome.statistic(|o: &SineTestOutcome| o.score.rms_mm).mean * UM_PER_MM)
            .fold((f64::INFINITY, 0.0f64), |(low, high), rms| {
                (low.min(rms), high.max(rms))
            })
    };
    let (alone, helped) = (
        range(FeedforwardKind::None),
        range(FeedforwardKind::Combined),
    );
    format!(
        "Without feedforward the laws' RMS errors lie between {:.2} and {:.2} um; with combined feedforward, between {:.2} and {:.2} um.",
        alone.0, alone.1, helped.0, helped.1
    )
}
