//! Tables and figures of an identified friction: friction-velocity map, virgin curve, hysteresis.

use quadrant_law::friction::stribeck::StaticFriction;
use quadrant_report::{Block, Cell, Colour, Section, Style, Table};
use quadrant_tune::identify::static_friction::{DirectionFit, FrictionFit, FrictionMap};
use quadrant_tune::identify::virgin_curve::GmsFit;

use crate::parts::{columns, lines, series};

/// The static friction model (thesis, Table 3.2).
pub fn friction_table(found: &FrictionFit) -> Table {
    let row = |name: &str, direction: &DirectionFit| {
        let StaticFriction {
            curve,
            viscous_v_s_per_mm,
        } = direction.model;
        let errors = &direction.fit.standard_errors;
        vec![
            Cell::text(name),
            Cell::number(curve.coulomb_v, 5),
            Cell::number(errors[0], 5),
            Cell::number(curve.breakaway_v, 5),
            Cell::number(direction.breakaway_error_v, 5),
            Cell::number(curve.stribeck_velocity_mm_s, 3),
            Cell::number(errors[2], 3),
            Cell::number(1e3 * viscous_v_s_per_mm, 4),
            Cell::number(1e3 * errors[3], 4),
            Cell::number(curve.exponent, 2),
        ]
    };
    Table {
        id: "static-friction".to_owned(),
        caption: format!(
            "Static friction, as seen at the amplifier's input; sigma contains B / A. Half the difference of the directions: {:.5} V. \
             Runs that stuck and slipped, and do not count: {}",
            found.offset_v, found.stick_slip_runs
        ),
        columns: columns(&[
            ("Direction", ""),
            ("Fc", "V"),
            ("± Fc", "V"),
            ("Fs", "V"),
            ("± Fs", "V"),
            ("Vs", "mm/s"),
            ("± Vs", "mm/s"),
            ("sigma", "mV s/mm"),
            ("± sigma", "mV s/mm"),
            ("delta", ""),
        ]),
        rows: vec![
            row("positive", &found.directions.positive),
            row("negative", &found.directions.negative),
        ],
    }
}

/// The friction-velocity map and its fit (thesis, Figs 3.9, 3.10).
pub fn friction_section(map: &FrictionMap, found: &FrictionFit) -> Section {
    let runs = |stick_slip: bool| {
        let runs = || {
            map.runs
                .iter()
                .filter(move |run| run.stick_slip == stick_slip)
        };
        (
            runs().map(|run| run.velocity_mm_s).collect::<Vec<_>>(),
            runs().map(|run| run.voltage_v).collect::<Vec<_>>(),
        )
    };
    let fastest = map
        .runs
        .iter()
        .map(|run| run.velocity_mm_s.abs())
        .fold(0.1, f64::max);
    let models = found.models();
    let curve: Vec<(f64, f64)> = (-400..=400)
        .map(|step| {
            let share = f64::from(step) / 400.0;
            let velocity = fastest * share * share.abs();
            let model = if velocity < 0.0 {
                models.negative
            } else {
                models.positive
            };
            (velocity, model.friction_v(velocity))
        })
        .collect();
    let (x, y) = curve
        .into_iter()
        .filter(|(velocity, _)| *velocity != 0.0)
        .unzip();
    let (even_x, even_y) = runs(false);
    let (stuck_x, stuck_y) = runs(true);
    let mut drawn = vec![
        series("fitted model", x, y, Style::solid(Colour::Blue)),
        series("runs", even_x, even_y, Style::points(Colour::Ink)),
    ];
    if !stuck_x.is_empty() {
        drawn.push(series(
            "stick-slip, not counted",
            stuck_x,
            stuck_y,
            Style::points(Colour::Vermillion),
        ));
    }
    Section {
        provenance: None,
        id: "friction".to_owned(),
        heading: "Friction at constant velocity".to_owned(),
        prose: vec![
            "At constant velocity the voltage is the friction. The slope at high velocity is σ + B / A, which motion cannot separate \
             apart, and each direction's level contains the amplifier's offset."
                .to_owned(),
        ],
        blocks: vec![
            Block::Table(friction_table(found)),
            Block::Figure(lines(
                "friction-map",
                "Voltage against velocity, runs and fitted model",
                ("velocity (mm/s)", "voltage (V)"),
                drawn,
            )),
        ],
    }
}

