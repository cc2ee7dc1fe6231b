//! Learning on part programs: reversals of all sizes, on three axes.

use std::fmt::Write as _;

use quadrant_gcode::{Limits, Program, Trajectory};
use quadrant_law::control::feedback::LawKind;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::replay::part_program::{ProgramTables, run_program};
use quadrant_report::{Cell, Column, Table};
use quadrant_settings::StageSettings;
use quadrant_sim::metrics::{largest, rms};
use quadrant_sim::plant::StageParameters;
use rayon::prelude::*;

use super::run::Friction;

/// Times that a program is run through; the last is scored.
const PASSES: usize = 4;

/// Friction over the commissioned one.
const FRICTIONS: [f64; 3] = [1.0, 1.5, 0.7];

/// Moves to and fro by at most 1 mm along both axes: strokes, mm.
const SHORT: [f64; 5] = [1.0, 0.5, 0.2, 0.1, 0.05];

/// A part: a face in lines, pockets of some sizes, a contour with rounded corners, an engraving.
const STROKES: [f64; 4] = [20.0, 8.0, 3.0, 1.0];
const RADII: [f64; 4] = [10.0, 4.0, 1.5, 0.5];

/// A program of short moves, to and fro four times each.
fn short_moves() -> String {
    let mut text = "G21 G90 G17 G94\nF300\n".to_owned();
    for stroke in SHORT {
        for _ in 0..4 {
            let _ = writeln!(text, "G1 X{stroke} Y{}\nG1 X0 Y0", 0.5 * stroke);
        }
    }
    text
}

/// A program with reversals of all sizes.
fn part() -> String {
    let mut text = "G21 G90 G17 G94\nF900\n".to_owned();
    for stroke in STROKES {
        // Lines of a face, to and fro, a step apart.
        for line in 0..4 {
            let across = 0.05 * stroke * f64::from(line);
            let x = if line % 2 == 0 { stroke } else { 0.0 };
            let _ = writeln!(text, "G1 Y{across}\nG1 X{x}");
        }
        text.push_str("G1 X0 Y0\n");
    }
    for radius in RADII {
        let _ = writeln!(
            text,
            "G1 X{radius} Y0\nG3 I-{radius}\nG2 I-{radius}\nG1 X0 Y0"
        );
    }
    text.push_str(&short_moves().replace("G21 G90 G17 G94\n", ""));
    text
}

/// Largest and RMS distance from the path in the last pass, um.
fn score(
    stage: &StageSettings,
    source: &str,
    friction: Friction,
    factor: f64,
    seed: u64,
) -> anyhow::Result<(f64, f64)> {
    let mut stage = stage.clone();
    stage.axes = stage.axes.each_ref().map(|axis| friction.of(axis));
    let program = Program::parse(&source.repeat(PASSES))?;
    let trajectory = Trajectory::plan(&program, &Limits::of(&stage))?;
    let tables = ProgramTables::sample(&trajectory, &stage);
    let mut truth = StageParameters::real();
    truth.axes = truth.axes.map(|axis| axis.with_friction(factor));
    let configuration = Configuration {
        controller: LawKind::Pid,
        feedforward: stage.axes[0].feedforward.kind,
        ..Configuration::PID
    };
    let mut setup = RunConfiguration::identified(stage);
    setup.truth = truth;
    let outcomes = run_program(&trajectory, &tables, &[configuration], &setup, seed, &|| {})?;
    let deviation = outcomes.first().map_or(&[][..], |it| &it.deviation_mm);
    let last: Vec<f64> = deviation[deviation.len() / PASSES * (PASSES - 1)..]
        .iter()
        .map(|deviation| 1e3 * deviation.iter().map(|part| part * part).sum::<f64>().sqrt())
        .collect();
    Ok((largest(&last), rms(&last)))
}

/// The table of part programs.
pub(super) fn table(stage: &StageSettings, seed: u64) -> anyhow::Result<Table> {
    let programs = [("short moves", short_moves()), ("part", part())];
    let cases: Vec<_> = programs
        .iter()
        .flat_map(|program| FRICTIONS.map(|factor| (program, factor)))
        .collect();
    let rows = cases
        .into_par_iter()
        .map(|((name, source), factor)| {
            let mut row = vec![Cell::text(format!("{name}, friction x {factor}"))];
            for friction in Friction::ALL {
                let (largest, rms) = score(stage, source, friction, factor, seed)?;
                row.extend([Cell::number(largest, 1), Cell::number(rms, 2)]);
            }
            Ok(row)
        })
        .collect::<anyhow::Result<_>>()?;
    let um = |heading| Column::with_unit(heading, "um");
    Ok(Table {
        id: "parts".to_owned(),
        caption: "Simulated. Distance from the path of three axes under PID, the last of four times through a program"
            .to_owned(),
        columns: vec![
            Column::new("program"),
            um("largest, without"),
            um("RMS, without"),
            um("largest, fixed"),
            um("RMS, fixed"),
            um("largest, learning"),
            um("RMS, learning"),
        ],
        rows,
    })
}
