//! The firmware's image in QEMU, on the simulated stage: the machine that comes closest to a board without being one.
//!
//! Everything passes in the order in which it passes in the [simulated machine](super::simulated), tick by tick, so
//! that a session is the same on both: the server looks at its port every [`PERIOD_TICKS`], and what it writes then is seen
//! one tick later.

use std::collections::VecDeque;

use quadrant_law::safety::Switches;
use quadrant_law::stage::Outputs;
use quadrant_law::supervisor::PERIOD_TICKS;
use quadrant_lockstep::{
    FLASH, FLASH_BYTES, InputRecord, LINK_BYTES, LINK_IN, LINK_IN_TAKEN, LINK_IN_WRITTEN, LINK_OUT,
    LINK_OUT_SHOWN, LINK_OUT_TAKEN, Mode,
};
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, StageSettings};
use quadrant_sim::plant::SimulatedStage;
use quadrant_sim::stage_setup::StageSetup;

use super::emulator::{EmulatorError, Lockstep, Memory, Program};
use super::timing::{off_ticks, port_bytes};
use crate::machine::emulator::record_of;

/// The job of a machine whose flash is empty: its settings, without a motion.
fn first_job(settings: &StageSettings) -> Vec<u8> {
    let job = Job {
        stage: settings.clone(),
        plan: PlanSettings::default(),
    };
    // Plain data: it cannot fail.
    postcard::to_allocvec(&job).unwrap_or_default()
}

/// The firmware's image on the simulated stage.
pub struct EmulatedMachine {
    lockstep: Lockstep,
    plant: SimulatedStage,
    /// Control rate of a machine whose flash is empty, Hz: the plant's, also where the flash says another.
    rate_hz: f64,
    /// What the firmware is given at each start, encoded.
    job: Vec<u8>,
    port: HostPort,
    outputs: Outputs,
    pressed: Switches,
    /// Lines of the log that are complete, and those that came last.
    complete: Vec<String>,
    recent: Vec<String>,
}

impl EmulatedMachine {
    /// Switches a machine on. `seed` decides the noise of its encoders, `flash` is what its flash for settings holds: of
    /// [`FLASH_BYTES`], 0xFF where it is erased.
    ///
    /// # Errors
    /// QEMU is not installed, or the flash is of another size.
    pub fn start(
        program: Program,
        setup: &StageSetup,
        seed: u64,
        flash: &[u8],
    ) -> Result<Self, EmulatorError> {
        if flash.len() != FLASH_BYTES {
            return Err(EmulatorError::FlashSize {
                bytes: flash.len(),
                expected: FLASH_BYTES,
            });
        }
        let memory = Memory::create()?;
        memory.write(FLASH, &inverted(flash))?;
        let StageSetup {
            settings,
            truth,
            marks,
        } = setup;
        let mut plant = SimulatedStage::new(truth, settings.rate_hz, seed);
        plant.set_marks(*marks);
        let job = first_job(settings);
        memory.prepare(Mode::Lockstep, 0, &job)?;
        let port = HostPort {
            room: port_bytes(settings.rate_hz).min(LINK_BYTES),
            ..HostPort::default()
        };
        port.reset(&memory)?;
        Ok(Self {
            lockstep: Lockstep::start(program, memory, |_| {})?,
            plant,
            rate_hz: settings.rate_hz,
            job,
            port,
            outputs: Outputs::default(),
            pressed: Switches::NONE,
            complete: Vec::new(),
            recent: Vec::new(),
        })
    }

    /// Control ticks since the last start.
    pub fn tick(&self) -> u32 {
        self.lockstep.tick()
    }

    /// The outputs of the last tick.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// The stage under it.
    pub fn plant_mut(&mut self) -> &mut SimulatedStage {
        &mut self.plant
    }

    /// Presses inputs, or lets go of them: emergency stop, switches, amplifier faults.
    pub fn press(&mut self, switches: Switches) {
        self.pressed = switches;
    }

    /// Sends bytes to the machine.
    pub fn send(&mut self, bytes: &[u8]) {
        self.port.to_machine.extend(bytes);
    }

