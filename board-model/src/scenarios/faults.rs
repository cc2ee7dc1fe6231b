//! Faults of the processor.

use anyhow::{Result, ensure};
use quadrant_link::message::Body;
use rigless::device::ResetCause;
use rigless::soc::Width;

use crate::bench::{Bench, Subject};
use crate::link::Client;
use crate::report::Report;
use crate::scenarios::{NEXT_TICK_S, clear, jogging, row_fault, row_off, row_started, runs};

/// TIM7_SR, which every control tick writes.
const TICK_STATUS: u64 = 0x4000_1410;
/// Handler of a task.
const TASK: &str = "DISPATCHER_1";
/// Time within which the task runs, s.
const TASK_PERIOD_S: f64 = 1e-3;
/// `push {r4-r7, lr}` and a branch to it.
const RECURSION: [u32; 1] = [0xE7FD_B5F0];
/// Writes NMIPENDSET, bit 31 of ICSR (0xE000ED04), and loops: movw, movt, mov.w, str, b.
const PEND_NMI: [u32; 4] = [0x5004_F64E, 0x0000_F2CE, 0x4100_F04F, 0xE7FE_6001];

/// Rows of what follows the end of the firmware: outputs, watchdog, the next start.
fn aftermath(
    bench: &mut Bench,
    report: &mut Report,
    since: u64,
    off_s: f64,
    fault: &str,
) -> Result<()> {
    bench.run_for(0.002);
    row_off(bench, report, "enable line", since, off_s);
    report.equal("/CLR", "low", clear(bench));
    let fed = bench.with(|world, _, _| world.feeds.0);
    bench.run_for(0.03);
    let reset = bench.with(|world, _, _| world.resets.first().copied());
    let measured = reset.map_or(0.0, |reset| (reset.0 - fed) as f64 * 1e-9);
    let [least, most] = bench.wiring.watchdog_s;
    report.row(
        "watchdog after its last feed",
        format!("{:.1} to {:.1} ms", least * 1e3, most * 1e3),
        format!("{:.2} ms", measured * 1e3),
        (least..=most).contains(&measured),
    );
    report.equal(
        "source of the reset",
        format!("{:?}", ResetCause::Model("IWDG")),
        format!("{:?}", reset.map_or(ResetCause::Core, |reset| reset.1)),
    );
    ensure!(
        runs(bench),
        "no control tick after the reset; log {:#?}",
        bench.log()
    );
    row_started(bench, report, "started by watchdog");
    let mut client = Client::open(bench)?;
    row_fault(bench, &mut client, report, "fault after the reset", fault)?;
    let refused = client.ask(bench, Body::Enable).is_err() || {
        bench.run_for(0.01);
        !bench.with(|_, board, _| board.is_enabled())
    };
    report.equal(
        "`enable` before the fault is reset is refused",
        true,
        refused,
    );
    client.ask(bench, Body::ResetFault)?;
    bench.run_for(0.01);
    client.ask(bench, Body::Enable)?;
    bench.run_for(0.01);
    report.equal(
        "enabled after `reset`",
        true,
        bench.with(|_, board, _| board.is_enabled()),
    );
    Ok(())
}

pub(super) fn hard_fault(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, _) = jogging(image, 20.0)?;
    let since = bench.now();
    bench.with_session(|_, session, _, _| session.fail_next(TICK_STATUS, TICK_STATUS + 4));
    aftermath(&mut bench, report, since, NEXT_TICK_S, "20 hard-fault")
}

/// Replaces the first instructions of a task, lets it run, and puts them back for the next start. Returns the instant of the
/// replacement.
fn run_instead(bench: &mut Bench, image: &Subject, code: &'static [u32]) -> Result<u64> {
    let since = bench.now();
    let elf = std::fs::read(&image.image)?;
    let symbols = rigless::symbols::Symbols::read(&elf, |address| address & !1)?;
    let task = symbols.get(TASK)? & !1;
    let mut old = Vec::new();
    for (address, &word) in (task..).step_by(4).zip(code) {
        old.push((
            address,
            bench.with_session(move |_, _, host, _| host.read(address, Width::W32))?,
        ));
        bench.with_session(move |_, _, host, _| host.program(address, Width::W32, word.into()))?;
    }
    bench.run_for(TASK_PERIOD_S);
    for (address, word) in old {
        bench.with_session(move |_, _, host, _| host.program(address, Width::W32, word))?;
    }
    Ok(since)
}

pub(super) fn stack_overflow(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, _) = jogging(image, 20.0)?;
    // The model answers where there is no memory; the chip's first store there is a bus error.
    let below = image.board.below_stack.clone();
    bench.with_session(move |_, session, _, _| session.fail_next(below.start, below.end));
    let since = run_instead(&mut bench, image, &RECURSION)?;
    let log = bench.log();
    let says = log.iter().find(|line| line.contains("the stack is full"));
    report.row(
        "cause in the log",
        "the stack is full",
        says.map_or("none", String::as_str),
        says.is_some(),
    );
    aftermath(
        &mut bench,
        report,
        since,
        TASK_PERIOD_S + NEXT_TICK_S,
        "20 hard-fault",
    )
}

pub(super) fn nmi(image: &Subject, report: &mut Report) -> Result<()> {
    let (mut bench, _) = jogging(image, 20.0)?;
    let since = run_instead(&mut bench, image, &PEND_NMI)?;
    aftermath(
        &mut bench,
        report,
        since,
        TASK_PERIOD_S + NEXT_TICK_S,
        "20 hard-fault",
    )
}
