//! The log over the link.

use anyhow::{Result, anyhow};
use quadrant_link::message::{Body, LogPage, Reply};

use crate::bench::{Bench, Subject};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{commissioned, enable, started};

/// Bytes that the server keeps (docs/log.md).
const KEPT: u32 = 2048;

pub(super) fn run(image: &Subject, report: &mut Report) -> Result<()> {
    let mut bench = started(image, Some(&commissioned(image)?))?;
    bench.with(|world, _, _| world.log.is_read = false);
    bench.run_for(0.02);
    let mut client = Client::open(&mut bench)?;
    client.ask(&mut bench, Body::Reboot)?;
    bench.run_for(3.0);
    let mut client = Client::open(&mut bench)?;
    let first = bench.log().len();
    let next = read(&mut bench, &mut client, 0)?;
    let lines = bench.log().split_off(first);
    row(
        report,
        "the start, which came before a host asked",
        &lines,
        "started by software",
    );
    row(
        report,
        "the settings that act",
        &lines,
        "settings number 1 from flash",
    );

    enable(&mut bench, &mut client)?;
    client.ask(&mut bench, Body::Disable)?;
    bench.run_for(0.1);
    let first = bench.log().len();
    let next = read(&mut bench, &mut client, next)?;
    let lines = bench.log().split_off(first);
    row(report, "what was done since", &lines, "outputs enabled");
    row(report, "and after it", &lines, "outputs disabled");

    // More lines than are kept, each second.
    bench.ticks();
    let mut total = next;
    let mut rounds = 0;
    while total.wrapping_sub(next) < KEPT + 300 && rounds < 200 {
        enable(&mut bench, &mut client)?;
        client.ask(&mut bench, Body::Disable)?;
        bench.run_for(0.3);
        rounds += 1;
        total = page(&mut bench, &mut client, total)?.from;
        while !page(&mut bench, &mut client, total)?.bytes.is_empty() {
            total += page(&mut bench, &mut client, total)?.bytes.len() as u32;
        }
    }
    let late = page(&mut bench, &mut client, next)?;
    report.row(
        "bytes that a host was too late for",
        format!("{}", total.wrapping_sub(next) - KEPT),
        late.from.wrapping_sub(next),
        late.from.wrapping_sub(next) == total.wrapping_sub(next) - KEPT,
    );
    let (shortest, longest) = bench.ticks().period_ns;
    report.equal(
        "time from tick to tick meanwhile, ns",
        "100000 to 100000".into(),
        format!("{shortest} to {longest}"),
    );
    report.equal("overruns", 0, client.status(&mut bench)?.overruns);
    let damaged = bench
        .log()
        .iter()
        .filter(|line| line.contains("damaged"))
        .count();
    report.equal("damaged lines", 0, damaged);
    report.none("complaints of the models", &bench.complaints());
    Ok(())
}

fn page(bench: &mut Bench, client: &mut Client, from: u32) -> Result<LogPage> {
    match client.ask(bench, Body::Log { from })? {
        Reply::Log(page) => Ok(page),
        other => Err(anyhow!("the log was asked for, the answer is {other:?}")),
    }
}

/// Reads the log from a byte on, and decodes it; returns the number of the next byte.
fn read(bench: &mut Bench, client: &mut Client, mut from: u32) -> Result<u32> {
    loop {
        let page = page(bench, client, from)?;
        if page.bytes.is_empty() {
            return Ok(from);
        }
        from = page.from.wrapping_add(page.bytes.len() as u32);
        bench.with(move |world, _, now| world.log.decode(&page.bytes, now.0));
    }
}

fn row(report: &mut Report, what: &str, lines: &[String], expected: &str) {
    let found = lines.iter().find(|line| line.contains(expected));
    report.row(
        what,
        expected,
        found.map_or("not there", String::as_str),
        found.is_some(),
    );
}
