//! The command `quadrant design pid`.

use std::path::PathBuf;

use anyhow::bail;
use clap::{Args, ValueEnum};
use quadrant_cli::output::{Output, command_line};
use quadrant_cli::say;
use quadrant_pages::design::pid::PidPage;
use quadrant_pages::parts::provenance;
use quadrant_tune::design::measured::MeasuredResponse;
use quadrant_tune::design::step_response::{StepRequest, step_response};
use quadrant_tune::design::{
    Form, INTEGRAL_SHARE, PidRequest, Process, Target, best_filter_s, best_pid, design_pid,
};
use quadrant_tune::identify::response::FrequencyResponse;

use super::process::Model;

/// Options of `quadrant design pid`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    model: Model,
    /// Design on a measured response, as `quadrant identify frf` saves it, and not on a model.
    #[arg(long, value_name = "FILE", conflicts_with = "gain")]
    frf: Option<PathBuf>,
    /// Lowest coherence of a line of the response that counts.
    #[arg(long, default_value_t = 0.9)]
    least_coherence: f64,
    /// The best PID, as `quadrant commission` makes it: on the loop as it runs, the least error after a step of the load with |S| up to 1.7 and
    /// |T| up to 1.5, and without --filter-s the best filter.
    #[arg(long, conflicts_with_all = [
        "gain_margin_db", "phase_margin_deg", "crossover_hz", "sensitivity_peak", "ki", "design_on",
    ])]
    best: bool,
    /// Gain margin, dB. With a crossover and no --phase-margin-deg of its own, the smallest allowed.
    #[arg(long, value_name = "DB")]
    gain_margin_db: Option<f64>,
    /// Phase margin of the loop, deg.
    #[arg(long, value_name = "DEG")]
    phase_margin_deg: Option<f64>,
    /// Crossover, Hz. Together with both margins it must come out of them, and bounds Ki.
    #[arg(long, value_name = "HZ")]
    crossover_hz: Option<f64>,
    /// Bound on |S|: the stiffest PID under it and --complementary-peak.
    #[arg(long, value_name = "PEAK", conflicts_with_all = ["gain_margin_db", "phase_margin_deg", "crossover_hz"])]
    sensitivity_peak: Option<f64>,
    /// Bound on |T|, the complementary sensitivity.
    #[arg(long, value_name = "PEAK", default_value_t = 1.3)]
    complementary_peak: f64,
    /// Share of both bounds that is left to integral action, 0 to 0.5: more integrates faster, at less stiffness.
    #[arg(long, value_name = "SHARE", default_value_t = INTEGRAL_SHARE, requires = "sensitivity_peak")]
    integral_share: f64,
    /// Ki, V/(mm s); without it, as much as the target does not notice.
    #[arg(long, value_name = "V_PER_MM_S")]
    ki: Option<f64>,
    /// Time constant of the derivative's filter, s; without it, that of the settings.
    #[arg(long, value_name = "S")]
    filter_s: Option<f64>,
    /// The form of the loop that has the margins asked for.
    #[arg(long, value_enum, default_value_t = Shape::Continuous)]
    design_on: Shape,
    #[command(flatten)]
    output: Output,
}

/// The form of the loop that a design is made on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Shape {
    /// The textbook's: continuous time, no hold.
    Continuous,
    /// As it runs: difference equations, hold, computation delay.
    Sampled,
}

/// Gain margin by default, dB: the thesis'.
const GAIN_MARGIN_DB: f64 = 9.9;
/// Phase margin by default, degrees: the thesis'.
const PHASE_MARGIN_DEG: f64 = 54.2;
/// Smallest gain margin of a design to a crossover, unless another is given, dB.
const LEAST_GAIN_MARGIN_DB: f64 = 6.0;

