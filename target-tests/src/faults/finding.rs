//! The outcome of a fault injection.

use anyhow::{Context, Result, bail, ensure};
use quadrant_law::safety::{FaultCode, Reaction};
use quadrant_law::stage::Outputs;
use quadrant_link::message::{Body, FaultReport};
use serde::{Deserialize, Serialize};

use super::case::Case;
use super::fixture::{A_WHILE, Fixture};

/// Ticks within which everything is found and has come to an end.
const LONGEST: u32 = 40_000;
/// Ticks until a capture is full: it holds fewer after its trigger.
const CAPTURE_TICKS: u32 = 300;

/// Finding of a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Finding {
    /// The fault.
    pub(crate) fault: String,
    /// Cause, in words.
    pub(crate) how: String,
    /// The axis that the firmware named, or the stage.
    pub(crate) axis: String,
    /// Ticks from the first whose inputs show the cause, which is 1, to the one that found it; none: when the firmware
    /// started.
    pub(crate) ticks: Option<u32>,
    /// The converters' words in that tick.
    pub(crate) codes: [i16; 3],
    /// True if the amplifiers were enabled in it.
    pub(crate) enabled: bool,
    /// Ticks from there to the first with the amplifiers disabled.
    pub(crate) ticks_until_off: u32,
    /// True if its trace was captured.
    pub(crate) captured: bool,
    /// Converter words and bytes of the link that were compared with the reference model's.
    pub(crate) compared: (u64, u64),
}

impl Finding {
    /// One at the start of a firmware.
    pub(crate) fn at_start(how: &str, code: FaultCode) -> Self {
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

    /// A row of the table that the command prints.
    pub(crate) fn row(&self, code: FaultCode) -> String {
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

/// Injects a fault into the running machine.
pub(crate) fn inject(fixture: &mut Fixture, code: FaultCode, case: &Case) -> Result<Finding> {
    let from = (case.bring)(fixture)?;
    // It may be due only.
    fixture.run(from.saturating_sub(fixture.tick()))?;
    let first = |fixture: &Fixture, enabled: bool, from: u32| {
        (from..fixture.tick()).find(|tick| {
            fixture
                .outputs(*tick)
                .is_some_and(|outputs| outputs.enabled == enabled)
        })
    };
    let before = from.checked_sub(1).and_then(|tick| fixture.outputs(tick));
    ensure!(
        before.is_some_and(|outputs| outputs.enabled),
        "the outputs were not enabled when it began"
    );
    fixture.run_until(LONGEST, "the outputs off", |fixture| {
        first(fixture, false, from).is_some()
    })?;
    fixture.run(CAPTURE_TICKS)?;
    let report = latched(fixture, code)?;
    let found = report.tick;
    let outputs = fixture.outputs(found).context("a tick that has been")?;
    let off = first(fixture, false, from).context("it is off")?;
    ensure!(
        first(fixture, true, off).is_none(),
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
        compared: fixture.compared,
        ..Finding::at_start(case.how, code)
    })
}

/// The fault that the firmware says is latched, which must be this one, and keep the outputs off.
pub(crate) fn latched(fixture: &mut Fixture, code: FaultCode) -> Result<FaultReport> {
    let Some(report) = fixture.fault()? else {
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
        fixture.ask(Body::Enable)?.is_err(),
        "outputs could be enabled while the fault is latched"
    );
    fixture.run(A_WHILE)?;
    Ok(report)
}

/// Checks that the log has a line with these words.
pub(crate) fn log_contains(log: &[String], words: &str) -> Result<()> {
    ensure!(
        log.iter().any(|line| line.contains(words)),
        "the log does not say `{words}`:\n{}",
        log.join("\n")
    );
    Ok(())
}

/// That all outputs are off.
pub(crate) fn are_off(outputs: &[Outputs]) -> bool {
    outputs.iter().all(|outputs| *outputs == Outputs::default())
}
