//! The page of a commissioning.

use quadrant_report::{
    Block, Cell, Column, Figure, Lines, Page, Plot, Provenance, Section, Style, Table,
};
use quadrant_sim::metrics::{Score, change_percent};
use quadrant_tune::commission::verify::Verification;
use quadrant_tune::commission::{Commissioned, CrossCheck};
use quadrant_tune::identify::motion::recommended;

use crate::identify::friction::{friction_section, presliding_section};
use crate::identify::linear::{motor_constant_table, plant_tables, response_section};
use crate::identify::motion::motion_table;
use crate::identify::revise::revise_sections;
use crate::parts::{UM_PER_MM, error_curve};

/// The gains (thesis, Table 4.1), with margins at the control rate.
pub fn gains_table(found: &Commissioned) -> Table {
    let pid = &found.settings.feedback.pid;
    let nonlinear = found.settings.feedback.nonlinear;
    let mut rows = vec![
        ("Kp", "V/mm", pid.kp_v_per_mm, 4),
        ("Ki", "V/(mm s)", pid.ki_v_per_mm_s, 2),
        ("Kd", "V s/mm", pid.kd_v_s_per_mm, 6),
        ("derivative filter", "us", 1e6 * pid.derivative_filter_s, 1),
        ("Popov bound on k(e)", "", found.sector_bound, 3),
    ];
    if let Some(gain) = nonlinear {
        rows.push(("ko", "1/mm", gain.rate_per_mm, 2));
        rows.push(("emax", "mm", gain.range_mm, 4));
        rows.push(("largest k(e)", "", gain.largest(), 3));
    }
    if let Ok(margins) = &found.margins {
        rows.extend([
            ("gain margin, sampled", "dB", margins.gain_margin_db, 2),
            ("at", "Hz", margins.phase_crossover_hz, 1),
            ("phase margin, sampled", "deg", margins.phase_margin_deg, 2),
            ("at", "Hz", margins.gain_crossover_hz, 1),
            ("largest |S|", "", margins.sensitivity_peak, 3),
            ("largest |T|", "", margins.complementary_peak, 3),
        ]);
    }
    Table {
        id: "gains".to_owned(),
        caption: "Controller, and its margins with sampling at the control rate".to_owned(),
        columns: vec![
            Column::new("Quantity"),
            Column::new("Unit"),
            Column::new("Value"),
        ],
        rows: rows
            .into_iter()
            .map(|(name, unit, value, decimals)| {
                vec![
                    Cell::text(name),
                    Cell::text(unit),
                    Cell::number(value, decimals),
                ]
            })
            .collect(),
    }
}

/// A number without what is less than a hundredth.
fn hundredths(value: f64) -> f64 {
    (100.0 * value).round() / 100.0
}

/// The errors of each law that was tried on the axis, by its own encoder.
pub fn results_table(verification: &Verification) -> Table {
    let pid = &verification.laws[0];
    let rows = verification.laws.iter().enumerate().map(|(index, law)| {
        let first = law.scores.first();
        let change = |read: fn(&Score) -> f64| match (first, pid.scores.first()) {
            (Some(own), Some(pid)) => Cell::number(change_percent(read(pid), read(own)), 1),
            _ => Cell::Missing,
        };
        let um = |read: fn(&Score) -> f64, decimals| {
            first.map_or(Cell::Missing, |score| {
                Cell::number(UM_PER_MM * read(score), decimals)
            })
        };
        let (worst, mean) = verification.against_pid(law);
        let percent = |ratio: f64| {
            if ratio.is_finite() {
                Cell::number(100.0 * ratio, 0)
            } else {
                Cell::Missing
            }
        };
        let state = match &law.stopped {
            Some(_) => "stopped",
            None if index == verification.chosen => "chosen",
            None => "",
        };
        vec![
            Cell::text(law.law.as_str()),
            um(|score| score.largest_mm, 2),
            um(|score| score.rms_mm, 3),
            change(|score| score.largest_mm),
            change(|score| score.rms_mm),
            Cell::number(law.scores.len() as f64, 0),
            percent(mean),
            percent(worst),
            Cell::text(state),
        ]
    });
    let sines: Vec<String> = verification
        .sines
        .iter()
        .map(|sine| {
            let [mm, mm_s] = [sine.amplitude_mm, sine.velocity_mm_s].map(hundredths);
            format!("{mm} mm at {mm_s} mm/s")
        })
        .collect();
    Table {
        id: "verdict".to_owned(),
        caption: format!(
            "Tracking error by the axis' own encoder, over two cycles, on the first sine, and its change against the PID; then largest \
             and RMS errors over those of the PID, on the mean and at worst, over as many sines as the law ran on: {}",
            sines.join(", ")
        ),
        columns: vec![
            Column::new("Law"),
            Column::with_unit("Largest", "um"),
            Column::with_unit("RMS", "um"),
            Column::with_unit("Change of largest", "%"),
            Column::with_unit("Change of RMS", "%"),
            Column::new("Sines"),
            Column::with_unit("Mean of PID", "%"),
            Column::with_unit("Worst of PID", "%"),
            Column::new(""),
        ],
        rows: rows.collect(),
    }
}

