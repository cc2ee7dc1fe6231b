//! Chapter 4 of the thesis on our stage: the controllers, and what the runs of chapter 5 are made of.

use anyhow::Context as _;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_pages::compare::comparison::AMPLITUDES_MM;
use quadrant_pages::compare::sine::{CYCLES, SCORED_CYCLES, VELOCITIES_MM_S, cycle_s};
use quadrant_pages::design::npid::NonlinearPage;
use quadrant_pages::design::pid::PidPage;
use quadrant_pages::parts::{columns, provenance};
use quadrant_report::{Block, Cell, Section, Table};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::design::npid::filtered_proof;
use quadrant_tune::design::robustness::{Uncertainty, robustness};
use quadrant_tune::design::step_response::{StepRequest, step_response};
use quadrant_tune::design::time_varying::VaryingLoop;
use quadrant_tune::design::{Form, Process, best_pid};

use super::Context;
use super::numbers::{Number, number};
use crate::study::Advance;

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

/// Standard deviations of A, B, C and Td, as shares: those of `quadrant design npid`.
const DEVIATIONS: [f64; 4] = [0.05, 0.10, 0.30, 0.05];
/// Number of draws.
const DRAWS: usize = 2000;
/// Heights of the steps, mm: within the encoder's noise, across emax, as `quadrant design npid` has them.
const STEPS_MM: [f64; 2] = [0.01, 0.1];

/// Examines the settings' PID and nonlinear gain on the settings' model of the x axis.
pub(super) fn sections(context: &Context, advance: Advance<'_>) -> anyhow::Result<Vec<Section>> {
    let stage = &context.settings.stage;
    let [x, ..] = &stage.axes;
    let plant = x
        .plant
        .context("the settings hold no model of the x axis: commission it with `quadrant commission --axis x`")?;
    let gain = x
        .feedback
        .nonlinear
        .context("the settings hold no nonlinear gain for the x axis: design one with `quadrant design npid`")?;
    let gains = x.feedback.pid;
    let filters = x.feedback.filters.as_deref().unwrap_or_default();
    let sample_time_s = 1.0 / stage.rate_hz;
    let sampled = Form::Sampled {
        sample_time_s,
        computation_delay_s: 0.0,
    };
    let process = Process::filtered(plant, filters);
    let answer = |height_mm, nonlinear| {
        let request = StepRequest {
            filters,
            sample_time_s,
            height_mm,
            limit_v: x.amplifier.output_limit_v,
            ..StepRequest::default()
        };
        step_response(&plant, &gains, nonlinear, &request)
    };
    let [small_mm, _] = STEPS_MM;
    let best = best_pid(&process, sampled, gains.derivative_filter_s)?.gains;
    let pid = PidPage {
        subject: String::new(),
        gains,
        forms: [
            ("continuous", gains, Form::Continuous),
            ("as it runs", gains, sampled),
            ("best PID, as it runs", best, sampled),
        ]
        .map(|(name, gains, form)| {
            (
                name.to_owned(),
                process.open_loop(&gains, form),
                process.margins(&gains, form),
            )
        })
        .into(),
        step: Some(answer(small_mm, None)),
    };
    let margins = process.margins(&gains, sampled)?;
    let destabiliser = VaryingLoop {
        plant,
        gains,
        filters,
        sample_time_s,
    }
    .worst(1.0, margins.gain_crossover_hz);
    advance(0.5);
    let nonlinear = NonlinearPage {
        subject: String::new(),
        plant: PlantModel {
            delay_s: plant.delay_s + 0.5 * sample_time_s,
            ..plant
        },
        gains,
        filters: filters.to_vec(),
        proof: filtered_proof(&plant, &gains, filters, sample_time_s),
        gain,
        destabiliser,
        robustness: robustness(
            &plant,
            &gains,
            filters,
            sample_time_s,
            &Uncertainty::independent(DEVIATIONS),
            DRAWS,
            context.seed,
        )?,
        steps: STEPS_MM
            .into_iter()
            .flat_map(|height_mm| {
                [("PID", None), ("N-PID", Some(&gain))]
                    .map(|(law, nonlinear)| (law, answer(height_mm, nonlinear)))
            })
            .collect(),
    };
    let [truth, ..] = &StageParameters::real().axes;
    let data = data_section(stage, truth, context.seeds);
    Ok(chapter4_sections(&pid, &nonlinear, data))
}

/// Tables 4.1 to 4.4 and Figures 4.2 to 4.11.
fn chapter4_sections(pid: &PidPage<'_>, nonlinear: &NonlinearPage, data: Section) -> Vec<Section> {
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
fn data_section(stage: &StageSettings, truth: &AxisParameters, seeds: u64) -> Section {
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
