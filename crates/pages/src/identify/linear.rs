//! Tables and figures of the linear model: motor constant, response, parameters.

use std::f64::consts::TAU;

use quadrant_report::{Block, Cell, Colour, Figure, Plot, Scale, Section, Style, Table};
use quadrant_tune::identify::frf::FrfMeasurement;
use quadrant_tune::identify::motor_constant::MotorConstant;
use quadrant_tune::identify::plant::PlantFit;
use quadrant_tune::identify::response::{FrequencyResponse, ResponsePoint};
use quadrant_written::Brief;

use crate::identify::bode::{Curve, bode_figures};
use crate::parts::{columns, lines, series};

/// The motor constant (thesis, Fig 3.7); k_f if the moving mass is known.
pub fn motor_constant_table(motor: &MotorConstant, moving_mass_kg: Option<f64>) -> Table {
    Table {
        id: "motor-constant".to_owned(),
        caption: "Motor constant from voltage steps in open loop; ± is one standard deviation over the passes. A screw's ripple \
                  makes it a few percent low: the linear model's A is the accurate one"
            .to_owned(),
        columns: columns(&[
            ("Level", "V"),
            ("A", "mm/(V s²)"),
            ("± A", "mm/(V s²)"),
            ("k_f", "N/V"),
        ]),
        rows: vec![vec![
            Cell::number(motor.level_v, 3),
            Cell::number(motor.gain_mm_per_v_s2, 0),
            Cell::number(motor.standard_error, 0),
            moving_mass_kg.map_or(Cell::Missing, |mass| {
                Cell::number(motor.force_n_per_v(mass), 3)
            }),
        ]],
    }
}

/// The measured response: its section, under feedback with the plain H1 estimate, which that biases, beside it.
pub fn response_section(measurement: &FrfMeasurement, model: Option<&PlantFit>) -> Section {
    let measured = &measurement.estimate.response;
    let modelled = model.map(|model| modelled(model, measured));
    let mut curves = Vec::new();
    if measurement.closed_loop {
        curves.push(Curve {
            name: "H1 (biased under feedback)".to_owned(),
            response: &measurement.plain.response,
            style: Style::points(Colour::Grey),
        });
    }
    curves.push(Curve {
        name: "measured".to_owned(),
        response: measured,
        style: Style::points(Colour::Ink),
    });
    if let Some(response) = &modelled {
        curves.push(Curve {
            name: "fitted model".to_owned(),
            response,
            style: Style::solid(Colour::Blue),
        });
    }
    let mut blocks: Vec<Block> =
        bode_figures("response", "Response, position over voltage", &curves).into();
    blocks.push(Block::Figure(quality_figure(measured)));
    let estimator = if measurement.closed_loop {
        "The instrument of the estimate is the injected excitation, which noise under feedback does not bias"
    } else {
        "The loop was open: the estimate is H1, of position over voltage"
    };
    Section {
        provenance: None,
        id: "response".to_owned(),
        heading: "Frequency response".to_owned(),
        prose: vec![format!(
            "{} blocks averaged, resolution {} Hz. {estimator}; the hold of the converter is divided out.",
            measurement.estimate.blocks,
            Brief(measurement.estimate.resolution_hz)
        )],
        blocks,
    }
}

/// A saved response and the model fitted to it.
pub fn fitted_response_section(response: &FrequencyResponse, model: &PlantFit) -> Section {
    let modelled = modelled(model, response);
    let curves = [
        Curve {
            name: "measured".to_owned(),
            response,
            style: Style::points(Colour::Ink),
        },
        Curve {
            name: "fitted model".to_owned(),
            response: &modelled,
            style: Style::solid(Colour::Blue),
        },
    ];
    let mut blocks: Vec<Block> =
        bode_figures("response", "Response, position over voltage", &curves).into();
    blocks.push(Block::Figure(quality_figure(response)));
    Section {
        provenance: None,
        id: "response".to_owned(),
        heading: "Frequency response".to_owned(),
        prose: Vec::new(),
        blocks,
    }
}

