//! The command `quadrant identify motion`.

use std::path::PathBuf;

use anyhow::{Context, bail, ensure};
use clap::Args;
use quadrant_cli::output::{Output, command_line, share, with_bar};
use quadrant_cli::{say, warn};
use quadrant_pages::identify::motion::{
    Reruns, candidates_table, motion_page, motion_table, validation_table,
};
use quadrant_pages::parts::provenance;
use quadrant_settings::StageSettings;
use quadrant_tune::identify::motion::{
    Candidate, CascadeLoop, MotionFitSettings, MotionModel, Signals, fit_motion, recommended,
    recommended_by, refined, replay_closed_loop, replay_open_loop, shuttle, validate,
};
use quadrant_tune::record::{ColumnNames, MotionOptions, Recording};
use quadrant_tune::test_axis::TestAxis;

use super::friction::put_friction;
use super::recorded;
use crate::numbers::Numbers;
use crate::subject::{Destination, Subject};

/// Options of `quadrant identify motion`.
#[derive(Clone, Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: Subject,
    /// A recorded motion: a CSV file with t_s, position_mm (or position_m), voltage_v and, for a closed loop, reference_mm (or
    /// reference_m).
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Another recorded motion of the same axis, taken later: every model is judged on it, and none is fitted to it.
    #[arg(long, value_name = "FILE", requires = "record")]
    validate: Option<PathBuf>,
    /// Columns of a record of another program, with their units: time=NAME:UNIT,position=NAME:UNIT,voltage=NAME:UNIT, and reference.
    /// NAME is that of the header, or a number from 1. Units: s, ms, us; mm, um, m, in, rad, deg, counts, or a number of them for one,
    /// as 0.5um; V, mV, A, N, Nm. Delimiter, decimal comma, lines before the header and a row of units are guessed, and said.
    #[arg(long, requires = "record", value_name = "QUANTITY=NAME:UNIT,...")]
    columns: Option<ColumnNames>,
    /// Take time stamps that are uneven, as of a host that polls: the record is interpolated on straight lines between its rows.
    #[arg(long, requires = "record")]
    resample: bool,
    /// Force per volt at the amplifier's input, N/V: adds parameters in kg, N s/m and N.
    #[arg(long, value_name = "N_PER_V")]
    force_per_volt: Option<f64>,
    /// Cut-off of the position's low-pass, Hz.
    #[arg(long, default_value_t = 100.0, value_name = "HZ")]
    cutoff_hz: f64,
    /// Rows of the regression a second, Hz.
    #[arg(long, default_value_t = 100.0, value_name = "HZ")]
    row_rate_hz: f64,
    /// Time cut at each end, s.
    #[arg(long, default_value_t = 0.05, value_name = "S")]
    edge_s: f64,
    /// Displacements at which pre-sliding elements may slip, um; at most 8.
    #[arg(long, default_value_t = Numbers(vec![2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0]), value_name = "UM,...")]
    knots_um: Numbers,
    /// Dead time from voltage to force, s, if it is known, from a frequency response for instance: gentle motions hardly distinguish it
    /// from inertia.
    #[arg(long, value_name = "S")]
    dead_time_s: Option<f64>,
    /// Position gain kp of the cascade that followed the record's reference, 1/s: adds its simulation in closed loop.
    #[arg(long, value_name = "PER_S", requires = "cascade_kv")]
    cascade_kp: Option<f64>,
    /// Velocity gain kv of that cascade, V s/m.
    #[arg(long, value_name = "V_S_PER_M", requires = "cascade_kp")]
    cascade_kv: Option<f64>,
    /// Times that the axis is moved to and fro, 1 to 100.
    #[arg(
        long,
        default_value_t = 2,
        value_name = "TIMES",
        value_parser = clap::value_parser!(u16).range(1..=100),
        conflicts_with = "record"
    )]
    rounds: u16,
    #[command(flatten)]
    destination: Destination,
    #[command(flatten)]
    output: Output,
}

impl Arguments {
    /// The way in which records are read.
    fn reading(&self) -> MotionOptions {
        MotionOptions {
            columns: self.columns.clone().unwrap_or_default(),
            resample: self.resample,
        }
    }
}

