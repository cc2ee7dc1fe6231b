//! The shares of worse windows, and the worst cases.

use quadrant_cli::say;

use super::{Comparison, Line, WORSE};
use crate::campaign::{Lines, list_worst};

/// A feedforward: its name, and its part of a line.
type Compared = (&'static str, fn(&Line) -> &Comparison);

const COMPARED: [Compared; 3] = [
    ("as commissioned", |line| &line.fixed),
    ("learning", |line| &line.learning),
    ("cancelling", |line| &line.cancelling),
];

/// Mean over the lines, without the runs that a fault ended: they have no RMS error.
fn mean(lines: &Lines<Line>, read: impl Fn(&Line) -> f64) -> f64 {
    let finite: Vec<f64> = lines
        .values()
        .map(read)
        .filter(|it| it.is_finite())
        .collect();
    finite.iter().sum::<f64>() / finite.len() as f64
}

/// Prints the shares of worse windows, and the worst cases, each with its seed.
pub(super) fn print(lines: &Lines<Line>) {
    let is_ended =
        |line: &&Line| !(line.learning.worst_ratio + line.cancelling.worst_ratio).is_finite();
    let ended = lines.values().filter(is_ended).count();
    say!("Ended by a fault: {ended}");
    say!(
        "Settled, with nothing new since the last reversal but one: {:.1} % of the windows\n",
        mean(lines, |line| line.settled_percent)
    );
    type Read = fn(&Comparison) -> [f64; 2];
    let windows: [(&str, Read); 2] = [
        ("all", |it| [it.worst_ratio, it.worse_percent]),
        ("settled", |it| {
            [it.settled_worst_ratio, it.settled_worse_percent]
        }),
    ];
    for (name, of) in COMPARED {
        for (windows, read) in windows {
            let mut ratios: Vec<f64> = lines.values().map(|line| read(of(line))[0]).collect();
            ratios.sort_by(f64::total_cmp);
            say!(
                "{name:<16} {windows:<8} worse than without feedforward in {} cases and {:.2} % of the windows; worst window of \
                 a case: median x {:.3}, largest x {:.3}",
                ratios.iter().filter(|ratio| **ratio > WORSE).count(),
                mean(lines, |line| read(of(line))[1]),
                ratios[ratios.len() / 2],
                ratios[ratios.len() - 1]
            );
        }
    }
    let [fixed, learning, cancelling] = COMPARED.map(|(_, of)| mean(lines, |line| of(line).rms_um));
    say!(
        "\nRMS error, mean over the cases: {:.2} um without, {fixed:.2} um as commissioned, {learning:.2} um learning, {cancelling:.2} um \
         learning and cancelling",
        mean(lines, |line| line.off_um)
    );
    list_worst(
        "Worst with cancelling",
        lines,
        |line| Some(line.cancelling.worst_ratio),
        |line| {
            let Comparison {
                worst_ratio,
                worst_at_s,
                ..
            } = line.cancelling;
            format!("x {worst_ratio:.3} at {worst_at_s:>4.1} s: {}", line.case)
        },
    );
}
