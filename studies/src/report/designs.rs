//! Chapter 3, what a commissioning of the x axis finds; and chapter 4, the controllers of the settings.

use anyhow::Context as _;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_pages::design::npid::NonlinearPage;
use quadrant_pages::design::pid::PidPage;
use quadrant_report::Section;
use quadrant_settings::StageSettings;
use quadrant_sim::plant::StageParameters;
use quadrant_tune::commission::{CommissionSettings, CrossCheck, commission};
use quadrant_tune::design::npid::filtered_proof;
use quadrant_tune::design::robustness::{Uncertainty, robustness};
use quadrant_tune::design::step_response::{StepRequest, step_response};
use quadrant_tune::design::time_varying::VaryingLoop;
use quadrant_tune::design::{Form, Process, best_pid};
use quadrant_tune::test_axis::SimulatedTestAxis;

use crate::report::{Context, Progress};
use crate::thesis::chapter3::chapter3_sections;
use crate::thesis::chapter4::{chapter4_sections, data_section};

/// Share of chapter 3's time after which the commissioning is done and the cross-checks begin.
const COMMISSIONED: f64 = 0.7;
/// Standard deviations of A, B, C and Td, as shares: those of `quadrant design npid`.
const DEVIATIONS: [f64; 4] = [0.05, 0.10, 0.30, 0.05];
/// Number of draws.
const DRAWS: usize = 2000;
/// Heights of the steps, mm: within the encoder's noise, across emax, as `quadrant design npid` has them.
const STEPS_MM: [f64; 2] = [0.01, 0.1];

/// Commissions the x axis from nothing known, and cross-checks the result.
pub(super) fn identification(
    context: &Context,
    progress: &Progress,
) -> anyhow::Result<Vec<Section>> {
    let [truth, ..] = StageParameters::real().axes;
    let mut rig = SimulatedTestAxis::new(0, truth, context.seed);
    let found = commission(
        &mut rig,
        &StageSettings::simulated().axes[0],
        &CommissionSettings::thesis(),
        &mut |_, done| progress.at(COMMISSIONED * done),
    )?;
    let checked = CrossCheck::run(&mut rig, &found.settings, context.seed, &mut |_, _| {
        progress.at(COMMISSIONED)
    })?;
    Ok(chapter3_sections(&found, &checked))
}

/// Examines the settings' PID and nonlinear gain on the settings' model of the x axis.
pub(super) fn controllers(context: &Context, progress: &Progress) -> anyhow::Result<Vec<Section>> {
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
    progress.at(0.5);
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
