//! `quadrant-studies faults`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use quadrant_cli::say;
use quadrant_law::safety::FaultCode;

use super::{Line, judge};
use crate::campaign::{Campaign, Seeded};

/// Options of `quadrant-studies faults`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    campaign: Campaign,
    /// Results, a line a seed: those that are there already are not run again.
    #[arg(long, default_value = "faults.csv", value_name = "FILE")]
    results: PathBuf,
}

impl Seeded for Line {
    fn seed(&self) -> u64 {
        self.seed
    }
}

/// Runs the campaign, or sums up what earlier ones have found.
///
/// # Errors
/// A file that cannot be read or written; something that must hold and did not.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let lines = arguments.campaign.lines(
        &arguments.results,
        "provoking random faults",
        |_| true,
        judge,
    )?;
    summary(&lines);
    let broken = lines
        .values()
        .filter(|line| !line.broken.is_empty())
        .count();
    if broken > 0 {
        bail!("{broken} of {} campaigns broke what must hold", lines.len());
    }
    Ok(())
}

/// Largest number of campaigns that are listed one by one.
const LISTED: usize = 10;

/// Prints what was broken, the faults, and the campaigns that went farthest, each with its seed.
fn summary(lines: &BTreeMap<u64, Line>) {
    say!(
        "Simulated, not measured: {} random campaigns of a second\n",
        lines.len()
    );
    let mut faults: BTreeMap<Option<u8>, usize> = BTreeMap::new();
    for line in lines.values() {
        *faults.entry(line.fault).or_default() += 1;
    }
    for (fault, count) in faults {
        let name = fault
            .and_then(FaultCode::from_number)
            .map_or("no fault", FaultCode::name);
        say!("{name:<24} {count:>7}");
    }
    let cut = lines
        .values()
        .filter(|line| line.was_cut == Some(true))
        .count();
    say!("supply failed while flash was written: {cut}");
    let way = |line: &&Line| line.unplanned_mm.unwrap_or(0.0);
    let (unseen, mut farthest): (Vec<&Line>, Vec<&Line>) =
        lines.values().partition(|line| line.unseen == Some(true));
    say!(
        "nothing shows that the encoder died: {}, at most {:.2} mm off",
        unseen.len(),
        unseen.iter().map(way).fold(0.0, f64::max)
    );
    farthest.sort_by(|a, b| way(b).total_cmp(&way(a)));
    say!("\nFarthest of the others until off, to be replayed with --seeds SEED+1 --results FILE:");
    for line in farthest.iter().take(LISTED) {
        let mm = line.unplanned_mm.unwrap_or(f64::NAN);
        say!("{:>8}  {mm:>6.2} mm  {}", line.seed, line.campaign);
    }
    for line in lines
        .values()
        .filter(|line| !line.broken.is_empty())
        .take(LISTED)
    {
        say!(
            "\n{:>8}  BROKEN: {}\n          {}",
            line.seed,
            line.broken,
            line.campaign
        );
    }
}
