//! `quadrant-studies robustness`.

use std::path::PathBuf;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::axis::Axis;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, command_line, progress};
use quadrant_cli::say;
use quadrant_pages::parts::provenance;
use quadrant_report::Page;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_tune::record::{ForceRecord, write_trace};

use crate::robustness::page::{robustness_full_table, robustness_sections, robustness_tables};
use crate::robustness::study::{StudyRequest, names, run_study, runs};

/// Options of `quadrant-studies robustness`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// The axis of the simulated stage.
    #[arg(long, value_enum, default_value = "x")]
    axis: Axis,
    #[command(flatten)]
    settings: LawSettings,
    /// Runs of each scenario and law, with a seed each, 1 to 100.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Backlash of the rack, um, 0 to 1000.
    #[arg(long, default_value_t = 20.0, value_name = "UM")]
    backlash_um: f64,
    /// Recorded force on the table, CSV: t_s, even, and force_x_n, force_y_n or force_z_n, in N; repeated as long as it
    /// takes.
    #[arg(long, value_name = "FILE")]
    force: Option<PathBuf>,
    /// Run only scenarios whose name contains this, and those that changes are counted from; no compliance.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// List the scenarios, and run none.
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    output: Output,
}

/// Sampling time of the cutting force that is written, s.
const FORCE_PERIOD_S: f64 = 2e-4;
/// Its samples: ten turns of the spindle.
const FORCE_SAMPLES: usize = 1000;

/// Runs the study, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { axis, output, .. } = arguments;
    if !(0.0..=1000.0).contains(&arguments.backlash_um) {
        bail!(
            "--backlash-um is {}, and may be 0 to 1000 um: a gap is not negative, and a larger one is a broken drive",
            arguments.backlash_um
        );
    }
    let backlash_mm = 1e-3 * arguments.backlash_um;
    if arguments.list {
        for (name, what) in names(axis.index(), backlash_mm) {
            say!("{name:<28} {what}");
        }
        return Ok(());
    }
    output.ready()?;
    let stage = arguments.settings.read()?.stage;
    let request = StudyRequest {
        stage,
        axis: axis.index(),
        backlash_mm,
        force: recorded_force(arguments)?,
        only: arguments.only.clone(),
        seed: output.seed,
        seeds: arguments.seeds,
    };
    let bar = progress(runs(&request), "running the scenarios");
    let report = run_study(&request, &|| bar.inc(1))?;
    bar.finish_and_clear();
    say!(
        "Simulated, not measured: {} axis; runs of each: {}, seeds from {} on\n",
        axis.name(),
        arguments.seeds,
        output.seed
    );
    for table in robustness_tables(&report) {
        output.table(&table)?;
    }
    let all = robustness_full_table(&report);
    all.write_csv(&output.file(&format!("{}.csv", all.id))?)?;
    write_cutting_force(output)?;
    let page = Page {
        title: "Robustness on the simulated stage".to_owned(),
        subtitle: "PID and N-PID, with and without friction compensation, on an axis that is no longer what it was; simulated, \
                   not measured"
            .to_owned(),
        provenance: provenance(&command_line(), output.seed),
        sections: robustness_sections(&report),
    };
    output.page(&page, "robustness.html")
}

/// The force of the file along the axis.
fn recorded_force(
    arguments: &Arguments,
) -> anyhow::Result<Option<quadrant_sim::plant::load::Force>> {
    let Some(path) = &arguments.force else {
        return Ok(None);
    };
    let axis = arguments.axis;
    let force = ForceRecord::read_csv(path)?.axes[axis.index()].take();
    let force = force.with_context(|| {
        format!(
            "{}: there is no column force_{}_n for the {} axis; add it, or choose another --axis",
            path.display(),
            axis.name(),
            axis.name()
        )
    })?;
    Ok(Some(force))
}

/// Writes the force that the cutting scenarios are made with: synthetic, and a template of a recorded one.
fn write_cutting_force(output: &Output) -> anyhow::Result<()> {
    let cut = Milling::slot();
    let time: Vec<f64> = (0..FORCE_SAMPLES)
        .map(|k| k as f64 * FORCE_PERIOD_S)
        .collect();
    let force = |component| -> Vec<f64> {
        time.iter()
            .map(|time_s| cut.force_n(component, *time_s))
            .collect()
    };
    let (feed, normal) = (force(Component::Feed), force(Component::Normal));
    write_trace(
        &output.file("synthetic-cutting-force.csv")?,
        &[("t_s", &time), ("force_x_n", &normal), ("force_y_n", &feed)],
    )?;
    Ok(())
}