fn quality_figure(response: &FrequencyResponse) -> Figure {
    let frequencies = || {
        response
            .points
            .iter()
            .map(|p| p.frequency_hz)
            .collect::<Vec<_>>()
    };
    let coherence = response.points.iter().map(|p| p.coherence).collect();
    let deviation = response
        .points
        .iter()
        .map(|p| p.relative_deviation)
        .collect();
    let mut figure = lines(
        "coherence",
        "Coherence, and standard deviation of the response over its magnitude",
        ("frequency (Hz)", "coherence, relative deviation"),
        vec![
            series(
                "coherence",
                frequencies(),
                coherence,
                Style::points(Colour::Blue),
            ),
            series(
                "relative deviation",
                frequencies(),
                deviation,
                Style::points(Colour::Vermillion),
            ),
        ],
    );
    if let Plot::Lines(lines) = &mut figure.plot {
        lines.x_scale = Scale::Logarithmic;
        lines.y_scale = Scale::Logarithmic;
    }
    figure
}

/// The response of a model at the lines of a measured one.
fn modelled(model: &PlantFit, measured: &FrequencyResponse) -> FrequencyResponse {
    let points = measured.points.iter().map(|point| ResponsePoint {
        response: model.response(TAU * point.frequency_hz),
        ..*point
    });
    FrequencyResponse {
        points: points.collect(),
    }
}

/// The linear model (thesis, Table 3.1), with standard errors, correlation with A, and fit by band.
pub fn plant_tables(found: &PlantFit) -> [Table; 2] {
    let unit = |name: &str| match name {
        "A" => "mm/(V s²)",
        "B" => "1/s",
        "Td" => "s",
        "C" => "1/s²",
        frequency if frequency.starts_with('f') => "Hz",
        _ => "",
    };
    let rows = found
        .fit
        .names
        .iter()
        .enumerate()
        .map(|(index, name)| {
            let value = found.fit.values[index];
            let decimals = if *name == "Td" { 7 } else { 2 };
            vec![
                Cell::text(*name),
                Cell::text(unit(name)),
                Cell::number(value, decimals),
                Cell::number(found.fit.standard_errors[index], decimals),
                Cell::number(100.0 * found.fit.standard_errors[index] / value, 3),
                Cell::number(found.fit.correlation[(index, 0)], 3),
                Cell::number(found.fit.correlation[(index, 1)], 3),
            ]
        })
        .collect();
    let parameters = Table {
        id: "linear-model".to_owned(),
        caption: format!(
            "Linear model A exp(-s Td) / (s² + B s + C){}, fitted to {} lines; ± is one standard deviation",
            match found.modes.len() {
                0 => "",
                1 => " times a mode (frequency f, damping ratio d; fa, da of the anti-resonance)",
                _ =>
                    " times two modes (frequency f, damping ratio d; fa, da of the anti-resonance)",
            },
            found.lines
        ),
        columns: columns(&[
            ("Parameter", ""),
            ("Unit", ""),
            ("Value", ""),
            ("±", ""),
            ("±", "%"),
            ("Correlation with A", ""),
            ("Correlation with B", ""),
        ]),
        rows,
    };
    let bands = Table {
        id: "linear-model-fit".to_owned(),
        caption: "Distance of the model from the measured response, RMS by band".to_owned(),
        columns: columns(&[
            ("From", "Hz"),
            ("To", "Hz"),
            ("Gain", "dB"),
            ("Phase", "deg"),
        ]),
        rows: found
            .bands
            .iter()
            .map(|band| {
                vec![
                    Cell::number(band.band_hz.0, 1),
                    Cell::number(band.band_hz.1, 1),
                    Cell::number(band.gain_db, 3),
                    Cell::number(band.phase_deg, 2),
                ]
            })
            .collect(),
    };
    [parameters, bands]
}