/// The slip-blocks (thesis, Table 3.3).
pub fn gms_table(found: &GmsFit) -> Table {
    Table {
        id: "slip-blocks".to_owned(),
        caption: format!(
            "Slip-blocks of the GMS model. C = {:.2} V/s ({}). The predicted hysteresis is off by {:.2} % of the breakaway level, RMS",
            found.gms.attraction_v_s,
            if found.attraction_determined {
                "the value that predicts the record best"
            } else {
                "assumed: the record does not determine it"
            },
            100.0 * found.prediction.relative_error
        ),
        columns: columns(&[("Block", ""), ("Knot", "um"), ("k", "V/mm"), ("alpha", "")]),
        rows: found
            .gms
            .elements
            .iter()
            .zip(&found.knots_mm)
            .enumerate()
            .map(|(index, (element, knot_mm))| {
                vec![
                    Cell::number((index + 1) as f64, 0),
                    Cell::number(1e3 * knot_mm, 2),
                    Cell::number(element.stiffness_v_per_mm, 3),
                    Cell::number(element.weight, 4),
                ]
            })
            .collect(),
    }
}

/// Virgin curve and hysteresis (thesis, Figs 3.11-3.13).
pub fn presliding_section(found: &GmsFit, breakaway_v: f64) -> Section {
    let measured: (Vec<f64>, Vec<f64>) = found
        .curve
        .points
        .iter()
        .map(|point| (1e3 * point.displacement_mm, point.force_v))
        .unzip();
    let reach_um = measured
        .0
        .last()
        .copied()
        .unwrap_or(1.0)
        .min(3e3 * found.knots_mm.last().copied().unwrap_or(1.0));
    let model: (Vec<f64>, Vec<f64>) = (0..=200)
        .map(|step| {
            let displacement_um = reach_um * f64::from(step) / 200.0;
            (
                displacement_um,
                found
                    .gms
                    .virgin_curve_v(1e-3 * displacement_um, breakaway_v),
            )
        })
        .unzip();
    let knots: (Vec<f64>, Vec<f64>) = found
        .knots_mm
        .iter()
        .map(|knot| (1e3 * knot, found.gms.virgin_curve_v(*knot, breakaway_v)))
        .unzip();
    let position_um: Vec<f64> = found
        .prediction
        .position_mm
        .iter()
        .map(|mm| 1e3 * mm)
        .collect();
    Section {
        provenance: None,
        id: "pre-sliding".to_owned(),
        heading: "Pre-sliding friction".to_owned(),
        prose: vec![
            "Branches of the measured hysteresis, halved by the Masing rule, are the virgin curve; its knots are the slip-blocks, refined on \
             the whole record. The prediction is the library's own GMS model along the measured position."
                .to_owned(),
        ],
        blocks: vec![
            Block::Table(gms_table(found)),
            Block::Figure(lines(
                "virgin-curve",
                "Virgin curve with knots",
                ("displacement (um)", "friction (V)"),
                vec![
                    series("from the hysteresis", measured.0, measured.1, Style::solid(Colour::Ink)),
                    series("model", model.0, model.1, Style::solid(Colour::Blue)),
                    series("knots", knots.0, knots.1, Style::points(Colour::Vermillion)),
                ],
            )),
            Block::Figure(lines(
                "hysteresis",
                "Hysteresis, measured and predicted",
                ("position (um)", "voltage (V)"),
                vec![
                    series("measured", position_um.clone(), found.prediction.measured_v.clone(), Style::solid(Colour::Ink)),
                    series("predicted", position_um, found.prediction.predicted_v.clone(), Style::dashed(Colour::Vermillion)),
                ],
            )),
        ],
    }
}
