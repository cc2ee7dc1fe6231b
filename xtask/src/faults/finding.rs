//! What came of a provocation.

use anyhow::{Context, Result, bail, ensure};
use quadrant::link::message::{Body, FaultReport};
use quadrant::safety::{FaultCode, Reaction};
use quadrant::stage::Outputs;
use serde::{Deserialize, Serialize};

use super::bench::{A_WHILE, Bench};
use super::case::Case;

/// Ticks within which everything is found and has come to an end.
const LONGEST: u32 = 40_000;
/// Ticks until a capture is full: it holds fewer after its trigger.
const CAPTURE_TICKS: u32 = 300;

/// How a fault was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Finding {
    /// The fault.
    pub(super) fault: String,
    /// What was done.
    pub(super) how: String,
    /// The axis that the firmware named, or the stage.
    pub(super) axis: String,
    /// Ticks from the first whose inputs show the cause, which is 1, to the one that found it; none: when the firmware
    /// started.
    pub(super) ticks: Option<u32>,
    /// The converters' words in that tick.
    pub(super) codes: [i16; 3],
    /// Whether the amplifiers were enabled in it.
    pub(super) enabled: bool,
    /// Ticks from there to the first with the amplifiers disabled.
    pub(super) ticks_until_off: u32,
    /// Whether its trace was captured.
    pub(super) captured: bool,
    /// Converter words and bytes of the link that were compared with the twin's.
    pub(super) compared: (u64, u64),
}

impl Finding {
    /// One at the start of a firmware.
    pub(super) fn at_start(how: &str, code: FaultCode) -> Self {
        Self {
            fault: code.name().into(),
            how: how.into(),
            axis: "the stage".into(),
            ticks: None,
            codes: [0; 3],
            enabled: false,
            ticks_until_off: 0,
            captured: false,
            compared: (0, 0),
        }
    }

    /// A row of the table in `docs/safety.md`.
    pub(super) fn row(&self, code: FaultCode) -> String {
        let [x, y, z] = self.codes;
        let reaction = match code.reaction() {
            Reaction::Off => "Off",
            Reaction::Stop => "Stop",
            Reaction::Hold => "Hold",
        };
        let ticks = self
            .ticks
            .map_or("at start".to_owned(), |ticks| ticks.to_string());
        let enabled = if self.enabled { "enabled" } else { "disabled" };
        format!(
            "| {} | {} | {} | {} | {reaction} | {ticks} | {x}, {y}, {z}, {enabled} | {} | {} |",
            code.number(),
            self.fault,
            self.how,
            self.axis,
            self.ticks_until_off,
            if self.captured { "yes" } else { "no" }
        )
    }
}

/// Provokes a fault of the running machine.
pub(super) fn provoke(bench: &mut Bench, code: FaultCode, case: &Case) -> Result<Finding> {
    let from = (case.bring)(bench)?;
    // It may be due only.
    bench.run(from.saturating_sub(bench.tick()))?;
    let first = |bench: &Bench, enabled: bool, from: u32| {
        (from..bench.tick()).find(|tick| {
            bench
                .outputs(*tick)
                .is_some_and(|outputs| outputs.enabled == enabled)
        })
    };
    let before = from.checked_sub(1).and_then(|tick| bench.outputs(tick));
    ensure!(
        before.is_some_and(|outputs| outputs.enabled),
        "the outputs were not enabled when it began"
    );
    bench.run_until(LONGEST, "the outputs off", |bench| {
        first(bench, false, from).is_some()
    })?;
    bench.run(CAPTURE_TICKS)?;
    let report = latched(bench, code)?;
    let found = report.tick;
    let outputs = bench.outputs(found).context("a tick that has been")?;
    let off = first(bench, false, from).context("it is off")?;
    ensure!(
        first(bench, true, off).is_none(),
        "the outputs were enabled again"
    );
    Ok(Finding {
        axis: report.axis.map_or("the stage", |axis| axis.as_str()).into(),
        ticks: Some((found + 1).checked_sub(from).context("found too early")?),
        codes: outputs.codes.map(|code| code.0).into_array(),
        enabled: outputs.enabled,
        // A converter that is not to be trusted is disabled by its board, a tick before the control law knows.
        ticks_until_off: off.saturating_sub(found),
        captured: report.captured,
        compared: bench.compared,
        ..Finding::at_start(case.how, code)
    })
}

/// The fault that the firmware says is latched, which must be this one, and keep the outputs off.
pub(super) fn latched(bench: &mut Bench, code: FaultCode) -> Result<FaultReport> {
    let Some(report) = bench.fault()? else {
        bail!("no fault is latched")
    };
    ensure!(
        report.code == code.number(),
        "found {} at tick {} instead",
        report.name,
        report.tick
    );
    ensure!(
        report.cause == code.cause() && report.remedy == code.remedy(),
        "the report says something else: {report:?}"
    );
    ensure!(
        bench.ask(Body::Enable)?.is_err(),
        "outputs could be enabled while the fault is latched"
    );
    bench.run(A_WHILE)?;
    Ok(report)
}

/// Whether the log has a line with these words.
pub(super) fn said(log: &[String], words: &str) -> Result<()> {
    ensure!(
        log.iter().any(|line| line.contains(words)),
        "the log does not say `{words}`:\n{}",
        log.join("\n")
    );
    Ok(())
}

/// That all outputs are off.
pub(super) fn are_off(outputs: &[Outputs]) -> bool {
    outputs.iter().all(|outputs| *outputs == Outputs::default())
}
