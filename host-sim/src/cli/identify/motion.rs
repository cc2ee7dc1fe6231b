//! `quadrant identify motion`.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_sim::identify::motion::{
    CascadeLoop, MotionFitSettings, MotionModel, fit_motion, recommended, replay_closed_loop,
    replay_open_loop, shuttle,
};
use quadrant_sim::presentation::{Reruns, candidates_table, motion_page, motion_table, provenance};
use quadrant_sim::record::Recording;
use quadrant_sim::settings_file::{Provenance, SettingsFile};

use super::rig::Axis;
use super::{recorded, simulated};
use crate::cli::output::{Output, command_line, share};

/// Options of `quadrant identify motion`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct Arguments {
    /// The axis of the simulated stage, which is moved to and fro; with --record, which axis of --settings it is.
    #[arg(long, value_enum, required_unless_present = "record")]
    axis: Option<Axis>,
    /// A recorded motion: a CSV file with t_s, position_mm (or position_m), voltage_v and, for a closed loop, reference_mm (or
    /// reference_m).
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
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
    #[arg(long, value_delimiter = ',', default_values_t = [2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 50.0], value_name = "UM,...")]
    knots_um: Vec<f64>,
    /// Dead time from voltage to force, s, if it is known, from a frequency response for instance: gentle motions hardly tell it
    /// from inertia.
    #[arg(long, value_name = "S")]
    dead_time_s: Option<f64>,
    /// Position gain kp of the cascade that followed the record's reference, 1/s: adds its simulation in closed loop.
    #[arg(long, value_name = "PER_S", requires = "cascade_kv")]
    cascade_kp: Option<f64>,
    /// Velocity gain kv of that cascade, V s/m.
    #[arg(long, value_name = "V_S_PER_M", requires = "cascade_kp")]
    cascade_kv: Option<f64>,
    /// Settings into whose axis --axis the model and the friction are written, as a new file.
    #[arg(long, value_name = "FILE", requires = "axis")]
    settings: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// The amplifier's range in a simulated cascade, V.
const LIMIT_V: f64 = 10.0;

pub(in crate::cli) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    if let Some(force) = arguments.force_per_volt
        && !(force > 0.0 && force.is_finite())
    {
        bail!("--force-per-volt {force}: it must be above zero");
    }
    let cascade = cascade(arguments)?;
    let (recording, subject) = recording(arguments)?;
    let settings = MotionFitSettings {
        cutoff_hz: arguments.cutoff_hz,
        edge_s: arguments.edge_s,
        row_rate_hz: arguments.row_rate_hz,
        knots_mm: arguments.knots_um.iter().map(|um| 1e-3 * um).collect(),
        dead_time_s: arguments.dead_time_s,
    };
    let bar = share("fitting models");
    let candidates = fit_motion(&recording, &settings, &|done| {
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.set_message("running the models");
    let reruns: Vec<Reruns> = candidates
        .iter()
        .map(|candidate| Reruns {
            open_loop: replay_open_loop(&candidate.model, &recording),
            closed_loop: cascade
                .as_ref()
                .map(|cascade| replay_closed_loop(&candidate.model, &recording, cascade)),
        })
        .collect();
    bar.finish_and_clear();
    let chosen = recommended(&candidates).context("no model of the record is one of friction")?;
    let tables = vec![
        candidates_table(&candidates, &reruns),
        motion_table(&chosen.model, arguments.force_per_volt),
    ];
    for table in &tables {
        output.table(table)?;
    }
    let command = command_line();
    let page = motion_page(&subject, tables, chosen, provenance(&command, output.seed));
    output.page(&page, "motion.html")?;
    write_settings(arguments, &chosen.model, &command)
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

/// The record, and what a page calls it.
fn recording(arguments: &Arguments) -> anyhow::Result<(Recording, String)> {
    match (&arguments.record, arguments.axis) {
        (Some(path), _) => {
            let title = recorded::title(std::slice::from_ref(path));
            Ok((recorded::read(path)?, title))
        }
        (None, Some(axis)) => {
            let output = &arguments.output;
            let bar = share("moving to and fro");
            let recording = shuttle(&mut axis.test_axis(output.seed), ROUNDS, &mut |done| {
                bar.set_position((1000.0 * done) as u64);
            })?;
            bar.finish_and_clear();
            println!("Simulated, not measured.");
            recording.write_csv(output.file("motion-recording.csv")?)?;
            Ok((recording, simulated(axis)))
        }
        (None, None) => bail!("--record or --axis is needed"),
    }
}

/// Rounds of the simulated stage's motion.
const ROUNDS: usize = 2;

/// Writes model and friction into the settings of the axis.
fn write_settings(arguments: &Arguments, model: &MotionModel, command: &str) -> anyhow::Result<()> {
    let (Some(path), Some(axis)) = (&arguments.settings, arguments.axis) else {
        return Ok(());
    };
    let mut file = SettingsFile::read(path)?;
    let settings = &mut file.stage.axes[axis.index()];
    settings.plant = Some(model.plant());
    settings.friction = model.friction_settings();
    file.provenance.push(Provenance {
        command: command.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        axis: axis.name().to_owned(),
        records: arguments
            .record
            .iter()
            .map(|path| path.display().to_string())
            .collect(),
        sets: ["friction", "plant"].map(str::to_owned).into(),
    });
    let path = arguments.output.file("settings.toml")?;
    file.write(&path)?;
    println!(
        "{}: the settings with this friction and model; the feedback gains are as they were, design them anew",
        path.display()
    );
    Ok(())
}
