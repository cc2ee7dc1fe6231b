//! The firmware's application in this process, on the simulated stage: what a host connects to without a board.
//!
//! Control interrupt, supervising task and server run one after the other, in the order in which the target runs them, so
//! that a session is the same every time. A serial port that carries ten bytes a tick each way joins them to the host.

mod flash;

use std::collections::VecDeque;

use quadrant::app::{
    Axis, Control, Inputs, Poll, Queues, Server, ServerParts, Snapshot, Supervision,
    TimingStatistics,
};
use quadrant::command::Command;
use quadrant::friction::gms::FIRMWARE_ELEMENTS;
use quadrant::hal::Serial;
use quadrant::link::message::NumberType;
use quadrant::lockstep::InputRecord;
use quadrant::safety::{FaultCode, Switches};
use quadrant::scalar::Scalar;
use quadrant::settings::{PlanSettings, SettingsError, StageSettings};
use quadrant::stage::{Outputs, StageState};
use quadrant::store::{BUFFER_BYTES, LoadError, Loaded, Store};

pub use self::flash::MemoryFlash;
use crate::plant::{SimulatedStage, StageTruth};

/// What the simulated machine calls itself.
const BOARD: &str = "simulated";
/// Words of the capture, as on the reference board.
const CAPTURE_WORDS: usize = quadrant::app::capture::CAPTURE_WORDS;
/// Bytes that the port carries in a run of the server: what 921 600 baud do in a millisecond.
pub(crate) const PORT_BYTES: usize = 92;
/// Ticks for which a power cycle leaves the stage to itself: 1 s at 10 kHz.
pub(crate) const OFF_TICKS: u32 = 10_000;

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

/// Requests of the operator at the machine that may wait, as in the firmware.
const REQUESTS: usize = 3;

/// The application, as it runs between two starts.
pub struct Running<S: Scalar> {
    control: Control<'static, 'static, S>,
    supervision: Supervision,
    server: Server<'static, 'static, S, MemoryFlash>,
    seen: Snapshot<S>,
    /// Requests of the operator at the machine.
    requests: VecDeque<Command>,
    /// What the supervising task let through.
    command: Option<Command>,
}

/// What the application starts with.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// The settings of a machine whose flash is empty.
    pub defaults: &'a StageSettings,
    /// The motions.
    pub plan: &'a PlanSettings,
    /// What the run before has left.
    pub fault: Option<FaultCode>,
    /// What the machine calls itself.
    pub board: &'static str,
    /// Rate of the timer that measures ticks, Hz.
    pub cycle_hz: u32,
    /// What the control law computes with, for the host.
    pub number: NumberType,
}

impl<'a> Start<'a> {
    /// As the simulated machine starts: without a motion.
    fn simulated(defaults: &'a StageSettings, plan: &'a PlanSettings) -> Self {
        Self {
            defaults,
            plan,
            fault: None,
            board: BOARD,
            cycle_hz: 0,
            number: NumberType::F32,
        }
    }
}

/// The firmware's application on the simulated stage.
pub struct SimulatedMachine {
    running: Running<f32>,
    plant: SimulatedStage,
    defaults: StageSettings,
    wire: Wire,
    outputs: Outputs,
    /// Inputs that somebody holds pressed, beside those of the stage.
    pressed: Switches,
}

impl SimulatedMachine {
    /// Starts a machine whose flash is empty, with `settings` in force until others are stored.
    ///
    /// # Errors
    /// The first of the settings that is refused.
    pub fn new(
        settings: &StageSettings,
        truth: &StageTruth,
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
        truth: &StageTruth,
        seed: u64,
        flash: MemoryFlash,
    ) -> Result<Self, SettingsError> {
        Ok(Self {
            running: Running::start(Start::simulated(settings, &PlanSettings::default()), flash)?,
            plant: SimulatedStage::new(truth, settings.rate_hz, seed),
            defaults: settings.clone(),
            wire: Wire::default(),
            outputs: Outputs::default(),
            pressed: Switches::NONE,
        })
    }

    /// Control ticks since the last start.
    pub fn tick(&self) -> u32 {
        self.running.control.state().tick()
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

    /// What the flash for settings holds.
    pub fn flash(&self) -> &MemoryFlash {
        self.running.server.flash()
    }

    /// Sends bytes to the machine.
    pub fn send(&mut self, bytes: &[u8]) {
        self.wire.to_machine.extend(bytes);
    }

    /// Takes what the machine has sent.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.wire.to_host)
    }

