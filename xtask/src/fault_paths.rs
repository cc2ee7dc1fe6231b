//! The ways out of trouble, driven in the emulated firmware: a fault of the axis, and a panic.

use anyhow::{Result, ensure};
use quadrant::link::lockstep::{Mode, OUTPUT, OutputRecord};
use quadrant_sim::emulator::{Clock, Emulator, Memory};

use crate::emulate;
use crate::image::{self, Board, Scalar, Target};
use crate::toolchain::Toolchain;
use crate::twin::{self, Twin};

/// Ticks of the run with a blocked axis: the fault comes after 0.6 s.
const TICKS: u32 = 10_000;

/// Blocks an axis, then hands over settings that are refused.
pub(crate) fn run(toolchain: Toolchain, scalar: Scalar) -> Result<()> {
    let board = Board::Mps2;
    let image = image::build(toolchain, Target { board, scalar })?;
    blocked_axis(&image, scalar)?;
    refused_settings(&image)
}

/// An axis whose encoder stands still while its reference moves: the outputs go to zero and are disabled in the tick
/// that finds it, which is the twin's tick, and the log says why.
fn blocked_axis(image: &image::Image, scalar: Scalar) -> Result<()> {
    let run = emulate::lockstep(
        image,
        Twin::of(scalar, twin::job())?.with_blocked_axis(),
        TICKS,
    )?;
    ensure!(run.tally.differ == 0, "{} words differ", run.tally.differ);
    ensure!(run.tally.enabled > 0, "the stage was never enabled");
    ensure!(!run.last.enabled, "the outputs are still enabled");
    ensure!(
        run.last.codes.iter().all(|code| code.0 == 0),
        "the outputs are not zero: {:?}",
        run.last
    );
    said(&run.log, "fault 1 on x")
}

/// Settings that are refused: the firmware panics before its first tick, outputs first, and the log names the field.
fn refused_settings(image: &image::Image) -> Result<()> {
    let memory = Memory::create()?;
    let mut job = twin::job();
    job.stage.axes[1].feedback.pid.kp_v_per_mm = f64::NAN;
    memory.prepare(Mode::Lockstep, 0, &twin::encode(&job)?)?;
    memory.write(OUTPUT, &[0xFF; OutputRecord::BYTES])?;
    let (succeeded, log) =
        Emulator::start(&image.program()?, &memory, Clock::Host, emulate::show)?.end()?;
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

fn said(log: &[String], words: &str) -> Result<()> {
    ensure!(
        log.iter().any(|line| line.contains(words)),
        "the log does not say `{words}`:\n{}",
        log.join("\n")
    );
    Ok(())
}
