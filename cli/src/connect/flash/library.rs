//! The debug probe by the library of probe-rs: nothing else has to be installed.

use std::fs;
use std::thread;
use std::time::Duration;

use anyhow::Context;
use probe_rs::architecture::arm::dp::DpAddress;
use probe_rs::architecture::arm::sequences::DefaultArmSequence;
use probe_rs::architecture::arm::{ArmDebugInterface, ArmError};
use probe_rs::config::Registry;
use probe_rs::flashing::{
    DownloadOptions, ElfLoader, ElfOptions, FlashProgress, ProgressEvent, ProgressOperation,
    build_loader,
};
use probe_rs::probe::Probe;
use probe_rs::rtt::find_rtt_control_block_in_raw_file;
use probe_rs::{Permissions, Target};
use quadrant_cli::output::share;
use quadrant_cli::say;
use quadrant_host::log::LogDecoder;

use super::log_buffer::LogBuffer;
use super::{Job, chips, probes};

/// Time from one look at the log to the next, while nothing comes.
const LOOK: Duration = Duration::from_millis(50);
/// Remedy of a chip that does not answer.
const NO_ANSWER: &str = "the chip does not answer: is the board powered, are both jumpers of CN2 set (Nucleo-F446RE), and is no other \
                         debugger connected?";

/// Flashes an image, verifies it and lets it start; with `stay`, shows its log until Ctrl-C.
pub(super) fn flash(job: &Job, stay: bool) -> anyhow::Result<()> {
    let target = target(&job.chip)?;
    let (probe, name) = probes::open(job.probe)?;
    let mut interface = interface(probe).with_context(|| format!("{name}: {NO_ANSWER}"))?;
    chips::check(&job.chip, chips::read(&mut *interface).context(NO_ANSWER)?)?;
    say!("{name}, {}", target.name);
    let mut probe = interface.close();
    probe.detach().context(NO_ANSWER)?;
    let mut session = probe
        .attach(target, Permissions::default())
        .context(NO_ANSWER)?;

    let loader = build_loader(
        &mut session,
        job.elf,
        ElfLoader(ElfOptions::default()),
        None,
    )
    .with_context(|| format!("{}: nothing was erased", job.elf.display()))?;
    let bar = share("erasing");
    bar.set_length(0);
    let mut options = DownloadOptions::default();
    options.verify = true;
    options.progress = FlashProgress::new(|event| match event {
        ProgressEvent::AddProgressBar { total, .. } => bar.inc_length(total.unwrap_or(0)),
        ProgressEvent::Started(operation) => bar.set_message(verb(operation)),
        ProgressEvent::Progress { size, .. } => bar.inc(size),
        _ => {}
    });
    loader
        .commit(&mut session, options)
        .context("the image is not on the board as a whole: flash it again")?;
    bar.finish_and_clear();
    session
        .core(0)?
        .reset()
        .context("cannot restart the board")?;
    say!(
        "{} is flashed and verified; the board has restarted",
        job.elf.display()
    );
    // It lets go of the chip.
    drop(session);
    if stay { log(job) } else { Ok(()) }
}

/// Shows the log of a board that runs, until Ctrl-C.
pub(super) fn log(job: &Job) -> anyhow::Result<()> {
    let image = fs::read(job.elf)?;
    let mut decoder = LogDecoder::of_image(job.elf).context("log")?;
    let address = find_rtt_control_block_in_raw_file(&image)?
        .with_context(|| format!("{}: it has no log", job.elf.display()))?;
    let (probe, name) = probes::open(job.probe)?;
    let mut interface = interface(probe).with_context(|| format!("{name}: {NO_ANSWER}"))?;
    chips::check(&job.chip, chips::read(&mut *interface).context(NO_ANSWER)?)?;
    let mut memory = interface
        .memory_interface(&chips::CORE)
        .context(NO_ANSWER)?;
    let buffer = LogBuffer::at(address, &mut *memory)?;
    loop {
        let bytes = buffer.take(&mut *memory).context("the log has ended")?;
        for line in decoder.push(&bytes) {
            say!("{line}");
        }
        if bytes.is_empty() {
            thread::sleep(LOOK);
        }
    }
}

/// Returns what probe-rs knows of a chip.
fn target(chip: &str) -> anyhow::Result<Target> {
    Registry::from_builtin_families()
        .get_target_by_name(chip)
        .with_context(|| {
            format!(
                "--chip {chip}: probe-rs knows no such chip; https://probe.rs/targets lists them"
            )
        })
}

/// Connects to a chip, whose core runs on.
fn interface(mut probe: Probe) -> Result<Box<dyn ArmDebugInterface>, ArmError> {
    probe
        .attach_to_unspecified()
        .map_err(|error| ArmError::Other(error.to_string()))?;
    let mut interface = probe
        .try_into_arm_debug_interface(DefaultArmSequence::create())
        .map_err(|(_, error)| error)?;
    interface.select_debug_port(DpAddress::Default)?;
    Ok(interface)
}

const fn verb(operation: ProgressOperation) -> &'static str {
    match operation {
        ProgressOperation::Fill => "reading",
        ProgressOperation::Erase => "erasing",
        ProgressOperation::Program => "writing",
        ProgressOperation::Verify => "verifying",
    }
}
