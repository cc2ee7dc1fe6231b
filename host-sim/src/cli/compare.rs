//! `quadrant compare`.

use std::path::{Path, PathBuf};

use clap::Args;
use quadrant_sim::circle::run_circles;
use quadrant_sim::command::output::{Output, progress};
use quadrant_sim::compare::page::{comparison_page, comparison_tables};
use quadrant_sim::compare::sine;
use quadrant_sim::compare::sine::{Outcome, VELOCITIES_MM_S, find};
use quadrant_sim::experiment::configuration::Configuration;
use quadrant_sim::experiment::run_configuration::{Knowledge, Setup};
use quadrant_sim::pages::provenance;
use quadrant_sim::record::write_trace;
use quadrant_sim::settings_file::SettingsFile;

/// Options of `quadrant compare`.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct Arguments {
    /// Settings of the virtual machine's control law, as `quadrant commission` leaves them.
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

/// Control ticks between two lines of a trace's CSV file.
const TRACE_TICKS: usize = 10;
/// Control period of the traces, s.
const PERIOD_S: f64 = 1e-4;

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let output = &arguments.output;
    let setups = setups(arguments.settings.as_deref())?;
    let runs = sine::RUNS * setups.len() as u64 + 1;
    let bar = progress(runs, "comparing on the simulated stage");
    let outcomes = sine::run_all::<f32>(&setups, output.seed, &bar)?;
    let [_, virtual_machine] = &setups;
    let circles = run_circles::<f32>(&Configuration::all(), virtual_machine, output.seed)?;
    bar.inc(1);
    bar.finish_and_clear();
    println!(
        "Simulated, not measured. x axis, sine of 30 mm; 10 kHz, f32; seed {}\n",
        output.seed
    );
    for table in comparison_tables(&outcomes, &circles) {
        output.table(&table)?;
    }
    for knowledge in Knowledge::ALL {
        for velocity in VELOCITIES_MM_S {
            write_errors(output, &outcomes, knowledge, velocity)?;
        }
    }
    let settings = arguments.settings.as_ref();
    let settings = settings.map_or_else(String::new, |path| {
        format!(" --settings {}", path.display())
    });
    let command = format!("quadrant compare{settings} --seed {}", output.seed);
    let page = comparison_page(&outcomes, &circles, provenance(&command, output.seed));
    output.page(&page, "comparison.html")
}

/// Both setups; the virtual machine's with the settings of a file, if there is one.
fn setups(settings: Option<&Path>) -> anyhow::Result<[Setup; 2]> {
    let Some(path) = settings else {
        return Ok(Setup::both()?);
    };
    let stage = SettingsFile::read(path)?.stage;
    Ok([Setup::matched(), Setup::virtual_machine(stage)])
}

/// Writes the errors of all configurations over the last cycle at one velocity.
fn write_errors(
    output: &Output,
    outcomes: &[Outcome],
    knowledge: Knowledge,
    velocity_mm_s: f64,
) -> anyhow::Result<()> {
    let thin = |signal: &[f64]| {
        signal
            .iter()
            .step_by(TRACE_TICKS)
            .copied()
            .collect::<Vec<_>>()
    };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for configuration in Configuration::all() {
        let Some(outcome) = find(outcomes, configuration, knowledge, velocity_mm_s) else {
            continue;
        };
        let cycle = &outcome.last_cycle;
        if columns.is_empty() {
            let reference = thin(&cycle.reference_mm);
            let time = (0..reference.len()).map(|k| (k * TRACE_TICKS) as f64 * PERIOD_S);
            columns.push(("t_s".to_owned(), time.collect()));
            columns.push(("reference_mm".to_owned(), reference));
        }
        columns.push((
            format!("error_mm {}", configuration.name()),
            thin(&cycle.error_mm),
        ));
    }
    let columns: Vec<(&str, &[f64])> = columns
        .iter()
        .map(|(name, signal)| (name.as_str(), signal.as_slice()))
        .collect();
    let name = format!(
        "errors-{}-{velocity_mm_s}-mm-s.csv",
        knowledge.name().replace(' ', "-")
    );
    write_trace(output.file(&name)?, &columns)?;
    Ok(())
}
