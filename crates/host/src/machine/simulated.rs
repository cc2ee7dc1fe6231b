//! The firmware's application on the simulated stage, in this process: what a host connects to without a board.
//!
//! A session is the same every time. A serial port that carries ten bytes a tick each way joins machine and host.

use std::collections::VecDeque;

use quadrant::app::Poll;
use quadrant::hal::Serial;
use quadrant_law::safety::Switches;
use quadrant_law::stage::Outputs;
use quadrant_link::message::NumberType;
use quadrant_settings::{PlanSettings, SettingsError, StageSettings};
use quadrant_sim::plant::{SimulatedStage, StageParameters};

use super::application::{BoardIdentity, Running, Start};
use super::memory_flash::MemoryFlash;
use super::timing::{off_ticks, port_bytes};

/// Name, timer and number type for the greeting.
const IDENTITY: BoardIdentity = BoardIdentity {
    board: "simulated",
    cycle_hz: 0,
    number: NumberType::F32,
};
/// The host's end of the port, and its wire.
#[derive(Debug, Default)]
struct Wire {
    to_machine: VecDeque<u8>,
    to_host: Vec<u8>,
    /// Bytes that may still be sent in this run.
    room: usize,
}

impl Serial for Wire {
    fn read(&mut self, into: &mut [u8]) -> usize {
        let count = into.len().min(self.to_machine.len());
        for (place, byte) in into.iter_mut().zip(self.to_machine.drain(..count)) {
            *place = byte;
        }
        count
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        let count = bytes.len().min(self.room);
        self.to_host.extend(&bytes[..count]);
        self.room -= count;
        count
    }
}

/// The start of the simulated machine: without a motion.
fn start<'a>(defaults: &'a StageSettings, plan: &'a PlanSettings) -> Start<'a> {
    Start {
        defaults,
        plan,
        fault: None,
        identity: IDENTITY,
    }
}

/// The firmware's application on the simulated stage.
pub struct SimulatedMachine {
    running: Running<f32>,
    plant: SimulatedStage,
    truth: StageParameters,
    /// Of the plant's noise.
    seed: u64,
    defaults: StageSettings,
    wire: Wire,
    /// Bytes that the wire carries in a run of the server, at the rate since the last start.
    port_bytes: usize,
    outputs: Outputs,
    /// Inputs that somebody holds pressed, beside those of the stage.
    pressed: Switches,
    /// The smallest and the largest position of each table so far, mm from where it stood at first.
    been_mm: [(f64, f64); 3],
}

impl SimulatedMachine {
    /// Starts a machine whose flash is empty, with `settings` as the defaults of its firmware.
    ///
    /// # Errors
    /// The first of the settings that is refused.
    pub fn new(
        settings: &StageSettings,
        truth: &StageParameters,
        seed: u64,
    ) -> Result<Self, SettingsError> {
        Self::with_flash(settings, truth, seed, MemoryFlash::default())
    }

    /// The same, on a flash that may have been used before.
    ///
    /// # Errors
    /// The first of the settings that is refused.
    pub fn with_flash(
        settings: &StageSettings,
        truth: &StageParameters,
        seed: u64,
        flash: MemoryFlash,
    ) -> Result<Self, SettingsError> {
        let running = Running::start(start(settings, &PlanSettings::default()), flash)?;
        Ok(Self {
            plant: SimulatedStage::new(truth, running.rate_hz(), seed),
            port_bytes: port_bytes(running.rate_hz()),
            running,
            truth: truth.clone(),
            seed,
            defaults: settings.clone(),
            wire: Wire::default(),
            outputs: Outputs::default(),
            pressed: Switches::NONE,
            been_mm: [(0.0, 0.0); 3],
        })
    }

    /// Control ticks since the last start.
    pub fn tick(&self) -> u32 {
        self.running.state().tick()
    }

    /// Control rate since the last start, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.running.rate_hz()
    }

    /// The outputs of the last tick.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// The stage under it.
    pub fn plant_mut(&mut self) -> &mut SimulatedStage {
        &mut self.plant
    }

    /// The smallest and the largest position of each table so far, mm from where it stood at first: for judging.
    pub fn been_mm(&self) -> [(f64, f64); 3] {
        self.been_mm
    }

    /// Presses inputs, or lets go of them: emergency stop, switches, amplifier faults.
    pub fn press(&mut self, switches: Switches) {
        self.pressed = switches;
    }

    /// Returns the flash for settings.
    pub fn flash(&self) -> &MemoryFlash {
        self.running.flash()
    }

    /// Sends bytes to the machine.
    pub fn send(&mut self, bytes: &[u8]) {
        self.wire.to_machine.extend(bytes);
    }

    /// Takes what the machine has sent.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.wire.to_host)
    }

    /// Runs `ticks` control ticks.
    pub fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.step();
        }
    }

    fn step(&mut self) {
        let mut inputs = self.plant.read_inputs(None);
        inputs.switches = inputs.switches.with(self.pressed);
        self.wire.room = self.port_bytes;
        let (outputs, after) = self.running.tick(&inputs, &mut self.wire);
        self.outputs = outputs;
        self.plant.step(&self.outputs);
        for ((low_mm, high_mm), axis) in self.been_mm.iter_mut().zip(self.plant.axes()) {
            *low_mm = low_mm.min(axis.position_mm());
            *high_mm = high_mm.max(axis.position_mm());
        }
        if after == Poll::Reboot {
            self.restart();
        }
    }

    /// Starts the firmware again: what is in flash stays, and the stage stands where it stands; at another control rate, where it stood at
    /// first.
    pub fn restart(&mut self) {
        let flash = self.flash().clone();
        let rate_hz = self.rate_hz();
        let plan = PlanSettings::default();
        match Running::start(start(&self.defaults, &plan), flash) {
            Ok(running) => self.running = running,
            // The defaults were accepted when the machine was made.
            Err(_) => unreachable!("the same settings were accepted before"),
        }
        if self.rate_hz() != rate_hz {
            let plant = self.plant.clone();
            self.plant = plant.sampled_at(&self.truth, self.rate_hz(), self.seed);
            self.port_bytes = port_bytes(self.rate_hz());
        }
    }

    /// Cuts the supply, lets the stage coast, and switches it on again: what is in flash stays.
    pub fn power_cycle(&mut self) {
        self.outputs = Outputs::default();
        for _ in 0..off_ticks(self.rate_hz()) {
            self.plant.step(&self.outputs);
        }
        // What was on its way to the machine is lost.
        self.wire.to_machine.clear();
        self.restart();
    }
}
