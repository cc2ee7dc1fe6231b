//! Campaigns: a result from each of many seeds, a line a seed of a CSV file, so that a campaign can be interrupted, divided
//! and merged.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Mutex;

use anyhow::{Context, bail};
use clap::Args;
use quadrant_cli::output::progress;
use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Options of a campaign.
#[derive(Clone, Debug, Args)]
pub struct Campaign {
    /// First seed, and number of seeds.
    #[arg(long, default_value = "1+20", value_name = "FIRST+COUNT")]
    seeds: Seeds,
    /// Only every n-th seed, beginning with the i-th: a campaign on several machines.
    #[arg(long, default_value = "1/1", value_name = "I/N")]
    shard: Shard,
    /// Runs nothing: sums up these files of results.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    merge: Vec<PathBuf>,
}

/// A line of results.
pub trait Seeded {
    /// The seed that it is the result of.
    fn seed(&self) -> u64;
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

impl Campaign {
    /// The results of the seeds for which `is_requested`: those that stand in the file of results, and those of the others, which are
    /// `judge`d and appended to it.
    ///
    /// # Errors
    /// A file that cannot be read or written, or no seed.
    pub fn lines<L: Seeded + Serialize + DeserializeOwned + Send>(
        &self,
        results: &Path,
        title: &'static str,
        is_requested: impl Fn(u64) -> bool,
        judge: impl Fn(u64) -> L + Sync,
    ) -> anyhow::Result<BTreeMap<u64, L>> {
        if !self.merge.is_empty() {
            let mut lines = BTreeMap::new();
            for path in &self.merge {
                lines.extend(read(path)?);
            }
            return Ok(lines);
        }
        let mut lines = if results.exists() {
            read(results)?
        } else {
            BTreeMap::new()
        };
        let Seeds { first, count } = self.seeds;
        let Shard {
            index,
            count: shards,
        } = self.shard;
        let requested: Vec<u64> = (first..first + count)
            .filter(|seed| (seed - first) % shards == index - 1)
            .filter(|&seed| is_requested(seed))
            .collect();
        let missing: Vec<u64> = requested
            .iter()
            .copied()
            .filter(|seed| !lines.contains_key(seed))
            .collect();
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(results)
            .with_context(|| results.display().to_string())?;
        let writer = csv::WriterBuilder::new()
            .has_headers(lines.is_empty())
            .from_writer(file);
        let writer = Mutex::new(writer);
        let bar = progress(missing.len() as u64, title);
        let found: Vec<anyhow::Result<L>> = missing
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
            lines.insert(line.seed(), line);
        }
        lines.retain(|seed, _| requested.contains(seed));
        if lines.is_empty() {
            bail!("no seed is left to run");
        }
        Ok(lines)
    }
}

fn read<L: Seeded + DeserializeOwned>(path: &Path) -> anyhow::Result<BTreeMap<u64, L>> {
    let at = || path.display().to_string();
    let mut reader = csv::Reader::from_path(path).with_context(at)?;
    reader
        .deserialize()
        .map(|line| line.map(|line: L| (line.seed(), line)))
        .collect::<Result<_, _>>()
        .with_context(at)
}
