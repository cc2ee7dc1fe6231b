//! `cargo xtask count`: the instructions of a control tick, from the interrupt's entry to its return, by stage.
//!
//! QEMU logs every run of instructions executed. These are instructions, not cycles.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, bail};
use quadrant_settings::Job;
use serde::{Deserialize, Serialize};

use crate::kinds::{Kinds, USUAL, emulated, usual};
use crate::trace::Tick;
use crate::walk;
use xtask::golden::{self, Golden};
use xtask::image::Scalar;
use xtask::toolchain::Toolchain;

/// Tolerance about the expected count, %: a count that falls by more may have left something out.
const TOLERANCE_PERCENT: f64 = 5.0;
/// Difference that is allowed for the smallest count.
const TOLERANCE: f64 = 3.0;

/// Instructions per tick of one stage or of all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Figure {
    mean: f64,
    min: u32,
    max: u32,
}

/// Counts of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Count {
    ticks: u32,
    total: Figure,
    /// Empty where only the whole is held.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    stages: BTreeMap<String, Figure>,
}

/// File of the expected counts.
const GOLDEN: Golden = Golden {
    path: golden::INSTRUCTIONS,
    head: "Written by `cargo xtask count --overwrite-expected`; `cargo xtask count` compares its figures with these.",
};

/// Counts the usual ticks stage by stage, and every other kind; prints, and compares the figures with the committed ones.
pub(crate) fn run(toolchain: Toolchain, scalar: Scalar, ticks: u32, overwrite: bool) -> Result<()> {
    let image = emulated(toolchain, scalar)?;
    let kinds = Kinds::traced(&image, ticks)?;
    walk::check(kinds.functions())?;
    println!("{}: instructions per control tick", image.target);
    println!(
        "  {:<20} {:>6} {:>9} {:>6} {:>6}",
        "stage or kind", "ticks", "mean", "min", "max"
    );
    let scalar = image.target.scalar_name();
    let mut counts = Vec::new();
    for (name, ticks) in kinds.each() {
        let count = summary(ticks);
        if name == USUAL {
            for (stage, figure) in &count.stages {
                print_row(stage, count.ticks, figure);
            }
        }
        print_row(name, count.ticks, &count.total);
        counts.push(if name == USUAL {
            (scalar.clone(), count)
        } else {
            (format!("{scalar}, {name}"), count.whole())
        });
    }
    if overwrite {
        return GOLDEN.store(Some(&image.compiler), counts);
    }
    counts
        .iter()
        .try_for_each(|(key, count)| compare(key, count, &image.compiler))
}

/// Counts some jobs, prints a line for each, and compares the figures with the committed ones.
pub(crate) fn run_all(
    toolchain: Toolchain,
    scalar: Scalar,
    jobs: Vec<(String, Job)>,
    ticks: u32,
    overwrite: bool,
) -> Result<()> {
    let image = emulated(toolchain, scalar)?;
    println!(
        "{}: instructions per control tick, three axes, over {ticks} ticks",
        image.target
    );
    println!(
        "  {:<28} {:>9} {:>6} {:>6}",
        "law, feedforward", "mean", "min", "max"
    );
    let mut counts = Vec::new();
    for (name, job) in jobs {
        let count = summary(&usual(&image, job, ticks)?);
        let Figure { mean, min, max } = count.total;
        println!("  {name:<28} {mean:>9.1} {min:>6} {max:>6}");
        counts.push((
            format!("{}, {name}", image.target.scalar_name()),
            count.whole(),
        ));
    }
    if overwrite {
        return GOLDEN.store(Some(&image.compiler), counts);
    }
    counts
        .iter()
        .try_for_each(|(key, count)| compare(key, count, &image.compiler))
}

impl Count {
    /// The same without its stages.
    fn whole(self) -> Self {
        Self {
            stages: BTreeMap::new(),
            ..self
        }
    }
}

fn print_row(name: &str, ticks: u32, figure: &Figure) {
    let Figure { mean, min, max } = figure;
    println!("  {name:<20} {ticks:>6} {mean:>9.1} {min:>6} {max:>6}");
}

fn summary<'a>(closed: impl IntoIterator<Item = &'a Tick>) -> Count {
    let closed: Vec<&Tick> = closed.into_iter().collect();
    let ticks = closed.len() as u32;
    let figure = |of: &dyn Fn(&Tick) -> u32| {
        let values = closed.iter().map(|tick| of(tick));
        let sum: u64 = values.clone().map(u64::from).sum();
        Figure {
            // To a tenth, so that the file stays readable.
            mean: (sum as f64 * 10.0 / f64::from(ticks)).round() / 10.0,
            min: values.clone().min().unwrap_or(0),
            max: values.max().unwrap_or(0),
        }
    };
    let names: BTreeSet<&'static str> = closed
        .iter()
        .flat_map(|tick| tick.stages.keys().copied())
        .collect();
    Count {
        ticks,
        total: figure(&Tick::instructions),
        stages: names
            .into_iter()
            .map(|name| {
                (
                    name.to_owned(),
                    figure(&|tick| tick.stages.get(name).copied().unwrap_or(0)),
                )
            })
            .collect(),
    }
}

fn compare(key: &str, count: &Count, compiler: &str) -> Result<()> {
    let Some((expected, difference)) = GOLDEN.read::<Count>()?.table(key, compiler) else {
        bail!(
            "no figure is committed for {key}: `cargo xtask count --overwrite-expected` makes one"
        );
    };
    let held = |name: &str, counted: f64, expected: f64| {
        let change = 100.0 * (counted / expected - 1.0);
        let allowed = (counted - expected).abs() <= TOLERANCE || change.abs() <= TOLERANCE_PERCENT;
        difference.ensure(allowed, || {
            format!(
                "{key}: {name} {counted} in place of {expected}, {change:+.1} %, more than {TOLERANCE_PERCENT} %; if that is intended, \
                 `cargo xtask count --overwrite-expected` accepts it"
            )
        })
    };
    let (total, before) = (count.total, expected.total);
    let change = 100.0 * (total.mean / before.mean - 1.0);
    println!(
        "  {key}: mean {} against {} expected, {change:+.1} %; most {} against {}",
        total.mean, before.mean, total.max, before.max
    );
    held("mean", total.mean, before.mean)?;
    held("least", total.min.into(), before.min.into())?;
    held("most", total.max.into(), before.max.into())?;
    let stages = count.stages.keys().chain(expected.stages.keys());
    for stage in stages.collect::<BTreeSet<_>>() {
        let mean = |of: &Count| of.stages.get(stage).map_or(0.0, |figure| figure.mean);
        held(stage, mean(count), mean(&expected))?;
    }
    Ok(())
}
