//! A board's image on a chip model that others wrote: see README.md.

mod ad5754r;
mod bench;
mod biss;
mod board;
mod link;
mod log;
mod report;
mod scenarios;
mod stage;
mod wiring;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Instant;

use clap::Parser;

use crate::bench::Subject;
use crate::report::Report;
use crate::scenarios::{SCENARIOS, Scenario};
use crate::wiring::BOARDS;

/// Run a board's image on a model of its chip, and compare what it does with manuals and documentation.
#[derive(Parser)]
#[command(name = "cargo xtask board-run", bin_name = "cargo xtask board-run")]
struct Options {
    /// The image [default: built from the tree]
    #[arg(long, required_unless_present = "list")]
    image: Option<PathBuf>,
    /// The board that the image is for
    #[arg(long, default_value = BOARDS[0].name, value_parser = BOARDS.map(|board| board.name))]
    board: String,
    /// Names the scenarios
    #[arg(long)]
    list: bool,
    /// Runs the scenarios of this name only; may be repeated
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Prints the firmware's log, too
    #[arg(long)]
    log: bool,
}

fn main() -> ExitCode {
    let options = Options::parse();
    if options.list {
        for Scenario { name, about, .. } in SCENARIOS {
            println!("{name:<16} {about}");
        }
        return ExitCode::SUCCESS;
    }
    let known = |name: &&String| {
        SCENARIOS
            .iter()
            .all(|scenario| scenario.name != name.as_str())
    };
    if let Some(name) = options.only.iter().find(known) {
        eprintln!("error: no scenario is called {name}; `cargo xtask board-run --list` names all");
        return ExitCode::FAILURE;
    }
    let chosen = SCENARIOS
        .iter()
        .filter(|s| options.only.is_empty() || options.only.iter().any(|n| n == s.name));
    let board = BOARDS.into_iter().find(|board| board.name == options.board);
    let board = board.unwrap_or(BOARDS[0]);
    let image = Subject {
        image: options.image.unwrap_or_default(),
        board,
        instructions_per_s: board.instructions_per_s,
    };
    log::SHOWN.store(options.log, Ordering::Relaxed);
    let started = Instant::now();
    let (mut rows, mut failed) = (0, 0);
    for scenario in chosen {
        let report = run(scenario, &image);
        rows += report.rows;
        failed += report.failed;
    }
    println!(
        "{rows} rows, {failed} not as expected, {:.0} s",
        started.elapsed().as_secs_f64()
    );
    if failed == 0 && rows > 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs a scenario.
fn run(scenario: &Scenario, image: &Subject) -> Report {
    let started = Instant::now();
    let mut report = Report::default();
    println!("{}", scenario.name);
    if let Err(error) = (scenario.run)(image, &mut report) {
        report.row(
            "the scenario itself",
            "runs to its end",
            format!("{error:#}"),
            false,
        );
    }
    println!("  {:.1} s", started.elapsed().as_secs_f64());
    report
}
