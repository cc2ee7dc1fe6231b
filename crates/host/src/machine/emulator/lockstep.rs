//! A firmware that runs tick by tick with its host.

use std::time::{Duration, Instant};

use quadrant_law::stage::Outputs;
use quadrant_lockstep::{
    END_OF_RUN, INPUT_SEQUENCE, InputRecord, LOCKSTEP_TICKS, Mode, OUTPUT_SEQUENCE, OutputRecord,
    input_offset, output_offset,
};

use super::backoff::Backoff;
use super::error::EmulatorError;
use super::memory::Memory;
use super::process::{Clock, Emulator, Listener};
use super::program::Program;

/// Time-out of the firmware's answer, in the host's time: a busy computer runs it slowly, but not this slowly.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Pause between two looks at the answers of several ticks: those of some 150 ticks come meanwhile.
const PAUSE: Duration = Duration::from_millis(1);

/// The emulated firmware in lockstep.
#[derive(Debug)]
pub struct Lockstep {
    program: Program,
    memory: Memory,
    emulator: Emulator,
    listener: Listener,
    /// Ticks asked, and those of them that were answered.
    asked: u32,
    answered: u32,
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
            asked: 0,
            answered: 0,
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
        self.asked = 0;
        self.answered = 0;
        Ok(())
    }

    /// The memory shared with the firmware.
    pub const fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Ticks asked for since the start.
    pub const fn tick(&self) -> u32 {
        self.asked
    }

    /// The lines of the log that have come since the last call: at least those of all ticks before the last answered.
    ///
    /// # Errors
    /// A log that cannot be read.
    pub fn new_lines(&mut self) -> Result<Vec<String>, EmulatorError> {
        self.emulator.new_lines()
    }

    /// Passes the next tick's inputs.
    ///
    /// # Errors
    /// As [`ask_all`](Self::ask_all).
    pub fn ask(&mut self, input: &InputRecord) -> Result<(), EmulatorError> {
        self.ask_all(std::slice::from_ref(input))
    }

    /// Passes the inputs of the next ticks, which the firmware runs one after the other.
    ///
    /// # Errors
    /// The memory fails, or more than [`room`](Self::room) are asked.
    pub fn ask_all(&mut self, inputs: &[InputRecord]) -> Result<(), EmulatorError> {
        if inputs.len() > self.room() {
            return Err(EmulatorError::NoRoom {
                asked: inputs.len(),
                room: self.room(),
            });
        }
        let mut bytes = Vec::with_capacity(inputs.len() * InputRecord::BYTES);
        let mut from = self.asked.wrapping_add(1);
        for input in inputs {
            self.asked = self.asked.wrapping_add(1);
            if input_offset(self.asked) < input_offset(from) {
                self.memory.write(input_offset(from), &bytes)?;
                bytes.clear();
                from = self.asked;
            }
            bytes.extend(input.encode());
        }
        self.memory.write(input_offset(from), &bytes)?;
        self.memory.set_word(INPUT_SEQUENCE, self.asked)
    }

    /// Ticks that may be asked now.
    pub const fn room(&self) -> usize {
        (LOCKSTEP_TICKS - self.unanswered()) as usize
    }

    const fn unanswered(&self) -> u32 {
        self.asked.wrapping_sub(self.answered)
    }

    /// Waits for the outputs of the oldest tick without an answer: nothing, if the firmware has ended itself instead, as it
    /// does for a restart.
    ///
    /// # Errors
    /// A firmware that failed or is silent.
    pub fn answer(&mut self) -> Result<Option<Outputs>, EmulatorError> {
        let mut backoff = Backoff::default();
        let answered = self.wait(|| backoff.pause())?;
        if answered == 0 {
            return Ok(None);
        }
        self.answered = self.answered.wrapping_add(1);
        let mut bytes = [0; OutputRecord::BYTES];
        self.memory.read(output_offset(self.answered), &mut bytes)?;
        Ok(Some(OutputRecord::decode(&bytes).outputs))
    }

    /// Waits, asleep, for the outputs of at least one tick; gives those of all ticks that have been answered by now, in
    /// their order. None, if the firmware has ended itself instead.
    ///
    /// # Errors
    /// A firmware that failed or is silent.
    pub fn answers(&mut self) -> Result<Vec<Outputs>, EmulatorError> {
        let mut count = self.wait(|| std::thread::sleep(PAUSE))?;
        let mut outputs = Vec::with_capacity(count as usize);
        while count > 0 {
            let first = self.answered.wrapping_add(1);
            // Up to the end of the ring.
            let left = (output_offset(0) - output_offset(first)) / OutputRecord::BYTES + 1;
            let part = count.min(left as u32);
            let mut bytes = vec![0; part as usize * OutputRecord::BYTES];
            self.memory.read(output_offset(first), &mut bytes)?;
            let (records, _) = bytes.as_chunks();
            outputs.extend(
                records
                    .iter()
                    .map(|record| OutputRecord::decode(record).outputs),
            );
            self.answered = self.answered.wrapping_add(part);
            count -= part;
        }
        Ok(outputs)
    }

    /// Waits until ticks have been answered; their number is zero, if the firmware has ended itself instead.
    fn wait(&mut self, mut pause: impl FnMut()) -> Result<u32, EmulatorError> {
        let since = Instant::now();
        let mut looked = since;
        loop {
            let count = self.news()?;
            if count > 0 {
                return Ok(count);
            }
            pause();
            // Seldom: it asks the operating system.
            if looked.elapsed() < PAUSE {
                continue;
            }
            looked = Instant::now();
            if let Some(status) = self.emulator.ended()? {
                // It may have answered first.
                let count = self.news()?;
                return match count > 0 || status.success() {
                    true => Ok(count),
                    false => Err(self.emulator.failure()?),
                };
            }
            if since.elapsed() >= TIMEOUT {
                return Err(EmulatorError::Silent {
                    tick: self.answered.wrapping_add(1),
                    waited: TIMEOUT,
                });
            }
        }
    }

    /// Ticks that were answered since the last look.
    fn news(&self) -> Result<u32, EmulatorError> {
        let sequence = self.memory.word(OUTPUT_SEQUENCE)?;
        let count = sequence.wrapping_sub(self.answered);
        // Before its start the firmware has written nothing: a number of before means no answer.
        Ok(if count <= self.unanswered() { count } else { 0 })
    }

    /// Lets the firmware end of its own accord, and returns the lines of the log that were not read before.
    ///
    /// # Errors
    /// A firmware that failed.
    pub fn finish(self) -> Result<Vec<String>, EmulatorError> {
        self.memory.set_word(INPUT_SEQUENCE, END_OF_RUN)?;
        self.emulator.wait()
    }
}
