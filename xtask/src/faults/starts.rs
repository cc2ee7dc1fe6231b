//! Faults that a firmware finds when it starts: what ended the one before it, and stored settings that it refuses.

use anyhow::{Result, anyhow, ensure};
use quadrant::friction::gms::{FIRMWARE_ELEMENTS, GmsElement};
use quadrant::link::lockstep::{Mode, OUTPUT, OutputRecord, Provocation};
use quadrant::safety::FaultCode;
use quadrant::settings::StageSettings;
use quadrant::stage::Outputs;
use quadrant::store::{BUFFER_BYTES, Provenance, Store};
use quadrant_sim::simulated_machine::MemoryFlash;

use super::bench::Bench;
use super::case::{moving, setup};
use super::finding::{Finding, latched, said};
use crate::image::Image;
use crate::twin;
use quadrant_sim::emulator::{Clock, Emulator, Memory};

/// What ends a firmware, what the next one finds, and what it says of it.
const DEATHS: [(&str, Provocation, FaultCode, &str); 5] = [
    (
        "a panic of the idle loop, 30 mm/s",
        Provocation::Panic,
        FaultCode::Panic,
        "by panic: panicked at src/board/mps2/provocation.rs",
    ),
    (
        "an undefined instruction, 30 mm/s",
        Provocation::UndefinedInstruction,
        FaultCode::HardFault,
        "by hard fault: at 0x",
    ),
    (
        "a read where there is nothing, 30 mm/s",
        Provocation::BusError,
        FaultCode::HardFault,
        "by hard fault: at 0x",
    ),
    (
        "a stack that is full, 30 mm/s",
        Provocation::StackOverflow,
        FaultCode::HardFault,
        "by hard fault: the stack is full",
    ),
    (
        "an interrupt without a handler, 30 mm/s",
        Provocation::StrayInterrupt,
        FaultCode::HardFault,
        "by interrupt without a handler: number 9",
    ),
];

/// Ends the firmware in motion, in every way that leads to a fault.
pub(super) fn deaths(image: &Image, fault: FaultCode) -> Result<Vec<Finding>> {
    DEATHS
        .into_iter()
        .filter(|(_, _, code, _)| *code == fault)
        .map(|(how, what, code, words)| {
            let mut bench = Bench::start(image, setup())?;
            moving(&mut bench, 1.0)?;
            let at = bench.tick();
            let left = bench.provoke(what, code)?;
            ensure!(
                left == Outputs::default(),
                "{how}: {left:?} was left at the outputs"
            );
            let finding = at_start(bench, how, code, |log| {
                said(log, words)?;
                said(log, &format!("ended in tick {at} "))
            })?;
            Ok(finding)
        })
        .collect()
}

/// A job whose settings are refused: the firmware panics before its first tick, outputs first, and names the field. No
/// firmware could do better with that job, so that this one ends.
pub(super) fn refused_job(image: &Image) -> Result<()> {
    let memory = Memory::create()?;
    let mut job = twin::job();
    job.stage.axes[1].feedback.pid.kp_v_per_mm = f64::NAN;
    memory.prepare(Mode::Lockstep, 0, &twin::encode(&job)?)?;
    memory.write(OUTPUT, &[0xFF; OutputRecord::BYTES])?;
    let (succeeded, log) =
        Emulator::start(&image.program()?, &memory, Clock::Host, |_| {})?.end()?;
    ensure!(
        !succeeded,
        "the firmware took settings that must be refused"
    );
    let mut left = [0; OutputRecord::BYTES];
    memory.read(OUTPUT, &mut left)?;
    ensure!(
        left == [0; OutputRecord::BYTES],
        "the panic left {left:?} at the outputs"
    );
    said(
        &log,
        "y.feedback.pid.kp_v_per_mm = NaN is not a finite number",
    )
}

/// Starts on a set that a firmware with room for more elements has stored.
pub(super) fn refused_settings(image: &Image) -> Result<Finding> {
    let mut settings = StageSettings::simulated();
    let more = FIRMWARE_ELEMENTS + 1;
    let element = GmsElement {
        stiffness_v_per_mm: 1.0,
        weight: 1.0 / more as f64,
    };
    settings.axes[1].friction.gms.elements = std::iter::repeat_n(element, more).collect();
    let mut store = Store::new(MemoryFlash::default(), 0);
    store
        .save(&settings, more, &Provenance::new(), &mut [0; BUFFER_BYTES])
        .map_err(|error| anyhow!("the set was not stored: {error}"))?;
    let mut setup = setup();
    setup.flash = store.into_flash();
    let how = "a stored set with more GMS elements than the firmware has room for";
    let bench = Bench::start(image, setup)?;
    at_start(bench, how, FaultCode::SettingsInvalid, |log| {
        said(log, "stored settings refused: ")
    })
}

/// What a firmware that starts with a fault says and does.
fn at_start(
    mut bench: Bench,
    how: &str,
    code: FaultCode,
    check: impl FnOnce(&[String]) -> Result<()>,
) -> Result<Finding> {
    let report = latched(&mut bench, code)?;
    ensure!(report.tick == 0, "not at the start: {report:?}");
    let compared = bench.compared;
    let outputs = (0..bench.tick()).filter_map(|tick| bench.outputs(tick));
    ensure!(
        { outputs }.all(|outputs| outputs == Outputs::default()),
        "outputs are not off after the start"
    );
    check(&bench.end()?)?;
    Ok(Finding {
        compared,
        ..Finding::at_start(how, code)
    })
}
