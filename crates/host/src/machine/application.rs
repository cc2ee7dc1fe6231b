//! The firmware's application in this process, between two starts, in two halves: the control interrupt's, and that of
//! supervising task and server. [`Running`] runs them one after the other in the order in which the target does; a board of
//! two threads runs each in its own.

use std::collections::VecDeque;

use quadrant::app::Translated;
use quadrant::app::glitch_monitor::GlitchReadings;
use quadrant::app::{
    Axis, Control, Inputs, Intake, Poll, Queues, Server, ServerParts, Snapshot, Supervision,
    TimingStatistics,
};
use quadrant::hal::Serial;
use quadrant::store::{BUFFER_BYTES, LoadError, Loaded, Store};
use quadrant_law::command::Command;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::safety::FaultCode;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Outputs, StageState};
use quadrant_link::message::NumberType;
use quadrant_settings::{PlanSettings, SettingsError, StageSettings};
use quadrant_sim::law_machine::TickInput;

use super::memory_flash::MemoryFlash;

/// Words of the capture, as on the reference board.
const CAPTURE_WORDS: usize = quadrant::app::capture::CAPTURE_WORDS;
/// Control rates of the simulated machine, Hz: all that settings allow.
const RATES_HZ: (f64, f64) = (1e3, 1e5);
/// Requests of the operator at the machine that may wait, as in the firmware.
const REQUESTS: usize = 3;

/// The application, as it runs between two starts.
pub struct Running<S: Scalar> {
    control: Control<'static, 'static, S>,
    slow: SlowHalf<S>,
    rate_hz: f64,
}

/// The slow half of the application: what the supervising task and the server do, on the fast half's snapshots.
pub struct SlowHalf<S: Scalar> {
    intake: Intake<'static>,
    supervision: Supervision,
    server: Server<'static, 'static, S, MemoryFlash>,
    /// Requests of the operator at the machine.
    requests: VecDeque<Command>,
    /// Commands of the supervising task: urgent ones, and those of the operator that it let through.
    commands: VecDeque<Command>,
}

/// Start conditions of the application.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// The settings of a machine whose flash is empty.
    pub defaults: &'a StageSettings,
    /// Motions that `run` starts.
    pub plan: &'a PlanSettings,
    /// Fault that the run before has left.
    pub fault: Option<FaultCode>,
    /// Name, timer and number type for the greeting.
    pub identity: BoardIdentity,
}

/// Name, timer and number type of a machine, for the greeting.
#[derive(Clone, Copy, Debug)]
pub struct BoardIdentity {
    /// Name of the board.
    pub board: &'static str,
    /// Rate of the timer that measures ticks, Hz; zero if there is none.
    pub cycle_hz: u32,
    /// Number type of the control law.
    pub number: NumberType,
}

