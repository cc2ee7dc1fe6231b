//! The 8 MHz of the debug probe, missing and lost.

use anyhow::Result;

use rigless::device::ResetCause;

use crate::bench::{Bench, Subject};
use crate::report::Report;
use crate::scenarios::{clear, jogging, resets, row_off};

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let mut bench = Bench::start_with_clock(image, None, 0);
    bench.run_for(2.0);
    report.equal(
        "no 8 MHz at the start: control ticks in 2 s",
        0,
        bench.ticks().count,
    );
    let enabled = bench
        .with(|world, board, _| board.is_enabled() || world.enables.iter().any(|change| change.1));
    report.equal(
        "no 8 MHz at the start: enable line",
        "low",
        if enabled { "high" } else { "low" },
    );
    report.equal("no 8 MHz at the start: /CLR", "low", clear(&bench));
    drop(bench);

    let (mut bench, _client) = jogging(image, 20.0)?;
    let since = bench.now();
    bench.with(|_, board, now| board.fail_hse(now));
    bench.run_for(0.05);
    // The chip model does not raise the NMI: see the scenario `nmi`.
    row_off(
        &mut bench,
        report,
        "8 MHz lost in motion, without the NMI",
        since,
        image.board.watchdog_s[1],
    );
    if image.board.own_clock_feeds {
        report.equal(
            "8 MHz lost: resets, as the ticks of the chip's own clock feed the watchdog",
            String::new(),
            resets(&mut bench),
        );
        bench.run_for(1.0);
    } else {
        report.equal(
            "8 MHz lost: reset by",
            format!("{:?}", ResetCause::Model("IWDG")),
            resets(&mut bench),
        );
        bench.ticks();
        bench.run_for(1.0);
        report.equal(
            "8 MHz still away: control ticks in 1 s",
            0,
            bench.ticks().count,
        );
    }
    let (on, enables) = bench.with(|world, board, _| {
        (
            board.is_enabled(),
            world.enables.last().map(|change| change.1),
        )
    });
    report.equal(
        "8 MHz still away: enable line low",
        true,
        !on && enables == Some(false),
    );
    Ok(())
}