impl Arguments {
    fn target(&self) -> anyhow::Result<Target> {
        let positive = [
            ("--gain-margin-db", self.gain_margin_db, 0.0),
            ("--phase-margin-deg", self.phase_margin_deg, 0.0),
            ("--crossover-hz", self.crossover_hz, 0.0),
            ("--sensitivity-peak", self.sensitivity_peak, 1.0),
            ("--complementary-peak", Some(self.complementary_peak), 1.0),
        ];
        for (option, value, least) in positive {
            if let Some(value) = value
                && !(value > least && value.is_finite())
            {
                bail!("{option} {value}: it must be above {least}");
            }
        }
        if !(0.0..=0.5).contains(&self.integral_share) {
            bail!(
                "--integral-share {}: it must be within 0 to 0.5",
                self.integral_share
            );
        }
        if let Some(sensitivity_peak) = self.sensitivity_peak {
            return Ok(Target::Bandwidth {
                sensitivity_peak,
                complementary_peak: self.complementary_peak,
                integral_share: self.integral_share,
            });
        }
        let phase_margin_deg = self.phase_margin_deg.unwrap_or(PHASE_MARGIN_DEG);
        let all = self.gain_margin_db.is_some() && self.phase_margin_deg.is_some();
        Ok(match self.crossover_hz {
            Some(crossover_hz) if !all => Target::Crossover {
                crossover_hz,
                phase_margin_deg,
                least_gain_margin_db: self.gain_margin_db.unwrap_or(LEAST_GAIN_MARGIN_DB),
            },
            crossover_hz => Target::Margins {
                gain_margin_db: self.gain_margin_db.unwrap_or(GAIN_MARGIN_DB),
                phase_margin_deg,
                crossover_hz,
            },
        })
    }
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { model, output, .. } = arguments;
    let (file, subject) = model.file(output)?;
    let sampled = model.sampled(&file)?;
    let filters = model.filters(&file);
    let (process, subject) = match &arguments.frf {
        Some(path) => {
            let response = FrequencyResponse::read_csv(path)?;
            let measured = MeasuredResponse::new(&response, arguments.least_coherence)?;
            let (low, high) = measured.band_hz();
            let subject = format!(
                "On the response in {}: {} lines from {low:.1} to {high:.1} Hz",
                path.display(),
                measured.lines()
            );
            let measured = Process::Measured {
                response: measured,
                filters: filters.clone(),
            };
            (measured, subject)
        }
        None => {
            let process = Process::filtered(model.plant(&file)?, &filters);
            (process, subject)
        }
    };
    let current = model.axis(&file).feedback.pid;
    let usual_filter_s = match sampled {
        Form::Sampled { sample_time_s, .. } if arguments.best => best_filter_s(1.0 / sample_time_s),
        _ => current.derivative_filter_s,
    };
    let request = PidRequest {
        target: arguments.target()?,
        form: match arguments.design_on {
            Shape::Continuous => Form::Continuous,
            Shape::Sampled => sampled,
        },
        derivative_filter_s: arguments.filter_s.unwrap_or(usual_filter_s),
        ki_v_per_mm_s: arguments.ki,
    };
    if !(1e-6..=1e-1).contains(&request.derivative_filter_s) {
        bail!(
            "--filter-s {}: it must be 0.000001 to 0.1 s",
            request.derivative_filter_s
        );
    }
    if let Some(ki) = request.ki_v_per_mm_s
        && !(0.0..=1e6).contains(&ki)
    {
        bail!("--ki {ki}: it must be zero to a million V/(mm s)");
    }
    let found = if arguments.best {
        best_pid(&process, sampled, request.derivative_filter_s)?
    } else {
        design_pid(&process, &request)?
    };

    let forms = [
        ("continuous".to_owned(), Form::Continuous),
        (sampled_name(sampled), sampled),
    ]
    .map(|(name, form)| {
        (
            name,
            process.open_loop(&found.gains, form),
            process.margins(&found.gains, form),
        )
    });
    let step = match (&process, sampled) {
        (
            Process::Model(plant) | Process::Modelled { plant, .. },
            Form::Sampled {
                sample_time_s,
                computation_delay_s,
            },
        ) => Some(step_response(
            plant,
            &found.gains,
            None,
            &StepRequest {
                filters: &filters,
                sample_time_s,
                computation_delay_s,
                limit_v: model.axis(&file).amplifier.output_limit_v,
                ..StepRequest::default()
            },
        )),
        _ => None,
    };
    let page = PidPage {
        subject,
        gains: found.gains,
        forms: forms.into(),
        step,
    };
    say!("{}\n", page.subject);
    for table in page.tables() {
        output.table(&table)?;
    }
    let command = command_line();
    output.page(&page.page(provenance(&command, output.seed)), "pid.html")?;
    let records = arguments
        .frf
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    model.write(output, file, &command, records, "feedback.pid", |axis| {
        axis.feedback.pid = found.gains;
    })
}

/// The sampled form, for a table.
fn sampled_name(form: Form) -> String {
    match form {
        Form::Continuous => "continuous".to_owned(),
        Form::Sampled {
            sample_time_s,
            computation_delay_s,
        } => format!(
            "sampled at {:.0} Hz, written after {:.0} us",
            1.0 / sample_time_s,
            1e6 * computation_delay_s
        ),
    }
}