    /// Takes what the machine has sent.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.port.to_host)
    }

    /// Returns the content of the flash for settings.
    ///
    /// # Errors
    /// The shared memory fails.
    pub fn flash(&self) -> Result<Vec<u8>, EmulatorError> {
        let mut bytes = vec![0; FLASH_BYTES];
        self.lockstep.memory().read(FLASH, &mut bytes)?;
        Ok(inverted(&bytes))
    }

    /// The lines of the firmware's log since the last call, of all ticks before the last: those of the last may not have
    /// been written yet.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn new_lines(&mut self) -> Result<Vec<String>, EmulatorError> {
        self.recent.extend(self.lockstep.new_lines()?);
        let tick = self.lockstep.tick();
        let is_sure = |line: &String| stamp(line).is_none_or(|stamp| stamp < tick);
        let sure = self.recent.iter().take_while(|line| is_sure(line)).count();
        let mut lines = std::mem::take(&mut self.complete);
        lines.extend(self.recent.drain(..sure));
        Ok(lines)
    }

    /// Runs until the server has looked at its port once more, and its answer is seen.
    ///
    /// # Errors
    /// A firmware that failed or is silent.
    pub fn run(&mut self) -> Result<(), EmulatorError> {
        for _ in 0..PERIOD_TICKS {
            self.step()?;
        }
        while self.lockstep.tick() % PERIOD_TICKS != 1 {
            self.step()?;
        }
        Ok(())
    }

    fn step(&mut self) -> Result<(), EmulatorError> {
        let mut input = record_of(&self.plant.read_inputs(None));
        input.switches = input.switches.with(self.pressed);
        self.outputs = match self.exchange(&input)? {
            Some(outputs) => outputs,
            // The firmware has ended itself for a restart, after the tick before: its first tick takes these inputs.
            None => {
                self.restart()?;
                self.exchange(&input)?.ok_or(EmulatorError::EndedAtStart)?
            }
        };
        self.plant.step(&self.outputs);
        Ok(())
    }

    fn exchange(&mut self, input: &InputRecord) -> Result<Option<Outputs>, EmulatorError> {
        self.port.give(self.lockstep.memory())?;
        self.lockstep.ask(input)?;
        let outputs = self.lockstep.answer()?;
        self.port.take(self.lockstep.memory())?;
        Ok(outputs)
    }

    /// Starts the firmware afresh: what is in flash stays, and the stage stands where it stands.
    fn restart(&mut self) -> Result<(), EmulatorError> {
        // The firmware that wrote them is gone: there will be no more of its last tick.
        self.complete.append(&mut self.recent);
        self.complete.extend(self.lockstep.new_lines()?);
        self.port = HostPort {
            to_host: std::mem::take(&mut self.port.to_host),
            room: self.port.room,
            ..HostPort::default()
        };
        self.port.reset(self.lockstep.memory())?;
        self.lockstep.restart(&self.job)
    }

    /// Cuts the supply, lets the stage coast, and switches it on again: what is in flash stays.
    ///
    /// # Errors
    /// QEMU does not start.
    pub fn power_cycle(&mut self) -> Result<(), EmulatorError> {
        self.outputs = Outputs::default();
        for _ in 0..off_ticks(self.rate_hz) {
            self.plant.step(&self.outputs);
        }
        self.restart()
    }
}

/// The host's end of the port, and its wire.
#[derive(Debug, Default)]
struct HostPort {
    to_machine: VecDeque<u8>,
    to_host: Vec<u8>,
    /// Bytes that the wire carries in a run of the server.
    room: usize,
    /// Bytes written to the ring towards the machine since its start.
    written: u32,
    /// Bytes read from the other ring.
    read: u32,
}

impl HostPort {
    /// Empties both rings, as at a start.
    fn reset(&self, memory: &Memory) -> Result<(), EmulatorError> {
        for word in [LINK_IN_WRITTEN, LINK_IN_TAKEN, LINK_OUT_SHOWN] {
            memory.set_word(word, 0)?;
        }
        self.make_room(memory)
    }

    /// Lets the machine write as many bytes as the wire carries in a run of the server: the rest of the ring counts as full.
    fn make_room(&self, memory: &Memory) -> Result<(), EmulatorError> {
        let full = (LINK_BYTES - self.room) as u32;
        memory.set_word(LINK_OUT_TAKEN, self.read.wrapping_sub(full))
    }

    /// Puts into the ring what there is room for.
    fn give(&mut self, memory: &Memory) -> Result<(), EmulatorError> {
        if self.to_machine.is_empty() {
            return Ok(());
        }
        let waiting = self.written.wrapping_sub(memory.word(LINK_IN_TAKEN)?) as usize;
        let count = LINK_BYTES
            .saturating_sub(waiting)
            .min(self.to_machine.len());
        for byte in self.to_machine.drain(..count) {
            memory.write(LINK_IN + self.written as usize % LINK_BYTES, &[byte])?;
            self.written = self.written.wrapping_add(1);
        }
        memory.set_word(LINK_IN_WRITTEN, self.written)
    }

    /// Takes from the ring what the machine has shown.
    fn take(&mut self, memory: &Memory) -> Result<(), EmulatorError> {
        let shown = memory.word(LINK_OUT_SHOWN)?;
        if shown == self.read {
            return Ok(());
        }
        while self.read != shown {
            let mut byte = [0];
            memory.read(LINK_OUT + self.read as usize % LINK_BYTES, &mut byte)?;
            self.to_host.extend(byte);
            self.read = self.read.wrapping_add(1);
        }
        self.make_room(memory)
    }
}

/// A flash's content as the shared memory holds it, or the other way round.
fn inverted(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().map(|byte| !byte).collect()
}

/// The tick at which a line of the log was written.
fn stamp(line: &str) -> Option<u32> {
    line.split_whitespace().next()?.parse().ok()
}
