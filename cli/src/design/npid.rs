//! The command `quadrant design npid`.

use anyhow::bail;
use clap::Args;
use quadrant_cli::output::{Output, command_line, share};
use quadrant_cli::say;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_pages::design::npid::NonlinearPage;
use quadrant_pages::parts::provenance;
use quadrant_tune::design::npid::{NonlinearRule, Range, choose_nonlinear, filtered_proof};
use quadrant_tune::design::robustness::{Uncertainty, robustness};
use quadrant_tune::design::step_response::{StepRequest, step_response};
use quadrant_tune::design::time_varying::VaryingLoop;
use quadrant_tune::design::{Form, Process};

use super::process::Model;

/// Options of `quadrant design npid`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    model: Model,
    /// Largest gain as a share of the Popov bound, 0 to 1.
    #[arg(long, default_value_t = 0.75, value_name = "SHARE")]
    sector_share: f64,
    /// emax, mm; without it, the error at which the proportional part equals the settings' breakaway friction.
    #[arg(long, value_name = "MM")]
    range_mm: Option<f64>,
    /// Standard deviations of A, B, C and Td, % of their values, for the robustness.
    #[arg(long, num_args = 4, default_values_t = [5.0, 10.0, 30.0, 5.0], value_name = "PERCENT")]
    deviation_percent: Vec<f64>,
    /// Draws of the model.
    #[arg(long, default_value_t = 2000)]
    draws: usize,
    #[command(flatten)]
    output: Output,
}

/// Heights of the steps shown, mm: within the encoder's noise, across emax, and far beyond.
const STEPS_MM: [f64; 2] = [0.01, 0.1];

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { model, output, .. } = arguments;
    if !(arguments.sector_share > 0.0 && arguments.sector_share <= 1.0) {
        bail!(
            "--sector-share {}: it must be above zero and at most 1",
            arguments.sector_share
        );
    }
    let deviations: [f64; 4] = std::array::from_fn(|i| arguments.deviation_percent[i] / 100.0);
    if !deviations.iter().all(|share| (0.0..=1.0).contains(share)) {
        bail!("--deviation-percent: each must be 0 to 100");
    }
    let (file, subject) = model.file(&arguments.output)?;
    let plant = model.plant(&file)?;
    let settings = model.axis(&file).clone();
    let gains = settings.feedback.pid;
    let filters = model.filters(&file);
    let sampled = model.sampled(&file)?;
    let Form::Sampled {
        sample_time_s,
        computation_delay_s,
    } = sampled
    else {
        bail!("the loop is not sampled");
    };
    // What the proof counts as delay.
    let late = PlantModel {
        delay_s: plant.delay_s + computation_delay_s,
        ..plant
    };
    let proof = filtered_proof(&late, &gains, &filters, sample_time_s);
    let margins = Process::filtered(plant, &filters).margins(&gains, sampled)?;
    let range = match arguments.range_mm {
        Some(range_mm) if (1e-3..=10.0).contains(&range_mm) => Range::Fixed(range_mm),
        Some(range_mm) => bail!("--range-mm {range_mm}: it must be 0.001 to 10 mm"),
        None => {
            let sliding = &settings.friction.sliding;
            Range::Breakaway(
                0.5 * (sliding.positive.curve.breakaway_v + sliding.negative.curve.breakaway_v),
            )
        }
    };
    let rule = NonlinearRule {
        sector_share: arguments.sector_share,
        largest: f64::INFINITY,
        range,
    };
    let Some(gain) = choose_nonlinear(&gains, proof.popov, &rule) else {
        bail!(
            "the Popov bound of this loop is {:.3}; {:.0} % of it leaves no gain above 1: lower Kp and Kd, or raise --sector-share",
            proof.popov,
            100.0 * arguments.sector_share
        );
    };
    let bar = share("searching for switching gains that destabilise");
    let destabiliser = VaryingLoop {
        plant: late,
        gains,
        filters: &filters,
        sample_time_s,
    }
    .worst(1.0, margins.gain_crossover_hz);
    bar.set_message("drawing models");
    bar.set_position(500);
    let robustness = robustness(
        &late,
        &gains,
        &filters,
        sample_time_s,
        &Uncertainty::independent(deviations),
        arguments.draws,
        output.seed,
    )?;
    bar.finish_and_clear();
    let steps = STEPS_MM.into_iter().flat_map(|height_mm| {
        let request = StepRequest {
            filters: &filters,
            sample_time_s,
            computation_delay_s,
            height_mm,
            limit_v: settings.amplifier.output_limit_v,
            ..StepRequest::default()
        };
        [("PID", None), ("N-PID", Some(&gain))]
            .map(|(law, nonlinear)| (law, step_response(&plant, &gains, nonlinear, &request)))
    });
    let page = NonlinearPage {
        subject,
        plant: PlantModel {
            delay_s: late.delay_s + 0.5 * sample_time_s,
            ..late
        },
        gains,
        filters: filters.clone(),
        proof,
        gain,
        destabiliser,
        robustness,
        steps: steps.collect(),
    };
    say!("{}\n", page.subject);
    for table in page.tables() {
        output.table(&table)?;
    }
    let command = command_line();
    output.page(&page.page(provenance(&command, output.seed)), "npid.html")?;
    model.write(
        output,
        file,
        &command,
        Vec::new(),
        "feedback.nonlinear",
        |axis| {
            axis.feedback.nonlinear = Some(gain);
        },
    )
}
