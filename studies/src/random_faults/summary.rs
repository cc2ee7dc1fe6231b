//! The rules that were broken, the faults, and the campaigns that went farthest.

use std::collections::BTreeMap;

use anyhow::bail;
use quadrant_cli::say;
use quadrant_law::safety::FaultCode;

use super::Line;
use crate::campaign::{LISTED, Lines, list_worst};

/// Prints the faults, and the campaigns that went farthest and that broke something, each with its seed.
///
/// # Errors
/// Something that must hold and did not.
pub(super) fn print(lines: &Lines<Line>) -> anyhow::Result<()> {
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
    let count = |is: fn(&Line) -> bool| lines.values().filter(|line| is(line)).count();
    let way = |line: &Line| line.unplanned_mm.unwrap_or(0.0);
    let is_unseen = |line: &Line| line.unseen == Some(true);
    let unseen = lines.values().filter(|line| is_unseen(line));
    say!(
        "supply failed while flash was written: {}\nnothing shows that the encoder died: {}, at most {:.2} mm off",
        count(|line| line.was_cut == Some(true)),
        unseen.clone().count(),
        unseen.map(way).fold(0.0, f64::max)
    );
    list_worst(
        "Farthest of the others until off",
        lines,
        |line| (!is_unseen(line)).then(|| way(line)),
        |line| {
            let mm = line.unplanned_mm.unwrap_or(f64::NAN);
            format!("{mm:>6.2} mm  {}", line.campaign)
        },
    );
    let broken = lines.iter().filter(|(_, line)| !line.broken.is_empty());
    for (seed, line) in broken.clone().take(LISTED) {
        say!(
            "\n{seed:>8}  BROKEN: {}\n          {}",
            line.broken,
            line.campaign
        );
    }
    match broken.count() {
        0 => Ok(()),
        count => bail!("{count} of {} campaigns broke what must hold", lines.len()),
    }
}
