//! The open-loop test of the motor constant (thesis, Fig 3.7).

use quadrant_report::{Block, Colour, Figure, Section, Style};
use quadrant_tune::identify::motor_constant::MotorConstant;

use crate::identify::linear::motor_constant_table;
use crate::parts::{lines, series};

/// Time over which the drawn velocity is taken, s.
const VELOCITY_S: f64 = 2e-3;

/// Returns the section of the test: its result, voltage and velocity over time.
pub fn motor_constant_section(found: &MotorConstant, moving_mass_kg: Option<f64>) -> Section {
    let recording = &found.recording;
    let time = |index: usize| index as f64 * recording.sample_time_s;
    let span = ((VELOCITY_S / recording.sample_time_s) as usize).max(1);
    let velocity: Vec<f64> = recording
        .position_mm
        .windows(span + 1)
        .map(|window| (window[span] - window[0]) / (span as f64 * recording.sample_time_s))
        .collect();
    // Each difference belongs to the middle of its span.
    let middle = (0..velocity.len()).map(|index| time(index) + 0.5 * time(span));
    let figure = |id: &str, caption: &str, label: &str, x: Vec<f64>, y: Vec<f64>| -> Figure {
        let curve = series(label, x, y, Style::solid(Colour::Blue));
        lines(id, caption, ("time (s)", label), vec![curve])
    };
    let voltage = figure(
        "voltage",
        "Voltage at the amplifier's input",
        "voltage (V)",
        (0..recording.len()).map(time).collect(),
        recording.voltage_v.clone(),
    );
    let caption = format!("Velocity, over {} ms", 1e3 * VELOCITY_S);
    let velocity = figure(
        "velocity",
        &caption,
        "velocity (mm/s)",
        middle.collect(),
        velocity,
    );
    Section {
        provenance: None,
        id: "open-loop-test".to_owned(),
        heading: "Open-loop test".to_owned(),
        prose: vec![
            "The voltage steps between two levels of one sign: the axis slides on, its friction stays the same, and what changes \
             is the acceleration, by A for each volt."
                .to_owned(),
        ],
        blocks: vec![
            Block::Table(motor_constant_table(found, moving_mass_kg)),
            Block::Figure(voltage),
            Block::Figure(velocity),
        ],
    }
}
