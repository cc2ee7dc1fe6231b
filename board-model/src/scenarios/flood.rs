//! A link without a pause.

use anyhow::Result;
use quadrant_link::message::Body;

use crate::bench::{Bench, Subject};
use crate::report::Report;
use crate::scenarios::{jogging, row_off};

/// From the last byte of `Disable` to the disabled amplifiers, s: that byte, 11 ticks (docs/safety.md), and a tick's computation.
const DISABLE_S: f64 = 1.3e-3;
/// Bytes a second of 921 600 baud, 8N1.
const BYTES_PER_S: f64 = 92_160.0;
/// Duration of each flood, s: less than the half second after which a silent host stops the machine.
const FLOOD_S: f64 = 0.3;

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, mut client) = jogging(image, 10.0)?;
    let before = client.status(&mut bench)?;
    bench.ticks();
    let bytes = (FLOOD_S * BYTES_PER_S) as usize;
    let mut seed = 1_u32;
    let noise = std::iter::repeat_with(|| {
        seed ^= seed << 13;
        seed ^= seed >> 17;
        seed ^= seed << 5;
        seed as u8
    });
    push(&bench, noise.take(bytes));
    bench.run_for(FLOOD_S);
    row_ticks(&mut bench, report, "noise");
    let status = client.status_at_last(&mut bench)?;
    report.equal("noise: the jog goes on", true, status.running);
    let lost = status.frames.damaged - before.frames.damaged;
    report.row(
        "noise: damaged frames that the server has counted",
        "at least 1",
        lost,
        lost > 0,
    );

    let request = client.frame(Body::Status)?;
    let flood = |bytes: usize| {
        request
            .iter()
            .copied()
            .cycle()
            .take(bytes / request.len() * request.len())
    };
    push(&bench, flood(bytes));
    bench.run_for(FLOOD_S);
    row_ticks(&mut bench, report, "requests");
    report.equal(
        "requests: the jog goes on",
        true,
        client.status_at_last(&mut bench)?.running,
    );

    push(&bench, flood(bytes / 4));
    client.begin(&bench, Body::Disable)?;
    let line = bench.line.clone();
    bench.run_until(FLOOD_S, 20e-6, move |_| {
        line.lock().expect("the line").to_board.is_empty()
    });
    let sent = bench.now();
    bench.run_for(0.05);
    row_off(
        &mut bench,
        report,
        "disable behind 75 ms of requests: from its last byte",
        sent,
        DISABLE_S,
    );
    report.equal("overruns", 0, client.status_at_last(&mut bench)?.overruns);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

fn push(bench: &Bench, bytes: impl Iterator<Item = u8>) {
    bench.line.lock().expect("the line").to_board.extend(bytes);
}

fn row_ticks(bench: &mut Bench, report: &mut Report, what: &str) {
    let (shortest, longest) = bench.ticks().period_ns;
    report.equal(
        &format!("{what}: time from tick to tick, ns"),
        "100000 to 100000".into(),
        format!("{shortest} to {longest}"),
    );
}
