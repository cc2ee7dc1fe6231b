//! Encoders by edges on the pins.

use anyhow::Result;

use crate::bench::Subject;
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::started;
use crate::stage::{COUNT_MM, INDEX_COUNTS};

/// Speed, counts/s.
const RATE: f64 = 200_000.0;

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let mut bench = started(image, None)?;
    let mut client = Client::open(&mut bench)?;
    let before = client.status(&mut bench)?;
    bench.spin([RATE, -RATE, RATE / 2.0]);
    bench.run_for(0.5);
    bench.spin([0.0; 3]);
    bench.run_for(0.01);
    let after = client.status(&mut bench)?;
    let shown = bench.with(|world, _, _| world.shown);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (count, captured) = bench.counter(axis);
        let mask = image.board.encoders[axis].mask;
        let text = |count: i64| (count as u32 & mask).to_string();
        report.equal(
            &format!("{name}: counter after {} edges", shown[axis].abs()),
            text(shown[axis]),
            (count & mask).to_string(),
        );
        // The captured count is that of the last index pulse that was passed: its beginning is an edge early or late.
        let turns = (shown[axis].abs() - INDEX_COUNTS / 2) / INDEX_COUNTS;
        let pulse =
            shown[axis].signum() * turns * INDEX_COUNTS + INDEX_COUNTS / 2 * shown[axis].signum();
        let differs = ((captured.wrapping_sub(pulse as u32) & mask) as i64 + 1) & i64::from(mask);
        report.row(
            &format!("{name}: count captured at the index"),
            format!("{} ±1", text(pulse)),
            captured & mask,
            differs <= 2,
        );
        let moved = after.axes[axis].position_mm - before.axes[axis].position_mm;
        report.row(
            &format!("{name}: position by the link"),
            format!("{:.4} mm", shown[axis] as f64 * COUNT_MM),
            format!("{moved:.4} mm"),
            (moved - shown[axis] as f64 * COUNT_MM).abs() < 1e-9,
        );
    }
    let [rejected, passed] = image.board.filtered_ns;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        for (ns, counts) in [(rejected, 0), (passed, 1)] {
            let (before, _) = bench.counter(axis);
            bench.with(move |world, board, now| world.glitch(board, now, axis, 0, ns));
            // Within the pulse, behind the filter.
            bench.run_for(1e-9 * ns as f64);
            let mut seen = bench.counter(axis).0;
            for _ in 0..40 {
                bench.run_for(50e-9);
                let (now, _) = bench.counter(axis);
                if now != before {
                    seen = now;
                }
            }
            let changed = u32::from(seen != before);
            report.equal(
                &format!("{name}: counts seen of a pulse of {ns} ns on A"),
                counts,
                changed,
            );
        }
    }
    report.equal("overruns", 0, client.status(&mut bench)?.overruns);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}
