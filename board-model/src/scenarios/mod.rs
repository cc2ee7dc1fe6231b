//! Scenarios: what is done to the board, and what manuals and documentation say that it does.

mod clock;
mod converter;
mod encoders;
mod fastest;
mod faults;
mod flood;
mod inputs;
mod jog;
mod link_log;
mod model;
mod serial_encoder;
mod start;
mod step_direction;
mod store;
mod words;

use std::sync::OnceLock;

use anyhow::{Result, anyhow, ensure};
use quadrant_link::message::{AxisName, Body, MachineState, Reply};
use quadrant_settings::StageSettings;

use crate::ad5754r;
use crate::bench::{Bench, Subject};
use crate::link::Client;
use crate::report::Report;

/// A scenario.
pub struct Scenario {
    /// Name on the command line.
    pub name: &'static str,
    /// Subject.
    pub about: &'static str,
    /// Runs it on an image.
    pub run: fn(&Subject, &mut Report) -> Result<()>,
}

macro_rules! scenarios {
    ($($name:literal, $about:literal, $run:path;)*) => {
        &[$(Scenario { name: $name, about: $about, run: $run }),*]
    };
}

/// All scenarios, in the order of a run.
pub const SCENARIOS: &[Scenario] = scenarios! {
    "model", "the converter's model: each violated time or format is a complaint", model::run;
    "start", "clock tree, tick, converter frames, complaints of the models", start::run;
    "encoders", "counts by edges at 200 000 a second, filter, index", encoders::run;
    "jog", "enable, jog and stop three axes behind converter and encoders", jog::run;
    "store", "settings by the link, stored and found after a reboot", store::reboot;
    "erase", "encoders turned by hand while a sector is erased", store::erase;
    "power-cut", "supply cut while a sector is erased", store::power_cut;
    "hard-fault", "bus error in the control tick of a moving machine", faults::hard_fault;
    "stack-overflow", "recursion without an end in a task", faults::stack_overflow;
    "nmi", "the interrupt of the clock security system", faults::nmi;
    "inputs", "each safety input of a moving machine", inputs::run;
    "converter", "converter lost in mid-frame", converter::run;
    "serial-encoder", "x behind a BiSS-C encoder: position, age, damaged frames, cut wire, error bit", serial_encoder::run;
    "step-direction", "pulses of another control for x: followed, too fast, jumping; SERVO ON and ALARM", step_direction::run;
    "flood", "noise and requests without a pause on the link", flood::run;
    "link-log", "the log over the link, while no probe reads it", link_log::run;
    "clock", "8 MHz missing at the start, and lost in motion", clock::run;
    "fastest", "a jog at the highest control rate that the board is up to", fastest::run;
    "words", "every converter word of 10 s of motion beside the reference model's", words::run;
};

/// From the cause of a fault to the disabled amplifiers, at most, s: the next tick, and its computation.
const NEXT_TICK_S: f64 = 200e-6;

/// Switches the board on and waits until the control ticks run.
fn started(image: &Subject, settings: Option<&[u8]>) -> Result<Bench> {
    let mut bench = Bench::start(image, settings);
    ensure!(
        runs(&mut bench),
        "no control tick within {} s; log: {:#?}",
        image.board.start_s,
        bench.log()
    );
    Ok(bench)
}

/// Waits until control ticks run.
fn runs(bench: &mut Bench) -> bool {
    bench.run_until(bench.wiring.start_s, 0.005, |world| world.ticks.count > 20)
}

/// Contents of the settings' sectors after the simulated stage's settings were stored by the link.
fn commissioned(image: &Subject) -> Result<Vec<u8>> {
    static STORED: OnceLock<Vec<u8>> = OnceLock::new();
    if let Some(stored) = STORED.get() {
        return Ok(stored.clone());
    }
    let mut bench = started(image, None)?;
    let mut client = Client::open(&mut bench)?;
    client.load(
        &mut bench,
        &StageSettings::simulated(),
        &StageSettings::default(),
    )?;
    client.store(&mut bench, "board-run")?;
    Ok(STORED.get_or_init(|| bench.settings_flash()).clone())
}

/// A commissioned board whose outputs drive the three axes.
fn driving(image: &Subject) -> Result<(Bench, Client)> {
    let mut bench = started(image, Some(&commissioned(image)?))?;
    bench.with(|world, _, _| world.plant = true);
    let mut client = Client::open(&mut bench)?;
    enable(&mut bench, &mut client)?;
    Ok((bench, client))
}

/// Enables, and waits until the outputs drive.
fn enable(bench: &mut Bench, client: &mut Client) -> Result<()> {
    client.ask(bench, Body::Enable)?;
    bench.run_for(0.005);
    let state = client.status(bench)?.state;
    ensure!(
        state == MachineState::Enabled,
        "enabled, but the state is {}; log: {:?}",
        state.as_str(),
        bench.log().last()
    );
    Ok(())
}

/// Time from an instant to the last fall of the enable line, s; none if it has not fallen since.
fn disabled_after(bench: &mut Bench, since: u64) -> Option<f64> {
    let enables = bench.with(|world, _, _| world.enables.clone());
    let fall = enables
        .iter()
        .find(|change| change.0 >= since && !change.1)?;
    Some((fall.0 - since) as f64 * 1e-9)
}

/// Adds a row of the time in which the outputs were off.
fn row_off(bench: &mut Bench, report: &mut Report, done: &str, since: u64, most_s: f64) {
    let off = disabled_after(bench, since);
    let measured = off.map_or("still on".into(), |s| format!("{:.1} us", s * 1e6));
    report.row(
        done,
        format!("off within {:.0} us", most_s * 1e6),
        measured,
        off.is_some_and(|s| s <= most_s),
    );
}

/// Adds a row of the latched fault.
fn row_fault(
    bench: &mut Bench,
    client: &mut Client,
    report: &mut Report,
    done: &str,
    expected: &str,
) -> Result<()> {
    let fault = match client.ask(bench, Body::Fault)? {
        Reply::Fault(fault) => fault,
        other => return Err(anyhow!("the fault was asked for, the answer is {other:?}")),
    };
    let name = fault.map_or("none".into(), |fault| {
        let axis = fault.axis.map_or(String::new(), |axis| format!(" {axis}"));
        format!("{} {}{axis}", fault.code, fault.name)
    });
    report.equal(done, expected.to_owned(), name);
    Ok(())
}

/// A machine that jogs x.
fn jogging(image: &Subject, velocity_mm_s: f64) -> Result<(Bench, Client)> {
    let (mut bench, mut client) = driving(image)?;
    client.ask(
        &mut bench,
        Body::Jog {
            axis: AxisName::X,
            velocity_mm_s,
        },
    )?;
    bench.run_for(0.1);
    Ok((bench, client))
}

/// Causes of the resets so far.
fn resets(bench: &mut Bench) -> String {
    let causes = |reset: &(_, _)| format!("{:?}", reset.1);
    bench.with(move |world, _, _| {
        world
            .resets
            .iter()
            .map(causes)
            .collect::<Vec<_>>()
            .join(" ")
    })
}

/// A row for the cause of the last start in the log.
fn row_started(bench: &mut Bench, report: &mut Report, expected: &str) {
    let log = bench.log();
    let says = log.iter().rev().find(|line| line.contains("started by"));
    let says = says.cloned().unwrap_or_default();
    report.row(
        "reset cause in the log",
        expected,
        &says,
        says.contains(expected),
    );
}

/// The level of /CLR.
fn clear(bench: &Bench) -> &'static str {
    match ad5754r::lock(&bench.chip).is_clear_released() {
        true => "high",
        false => "low",
    }
}
