//! A running QEMU, its log and its end.

use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::time::Duration;

use quadrant_lockstep::MEMORY_BYTES;

use super::error::EmulatorError;
use super::log::Log;
use super::memory::Memory;
use super::program::Program;

/// The emulator's name in the search path.
const QEMU: &str = "qemu-system-arm";
/// Time from one look at a running emulator to the next.
const LOOK: Duration = Duration::from_millis(5);
/// Lines of the log that an error carries.
const LAST_WORDS: usize = 5;

/// Source of the emulated machine's clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The host's: fastest, but times are not reproducible. For lockstep, in which no time is looked at.
    Host,
    /// The count of instructions, one being 8 ns: reproducible, and about what the reference board's 180 MHz give.
    Instructions,
}

/// Callback for each line of the firmware's log when it is read.
pub type Listener = fn(&str);

/// A running emulator. Dropping it ends it.
#[derive(Debug)]
pub struct Emulator {
    child: Child,
    log: Log,
    listener: Listener,
}

/// QEMU's command line for a program in a memory; the firmware's log comes at standard output.
pub fn command_line(program: &Program, memory: &Memory, clock: Clock) -> Command {
    let mut qemu = Command::new(QEMU);
    // The libraries of the parent process are not QEMU's.
    qemu.env_remove("LD_LIBRARY_PATH").stdin(Stdio::null());
    // Ctrl-C in the terminal is for the host, which stops the axes and ends QEMU itself.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut qemu, 0);
    qemu.arg("-machine")
        .arg(format!("{},memory-backend=psram", program.machine()));
    qemu.arg("-object").arg(format!(
        "memory-backend-file,id=psram,size={MEMORY_BYTES},mem-path={},share=on",
        memory.path().display()
    ));
    qemu.args(["-nographic", "-monitor", "none", "-serial", "none"]);
    qemu.args(["-semihosting-config", "enable=on,target=native"]);
    if clock == Clock::Instructions {
        qemu.args(["-icount", "shift=3"]);
    }
    qemu.arg("-kernel").arg(program.path());
    qemu
}

impl Emulator {
    /// Starts a program. The memory must have been prepared.
    ///
    /// # Errors
    /// QEMU is not installed.
    pub fn start(
        program: &Program,
        memory: &Memory,
        clock: Clock,
        listener: Listener,
    ) -> Result<Self, EmulatorError> {
        Self::spawn(command_line(program, memory, clock), program, listener)
    }

    /// Starts a command line made by [`command_line`].
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn spawn(
        mut qemu: Command,
        program: &Program,
        listener: Listener,
    ) -> Result<Self, EmulatorError> {
        let (log, stdout) = Log::create(program.table())?;
        let child = qemu
            .stdout(stdout)
            .spawn()
            .map_err(EmulatorError::NotStarted)?;
        Ok(Self {
            child,
            log,
            listener,
        })
    }

    /// QEMU's standard error, when the command line made it a pipe.
    pub fn take_stderr(&mut self) -> Option<ChildStderr> {
        self.child.stderr.take()
    }

    /// Returns the exit status of the emulator, once it has ended.
    ///
    /// # Errors
    /// The operating system does not say.
    pub fn ended(&mut self) -> Result<Option<ExitStatus>, EmulatorError> {
        self.child
            .try_wait()
            .map_err(|source| EmulatorError::io("look after QEMU", source))
    }

    /// The lines of the log that have come since the last call. The firmware waits until a line is written, so that all of
    /// it is here when the firmware has gone on.
    ///
    /// # Errors
    /// A log that cannot be read.
    pub fn new_lines(&mut self) -> Result<Vec<String>, EmulatorError> {
        let lines = self.log.read()?;
        for line in &lines {
            (self.listener)(line);
        }
        Ok(lines)
    }

    /// Ends the emulator, as a power cut does.
    ///
    /// # Errors
    /// The operating system does not let us.
    pub fn kill(&mut self) -> Result<(), EmulatorError> {
        let failed = |source| EmulatorError::io("end QEMU", source);
        self.child.kill().map_err(failed)?;
        self.child.wait().map_err(failed)?;
        Ok(())
    }

    /// Returns the error of a firmware that failed.
    ///
    /// # Errors
    /// As [`new_lines`](Self::new_lines).
    pub(super) fn failure(&mut self) -> Result<EmulatorError, EmulatorError> {
        Ok(failed(&self.new_lines()?))
    }

    /// Waits for the end, and returns whether it was a success, and the lines of the log that were not read before.
    ///
    /// # Errors
    /// As [`new_lines`](Self::new_lines) and [`ended`](Self::ended).
    pub fn end(mut self) -> Result<(bool, Vec<String>), EmulatorError> {
        let mut lines = Vec::new();
        let status = loop {
            let ended = self.ended()?;
            lines.extend(self.new_lines()?);
            match ended {
                Some(status) => break status,
                None => std::thread::sleep(LOOK),
            }
        };
        Ok((status.success(), lines))
    }

    /// Waits for the end and returns the lines of the log that were not read before.
    ///
    /// # Errors
    /// Anything but success, with the log's last lines.
    pub fn wait(self) -> Result<Vec<String>, EmulatorError> {
        let (succeeded, lines) = self.end()?;
        if succeeded {
            return Ok(lines);
        }
        Err(failed(&lines))
    }
}

fn failed(lines: &[String]) -> EmulatorError {
    let last = lines.len().saturating_sub(LAST_WORDS);
    EmulatorError::Failed {
        last_words: lines[last..].join("\n  "),
    }
}

impl Drop for Emulator {
    fn drop(&mut self) {
        // It may have ended by itself: then there is nothing to do.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
