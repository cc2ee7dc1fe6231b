//! Chapter 3 of the thesis on our stage: from experiments to a plant model with friction.

use quadrant_pages::identify::friction::{friction_section, presliding_section};
use quadrant_pages::identify::linear::{plant_tables, response_section};
use quadrant_pages::identify::motor_constant::motor_constant_section;
use quadrant_pages::identify::revise::revise_sections;
use quadrant_pages::parts::{lines, series};
use quadrant_report::{Block, Colour, Figure, Section, Style};
use quadrant_settings::StageSettings;
use quadrant_sim::plant::StageParameters;
use quadrant_tune::commission::{CommissionSettings, Commissioned, CrossCheck, commission};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::SimulatedTestAxis;

use super::Context;
use super::numbers::{Number, number};
use crate::study::Advance;

/// The thesis' numbers. Of 3.16 to 3.21 it lists two for each kind of friction.
const NUMBERS: [Number; 19] = [
    ("response-gain", "Figure 3.5a"),
    ("response-phase", "Figure 3.5b"),
    ("voltage", "Figure 3.7a"),
    ("velocity", "Figure 3.7b"),
    ("constant-velocity", "Figure 3.8"),
    ("friction-map", "Figure 3.9 and 3.10"),
    ("hysteresis-measured", "Figure 3.11"),
    ("virgin-curve", "Figure 3.12"),
    ("hysteresis", "Figure 3.13"),
    ("revised-static-gain", "Figure 3.16"),
    ("revised-static-phase", "Figure 3.17"),
    ("revised-gms-gain", "Figure 3.18"),
    ("revised-gms-phase", "Figure 3.19"),
    ("revised-both-gain", "Figure 3.20"),
    ("revised-both-phase", "Figure 3.21"),
    ("linear-model", "Table 3.1"),
    ("static-friction", "Table 3.2"),
    ("slip-blocks", "Table 3.3"),
    ("revised-model", "Table 3.4"),
];

/// Velocity of Figure 3.8, mm/s.
const SHOWN_VELOCITY_MM_S: f64 = 2.0;

/// Share of the time after which the commissioning is done and the cross-checks begin.
const COMMISSIONED: f64 = 0.7;

/// Commissions the x axis from nothing known, and cross-checks the result.
pub(super) fn sections(context: &Context, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
    let [truth, ..] = StageParameters::real().axes;
    let mut rig = SimulatedTestAxis::new(0, truth, context.seed);
    let found = commission(
        &mut rig,
        &StageSettings::simulated().axes[0],
        &CommissionSettings::thesis(),
        &mut |_, _| {},
    )?;
    advance(COMMISSIONED);
    let checked = CrossCheck::run(&mut rig, &found.settings, context.seed, &mut |_, _| {})?;
    Ok(chapter3_sections(&found, &checked))
}

/// Tables 3.1 to 3.4 and Figures 3.5 to 3.21, from a commissioning and its cross-checks.
fn chapter3_sections(found: &Commissioned, checked: &CrossCheck) -> Vec<Section> {
    let (map, friction, runs) = &found.friction;
    let (gms, slow_sine) = &found.presliding;
    let plant = &found.plant.plant;

    let mut response = response_section(&found.response, Some(&found.plant));
    response
        .blocks
        .extend(plant_tables(&found.plant).map(Block::Table));
    let mut constant_velocity = friction_section(map, friction);
    if let Some(run) = nearest(runs, SHOWN_VELOCITY_MM_S) {
        let figure = Block::Figure(constant_velocity_figure(run));
        constant_velocity.blocks.insert(0, figure);
    }
    let presliding = gms.as_ref().ok().map(|gms| {
        let mut section = presliding_section(gms, friction.mean_levels_v().1);
        let figure = Block::Figure(hysteresis_figure(slow_sine));
        section.blocks.insert(1, figure);
        section
    });
    let mut sections = vec![
        response,
        motor_constant_section(&found.motor, None),
        constant_velocity,
    ];
    sections.extend(presliding);
    sections.extend(revise_sections(
        &checked.at_rest,
        plant,
        &checked.revisions,
        &[],
    ));
    number(sections, "chapter-3", &NUMBERS)
}

/// The mean velocity of the reference over the middle fifth of a run, mm/s.
fn velocity_mm_s(run: &Recording) -> f64 {
    let (from, to) = (2 * run.len() / 5, 3 * run.len() / 5);
    let distance = |reference: &[f64]| Some(reference.get(to)? - reference.get(from)?);
    distance(&run.reference_mm).map_or(f64::NAN, |mm| mm / ((to - from) as f64 * run.sample_time_s))
}

/// The run whose velocity is nearest.
fn nearest(runs: &[Recording], requested_mm_s: f64) -> Option<&Recording> {
    let distance = |run: &Recording| (velocity_mm_s(run) / requested_mm_s).ln().abs();
    runs.iter()
        .filter(|run| velocity_mm_s(run) > 0.0)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

fn constant_velocity_figure(run: &Recording) -> Figure {
    let time = (0..run.len()).map(|index| index as f64 * run.sample_time_s);
    lines(
        "constant-velocity",
        &format!(
            "Voltage of the run at {:.2} mm/s, on the way there and back to rest",
            velocity_mm_s(run)
        ),
        ("time (s)", "voltage (V)"),
        vec![series(
            "voltage",
            time.collect(),
            run.voltage_v.clone(),
            Style::solid(Colour::Blue),
        )],
    )
}

fn hysteresis_figure(recording: &Recording) -> Figure {
    lines(
        "hysteresis-measured",
        "Voltage against position during the slow sine, where the voltage is the friction",
        ("position (um)", "voltage (V)"),
        vec![series(
            "measured",
            recording.position_mm.iter().map(|mm| 1e3 * mm).collect(),
            recording.voltage_v.clone(),
            Style::solid(Colour::Ink),
        )],
    )
}
