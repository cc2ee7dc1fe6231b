//! `quadrant-studies axes`.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::output::progress;
use rayon::prelude::*;

use super::{Line, Outcome, RandomAxis, judge};
use quadrant_cli::say;

/// Options of `quadrant-studies axes`.
#[derive(Clone, Debug, Args)]
pub struct Arguments {
    /// First seed, and number of seeds.
    #[arg(long, default_value = "1+20", value_name = "FIRST+COUNT")]
    seeds: Seeds,
    /// Only every n-th seed, beginning with the i-th: a campaign on several machines.
    #[arg(long, default_value = "1/1", value_name = "I/N")]
    shard: Shard,
    /// Results, a line a seed: those that are there already are not run again.
    #[arg(long, default_value = "axes.csv", value_name = "FILE")]
    results: PathBuf,
    /// Only axes without a resonance.
    #[arg(long)]
    rigid: bool,
    /// Runs nothing: sums up these files of results.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    merge: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug)]
struct Seeds {
    first: u64,
    count: u64,
}

impl FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('+').and_then(|(first, count)| {
            Some(Self {
                first: first.parse().ok()?,
                count: count.parse().ok()?,
            })
        });
        parts.ok_or_else(|| format!("{text:?} is no FIRST+COUNT, such as 1+1000"))
    }
}

#[derive(Clone, Copy, Debug)]
struct Shard {
    index: u64,
    count: u64,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text
            .split_once('/')
            .and_then(|(index, count)| Some((index.parse().ok()?, count.parse().ok()?)));
        match parts {
            Some((index, count)) if (1..=count).contains(&index) => Ok(Self { index, count }),
            _ => Err(format!(
                "{text:?} is no I/N with I from 1 to N, such as 2/8"
            )),
        }
    }
}

/// Runs the campaign, or sums up what earlier ones have found.
///
/// # Errors
/// A file that cannot be read or written.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if !arguments.merge.is_empty() {
        let mut lines = BTreeMap::new();
        for path in &arguments.merge {
            lines.extend(read(path)?);
        }
        summary(&lines);
        return Ok(());
    }
    let path = &arguments.results;
    let mut lines = if path.exists() {
        read(path)?
    } else {
        BTreeMap::new()
    };
    let Seeds { first, count } = arguments.seeds;
    let Shard {
        index,
        count: shards,
    } = arguments.shard;
    let wanted: Vec<u64> = (first..first + count)
        .filter(|seed| (seed - first) % shards == index - 1)
        .filter(|&seed| !arguments.rigid || RandomAxis::new(seed).is_rigid())
        .collect();
    let missing: Vec<u64> = wanted
        .iter()
        .copied()
        .filter(|seed| !lines.contains_key(seed))
        .collect();
    let file = OpenOptions::new()
        .create(true)
        .append(true)
        .open(path)
        .with_context(|| path.display().to_string())?;
    let writer = csv::WriterBuilder::new()
        .has_headers(lines.is_empty())
        .from_writer(file);
    let writer = Mutex::new(writer);
    let bar = progress(missing.len() as u64, "commissioning random axes");
    let found: Vec<anyhow::Result<Line>> = missing
        .par_iter()
        .map(|&seed| {
            let line = judge(seed);
            // A line at a time, so that nothing is lost when the campaign is interrupted.
            let mut writer = writer.lock().unwrap_or_else(|broken| broken.into_inner());
            writer.serialize(&line)?;
            writer.flush()?;
            bar.inc(1);
            Ok(line)
        })
        .collect();
    bar.finish_and_clear();
    for line in found {
        let line = line?;
        lines.insert(line.seed, line);
    }
    lines.retain(|seed, _| wanted.contains(seed));
    if lines.is_empty() {
        bail!("no seed is left to run");
    }
    summary(&lines);
    Ok(())
}

fn read(path: &Path) -> anyhow::Result<BTreeMap<u64, Line>> {
    let at = || path.display().to_string();
    let mut reader = csv::Reader::from_path(path).with_context(at)?;
    reader
        .deserialize()
        .map(|line| line.map(|line: Line| (line.seed, line)))
        .collect::<Result<_, _>>()
        .with_context(at)
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
        Outcome::Refused,
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
}
