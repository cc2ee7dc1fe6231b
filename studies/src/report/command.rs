//! `quadrant-studies report`.

use clap::Args;
use clap::builder::PossibleValuesParser;
use quadrant_cli::law_settings::LawSettings;
use quadrant_cli::output::{Output, share};
use quadrant_cli::{say, warn};
use quadrant_report::{Block, Page, Table};

use crate::report::{Context, Done, PARTS, Part, Request, compute};

/// Options of `quadrant-studies report`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// Only this part, and its tables in the terminal; may be given several times.
    #[arg(long, value_name = "PART", value_parser = PossibleValuesParser::new(PARTS.iter().map(|part| part.id)))]
    only: Vec<String>,
    /// Say which parts there are, and about how long each takes, and stop.
    #[arg(long)]
    list: bool,
    /// Compute everything, also what an earlier report left in the folder.
    #[arg(long)]
    fresh: bool,
    /// Runs of each configuration with the identified model, with consecutive seeds: means are shown with one standard deviation.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    #[command(flatten)]
    settings: LawSettings,
    #[command(flatten)]
    output: Output,
}

/// The part that is shown in the terminal when all are asked for.
const SHOWN: &str = "headline";

/// Runs the study, prints its tables and writes its page.
///
/// # Errors
/// Refused arguments, a run that fails, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Arguments { output, only, .. } = arguments;
    let context = Context::new(output.seed, arguments.seeds, arguments.settings.clone())?;
    if arguments.list {
        for part in PARTS {
            let shared_s = if part.needs_comparison {
                context.comparison_s()
            } else {
                0.0
            };
            let seconds = shared_s + (part.expected_s)(&context);
            say!("{:<12} {seconds:>5.0} s  {}", part.id, part.title);
        }
        let sharing = PARTS.iter().filter(|part| part.needs_comparison);
        let sharing: Vec<&str> = sharing.map(|part| part.id).collect();
        say!(
            "On two cores. {:.0} s of {} are the same runs, which one report does once.",
            context.comparison_s(),
            sharing.join(", ")
        );
        return Ok(());
    }
    let is_requested = |part: &&Part| only.is_empty() || only.iter().any(|id| id == part.id);
    let parts: Vec<Part> = PARTS.iter().filter(is_requested).copied().collect();
    let bar = share("report");
    bar.enable_steady_tick(std::time::Duration::from_millis(200));
    let done = compute(
        &Request {
            parts: &parts,
            context: &context,
            folder: output.file("parts")?,
            fresh: arguments.fresh,
        },
        &bar,
        &mut |line| bar.suspend(|| warn!("{line}")),
    )?;
    bar.finish_and_clear();
    say!(
        "Simulated, not measured; seed {}, {} seeds\n",
        output.seed,
        arguments.seeds
    );
    for Done { part, sections } in &done {
        let shown = part.id == SHOWN || !only.is_empty();
        let blocks = sections.iter().flat_map(|section| &section.blocks);
        for table in blocks.filter_map(table_of) {
            if shown {
                output.table(table)?;
            } else {
                table.write_csv(&output.file(&format!("{}.csv", table.id))?)?;
            }
        }
    }
    let named: Vec<&str> = if only.is_empty() {
        Vec::new()
    } else {
        parts.iter().map(|part| part.id).collect()
    };
    let page = Page {
        title: "The thesis' tables and figures on the simulated stage".to_owned(),
        subtitle: "Under the thesis' numbers, beside its headline figures; simulated, not measured"
            .to_owned(),
        provenance: context.provenance(&named),
        sections: done.into_iter().flat_map(|done| done.sections).collect(),
    };
    output.page(&page, "report.html")
}

fn table_of(block: &Block) -> Option<&Table> {
    match block {
        Block::Table(table) => Some(table),
        Block::Figure(_) => None,
        Block::Labelled { block, .. } => table_of(block),
    }
}