/// Starts both halves of the application, as the firmware does after a reset, with the settings that are in force.
///
/// # Errors
/// The first of the settings for an empty flash that is refused.
pub fn start_halves<S: Scalar>(
    start: Start<'_>,
    flash: MemoryFlash,
) -> Result<(Control<'static, 'static, S>, SlowHalf<S>, StageSettings), SettingsError> {
    let Start { defaults, .. } = start;
    let (mut invalid, mut keep_draft) = (None, false);
    let mut store = Store::new(flash, 0);
    let buffer: &'static mut [u8; BUFFER_BYTES] = Box::leak(Box::new([0; BUFFER_BYTES]));
    let settings: &'static mut StageSettings = Box::leak(Box::new(defaults.clone()));
    let draft: &'static mut StageSettings = Box::leak(Box::new(defaults.clone()));
    let loaded = store.load(settings, FIRMWARE_ELEMENTS, buffer, &mut |_| {});
    let provenance = match loaded {
        Ok(Some(Loaded {
            provenance,
            is_newest: true,
            ..
        })) => provenance,
        Ok(Some(older)) => {
            draft.copy_from(settings);
            settings.copy_from(defaults);
            (invalid, keep_draft) = (Some(FaultCode::SettingsInvalid), true);
            older.provenance
        }
        Ok(None) => {
            settings.copy_from(defaults);
            Default::default()
        }
        Err(LoadError::Decode(_) | LoadError::Log(_)) => {
            settings.copy_from(defaults);
            invalid = Some(FaultCode::SettingsInvalid);
            Default::default()
        }
    };
    let resolution_mm = settings
        .axes
        .each_ref()
        .map(|axis| axis.encoder.resolution_mm);
    let stage = settings.build::<S, FIRMWARE_ELEMENTS>()?;
    let plan = start.plan.build(settings)?;
    let (axes, operation) = stage.into_axes();
    // What the tasks share lives as long as the firmware does, and so it is here: a few tens of KB for each start.
    let back_buffer: &'static mut Axis<S> = Box::leak(Box::new(axes[0].clone()));
    let axes = axes.map(|axis| -> &'static mut Axis<S> { Box::leak(Box::new(axis)) });
    let queues: &'static mut Queues<'static, S> = Box::leak(Box::new(Queues::new()));
    let (control_ends, intake_ends, ends) = queues.split();
    let rate_hz = settings.rate_hz as u32;
    let mut control = Control::new(axes, operation, plan, rate_hz, control_ends);
    for code in [start.fault, invalid].into_iter().flatten() {
        control.start_faulted(code);
    }
    let identity = start.identity;
    let in_force = settings.clone();
    let slow = SlowHalf {
        intake: Intake::new(intake_ends),
        supervision: Supervision::new(resolution_mm),
        server: Server::new(ServerParts {
            ends,
            back_buffer,
            settings,
            draft,
            keep_draft,
            provenance,
            store,
            buffer,
            capture: Box::leak(vec![0; CAPTURE_WORDS].into_boxed_slice()),
            board: identity.board,
            cycle_hz: identity.cycle_hz,
            rates_hz: RATES_HZ,
            pulse_axes: [false; 3],
            serial_axes: [false; 3],
            number: identity.number,
            log: None,
        }),
        requests: VecDeque::new(),
        commands: VecDeque::new(),
    };
    Ok((control, slow, in_force))
}

impl<S: Scalar> SlowHalf<S> {
    /// Receives a request of the operator at the machine; one more than may wait is dropped.
    pub fn request(&mut self, request: Option<Command>) {
        if self.requests.len() < REQUESTS {
            self.requests.extend(request);
        }
    }

    /// One run on a snapshot that is due.
    pub fn run(
        &mut self,
        seen: &Snapshot<S>,
        timing: TimingStatistics,
        serial: &mut impl Serial,
    ) -> Poll {
        let received = self.intake.run(serial);
        if let Some(urgent) = received.urgent {
            let command = Intake::overtake(urgent, self.requests.drain(..));
            self.commands.push_back(command);
        }
        let supervised = self.supervision.run(seen, self.requests.pop_front());
        if let Some(command) = supervised.command {
            self.intake.note(command);
            self.commands.push_back(command);
        }
        for event in supervised.events {
            self.server
                .push_event(seen.tick, Translated::translated(event));
        }
        self.server.poll(serial, seen, timing)
    }

    /// The next command for the control law, if there is one.
    pub fn take_command(&mut self) -> Option<Command> {
        self.commands.pop_front()
    }

    /// Number of valid requests so far.
    pub const fn frames(&self) -> u32 {
        self.intake.frames()
    }

    /// The glitch monitor's latest results.
    pub const fn glitch_readings(&self) -> GlitchReadings {
        self.supervision.glitch_readings()
    }

    /// The flash that settings are stored in.
    pub fn flash(&self) -> &MemoryFlash {
        self.server.flash()
    }

    /// The server of the link.
    pub fn server(&mut self) -> &mut Server<'static, 'static, S, MemoryFlash> {
        &mut self.server
    }
}

impl<S: Scalar> Running<S> {
    /// As the firmware does after a reset.
    ///
    /// # Errors
    /// The first of the settings for an empty flash that is refused.
    pub fn start(start: Start<'_>, flash: MemoryFlash) -> Result<Self, SettingsError> {
        let (control, slow, settings) = start_halves(start, flash)?;
        Ok(Self {
            control,
            slow,
            rate_hz: settings.rate_hz,
        })
    }

    /// Control rate of the settings that it started with, Hz.
    pub const fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// One control period, and what the slower tasks do before the next: the outputs, and what is to be done after it.
    pub fn tick(&mut self, inputs: &TickInput, serial: &mut impl Serial) -> (Outputs, Poll) {
        self.control.note_requests(self.slow.frames());
        let outputs = self.control.tick(&mut Inputs {
            command: self.slow.take_command(),
            ..inputs.inputs()
        });
        self.slow.flash().set_outputs_off(!outputs.enabled);
        self.slow.request(inputs.request);
        if !self.control.observe(0) {
            return (outputs, Poll::Continue);
        }
        let seen = self.control.snapshot();
        let after = self.slow.run(&seen, TimingStatistics::default(), serial);
        self.control.show_glitches(self.slow.glitch_readings());
        (outputs, after)
    }

    /// The flash that settings are stored in.
    pub fn flash(&self) -> &MemoryFlash {
        self.slow.flash()
    }

    /// The control law's memory.
    pub fn state(&self) -> &StageState<S, FIRMWARE_ELEMENTS> {
        self.control.state()
    }
}
