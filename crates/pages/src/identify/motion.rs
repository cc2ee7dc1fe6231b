//! Page of the inertia and friction of a motion record.

use quadrant_report::{Block, Cell, Colour, Page, Provenance, Section, Style, Table};
use quadrant_tune::identify::motion::{Candidate, MotionModel, Replayed};

use crate::parts::{UM_PER_MM, columns, lines, series};

/// Misfit of a model that is run over its record.
#[derive(Clone, Debug)]
pub struct Reruns {
    /// Driven by the recorded voltage.
    pub open_loop: Replayed,
    /// Following the recorded reference under a cascade, where one is given.
    pub closed_loop: Option<Replayed>,
}

/// The models beside each other: how well they explain the voltage, and how well they move.
pub fn candidates_table(candidates: &[Candidate], reruns: &[Reruns]) -> Table {
    let percent =
        |share: Option<f64>| share.map_or(Cell::Missing, |share| Cell::number(100.0 * share, 3));
    let rows = candidates.iter().zip(reruns).map(|(candidate, rerun)| {
        let closed = rerun.closed_loop.as_ref();
        vec![
            Cell::text(if candidate.refined {
                "the recommended, refined in motion".to_owned()
            } else {
                candidate.model.structure.addition()
            }),
            percent(Some(candidate.model.relative_error)),
            percent(candidate.validation_error),
            Cell::number(rerun.open_loop.position_rms_mm, 2),
            closed.map_or(Cell::Missing, |closed| {
                Cell::number(UM_PER_MM * closed.position_rms_mm, 2)
            }),
            percent(closed.map(|closed| closed.voltage_error)),
        ]
    });
    Table {
        id: "motion-models".to_owned(),
        caption: "Models of the record, each with one part more than the one above. Relative error: norm of the unexplained voltage over that of the voltage. Validation: the same on \
                  parts of the trajectory that were withheld, in all their repetitions. Open loop: simulated from the recorded voltage alone; \
                  closed loop: simulated on the recorded reference. Refined: fitted to the motion in open loop, too"
            .to_owned(),
        columns: columns(&[
            ("Model", ""),
            ("Relative error", "%"),
            ("Validation", "%"),
            ("Open loop, position RMS", "mm"),
            ("Closed loop, position RMS", "um"),
            ("Closed loop, voltage", "%"),
        ]),
        rows: rows.collect(),
    }
}

/// Errors of models that were fitted to one record on another.
pub fn validation_table(errors: &[(&Candidate, f64)], record: &str) -> Table {
    Table {
        id: "motion-validation".to_owned(),
        caption: format!(
            "Relative error on {record}, on which nothing was fitted, beside that on the record of the fit; drift is taken as it stood at \
             the end of that"
        ),
        columns: columns(&[
            ("Model", ""),
            ("Relative error", "%"),
            ("On the other record", "%"),
        ]),
        rows: errors
            .iter()
            .map(|(candidate, error)| {
                vec![
                    Cell::text(candidate.model.structure.addition()),
                    Cell::number(100.0 * candidate.model.relative_error, 3),
                    Cell::number(100.0 * error, 3),
                ]
            })
            .collect(),
    }
}

