//! Faults that a firmware finds when it starts: what ended the one before it, and stored settings that it refuses.

use anyhow::{Result, anyhow, ensure};
use quadrant::store::{BUFFER_BYTES, Provenance, Store};
use quadrant_host::machine::emulator::{Clock, Emulator, Memory};
use quadrant_host::machine::memory_flash::MemoryFlash;
use quadrant_law::friction::gms::{FIRMWARE_ELEMENTS, GmsElement};
use quadrant_law::safety::FaultCode;
use quadrant_law::stage::Outputs;
use quadrant_lockstep::{InjectedFault, Mode, OUTPUT, OutputRecord};
use quadrant_settings::StageSettings;
use xtask::image::Image;

use super::approach::moving;
use super::case::configuration;
use super::finding::{Finding, latched, log_contains};
use super::fixture::Fixture;
use crate::reference_model;

/// Ends of a firmware, the fault that the next one finds, and its words for it.
const RESETS: [(&str, InjectedFault, FaultCode, &str); 5] = [
    (
        "a panic of the idle loop, 30 mm/s",
        InjectedFault::Panic,
        FaultCode::Panic,
        "by panic: panicked at src/board/mps2/fault_injection.rs",
    ),
    (
        "an undefined instruction, 30 mm/s",
        InjectedFault::UndefinedInstruction,
        FaultCode::HardFault,
        "by hard fault: at 0x",
    ),
    (
        "a read where there is nothing, 30 mm/s",
        InjectedFault::BusError,
        FaultCode::HardFault,
        "by hard fault: at 0x",
    ),
    (
        "a stack that is full, 30 mm/s",
        InjectedFault::StackOverflow,
        FaultCode::HardFault,
        "by hard fault: the stack is full",
    ),
    (
        "an interrupt without a handler, 30 mm/s",
        InjectedFault::StrayInterrupt,
        FaultCode::HardFault,
        "by interrupt without a handler: number 9",
    ),
];

/// Ends the firmware in motion, in every way that leads to a fault.
pub(crate) fn resets(image: &Image, fault: FaultCode) -> Result<Vec<Finding>> {
    RESETS
        .into_iter()
        .filter(|(_, _, code, _)| *code == fault)
        .map(|(how, what, code, words)| {
            let mut fixture = Fixture::start(image, configuration())?;
            moving(&mut fixture, 1.0)?;
            let at = fixture.tick();
            let left = fixture.inject_fault(what, code)?;
            ensure!(
                left == Outputs::default(),
                "{how}: {left:?} was left at the outputs"
            );
            let finding = at_start(fixture, how, code, |log| {
                log_contains(log, words)?;
                log_contains(log, &format!("ended in tick {at} "))
            })?;
            Ok(finding)
        })
        .collect()
}

/// A job whose settings are refused: the firmware panics before its first tick, outputs first, and names the field. No
/// firmware could do better with that job, so that this one ends.
pub(crate) fn refused_job(image: &Image) -> Result<()> {
    let memory = Memory::create()?;
    let mut job = reference_model::job();
    job.stage.axes[1].feedback.pid.kp_v_per_mm = f64::NAN;
    memory.prepare(Mode::Lockstep, 0, &reference_model::encode(&job)?)?;
    memory.write(OUTPUT, &[0xFF; OutputRecord::BYTES])?;
    let (succeeded, log) = Emulator::start(
        &reference_model::program(image)?,
        &memory,
        Clock::Host,
        |_| {},
    )?
    .end()?;
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
    log_contains(
        &log,
        "y/feedback/pid/kp_v_per_mm = NaN is not a finite number",
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
    let mut configuration = configuration();
    configuration.flash = store.into_flash();
    let how = "a stored set with more GMS elements than the firmware has room for";
    let fixture = Fixture::start(image, configuration)?;
    at_start(fixture, how, FaultCode::SettingsInvalid, |log| {
        log_contains(log, "stored settings refused: ")
    })
}

/// Returns the log and the outputs of a firmware that starts with a fault.
fn at_start(
    mut fixture: Fixture,
    how: &str,
    code: FaultCode,
    check: impl FnOnce(&[String]) -> Result<()>,
) -> Result<Finding> {
    let report = latched(&mut fixture, code)?;
    ensure!(report.tick == 0, "not at the start: {report:?}");
    let compared = fixture.compared;
    let outputs = (0..fixture.tick()).filter_map(|tick| fixture.outputs(tick));
    ensure!(
        { outputs }.all(|outputs| outputs == Outputs::default()),
        "outputs are not off after the start"
    );
    check(&fixture.end()?)?;
    Ok(Finding {
        compared,
        ..Finding::at_start(how, code)
    })
}
