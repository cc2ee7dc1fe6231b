//! QEMU with the firmware in it.

mod log;
mod memory;

use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;

use anyhow::{Context, Result, bail, ensure};

pub(crate) use self::memory::Memory;
use crate::command;
use crate::image::Image;

/// What drives the emulated machine's clocks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Clock {
    /// The host's: fastest, but times are not reproducible. For lockstep, in which no time is looked at.
    Host,
    /// The count of instructions, one being 8 ns: reproducible, and about what the reference board's 180 MHz give.
    Instructions,
}

/// A running emulator. Dropping it ends it.
pub(crate) struct Emulator {
    child: Child,
    log: Option<JoinHandle<Result<Vec<String>>>>,
}

/// QEMU's command line for an image, with the firmware's log at standard output.
pub(crate) fn command_line(image: &Image, memory: &Memory, clock: Clock) -> Result<Command> {
    let Some(machine) = image.target.machine() else {
        bail!("{} is a real board: it is not emulated", image.target);
    };
    let mut qemu = command::command("qemu-system-arm");
    qemu.args(["-machine", &format!("{machine},memory-backend=psram")]);
    let backend = format!(
        "memory-backend-file,id=psram,size={},mem-path={},share=on",
        quadrant::link::lockstep::MEMORY_BYTES,
        memory.path().display()
    );
    qemu.args(["-object", &backend]);
    qemu.args(["-nographic", "-monitor", "none", "-serial", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native"]);
    if clock == Clock::Instructions {
        qemu.args(["-icount", "shift=3"]);
    }
    qemu.arg("-kernel").arg(&image.path);
    Ok(qemu)
}

/// Decodes a log that was read out of a machine's memory, and prints it.
pub(crate) fn decode_log(bytes: &[u8], elf: &[u8]) -> Result<Vec<String>> {
    log::decode(bytes, elf, true)
}

impl Emulator {
    /// Starts the image. The memory must have been prepared.
    pub(crate) fn start(image: &Image, memory: &Memory, clock: Clock, echo: bool) -> Result<Self> {
        Self::spawn(command_line(image, memory, clock)?, image, echo)
    }

    /// Starts a command line made by [`command_line`]. With `echo` the log is printed as it comes.
    pub(crate) fn spawn(mut qemu: Command, image: &Image, echo: bool) -> Result<Self> {
        let mut child = qemu
            .stdout(Stdio::piped())
            .spawn()
            .context("cannot start qemu-system-arm: `cargo xtask setup` installs it")?;
        let stdout = child
            .stdout
            .take()
            .context("QEMU's standard output is a pipe")?;
        let elf = image.elf.clone();
        let log = std::thread::spawn(move || log::decode(stdout, &elf, echo));
        Ok(Self {
            child,
            log: Some(log),
        })
    }

    /// QEMU's standard error, when the command line made it a pipe.
    pub(crate) fn take_stderr(&mut self) -> Option<std::process::ChildStderr> {
        self.child.stderr.take()
    }

    /// How the emulator ended, if it has.
    pub(crate) fn ended(&mut self) -> Result<Option<ExitStatus>> {
        self.child.try_wait().context("cannot look after QEMU")
    }

    /// Waits for the end, and returns whether it was a success, and the log.
    pub(crate) fn end(mut self) -> Result<(bool, Vec<String>)> {
        let status = self.child.wait().context("cannot wait for QEMU")?;
        let log = self.log.take().context("the log is taken once")?;
        let Ok(lines) = log.join() else {
            bail!("the thread that decodes the log panicked")
        };
        Ok((status.success(), lines?))
    }

    /// Waits for the end and returns the log. Anything but success is an error that carries the log's last lines.
    pub(crate) fn wait(self) -> Result<Vec<String>> {
        let (succeeded, lines) = self.end()?;
        let last = lines
            .iter()
            .rev()
            .take(5)
            .rev()
            .map(|line| format!("\n  {line}"))
            .collect::<String>();
        ensure!(succeeded, "the firmware failed; its last words:{last}");
        Ok(lines)
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended by itself: then there is nothing to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