/// The parameters of a model; in newtons, metres and seconds too where the force per volt is known.
pub fn motion_table(model: &MotionModel, force_n_per_v: Option<f64>) -> Table {
    let rows = model.estimates.iter().map(|estimate| {
        let (factor, si_unit) = estimate.to_si;
        // Times and velocities have no force in them.
        let forceless = si_unit == "s" || si_unit == "m/s";
        let factor = if forceless {
            Some(factor)
        } else {
            force_n_per_v.map(|force| factor * force)
        };
        let si = |value: f64| {
            factor.map_or(Cell::Missing, |factor| {
                significant(factor * value, factor * estimate.value)
            })
        };
        vec![
            Cell::text(estimate.name.as_str()),
            Cell::text(estimate.unit),
            significant(estimate.value, estimate.value),
            significant(estimate.standard_error, estimate.value),
            Cell::text(si_unit),
            si(estimate.value),
            si(estimate.standard_error),
        ]
    });
    Table {
        id: "motion-parameters".to_owned(),
        caption: format!(
            "Parameters of \"{}\"; ± is one standard deviation: noise, parts of the trajectory withheld, and the distance to other models \
             that predict nearly as well. The offset holds gravity, the amplifier's offset \
             and half the difference of the Coulomb levels; the viscous friction holds B / A; Td holds half a period of the voltage's hold",
            model.structure.name()
        ),
        columns: columns(&[
            ("Parameter", ""),
            ("Unit", ""),
            ("Value", ""),
            ("±", ""),
            ("SI", ""),
            ("Value, SI", ""),
            ("±, SI", ""),
        ]),
        rows: rows.collect(),
    }
}

/// A number with as many decimals as show six digits of another.
fn significant(value: f64, of: f64) -> Cell {
    let decimals = (5.0 - of.abs().log10().floor()).clamp(0.0, 12.0);
    Cell::number(value, decimals as usize)
}

/// The page of a record.
pub fn motion_page(
    subject: &str,
    tables: Vec<Table>,
    chosen: &Candidate,
    provenance: Provenance,
) -> Page {
    let rows = &chosen.rows;
    let explained = rows
        .voltage_v
        .iter()
        .zip(&rows.residual_v)
        .map(|(voltage, residual)| voltage - residual)
        .collect();
    let over_time =
        |values: Vec<f64>, name: &str, style| series(name, rows.time_s.clone(), values, style);
    let fastest = rows
        .velocity_mm_s
        .iter()
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    let velocities: Vec<f64> = (-200..=200)
        .map(|i| fastest * f64::from(i) / 200.0)
        .collect();
    let friction = velocities.iter().map(|&velocity| {
        let way = if velocity < 0.0 {
            &chosen.model.friction.negative
        } else {
            &chosen.model.friction.positive
        };
        way.friction_v(velocity)
    });
    let friction: Vec<f64> = friction.collect();
    Page {
        title: "Inertia and friction of a motion record".to_owned(),
        subtitle: subject.to_owned(),
        provenance,
        sections: vec![
            Section {
                provenance: None,
                id: "models".to_owned(),
                heading: "Models and parameters".to_owned(),
                prose: vec![
                    "Each model has one part more than the one before. The simplest of those whose error is smallest where they were \
                     not fitted is shown below, refined by its own motion where that made it move better."
                        .to_owned(),
                ],
                blocks: tables.into_iter().map(Block::Table).collect(),
            },
            Section {
                provenance: None,
                id: "explained".to_owned(),
                heading: "What the model explains".to_owned(),
                prose: Vec::new(),
                blocks: vec![
                    Block::Figure(lines(
                        "motion-voltage",
                        "Voltage of the record, as explained, and what is left",
                        ("time (s)", "voltage (V)"),
                        vec![
                            over_time(rows.voltage_v.clone(), "recorded", Style::solid(Colour::Ink)),
                            over_time(explained, "explained", Style::dashed(Colour::Blue)),
                            over_time(
                                rows.residual_v.clone(),
                                "left",
                                Style::solid(Colour::Vermillion),
                            ),
                        ],
                    )),
                    Block::Figure(lines(
                        "motion-friction",
                        "Friction against velocity: voltage without inertia and offset, and the model",
                        ("velocity (mm/s)", "friction (V)"),
                        vec![
                            series(
                                "record",
                                rows.velocity_mm_s.clone(),
                                rows.friction_v.clone(),
                                Style::points(Colour::Grey),
                            ),
                            series("model", velocities, friction, Style::solid(Colour::Blue)),
                        ],
                    )),
                ],
            },
        ],
    }
}
