//! `quadrant compare`.

use clap::Args;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, share};
use quadrant_cli::say;
use quadrant_sim::circle::run_circles;
use quadrant_sim::compare::comparison::{Comparison, Request};
use quadrant_sim::compare::honest::{self, with_best_pid};
use quadrant_sim::compare::page::{comparison_page, comparison_tables};
use quadrant_sim::compare::sine::{AMPLITUDE_MM, VELOCITIES_MM_S};
use quadrant_sim::experiment::configuration::Configuration;
use quadrant_sim::experiment::run_configuration::{ModelKnowledge, RunConfiguration};
use quadrant_sim::pages::provenance;
use quadrant_sim::record::write_trace;

/// Options of `quadrant compare`.
#[derive(Clone, Debug, Args)]
// Beside the group of the program without a command.
#[group(id = "comparison")]
pub(super) struct Arguments {
    #[command(flatten)]
    settings: LawSettings,
    /// Noise seeds of the runs with the identified model, from --seed on, 1 to 100; tables give means over them.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=100))]
    seeds: u64,
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
    let setups = RunConfiguration::both(&settings.stage);
    let configurations = Configuration::all();
    let bar = share("comparing on the simulated stage");
    bar.set_length(STEPS);
    let best = RunConfiguration::both(&with_best_pid(&settings.stage)?);
    let request = |setups, configurations| Request {
        setups,
        configurations,
        amplitudes_mm: &[AMPLITUDE_MM],
        seed: output.seed,
        seeds: *seeds,
    };
    let requests = [
        request(&setups, &configurations),
        request(&best, &honest::CONFIGURATIONS),
    ];
    let whole_s: f64 = requests.iter().map(Request::expected_s).sum();
    let [comparison, honest] = requests.each_ref().map(|request| {
        let share = request.expected_s() / whole_s;
        request.run(&|done| bar.inc((done * share * STEPS as f64) as u64))
    });
    let (comparison, honest) = (comparison?, honest?);
    let [_, identified] = &setups;
    let circles = run_circles(&configurations, identified, output.seed)?;
    bar.finish_and_clear();
    say!(
        "Simulated, not measured. x axis, sine of 30 mm; 10 kHz, f32; seed {}\n",
        output.seed
    );
    for table in comparison_tables(&comparison, &honest, &circles) {
        output.table(&table)?;
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
        &honest,
        &circles,
        provenance(&command, output.seed),
    );
    output.page(&page, "comparison.html")
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
    for configuration in Configuration::all() {
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
