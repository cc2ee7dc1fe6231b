//! `quadrant-studies cuts`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;

use super::{Line, WORSE, judge};
use crate::campaign::{Campaign, Seeded};
use quadrant_cli::say;

/// Options of `quadrant-studies cuts`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    campaign: Campaign,
    /// Results, a line a seed: those that are there already are not run again.
    #[arg(long, default_value = "cuts.csv", value_name = "FILE")]
    results: PathBuf,
}

impl Seeded for Line {
    fn seed(&self) -> u64 {
        self.seed
    }
}

/// Largest number of cases that are listed one by one.
const LISTED: usize = 10;

/// Runs the campaign, or sums up what earlier ones have found.
///
/// # Errors
/// A file that cannot be read or written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let results = &arguments.results;
    let lines = arguments
        .campaign
        .lines(results, "cutting", |_| true, judge)?;
    summary(&lines);
    Ok(())
}

/// Prints the shares of worse windows, and the worst cases, each with its seed.
fn summary(lines: &BTreeMap<u64, Line>) {
    say!("Simulated, not measured: {} random cuts\n", lines.len());
    // Without the runs that a fault ended: they have no RMS error.
    let mean = |read: fn(&Line) -> f64| {
        let finite = || lines.values().map(read).filter(|value| value.is_finite());
        finite().sum::<f64>() / finite().count() as f64
    };
    let ended = lines
        .values()
        .filter(|line| !(line.worst_ratio + line.cancelling_worst_ratio).is_finite());
    say!("Ended by a fault: {}", ended.count());
    for (name, ratio, percent) in [
        (
            "as commissioned",
            (|line| line.fixed_worst_ratio) as fn(&Line) -> f64,
            (|line| line.fixed_worse_percent) as fn(&Line) -> f64,
        ),
        (
            "learning",
            |line| line.worst_ratio,
            |line| line.worse_percent,
        ),
        (
            "cancelling",
            |line| line.cancelling_worst_ratio,
            |line| line.cancelling_worse_percent,
        ),
    ] {
        let cases = lines.values().filter(|line| ratio(line) > WORSE).count();
        let mut ratios: Vec<f64> = lines.values().map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        say!(
            "{name:<16} worse than without feedforward in {cases} cases and {:.2} % of the windows; worst window of a case: \
             median x {:.3}, largest x {:.3}",
            mean(percent),
            ratios[ratios.len() / 2],
            ratios[ratios.len() - 1]
        );
    }
    say!(
        "\nRMS error, mean over the cases: {:.2} um without, {:.2} um as commissioned, {:.2} um learning, {:.2} um learning and \
         cancelling",
        mean(|line| line.off_um),
        mean(|line| line.fixed_um),
        mean(|line| line.learning_um),
        mean(|line| line.cancelling_um)
    );
    let mut worst: Vec<&Line> = lines.values().collect();
    worst.sort_by(|a, b| {
        b.cancelling_worst_ratio
            .total_cmp(&a.cancelling_worst_ratio)
    });
    say!("\nWorst with cancelling, to be replayed with --seeds SEED+1 --results FILE:");
    for line in worst.iter().take(LISTED) {
        say!(
            "{:>6}  x {:.3} at {:>4.1} s: {}",
            line.seed,
            line.cancelling_worst_ratio,
            line.cancelling_worst_at_s,
            line.case
        );
    }
}
