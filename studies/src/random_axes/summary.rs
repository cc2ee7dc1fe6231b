//! The counts of a campaign, the errors, and the worst axes.

use std::collections::BTreeMap;

use quadrant_cli::say;
use strum::VariantArray as _;

use super::{Line, Outcome};
use crate::campaign::{LISTED, Lines, list_worst};

fn median(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Prints the counts, the errors, and the worst axes, each with its seed.
pub(super) fn print(lines: &Lines<Line>) {
    for outcome in Outcome::VARIANTS {
        let count = lines.values().filter(|it| it.outcome == *outcome).count();
        let percent = 100.0 * count as f64 / lines.len() as f64;
        say!("{outcome:<16} {count:>6} {percent:>6.1} %");
    }
    if let Some(median) = median(lines.values().filter_map(|line| line.mean_ratio)) {
        say!(
            "\nLargest error against the PID, median over what was commissioned: {:+.1} %",
            100.0 * (median - 1.0)
        );
    }
    if let Some(median) = median(lines.values().filter_map(|line| line.program_ratio)) {
        say!(
            "On the program of moves, median: {:+.1} %",
            100.0 * (median - 1.0)
        );
    }
    let axis_min = || lines.values().map(|line| line.axis_min);
    let computed_s: f64 = lines.values().map(|line| line.computed_s).sum();
    say!(
        "Axis time, median: {:.1} min\nAxis time over the time of a core: {:.0}",
        median(axis_min()).unwrap_or(f64::NAN),
        60.0 * axis_min().sum::<f64>() / computed_s
    );
    let mut reasons: BTreeMap<&str, Vec<u64>> = BTreeMap::new();
    for (seed, line) in lines.iter().filter(|(_, line)| !line.reason.is_empty()) {
        let reason = line.reason.split(':').next().unwrap_or_default();
        reasons.entry(reason).or_default().push(*seed);
    }
    for (reason, seeds) in &reasons {
        let first = &seeds[..seeds.len().min(LISTED)];
        say!("{reason}: {} axes, seeds {first:?}", seeds.len());
    }
    list_worst(
        "Worst",
        lines,
        |line| line.worst_ratio,
        |line| {
            format!(
                "{:>6.1} % of the PID's largest error, {}: {}",
                100.0 * line.worst_ratio.unwrap_or(f64::NAN),
                line.feedforward,
                line.axis
            )
        },
    );
    list_worst(
        "Faults of healthy axes",
        lines,
        |line| (line.health.faults > 0).then_some(line.health.faults as f64),
        |line| {
            format!(
                "{} of the moves: {}: {}",
                line.health.faults, line.health.fault, line.axis
            )
        },
    );
    list_worst(
        "Hum at rest, over a count and the noise",
        lines,
        |line| line.health.hum.filter(|ratio| *ratio > 1.0),
        |line| format!("{:.1}: {}", line.health.hum.unwrap_or(f64::NAN), line.axis),
    );
    list_worst(
        "Worse when small",
        lines,
        |line| (line.small.worse > 0).then_some(line.small.worse as f64),
        |line| {
            format!(
                "worse on {} small slow sines, at worst {}: {}",
                line.small.worse, line.small.sine, line.axis
            )
        },
    );
    let few: Vec<u64> = lines
        .iter()
        .filter(|(_, line)| !line.small.few_counts.is_empty())
        .map(|(seed, _)| *seed)
        .collect();
    if let [first, ..] = few[..] {
        say!(
            "Worse on moves of five counts: {} axes; seed {first}: {}",
            few.len(),
            lines[&first].small.few_counts
        );
    }
}