/// The whole commissioning of one axis.
pub fn commission_page(
    axis: &str,
    found: &Commissioned,
    checked: Option<&CrossCheck>,
    provenance: Provenance,
) -> Page {
    let error_curves = found
        .verification
        .iter()
        .flat_map(|verification| &verification.laws)
        .enumerate()
        .map(|(index, result)| {
            let recording = &result.recording;
            let errors: Vec<f64> = recording
                .reference_mm
                .iter()
                .zip(&recording.position_mm)
                .map(|(reference, position)| reference - position)
                .collect();
            error_curve(
                result.law.clone(),
                &errors,
                recording.sample_time_s,
                Style::nth(index),
            )
        })
        .collect();
    let [parameters, bands] = plant_tables(&found.plant);
    let (map, friction, _) = &found.friction;
    let (gms, _) = &found.presliding;
    let mut response = response_section(&found.response, Some(&found.plant));
    response
        .blocks
        .insert(0, Block::Table(motor_constant_table(&found.motor, None)));
    response
        .blocks
        .extend([parameters, bands].map(Block::Table));
    let mut result = Section {
        provenance: None,
        id: "result".to_owned(),
        // From saved recordings nothing ran on the settings.
        heading: "Controller".to_owned(),
        prose: found
            .notes()
            .into_iter()
            .chain(found.drift_note())
            .collect(),
        blocks: vec![Block::Table(gains_table(found))],
    };
    if let Some(verification) = &found.verification {
        result.heading = "What it achieves".to_owned();
        result.blocks.splice(
            ..0,
            [
                Block::Table(results_table(verification)),
                Block::Figure(Figure {
                    id: "verdict-errors".to_owned(),
                    caption: "Tracking error, by the axis' own encoder".to_owned(),
                    plot: Plot::Lines(Lines {
                        x_label: "time (s)".to_owned(),
                        y_label: "tracking error (um)".to_owned(),
                        series: error_curves,
                        ..Lines::default()
                    }),
                }),
            ],
        );
    }
    let mut sections = vec![result, response, friction_section(map, friction)];
    if let Ok(gms) = gms {
        sections.push(presliding_section(gms, friction.mean_levels_v().1));
    }
    sections.extend(
        checked
            .into_iter()
            .flat_map(|checked| check_sections(found, checked)),
    );
    Page {
        title: format!("Commissioning of {axis}"),
        subtitle: "From an unknown axis to settings, every step measured on the axis itself"
            .to_owned(),
        provenance,
        sections,
    }
}

/// The cross-checks: the model revised for explicit friction, and an ordinary motion.
fn check_sections(found: &Commissioned, checked: &CrossCheck) -> Vec<Section> {
    let mut sections = revise_sections(
        &checked.at_rest,
        &found.plant.plant,
        &checked.revisions,
        &[],
    );
    if let Some(chosen) = recommended(&checked.motion) {
        let agreement = checked
            .inertia_agreement(&found.settings)
            .unwrap_or(f64::NAN);
        sections.push(Section {
            provenance: None,
            id: "motion".to_owned(),
            heading: "An ordinary motion".to_owned(),
            prose: vec![format!(
                "Inertia and friction of an ordinary motion, by inverse dynamics, the dead time taken from the linear model: its A is {agreement:.3} \
                 times that of the frequency response. A motion record shows little of the pre-sliding friction."
            )],
            blocks: vec![Block::Table(motion_table(&chosen.model, None))],
        });
    }
    sections
}
