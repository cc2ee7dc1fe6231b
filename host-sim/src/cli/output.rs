//! Where results go: tables to the terminal and to CSV files, pages to HTML.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use quadrant_sim::report::{Page, Table};

/// Options that every experiment has.
#[derive(Clone, Debug, Args)]
pub(super) struct Output {
    /// Folder for CSV files and the HTML page; made if it is missing.
    #[arg(long, default_value = Self::FOLDER, value_name = "FOLDER")]
    out: PathBuf,
    /// Seed of the simulated noise; the same seed gives the same results.
    #[arg(long, default_value_t = Self::SEED)]
    pub(super) seed: u64,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            out: Self::FOLDER.into(),
            seed: Self::SEED,
        }
    }
}

impl Output {
    const FOLDER: &str = "quadrant-out";
    const SEED: u64 = 1;

    /// The path of a file in the folder, which is made.
    pub(super) fn file(&self, name: &str) -> anyhow::Result<PathBuf> {
        std::fs::create_dir_all(&self.out)
            .with_context(|| format!("cannot make the folder {}", self.out.display()))?;
        Ok(self.out.join(name))
    }

    /// Prints a table and writes it as CSV.
    pub(super) fn table(&self, table: &Table) -> anyhow::Result<()> {
        println!("{}\n", table.to_text());
        table.write_csv(self.file(&format!("{}.csv", table.id))?)?;
        Ok(())
    }

    /// Writes a page.
    pub(super) fn page(&self, page: &Page, name: &str) -> anyhow::Result<()> {
        let path = self.file(name)?;
        page.write_html(&path)?;
        println!(
            "{}: open it in a browser; the tables beside it are CSV",
            path.display()
        );
        Ok(())
    }
}

/// A progress bar over a share of 0 to 1, in thousandths; hidden where nobody watches.
pub(super) fn share(what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {percent} %, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style).with_message(what)
}

/// A progress bar over `runs`; hidden where nobody watches.
pub(super) fn progress(runs: u64, what: &'static str) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} runs, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(runs).with_style(style).with_message(what)
}

/// The command line as it was given, but for the folder of the results: what a reader repeats.
pub(super) fn command_line() -> String {
    let mut words = vec!["quadrant".to_owned()];
    let mut given = std::env::args().skip(1);
    while let Some(word) = given.next() {
        if word == "--out" {
            given.next();
        } else if !word.starts_with("--out=") {
            words.push(word);
        }
    }
    words.join(" ")
}