    /// Runs control ticks.
    pub fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.step();
        }
    }

    fn step(&mut self) {
        let mut inputs = self.plant.read_inputs(None);
        inputs.switches = inputs.switches.with(self.pressed);
        self.wire.room = PORT_BYTES;
        let (outputs, after) = self.running.tick(&inputs, &mut self.wire);
        self.outputs = outputs;
        self.plant.step(&self.outputs);
        if after == Poll::Reboot {
            self.restart();
        }
    }

    /// Starts the firmware afresh: what is in flash stays, and the stage stands where it stands.
    pub fn restart(&mut self) {
        let flash = self.flash().clone();
        let plan = PlanSettings::default();
        match Running::start(Start::simulated(&self.defaults, &plan), flash) {
            Ok(running) => self.running = running,
            // The defaults were accepted when the machine was made.
            Err(_) => unreachable!("the same settings were accepted before"),
        }
    }

    /// Cuts the supply, lets the stage coast, and switches it on again: what is in flash stays.
    pub fn power_cycle(&mut self) {
        self.outputs = Outputs::default();
        for _ in 0..OFF_TICKS {
            self.plant.step(&self.outputs);
        }
        // What was on its way to the machine is lost.
        self.wire.to_machine.clear();
        self.restart();
    }
}

impl<S: Scalar> Running<S> {
    /// As the firmware does after a reset.
    ///
    /// # Errors
    /// The first of the settings for an empty flash that is refused.
    pub fn start(start: Start<'_>, flash: MemoryFlash) -> Result<Self, SettingsError> {
        let Start { defaults, .. } = start;
        let mut fault = None;
        let mut store = Store::new(flash, 0);
        // What the tasks share lives as long as the firmware does, and so it is here: a few tens of KB for each start.
        let buffer: &'static mut [u8; BUFFER_BYTES] = Box::leak(Box::new([0; BUFFER_BYTES]));
        let settings: &'static mut StageSettings = Box::leak(Box::new(defaults.clone()));
        let draft: &'static mut StageSettings = Box::leak(Box::new(defaults.clone()));
        let loaded = store.load(settings, FIRMWARE_ELEMENTS, buffer, &mut |_| {});
        let provenance = match loaded {
            Ok(Some(Loaded { provenance, .. })) => provenance,
            Ok(None) => {
                settings.copy_from(defaults);
                Default::default()
            }
            Err(LoadError::Decode(_) | LoadError::Log(_)) => {
                settings.copy_from(defaults);
                fault = Some(FaultCode::SettingsInvalid);
                Default::default()
            }
        };
        let resolution_mm = settings
            .axes
            .each_ref()
            .map(|axis| axis.encoder.resolution_mm);
        let stage = settings.build::<S, FIRMWARE_ELEMENTS>()?;
        let plan = start.plan.build(settings)?;
        let (axes, streaming) = stage.into_axes();
        let back_buffer: &'static mut Axis<S> = Box::leak(Box::new(axes[0].clone()));
        let axes = axes.map(|axis| -> &'static mut Axis<S> { Box::leak(Box::new(axis)) });
        let queues: &'static mut Queues<'static, S> = Box::leak(Box::new(Queues::new()));
        let (control_ends, ends) = queues.split();
        let mut control = Control::new(axes, streaming, plan, control_ends);
        if let Some(code) = start.fault.or(fault) {
            control.start_faulted(code);
        }
        Ok(Self {
            control,
            supervision: Supervision::new(resolution_mm),
            server: Server::new(ServerParts {
                ends,
                back_buffer,
                settings,
                draft,
                provenance,
                store,
                buffer,
                capture: Box::leak(vec![0; CAPTURE_WORDS].into_boxed_slice()),
                board: start.board,
                cycle_hz: start.cycle_hz,
                number: start.number,
            }),
            seen: Snapshot::default(),
            requests: VecDeque::new(),
            command: None,
        })
    }

    /// One control period, and what the slower tasks do before the next: the outputs, and what is to be done after it.
    pub fn tick(&mut self, inputs: &InputRecord, serial: &mut impl Serial) -> (Outputs, Poll) {
        let outputs = self.control.tick(&Inputs {
            command: self.command.take(),
            link_lost: self.server.link_lost(),
            ..inputs.inputs()
        });
        if self.requests.len() < REQUESTS {
            self.requests.extend(inputs.request);
        }
        if !self.control.observe(0) {
            return (outputs, Poll::Continue);
        }
        let seen = self.control.snapshot();
        self.seen = seen;
        let supervised = self.supervision.run(
            &seen,
            self.requests.pop_front(),
            self.server.is_commissioned(),
        );
        self.command = supervised.command;
        self.control
            .show_glitches(self.supervision.glitch_readings());
        for event in supervised.events.into_iter().flatten() {
            self.server.push_event(seen.tick, event);
        }
        let after = self
            .server
            .poll(serial, &self.seen, TimingStatistics::default());
        (outputs, after)
    }

    /// What the control law knows.
    pub fn state(&self) -> &StageState<S, FIRMWARE_ELEMENTS> {
        self.control.state()
    }
}
