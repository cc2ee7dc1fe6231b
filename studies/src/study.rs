//! The frame of a study: its options, its runs under a progress bar, its tables in the terminal, and its page.

use clap::Args;
use quadrant_cli::output::{Output, command_line, share};
use quadrant_cli::say;
use quadrant_pages::parts::provenance;
use quadrant_report::{Block, Page, Section, Table};

/// Receives the share of a whole that was done since its last call, from any thread.
pub type Advance<'a> = &'a (dyn Fn(f64) + Sync);

/// A study; its fields are its options.
pub trait Study: Args {
    /// Name of its page's file.
    const NAME: &'static str;
    /// Heading of its page.
    const TITLE: &'static str;
    /// Line below the heading.
    const SUBTITLE: &'static str;

    /// Runs it. `seed` decides the simulated noise.
    ///
    /// # Errors
    /// Refused options or settings, or a run that fails.
    fn run(&self, seed: u64, advance: Advance<'_>) -> anyhow::Result<Vec<Section>>;

    /// True if the tables of a section are shown in the terminal.
    fn shows(&self, _section: &Section) -> bool {
        true
    }
}

/// Options of a study, and where its results go.
#[derive(Clone, Debug, Args)]
pub struct Arguments<S: Args> {
    #[command(flatten)]
    study: S,
    #[command(flatten)]
    output: Output,
}

/// Steps of the progress bar.
const STEPS: f64 = 1e6;

impl<S: Study> Arguments<S> {
    /// Runs the study, prints its tables and writes its page.
    ///
    /// # Errors
    /// As [`Study::run`]; a file that cannot be written.
    pub fn run(&self) -> anyhow::Result<()> {
        let Self { study, output } = self;
        output.ready()?;
        let bar = share(S::NAME);
        bar.set_length(STEPS as u64);
        let sections = study.run(output.seed, &|share| bar.inc((share * STEPS) as u64))?;
        bar.finish_and_clear();
        say!("Simulated, not measured; seed {}\n", output.seed);
        for section in &sections {
            for table in section.blocks.iter().filter_map(table_of) {
                if study.shows(section) {
                    output.table(table)?;
                } else {
                    output.keep_table(table)?;
                }
            }
        }
        let page = Page {
            title: S::TITLE.to_owned(),
            subtitle: format!("{}; simulated, not measured", S::SUBTITLE),
            provenance: provenance(&command_line(), output.seed),
            sections,
        };
        output.page(&page, S::NAME)
    }
}

fn table_of(block: &Block) -> Option<&Table> {
    match block {
        Block::Table(table) => Some(table),
        Block::Figure(_) => None,
        Block::Labelled { block, .. } => table_of(block),
    }
}

/// A section of these blocks alone.
pub fn results(blocks: Vec<Block>) -> Vec<Section> {
    vec![Section {
        id: "results".to_owned(),
        heading: "Results".to_owned(),
        provenance: None,
        prose: Vec::new(),
        blocks,
    }]
}
