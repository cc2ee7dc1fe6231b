//! `quadrant compare`.

use clap::Args;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, share};
use quadrant_cli::{say, terminal};
use quadrant_sim::circle::run_circles;
use quadrant_sim::client::plot;
use quadrant_sim::compare::comparison::{Comparison, Request};
use quadrant_sim::compare::glance::Glance;
use quadrant_sim::compare::page::{comparison_page, comparison_tables};
use quadrant_sim::compare::sine::{AMPLITUDE_MM, VELOCITIES_MM_S};
use quadrant_sim::experiment::configuration::Configuration;
use quadrant_sim::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use quadrant_sim::pages::provenance;
use quadrant_sim::record::write_trace;
use quadrant_sim::report::wrapped;

/// Options of `quadrant compare`.
#[derive(Clone, Debug, Args)]
// Beside the group of the program without a command.
#[group(id = "comparison")]
pub(super) struct Arguments {
    #[command(flatten)]
    settings: LawSettings,
    /// Noise seeds of the runs whose friction was identified from experiments, from --seed on, 1 to 100; tables give means over them.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
    /// Print every table, not only the result.
    #[arg(long)]
    tables: bool,
    #[command(flatten)]
    output: Output,
}

/// Control ticks between two lines of a trace's CSV file.
const TRACE_TICKS: usize = 10;
/// Control rate of the traces, Hz.
const RATE_HZ: f64 = 1e4;
/// Steps of the progress bar.
const STEPS: u64 = 1_000_000;

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { output, seeds, .. } = arguments;
    output.ready()?;
    let settings = arguments.settings.read()?;
    let [exact, identified] = RunConfiguration::both(&settings.stage);
    let setups = [exact.with_best_pid()?, identified.with_best_pid()?];
    let configurations = Configuration::with_best_pid();
    let bar = share("comparing on the simulated stage");
    bar.set_length(STEPS);
    let request = Request {
        setups: &setups,
        configurations: &configurations,
        amplitudes_mm: &[AMPLITUDE_MM],
        seed: output.seed,
        seeds: *seeds,
    };
    let comparison = request.run(&|done| bar.inc((done * STEPS as f64) as u64))?;
    let [_, identified] = &setups;
    let circles = run_circles(&configurations, identified, output.seed)?;
    bar.finish_and_clear();
    let own = match arguments.settings.path {
        None => "thesis'",
        Some(_) => "settings'",
    };
    let glance = Glance::of(&comparison, own);
    show(&glance, output)?;
    for table in comparison_tables(&comparison, &circles) {
        if arguments.tables {
            output.table(&table)?;
        } else {
            output.keep_table(&table)?;
        }
    }
    for knowledge in ModelKnowledge::ALL {
        for velocity in VELOCITIES_MM_S {
            write_errors(output, &comparison, knowledge, velocity)?;
        }
    }
    let settings = arguments.settings.option();
    let mut command = format!("quadrant compare{settings} --seed {}", output.seed);
    if *seeds > 1 {
        command += &format!(" --seeds {seeds}");
    }
    let page = comparison_page(
        &comparison,
        &glance,
        &circles,
        provenance(&command, output.seed),
    );
    output.page(&page, "comparison.html")?;
    if !arguments.tables {
        say!("`quadrant compare --tables` prints every table");
    }
    Ok(())
}

/// Lines of the reversal's plot.
const PLOT_LINES: usize = 6;
/// Most characters of its width.
const PLOT_WIDTH: usize = 80;

/// Prints the result: a sentence, a table, a reversal.
fn show(glance: &Glance, output: &Output) -> anyhow::Result<()> {
    let width = terminal::output_width();
    say!("{}\n", wrapped(&glance.sentence, width).join("\n"));
    output.table(&glance.table)?;
    let Some((_, first)) = glance.reversals.first() else {
        return Ok(());
    };
    let caption = format!(
        "One reversal at {} mm/s: error in um over {:.2} s",
        VELOCITIES_MM_S[0],
        first.duration_s()
    );
    say!("{caption}");
    let width = width.min(PLOT_WIDTH);
    let curves: Vec<&[f64]> = glance
        .reversals
        .iter()
        .map(|(_, reversal)| reversal.error_um.as_slice())
        .collect();
    let mut names = String::new();
    for (index, (name, _)) in glance.reversals.iter().enumerate() {
        let place = plot::place(index, curves.len(), width);
        names = format!("{names:<place$}{name}");
    }
    say!("{names}");
    for line in plot::beside(&curves, width, PLOT_LINES) {
        say!("{line}");
    }
    say!();
    Ok(())
}

/// Writes the errors of all configurations over the last cycle at one velocity.
fn write_errors(
    output: &Output,
    comparison: &Comparison,
    knowledge: ModelKnowledge,
    velocity_mm_s: f64,
) -> anyhow::Result<()> {
    // To the nanometre.
    let thin = |signal: &[f64]| {
        let thinned = signal.iter().step_by(TRACE_TICKS);
        thinned.map(|mm| (1e6 * mm).round() / 1e6).collect()
    };
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for configuration in Configuration::with_best_pid() {
        let Some(entry) = comparison.find(configuration, knowledge, AMPLITUDE_MM, velocity_mm_s)
        else {
            continue;
        };
        let cycle = &entry.last_cycle;
        if columns.is_empty() {
            let reference: Vec<f64> = thin(&cycle.reference_mm);
            let time = (0..reference.len()).map(|k| (k * TRACE_TICKS) as f64 / RATE_HZ);
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
    write_trace(&output.file(&name)?, &columns)?;
    Ok(())
}