/// Relative error above which a model is doubtful.
const DOUBTFUL_ERROR: f64 = 0.2;
/// Relative error above which a model is no result.
const LARGEST_ERROR: f64 = 0.5;
/// The amplifier's range in a simulated cascade, V.
const LIMIT_V: f64 = 10.0;

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    output.ready()?;
    if let Some(force) = arguments.force_per_volt
        && !(force > 0.0 && force.is_finite())
    {
        bail!("--force-per-volt {force}: it must be above zero");
    }
    let cascade = cascade(arguments)?;
    let (recording, title, stage) = recording(arguments)?;
    let settings = MotionFitSettings {
        cutoff_hz: arguments.cutoff_hz,
        edge_s: arguments.edge_s,
        row_rate_hz: arguments.row_rate_hz,
        knots_mm: arguments.knots_um.0.iter().map(|um| 1e-3 * um).collect(),
        dead_time_s: arguments.dead_time_s,
    };
    let other = match &arguments.validate {
        Some(path) => Some(recorded::read_motion(path, &arguments.reading())?),
        None => None,
    };
    let Fit {
        candidates,
        reruns,
        chosen,
    } = fit(&recording, &settings, other.as_ref(), cascade.as_ref())?;
    let mut tables = vec![candidates_table(&candidates, &reruns)];
    let model = &candidates[chosen].model;
    let mut error = model.relative_error;
    if let (Some(path), Some(other)) = (&arguments.validate, &other) {
        let errors = validate(&candidates, other, &settings)?;
        error = errors[chosen];
        let errors: Vec<_> = candidates.iter().zip(errors).collect();
        tables.push(validation_table(&errors, &path.display().to_string()));
    }
    tables.push(motion_table(model, arguments.force_per_volt));
    for table in &tables {
        output.table(table)?;
    }
    let page = motion_page(
        &title,
        tables,
        &candidates[chosen],
        provenance(&command_line(), output.seed),
    );
    output.page(&page, "motion.html")?;
    let Arguments {
        subject,
        destination,
        ..
    } = arguments;
    ensure_fits(error)?;
    let records: Vec<PathBuf> = arguments
        .record
        .iter()
        .chain(&arguments.validate)
        .cloned()
        .collect();
    say!("{}", plant_line(model));
    destination.write(
        subject,
        stage,
        &records,
        &["friction", "plant"],
        |settings| {
            settings.plant = Some(model.plant());
            put_friction(settings, model.friction_settings());
        },
    )?;
    if let Some(explained) = judge(model, error) {
        say!("{explained}");
    }
    Ok(())
}

/// Models of a recorded motion.
pub(crate) struct Fit {
    candidates: Vec<Candidate>,
    /// The motion that each of them predicts.
    reruns: Vec<Reruns>,
    /// Number of the recommended one.
    chosen: usize,
}

impl Fit {
    /// The recommended model.
    pub(crate) fn model(&self) -> &MotionModel {
        &self.candidates[self.chosen].model
    }
}

