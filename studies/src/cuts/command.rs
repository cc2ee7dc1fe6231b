//! `quadrant-studies cuts`.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use anyhow::Context;
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
    /// Folder for a trace of each seed: errors, scale, gate and voltages over time, as CSV.
    #[arg(long, value_name = "FOLDER")]
    traces: Option<PathBuf>,
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
    if let Some(folder) = &arguments.traces {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let lines = arguments.campaign.lines(
        &arguments.results,
        "cutting",
        |_| true,
        |seed| judge(seed, arguments.traces.as_deref()),
    )?;
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
    say!(
        "Settled, with nothing new since the last reversal but one: {:.1} % of the windows\n",
        mean(|line| line.settled_percent)
    );
    type Read = fn(&Line) -> f64;
    let laws: [(&str, [Read; 4]); 3] = [
        (
            "as commissioned",
            [
                |line| line.fixed_worst_ratio,
                |line| line.fixed_worse_percent,
                |line| line.fixed_settled_worst_ratio,
                |line| line.fixed_settled_worse_percent,
            ],
        ),
        (
            "learning",
            [
                |line| line.worst_ratio,
                |line| line.worse_percent,
                |line| line.settled_worst_ratio,
                |line| line.settled_worse_percent,
            ],
        ),
        (
            "cancelling",
            [
                |line| line.cancelling_worst_ratio,
                |line| line.cancelling_worse_percent,
                |line| line.cancelling_settled_worst_ratio,
                |line| line.cancelling_settled_worse_percent,
            ],
        ),
    ];
    for (name, [worst, percent, settled_worst, settled_percent]) in laws {
        for (windows, ratio, percent) in [
            ("all", worst, percent),
            ("settled", settled_worst, settled_percent),
        ] {
            let cases = lines.values().filter(|line| ratio(line) > WORSE).count();
            let mut ratios: Vec<f64> = lines.values().map(ratio).collect();
            ratios.sort_by(f64::total_cmp);
            say!(
                "{name:<16} {windows:<8} worse than without feedforward in {cases} cases and {:.2} % of the windows; worst window of \
                 a case: median x {:.3}, largest x {:.3}",
                mean(percent),
                ratios[ratios.len() / 2],
                ratios[ratios.len() - 1]
            );
        }
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
