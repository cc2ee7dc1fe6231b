//! `quadrant-studies axes`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;

use super::cases::table;
use super::page::page;
use super::{Judging, Line, Outcome, RandomAxis, judged};
use crate::campaign::{Campaign, Seeded};
use quadrant_cli::{say, warn};

/// Options of `quadrant-studies axes`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    campaign: Campaign,
    /// Results, a line a seed: those that are there already are not run again.
    #[arg(long, default_value = "axes.csv", value_name = "FILE")]
    results: PathBuf,
    /// Folder for a page of each axis: what was found beside what is true, and everything that was tried.
    #[arg(long, value_name = "FOLDER")]
    pages: Option<PathBuf>,
    /// Only axes without a resonance.
    #[arg(long)]
    rigid: bool,
    /// Named axes instead, each with one thing that a commissioning may stumble over: a table of them, in Markdown.
    #[arg(long, conflicts_with_all = ["seeds", "shard", "merge", "rigid", "pages"])]
    cases: bool,
}

impl Seeded for Line {
    fn seed(&self) -> u64 {
        self.seed
    }
}

/// Runs the campaign, or sums up what earlier ones have found.
///
/// # Errors
/// A file that cannot be read or written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if arguments.cases {
        table();
        return Ok(());
    }
    if let Some(folder) = &arguments.pages {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    }
    let is_requested = |seed: u64| !arguments.rigid || RandomAxis::new(seed).is_rigid();
    let lines = arguments.campaign.lines(
        &arguments.results,
        "commissioning random axes",
        is_requested,
        |seed| judge_with_page(seed, arguments.pages.as_deref()),
    )?;
    summary(&lines);
    Ok(())
}

/// Commissions the axis of a seed, judges the result, and leaves its page in a folder.
fn judge_with_page(seed: u64, folder: Option<&Path>) -> Line {
    let subject = RandomAxis::new(seed).subject();
    let judged = judged(&subject, super::Path::of(seed), Judging::SmallToo);
    if let Some(folder) = folder {
        let path = folder.join(format!("{seed}.html"));
        // The result is worth more than its page.
        if let Err(error) = page(&subject, &judged).write_html(&path) {
            warn!("{}: {error}", path.display());
        }
    }
    judged.line
}

/// Largest number of axes that are listed one by one.
const LISTED: usize = 10;

/// Prints the counts, the errors, and the worst axes, each with its seed.
fn summary(lines: &BTreeMap<u64, Line>) {
    say!("Simulated, not measured: {} random axes\n", lines.len());
    for outcome in [
        Outcome::Commissioned,
        Outcome::PidAlone,
        Outcome::WorseThanPid,
        Outcome::WorseWhenSmall,
        Outcome::Refused,
        Outcome::RefusedWrongly,
        Outcome::LeftTravel,
    ] {
        let count = lines
            .values()
            .filter(|line| line.outcome == outcome)
            .count();
        let percent = 100.0 * count as f64 / lines.len() as f64;
        say!("{outcome:<16} {count:>6} {percent:>6.1} %");
    }
    let mut ratios: Vec<f64> = lines.values().filter_map(|line| line.mean_ratio).collect();
    ratios.sort_by(f64::total_cmp);
    if let Some(median) = ratios.get(ratios.len() / 2) {
        say!(
            "\nLargest error against the PID, median over what was commissioned: {:+.1} %",
            100.0 * (median - 1.0)
        );
    }
    let mut minutes: Vec<f64> = lines.values().map(|line| line.axis_min).collect();
    minutes.sort_by(f64::total_cmp);
    say!("Axis time, median: {:.1} min", minutes[minutes.len() / 2]);
    let axis_s: f64 = lines.values().map(|line| 60.0 * line.axis_min).sum();
    let computed_s: f64 = lines.values().map(|line| line.computed_s).sum();
    say!(
        "Axis time over the time of a core: {:.0}",
        axis_s / computed_s
    );
    let mut reasons: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for line in lines.values().filter(|line| !line.reason.is_empty()) {
        let reason = line.reason.split(':').next().unwrap_or_default();
        reasons
            .entry(reason.to_owned())
            .or_default()
            .push(line.seed);
    }
    for (reason, seeds) in &reasons {
        say!(
            "{reason}: {} axes, seeds {:?}",
            seeds.len(),
            &seeds[..seeds.len().min(LISTED)]
        );
    }
    let mut worst: Vec<&Line> = lines
        .values()
        .filter(|line| line.worst_ratio.is_some())
        .collect();
    worst.sort_by(|a, b| {
        b.worst_ratio
            .unwrap_or(0.0)
            .total_cmp(&a.worst_ratio.unwrap_or(0.0))
    });
    say!("\nWorst, to be replayed with --seeds SEED+1 --results FILE:");
    for line in worst.iter().take(LISTED) {
        say!(
            "{:>6}  {:>6.1} % of the PID's largest error, {}: {}",
            line.seed,
            100.0 * line.worst_ratio.unwrap_or(f64::NAN),
            line.feedforward,
            line.axis
        );
    }
    let mut small: Vec<&Line> = lines.values().filter(|line| line.small_worse > 0).collect();
    small.sort_by_key(|line| std::cmp::Reverse(line.small_worse));
    for line in small.iter().take(LISTED) {
        say!(
            "{:>6}  worse on {} small slow sines, at worst {}: {}",
            line.seed,
            line.small_worse,
            line.small_sine,
            line.axis
        );
    }
}
