//! Chapter 4 of the thesis on our stage: the controllers, and what the runs of chapter 5 are made of.

use quadrant_pages::compare::comparison::AMPLITUDES_MM;
use quadrant_pages::compare::sine::{CYCLES, SCORED_CYCLES, VELOCITIES_MM_S, cycle_s};
use quadrant_pages::design::npid::NonlinearPage;
use quadrant_pages::design::pid::PidPage;
use quadrant_pages::parts::{columns, provenance};
use quadrant_report::{Block, Cell, Section, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::AxisParameters;

use crate::thesis::numbers::{Number, number};

const PID_NUMBERS: [Number; 9] = [
    ("pid-gains", "Table 4.1"),
    ("step-properties", "Table 4.2"),
    ("open-loop-gain", "Figure 4.2a"),
    ("open-loop-phase", "Figure 4.2b"),
    ("nyquist", "Figure 4.3"),
    ("closed-loop", "Figure 4.6"),
    ("sensitivity", "Figure 4.7"),
    ("step", "Figure 4.8a"),
    ("step-voltage", "Figure 4.8b"),
];

const NONLINEAR_NUMBERS: [Number; 5] = [
    ("step-properties", "Table 4.3"),
    ("popov", "Figure 4.9"),
    ("nonlinear-gain-curve", "Figure 4.10"),
    ("step", "Figure 4.11a"),
    ("step-voltage", "Figure 4.11b"),
];

/// Tables 4.1 to 4.4 and Figures 4.2 to 4.11.
pub fn chapter4_sections(
    pid: &PidPage<'_>,
    nonlinear: &NonlinearPage,
    data: Section,
) -> Vec<Section> {
    // A page's own command is that of the report.
    let pid = pid.page(provenance("", 0)).sections;
    let nonlinear = nonlinear.page(provenance("", 0)).sections;
    let mut sections = number(pid, "chapter-4-pid", &PID_NUMBERS);
    sections.extend(number(nonlinear, "chapter-4-npid", &NONLINEAR_NUMBERS));
    sections.extend(number(
        vec![data],
        "chapter-4",
        &[("data-properties", "Table 4.4")],
    ));
    sections
}

/// Data of the simulation (exact model) and of the experiment (identified model): rates, resolutions, cycles.
pub fn data_section(stage: &StageSettings, truth: &AxisParameters, seeds: u64) -> Section {
    let [x, ..] = &stage.axes;
    Section {
        provenance: None,
        id: "data".to_owned(),
        heading: "Data properties".to_owned(),
        prose: Vec::new(),
        blocks: vec![Block::Table(Table {
            id: "data-properties".to_owned(),
            caption: "What the data of simulation and experiment are".to_owned(),
            columns: columns(&[
                ("Quantity", ""),
                ("Unit", ""),
                ("Simulation (exact model)", ""),
                ("Experiment (identified model)", ""),
            ]),
            rows: data_rows(stage.rate_hz, x, truth, seeds),
        })],
    }
}

fn data_rows(rate_hz: f64, x: &AxisSettings, truth: &AxisParameters, seeds: u64) -> Vec<Vec<Cell>> {
    let imperfections = &truth.imperfections;
    let same = |name: &str, unit: &str, value: f64, decimals| {
        vec![
            Cell::text(name),
            Cell::text(unit),
            Cell::number(value, decimals),
            Cell::number(value, decimals),
        ]
    };
    let imperfect = |name: &str, unit: &str, value: f64, decimals| {
        vec![
            Cell::text(name),
            Cell::text(unit),
            Cell::number(0.0, decimals),
            Cell::number(value, decimals),
        ]
    };
    let mut rows = vec![
        same("control rate", "Hz", rate_hz, 0),
        same("encoder count", "um", 1e3 * x.encoder.resolution_mm, 2),
        same(
            "converter step",
            "mV",
            1e3 * truth.full_scale_v / quadrant_law::units::DacCode::FULL_SCALE,
            3,
        ),
        imperfect(
            "encoder noise, standard deviation",
            "um",
            1e3 * imperfections.encoder_noise_mm,
            2,
        ),
        imperfect(
            "offset of converter and amplifier",
            "mV",
            1e3 * imperfections.offset_v,
            1,
        ),
        imperfect(
            "ripple of the screw, amplitude",
            "mV",
            1e3 * imperfections.ripple_v,
            1,
        ),
        vec![
            Cell::text("lead of the screw"),
            Cell::text("mm"),
            Cell::Missing,
            Cell::number(imperfections.lead_mm, 0),
        ],
        vec![
            Cell::text("friction known to the law"),
            Cell::text(""),
            Cell::text("the plant's"),
            Cell::text("as identified"),
        ],
        vec![
            Cell::text("GMS elements of the law"),
            Cell::text(""),
            Cell::number(truth.gms.elements.len() as f64, 0),
            Cell::number(x.friction.gms.elements.len() as f64, 0),
        ],
        vec![
            Cell::text("runs of a configuration"),
            Cell::text(""),
            Cell::number(1.0, 0),
            Cell::number(seeds as f64, 0),
        ],
        same("cycles at full speed", "", CYCLES, 2),
        same("cycles that count", "", SCORED_CYCLES as f64, 0),
    ];
    for amplitude in AMPLITUDES_MM {
        for velocity in VELOCITIES_MM_S {
            let period_s = cycle_s(amplitude, velocity);
            let name = format!("samples that count, {amplitude} mm at {velocity} mm/s");
            rows.push(same(
                &name,
                "",
                SCORED_CYCLES as f64 * (period_s * rate_hz).round(),
                0,
            ));
        }
    }
    rows
}
