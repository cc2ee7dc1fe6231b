//! A firmware that runs tick by tick with its host.

use std::time::{Duration, Instant};

use quadrant::lockstep::{
    END_OF_RUN, INPUT, INPUT_SEQUENCE, InputRecord, Mode, OUTPUT, OUTPUT_SEQUENCE, OutputRecord,
};
use quadrant::stage::Outputs;

use super::error::EmulatorError;
use super::memory::Memory;
use super::process::{Clock, Emulator, Listener};
use super::program::Program;

/// Time-out of the firmware's answer, in the host's time: a busy computer runs it slowly, but not this slowly.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Looks at the answer between two pauses.
const LOOKS: u32 = 1 << 10;
/// Pauses between two looks at the clock.
const PAUSES: u32 = 1 << 6;

/// The emulated firmware in lockstep.
#[derive(Debug)]
pub struct Lockstep {
    program: Program,
    memory: Memory,
    emulator: Emulator,
    listener: Listener,
    tick: u32,
}

impl Lockstep {
    /// Starts a program in a memory that has been prepared for [`Mode::Lockstep`].
    ///
    /// # Errors
    /// QEMU is not installed.
    pub fn start(
        program: Program,
        memory: Memory,
        listener: Listener,
    ) -> Result<Self, EmulatorError> {
        let emulator = Emulator::start(&program, &memory, Clock::Host, listener)?;
        Ok(Self {
            program,
            memory,
            emulator,
            listener,
            tick: 0,
        })
    }

    /// Starts the program afresh in the same memory, as after a reset. What was under way is lost; an emulator that has not
    /// ended yet is ended.
    ///
    /// # Errors
    /// QEMU does not start.
    pub fn restart(&mut self, job: &[u8]) -> Result<(), EmulatorError> {
        self.emulator.kill()?;
        self.memory.set_word(INPUT_SEQUENCE, 0)?;
        self.memory.set_word(OUTPUT_SEQUENCE, 0)?;
        self.memory.prepare(Mode::Lockstep, 0, job)?;
        self.emulator = Emulator::start(&self.program, &self.memory, Clock::Host, self.listener)?;
        self.tick = 0;
        Ok(())
    }

    /// The memory shared with the firmware.
    pub const fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Ticks asked for since the start.
    pub const fn tick(&self) -> u32 {
        self.tick
    }

    /// The lines of the log that have come since the last call: at least those of all ticks before the last answered.
    ///
    /// # Errors
    /// A log that cannot be read.
    pub fn new_lines(&mut self) -> Result<Vec<String>, EmulatorError> {
        self.emulator.new_lines()
    }

    /// SimulatedIo over the next tick's inputs; [`answer`](Self::answer) must follow.
    ///
    /// # Errors
    /// The memory fails.
    pub fn ask(&mut self, input: &InputRecord) -> Result<(), EmulatorError> {
        self.tick = self.tick.wrapping_add(1);
        self.memory.write(INPUT, &input.encode())?;
        self.memory.set_word(INPUT_SEQUENCE, self.tick)
    }

    /// Waits for the tick's outputs: nothing, if the firmware has ended itself instead, as it does for a restart.
    ///
    /// # Errors
    /// A firmware that failed or is silent.
    pub fn answer(&mut self) -> Result<Option<Outputs>, EmulatorError> {
        let mut since = None;
        loop {
            for _ in 0..PAUSES {
                for _ in 0..LOOKS {
                    if self.memory.word(OUTPUT_SEQUENCE)? == self.tick {
                        return self.outputs().map(Some);
                    }
                    std::hint::spin_loop();
                }
                // The firmware may need this very core.
                std::thread::yield_now();
            }
            let since = *since.get_or_insert_with(Instant::now);
            if let Some(status) = self.emulator.ended()? {
                // It may have answered first.
                if self.memory.word(OUTPUT_SEQUENCE)? == self.tick {
                    return self.outputs().map(Some);
                }
                return match status.success() {
                    true => Ok(None),
                    false => Err(self.emulator.failure()?),
                };
            }
            if since.elapsed() >= TIMEOUT {
                return Err(EmulatorError::Silent {
                    tick: self.tick,
                    waited: TIMEOUT,
                });
            }
        }
    }

    /// Lets the firmware end of its own accord, and returns the lines of the log that were not read before.
    ///
    /// # Errors
    /// A firmware that failed.
    pub fn finish(self) -> Result<Vec<String>, EmulatorError> {
        self.memory.set_word(INPUT_SEQUENCE, END_OF_RUN)?;
        self.emulator.wait()
    }

    fn outputs(&self) -> Result<Outputs, EmulatorError> {
        let mut bytes = [0; OutputRecord::BYTES];
        self.memory.read(OUTPUT, &mut bytes)?;
        Ok(OutputRecord::decode(&bytes).outputs)
    }
}