/// Fits all models to a recorded motion, judges them on another if there is one, and refines the best.
///
/// # Errors
/// A record that no model can be fitted to.
pub(crate) fn fit(
    recording: &Recording,
    settings: &MotionFitSettings,
    other: Option<&Recording>,
    cascade: Option<&CascadeLoop>,
) -> anyhow::Result<Fit> {
    let bar = share("fitting models");
    let mut candidates = fit_motion(recording, settings, &|done| {
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.set_message("refining the best");
    let best = match other {
        Some(other) => recommended_by(&candidates, other, settings)?,
        None => recommended(&candidates),
    };
    let best = best.context("no model of the record is one of friction")?;
    // What the record hardly determines, its motion in open loop does not determine either, and the search takes a minute.
    let doubtful = !best.model.doubts().is_empty();
    let refined = (!doubtful).then(|| refined(best, recording, settings));
    bar.set_message("running the models");
    let signals = Signals::new(recording, settings);
    let rerun = |candidate: &Candidate| Reruns {
        open_loop: replay_open_loop(&candidate.model, recording, &signals),
        closed_loop: cascade
            .map(|cascade| replay_closed_loop(&candidate.model, recording, &signals, cascade)),
    };
    let is_best = |candidate: &Candidate| std::ptr::eq(candidate, best);
    let mut chosen = candidates
        .iter()
        .position(is_best)
        .context("the recommended model is none of the candidates")?;
    // A search that found no end, or nothing better, leaves the best as it is.
    if let Some(Ok(refined)) = refined {
        let rms = |candidate: &Candidate| rerun(candidate).open_loop.position_rms_mm;
        if refined.explains_as_well_as(best) && rms(&refined) < rms(best) {
            chosen = candidates.len();
        }
        candidates.push(refined);
    }
    let reruns = candidates.iter().map(rerun).collect();
    bar.finish_and_clear();
    Ok(Fit {
        candidates,
        reruns,
        chosen,
    })
}

/// Share of the voltage that a model with a relative error explains, %.
fn explained(error: f64) -> f64 {
    100.0 * (1.0 - error).max(0.0)
}

/// Checks that a model explains enough of the voltage to be a result.
///
/// # Errors
/// It does not.
pub(crate) fn ensure_fits(error: f64) -> anyhow::Result<()> {
    ensure!(
        error <= LARGEST_ERROR,
        "no model fits: the best explains {:.0} % of the voltage, and less than {:.0} % is no result; is the voltage that of this \
         axis, and does nothing else move it?",
        explained(error),
        explained(LARGEST_ERROR)
    );
    Ok(())
}

/// Warns of what is doubtful about a model; returns a line about one that explains the voltage.
pub(crate) fn judge(model: &MotionModel, error: f64) -> Option<String> {
    for doubt in model.doubts() {
        warn!(
            "warning: {} is known to ± {:.0} % only, and the plant is made of it: record {}",
            doubt.name,
            100.0 * doubt.share,
            doubt.remedy
        );
    }
    if error > DOUBTFUL_ERROR {
        warn!(
            "warning: the model explains {:.0} % of the voltage only; what is missing in it is in no parameter",
            explained(error)
        );
        return None;
    }
    Some(format!(
        "The model explains {:.1} % of the voltage",
        explained(error)
    ))
}

/// The plant of a model in a line, in the units of `quadrant design`.
pub(crate) fn plant_line(model: &MotionModel) -> String {
    let plant = model.plant();
    format!(
        "Plant: gain {:.2} mm/(V s²), damping {:.2} 1/s, delay {:.6} s",
        plant.gain_mm_per_v_s2, plant.damping_per_s, plant.delay_s
    )
}

fn cascade(arguments: &Arguments) -> anyhow::Result<Option<CascadeLoop>> {
    let (Some(position_gain_per_s), Some(kv)) = (arguments.cascade_kp, arguments.cascade_kv) else {
        return Ok(None);
    };
    if !(position_gain_per_s > 0.0 && kv > 0.0) {
        bail!("--cascade-kp {position_gain_per_s} --cascade-kv {kv}: both must be above zero");
    }
    Ok(Some(CascadeLoop {
        position_gain_per_s,
        velocity_gain_v_s_per_mm: 1e-3 * kv,
        limit_v: LIMIT_V,
    }))
}

/// Travel of an axis of which none is known, mm.
pub(crate) const TRAVEL_MM: f64 = 200.0;

/// Moves an axis to and fro, under the settings in force.
pub(crate) fn move_to_and_fro(
    test_axis: &mut dyn TestAxis,
    rounds: usize,
) -> anyhow::Result<Recording> {
    let found = with_bar("moving to and fro", |progress| {
        shuttle(test_axis, rounds, progress)
    })?;
    Ok(found)
}

/// The record, its title on a page, and the settings of the machine, if one was measured.
fn recording(arguments: &Arguments) -> anyhow::Result<(Recording, String, Option<StageSettings>)> {
    let Arguments {
        subject,
        destination,
        output,
        ..
    } = arguments;
    if let Some(path) = &arguments.record {
        let title = recorded::title(std::slice::from_ref(path));
        return Ok((
            recorded::read_motion(path, &arguments.reading())?,
            title,
            None,
        ));
    }
    let start = subject.start_axis(destination.into.as_deref())?;
    let measured = subject.measure(
        output.seed,
        start.as_ref(),
        Some(TRAVEL_MM),
        |test_axis, base| {
            if start.is_some() {
                test_axis.apply(base)?;
            }
            let recording = move_to_and_fro(test_axis, arguments.rounds.into())?;
            recording.write_csv(&output.file("motion-recording.csv")?)?;
            Ok(recording)
        },
    )?;
    Ok((measured.found, measured.title, Some(measured.stage)))
}
