//! The converter lost in mid-frame.

use anyhow::{Result, ensure};
use quadrant_link::message::Body;

use crate::ad5754r;
use crate::bench::{Bench, Subject};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{clear, commissioned, jogging, row_fault, row_off, runs};

/// From the loss to the disabled amplifiers, s: a difference is found within four ticks (docs/board-nucleo-f446re.md), and a tick's computation.
const FOUND_S: f64 = 500e-6;

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let mut bench = Bench::start(image, Some(&commissioned(image)?));
    ad5754r::lock(&bench.chip).power_off();
    ensure!(runs(&mut bench), "no control tick without a converter");
    let mut client = Client::open(&mut bench)?;
    let refusal = client
        .ask(&mut bench, Body::Enable)
        .err()
        .map(|error| format!("{error:#}"));
    bench.run_for(0.01);
    let drives = bench.with(|_, board, _| board.is_enabled());
    let answer = refusal.unwrap_or_else(|| "accepted".into());
    report.row(
        "no converter at the start: `enable`",
        "refused",
        answer,
        !drives,
    );
    report.equal("no converter at the start: /CLR", "low", clear(&bench));
    drop(bench);

    let (mut bench, mut client) = jogging(image, 20.0)?;
    // 15 bytes a tick: within the second frame of the writing.
    ad5754r::lock(&bench.chip).fails_after_bytes = Some(5);
    let since = bench.now();
    bench.run_for(0.002);
    row_off(
        &mut bench,
        report,
        "supply of the converter lost after 5 bytes",
        since,
        FOUND_S,
    );
    report.equal("/CLR", "low", clear(&bench));
    row_fault(
        &mut bench,
        &mut client,
        report,
        "fault",
        "15 output-mismatch x",
    )?;
    ad5754r::lock(&bench.chip).power_on();
    bench.run_for(0.2);
    let volts = ad5754r::lock(&bench.chip).volts();
    report.equal(
        "outputs of the converter that is back, V",
        "0 0 0".into(),
        volts.map(|v| v.to_string()).join(" "),
    );
    let _ = client.ask(&mut bench, Body::ResetFault);
    let _ = client.ask(&mut bench, Body::Enable);
    bench.run_for(0.01);
    report.equal(
        "`enable` with a converter that was not set up",
        false,
        bench.with(|_, board, _| board.is_enabled()),
    );
    Ok(())
}
