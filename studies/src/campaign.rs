//! Campaigns: a result from each of many seeds, a line a seed of a CSV file, so that a campaign can be interrupted, divided
//! and merged.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::output::progress;
use quadrant_cli::say;
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// A campaign; its fields are its own options.
pub trait Campaign: Args + Sync {
    /// Result of a seed. A result may have parts: each of their fields is a column.
    type Line: Serialize + DeserializeOwned + Send;
    /// Its name: that of the file of results.
    const NAME: &'static str;
    /// Names of the line's columns, in the order of its fields.
    const COLUMNS: &'static [&'static str];

    /// Makes ready for the first seed.
    ///
    /// # Errors
    /// Options that cannot be met.
    fn prepare(&self) -> anyhow::Result<()> {
        Ok(())
    }

    /// True if a seed is run at all.
    fn requests(&self, _seed: u64) -> bool {
        true
    }

    /// Runs a seed.
    fn judge(&self, seed: u64) -> Self::Line;

    /// Prints what the lines, at least one, come to.
    ///
    /// # Errors
    /// Something that must hold and did not.
    fn summarise(lines: &Lines<Self::Line>) -> anyhow::Result<()>;
}

/// Results by seed.
pub type Lines<L> = BTreeMap<u64, L>;

/// Options of a campaign.
#[derive(Clone, Debug, Args)]
pub struct Arguments<C: Args> {
    /// First seed, and number of seeds.
    #[arg(long, default_value = "1+20", value_name = "FIRST+COUNT")]
    seeds: Seeds,
    /// Only every n-th seed, beginning with the i-th: a campaign on several machines.
    #[arg(long, default_value = "1/1", value_name = "I/N")]
    shard: Shard,
    /// Results, a line a seed: those that are there already are not run again. The campaign's name and .csv, if it is left out.
    #[arg(long, value_name = "FILE")]
    results: Option<PathBuf>,
    /// Runs nothing: sums up these files of results.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    merge: Vec<PathBuf>,
    #[command(flatten)]
    campaign: C,
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

impl<C: Campaign> Arguments<C> {
    /// Runs the campaign, or sums up what earlier ones have found.
    ///
    /// # Errors
    /// A file that cannot be read or written, or no seed; as [`Campaign::summarise`].
    pub fn run(&self) -> anyhow::Result<()> {
        let mut lines = Lines::new();
        for path in &self.merge {
            lines.extend(read::<C>(path)?);
        }
        if self.merge.is_empty() {
            lines = self.lines()?;
        }
        if lines.is_empty() {
            bail!("no seed is left to run");
        }
        say!(
            "Simulated, not measured: {} random {}\n",
            lines.len(),
            C::NAME
        );
        C::summarise(&lines)
    }

    /// The results of the requested seeds: those in the file of results, and those of the others, which are appended to it.
    fn lines(&self) -> anyhow::Result<Lines<C::Line>> {
        let results = match &self.results {
            Some(path) => path.clone(),
            None => PathBuf::from(format!("{}.csv", C::NAME)),
        };
        self.campaign.prepare()?;
        let mut lines = match results.exists() {
            true => read::<C>(&results)?,
            false => Lines::new(),
        };
        let Seeds { first, count } = self.seeds;
        let requested: Vec<u64> = (first..first + count)
            .filter(|seed| (seed - first) % self.shard.count == self.shard.index - 1)
            .filter(|&seed| self.campaign.requests(seed))
            .collect();
        let is_missing = |seed: &u64| !lines.contains_key(seed);
        let missing: Vec<u64> = requested.iter().copied().filter(is_missing).collect();
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&results)
            .with_context(|| results.display().to_string())?;
        if file.metadata()?.len() == 0 {
            writeln!(file, "{}", header::<C>().join(","))?;
        }
        let writer = csv::WriterBuilder::new()
            .has_headers(false)
            .from_writer(file);
        let writer = Mutex::new(writer);
        let bar = progress(missing.len() as u64, C::NAME);
        let found: Vec<anyhow::Result<(u64, C::Line)>> = missing
            .par_iter()
            .map(|&seed| {
                let line = self.campaign.judge(seed);
                // A line at a time, so that nothing is lost when the campaign is interrupted.
                let mut writer = writer.lock().unwrap_or_else(|broken| broken.into_inner());
                writer.serialize((seed, &line))?;
                writer.flush()?;
                bar.inc(1);
                Ok((seed, line))
            })
            .collect();
        bar.finish_and_clear();
        for line in found {
            lines.extend([line?]);
        }
        lines.retain(|seed, _| requested.contains(seed));
        Ok(lines)
    }
}

fn header<C: Campaign>() -> Vec<&'static str> {
    [&["seed"], C::COLUMNS].concat()
}

fn read<C: Campaign>(path: &Path) -> anyhow::Result<Lines<C::Line>> {
    let at = || path.display().to_string();
    let mut reader = csv::Reader::from_path(path).with_context(at)?;
    if reader.headers().with_context(at)? != header::<C>() {
        bail!(
            "{} has other columns than {}: it is of another campaign, or of another version of this program",
            path.display(),
            header::<C>().join(",")
        );
    }
    reader
        .records()
        .map(|record| record?.deserialize(None))
        .collect::<Result<_, _>>()
        .with_context(at)
}

/// Largest number of seeds that are listed one by one.
pub const LISTED: usize = 10;

/// Lists the worst seeds below a title, by `badness`; lines that have none are left out.
pub fn list_worst<L>(
    title: &str,
    lines: &Lines<L>,
    badness: impl Fn(&L) -> Option<f64>,
    describe: impl Fn(&L) -> String,
) {
    let mut worst: Vec<(f64, u64, &L)> = lines
        .iter()
        .filter_map(|(seed, line)| Some((badness(line)?, *seed, line)))
        .collect();
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    if worst.is_empty() {
        return;
    }
    say!("\n{title}, to be replayed with --seeds SEED+1 --results FILE:");
    for (_, seed, line) in worst.iter().take(LISTED) {
        say!("{seed:>8}  {}", describe(line));
    }
}

/// Makes the folder of an option, if it is given.
///
/// # Errors
/// A folder that cannot be made.
pub fn make_folder(folder: Option<&Path>) -> anyhow::Result<()> {
    folder.map_or(Ok(()), |folder| {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())
    })
}
