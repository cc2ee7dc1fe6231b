//! The page of one axis: what was found beside what is true, everything that was tried, and the commissioning's own page.

use quadrant_cli::output::command_line;
use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_pages::commission::commission_page;
use quadrant_pages::parts::{UM_PER_MM, columns, lines, provenance, series};
use quadrant_report::{Block, Cell, Column, Figure, Page, Section, Series, Style, Table};
use quadrant_sim::sine_test::SineTest;
use quadrant_tune::commission::verify::{LawResult, Verification};

use super::{Judged, Subject};

/// Least and largest velocity of the figure of sliding friction, mm/s.
const VELOCITIES_MM_S: (f64, f64) = (0.05, 100.0);
/// Number of these velocities.
const VELOCITIES: usize = 120;
/// Largest displacement of the figure of the virgin curve, mm.
const LARGEST_MM: f64 = 0.15;
/// Number of displacements.
const DISPLACEMENTS: usize = 150;

/// The page of an axis that was judged.
pub(super) fn page(subject: &Subject, judged: &Judged) -> Page {
    let Judged { line, found, tried } = judged;
    let mut blocks = vec![Block::Table(parameters(subject, judged))];
    if found.is_some() {
        blocks.extend([sliding(subject, judged), virgin(subject, judged)].map(Block::Figure));
    }
    let experiments = Table {
        id: "experiments".to_owned(),
        caption: "Experiments, in their order".to_owned(),
        columns: columns(&[("Experiment", ""), ("Ended", "s"), ("Stopped", "")]),
        rows: tried
            .iter()
            .map(|tried| {
                let stopped = tried.stopped.clone().map_or(Cell::Missing, Cell::Text);
                vec![
                    Cell::text(&tried.name),
                    Cell::number(tried.ended_s, 1),
                    stopped,
                ]
            })
            .collect(),
    };
    let section = |id: &str, heading: &str, prose: Vec<String>, blocks| Section {
        provenance: None,
        id: id.to_owned(),
        heading: heading.to_owned(),
        prose,
        blocks,
    };
    let mut prose = vec![
        subject.description.clone(),
        format!("Result: {}.", line.outcome),
    ];
    if !line.reason.is_empty() {
        prose.push(line.reason.clone());
    }
    let title = format!("Random axis {}", subject.seed);
    let provenance = provenance(&command_line(), subject.seed);
    let mut sections = vec![section("truth", "Found and true", prose, blocks)];
    if let Some(found) = found {
        if let Some(trials) = &found.verification {
            let trials = vec![Block::Table(trials_table(trials))];
            sections.push(section("trials", "Trials", Vec::new(), trials));
        }
        sections.extend(commission_page(&title, found, None, provenance.clone()).sections);
    }
    let tables = vec![Block::Table(experiments)];
    sections.push(section("tried", "What was tried", Vec::new(), tables));
    Page {
        title,
        subtitle: "Simulated: a commissioning beside the axis that it did not know".to_owned(),
        provenance,
        sections,
    }
}

/// The largest error of each law on each sine.
fn trials_table(trials: &Verification) -> Table {
    let head = |sine: &SineTest| {
        let sine = format!(
            "{:.1} mm at {:.1} mm/s",
            sine.amplitude_mm, sine.velocity_mm_s
        );
        Column::with_unit(sine, "um")
    };
    let row = |law: &LawResult| {
        let errors = (0..trials.sines.len()).map(|index| {
            let score = law.scores.get(index);
            score.map_or(Cell::Missing, |it| {
                Cell::number(UM_PER_MM * it.largest_mm, 2)
            })
        });
        std::iter::once(Cell::text(&law.law))
            .chain(errors)
            .collect()
    };
    Table {
        id: "by-sine".to_owned(),
        caption: "Largest error, by the axis' own encoder".to_owned(),
        columns: std::iter::once(Column::new("Law"))
            .chain(trials.sines.iter().map(head))
            .collect(),
        rows: trials.laws.iter().map(row).collect(),
    }
}

fn parameters(subject: &Subject, judged: &Judged) -> Table {
    let truth = &subject.parameters;
    let found = judged.found.as_ref();
    let plant = found.map(|found| found.plant.plant);
    let friction = &truth.friction;
    let viscous =
        0.5 * (friction.positive.viscous_v_s_per_mm + friction.negative.viscous_v_s_per_mm);
    let mode = found.and_then(|found| found.plant.modes.first());
    let sliding = found.map(|found| &found.settings.friction.sliding);
    let number = |value: Option<f64>, decimals| {
        value.map_or(Cell::Missing, |value| Cell::number(value, decimals))
    };
    let row = |name: &str, unit: &str, truth: Option<f64>, found: Option<f64>, decimals| {
        vec![
            Cell::text(name),
            Cell::text(unit),
            number(truth, decimals),
            number(found, decimals),
        ]
    };
    let rigid = |value: fn(&quadrant_law::control::plant_model::PlantModel) -> f64| {
        plant.as_ref().map(value)
    };
    let mut rows = vec![
        row(
            "A",
            "mm/(V s^2)",
            Some(truth.gain_mm_per_v_s2),
            rigid(|plant| plant.gain_mm_per_v_s2),
            0,
        ),
        row(
            "B with viscous friction",
            "1/s",
            Some(truth.damping_per_s + truth.gain_mm_per_v_s2 * viscous),
            rigid(|plant| plant.damping_per_s),
            1,
        ),
        row(
            "Td",
            "ms",
            Some(1e3 * truth.delay_s),
            rigid(|plant| 1e3 * plant.delay_s),
            3,
        ),
        row(
            "first mode",
            "Hz",
            subject.resonance_hz,
            mode.map(|mode| mode.frequency_hz),
            1,
        ),
    ];
    type Level = fn(&StaticFriction) -> f64;
    let levels: [(&str, &str, Level); 4] = [
        ("Coulomb level", "V", |it| it.curve.coulomb_v),
        ("breakaway level", "V", |it| it.curve.breakaway_v),
        ("Stribeck velocity", "mm/s", |it| {
            it.curve.stribeck_velocity_mm_s
        }),
        ("viscous friction", "V s/mm", |it| it.viscous_v_s_per_mm),
    ];
    for (name, unit, level) in levels {
        for (sense, truth, found) in [
            (
                "forwards",
                &friction.positive,
                sliding.map(|it| &it.positive),
            ),
            (
                "backwards",
                &friction.negative,
                sliding.map(|it| &it.negative),
            ),
        ] {
            let name = format!("{name}, {sense}");
            rows.push(row(&name, unit, Some(level(truth)), found.map(level), 4));
        }
    }
    Table {
        id: "parameters".to_owned(),
        caption: "Parameters, true and found".to_owned(),
        columns: columns(&[("Quantity", ""), ("Unit", ""), ("True", ""), ("Found", "")]),
        rows,
    }
}

/// A curve of the axis and one of the settings.
fn beside(x: &[f64], truth: impl Fn(f64) -> f64, found: impl Fn(f64) -> f64) -> Vec<Series> {
    let curve = |name: &str, y: &dyn Fn(f64) -> f64, style| {
        series(name, x.to_vec(), x.iter().map(|x| y(*x)).collect(), style)
    };
    vec![
        curve("true", &truth, Style::nth(0)),
        curve("found", &found, Style::nth(1)),
    ]
}

/// Friction while sliding, forwards, over the logarithm of the velocity.
fn sliding(subject: &Subject, judged: &Judged) -> Figure {
    let (slowest, fastest) = VELOCITIES_MM_S;
    let decades = (fastest / slowest).log10();
    let logarithms: Vec<f64> = (0..VELOCITIES)
        .map(|index| slowest.log10() + decades * index as f64 / (VELOCITIES - 1) as f64)
        .collect();
    let truth = subject.parameters.friction.positive;
    let found = judged
        .found
        .as_ref()
        .map(|found| found.settings.friction.sliding.positive);
    let volts = |friction: Option<StaticFriction>, logarithm: f64| {
        friction.map_or(f64::NAN, |it| it.friction_v(10.0_f64.powf(logarithm)))
    };
    lines(
        "true-sliding",
        "Friction while sliding forwards",
        ("log10 of the velocity in mm/s", "friction (V)"),
        beside(
            &logarithms,
            |at| volts(Some(truth), at),
            |at| volts(found, at),
        ),
    )
}

/// The virgin curves of the GMS elements; those of an axis with another model are of the same range and level.
fn virgin(subject: &Subject, judged: &Judged) -> Figure {
    let displacements: Vec<f64> = (0..DISPLACEMENTS)
        .map(|index| LARGEST_MM * index as f64 / (DISPLACEMENTS - 1) as f64)
        .collect();
    let truth = &subject.parameters;
    let level_v = truth.friction.positive.curve.breakaway_v;
    let found = judged.found.as_ref().map(|found| &found.settings.friction);
    lines(
        "true-virgin",
        "Virgin curve, at the level of breakaway forwards",
        ("displacement (mm)", "friction (V)"),
        beside(
            &displacements,
            |at| truth.gms.virgin_curve_v(at, level_v),
            |at| {
                found.map_or(f64::NAN, |found| {
                    let level_v = found.sliding.positive.curve.breakaway_v;
                    found.gms.virgin_curve_v(at, level_v)
                })
            },
        ),
    )
}
