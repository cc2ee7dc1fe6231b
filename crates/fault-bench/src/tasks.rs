//! The application's tasks in this process, each interrupted by those above it wherever it touches what they share.
//!
//! On the target a task of higher priority runs on top of the one that it interrupts, and to its end. A call from within
//! does the same: the server's port and flash are stand-ins that let control ticks and the supervising task run, as many as
//! the seed says, before and after every access, and for as long as the flash takes. So one seed is one interleaving.

use std::cell::RefCell;
use std::collections::{BTreeMap, VecDeque};
use std::rc::Rc;

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use quadrant::app::{
    Axis, Control, Inputs, Intake, Poll, Queues, Server, ServerParts, Snapshot, Supervision,
    TimingStatistics,
};
use quadrant::hal::{Serial, SettingsFlash};
use quadrant::store::{BUFFER_BYTES, Provenance, Store};
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety::FaultCode;
use quadrant_law::stage::{Outputs, StageState};
use quadrant_law::units::POSITION_FRACTION_BITS;
use quadrant_link::frame::{self, FRAME_BYTES, Receiver};
use quadrant_link::message::{
    Body, LinkError, Message, Notice, NumberType, Reply, Request, TelemetryBlock,
};
use quadrant_settings::{PlanSettings, StageSettings};

use crate::flash::{Flash, FlashError};
use crate::noise::Noise;
use crate::plant::{Encoder, Plant};

/// Ticks that an erasure takes here; on the reference board it is 2500 to 5000.
const ERASE_TICKS: u32 = 400;

/// An x axis that moves as its output makes it, with an encoder that may die.
pub struct Moved {
    pub plant: Plant,
    pub encoder: Encoder,
    /// Ticks since the encoder died.
    pub dead: Option<u32>,
}

/// Control interrupt and supervising task, and what they see.
pub struct Upper {
    /// In place of an x axis that follows its reference exactly.
    pub x: Option<Moved>,
    control: Control<'static, 'static, f32>,
    intake: Intake<'static>,
    supervision: Supervision,
    line: Line,
    commands: VecDeque<Command>,
    requests: VecDeque<Command>,
    seen: Snapshot<f32>,
    noise: Noise,
    pub outputs: Outputs,
    /// Counts by which the x axis is away from its reference, while nothing else moves it.
    pub pushed: i64,
    /// Inputs of the next tick beside the readings, which are those of a stage that follows its reference exactly.
    pub inputs: Inputs,
    /// An operation on the flash is under way.
    busy: bool,
    /// Ticks in which the outputs were on while the flash was busy.
    pub driven_while_busy: u32,
    /// Times that the flash was to be written with the enable line high, and was not.
    pub guarded: u32,
    /// Ticks in which the axes of one plan moved as those of two.
    pub torn: u32,
    from: [i64; 3],
    was_running: bool,
}

/// The line from the host.
#[derive(Default)]
struct Line(VecDeque<u8>);

impl Serial for Line {
    fn read(&mut self, into: &mut [u8]) -> usize {
        let count = into.len().min(self.0.len());
        for (place, byte) in into.iter_mut().zip(self.0.drain(..count)) {
            *place = byte;
        }
        count
    }

    fn write(&mut self, _bytes: &[u8]) -> usize {
        0
    }
}

impl Upper {
    /// One control tick, and the supervising task when it is due.
    pub fn tick(&mut self) {
        let references = self
            .control
            .state()
            .axes()
            .by_ref()
            .map(|axis| axis.reference().0)
            .into_array();
        let mut counts = references.map(|position| position >> POSITION_FRACTION_BITS);
        counts[0] += self.pushed;
        if let Some(x) = &mut self.x {
            let volts = self.outputs.codes[0].to_volts(10.0);
            x.plant.step(if self.outputs.enabled { volts } else { 0.0 });
            x.dead = x.dead.map(|age| age + 1);
            counts[0] = x.encoder.read(x.plant.position_mm, x.dead);
        }
        let readings = counts.map(|count| EncoderReading::of(count as u32));
        self.control.note_requests(self.intake.frames());
        self.outputs = self.control.tick(&mut Inputs {
            readings: readings.into(),
            command: self.commands.pop_front().or(self.inputs.command),
            ..self.inputs
        });
        self.driven_while_busy += u32::from(self.busy && self.outputs.enabled);
        self.look_at_the_plan(references);
        if self.control.observe(0) {
            self.supervise();
        }
    }

    /// The plans of the tests move all axes to one side.
    fn look_at_the_plan(&mut self, references: [i64; 3]) {
        let running = self.control.state().is_running();
        if running && !self.was_running {
            self.from = references;
        }
        self.was_running = running;
        let signs: Vec<i64> = (0..3)
            .map(|axis| (references[axis] - self.from[axis]).signum())
            .collect();
        self.torn += u32::from(running && signs.contains(&1) && signs.contains(&-1));
    }

    fn supervise(&mut self) {
        let received = self.intake.run(&mut self.line);
        if let Some(urgent) = received.urgent {
            let command = Intake::overtake(urgent, self.requests.drain(..));
            self.commands.push_back(command);
        }
        let snapshot = self.control.snapshot();
        let supervised = self.supervision.run(&snapshot, self.requests.pop_front());
        if let Some(command) = supervised.command {
            self.intake.note(command);
            self.commands.push_back(command);
        }
        if !supervised.glitches.is_empty() {
            self.control
                .show_glitches(self.supervision.glitch_readings());
        }
        self.seen = snapshot;
    }

    pub fn state(&self) -> &StageState<f32> {
        self.control.state()
    }

    pub fn snapshot(&self) -> Snapshot<f32> {
        self.control.snapshot()
    }

    /// The wish of the operator's button.
    pub fn operate(&mut self, command: Command) {
        if self.requests.len() < 3 {
            self.requests.push_back(command);
        }
    }

    /// Bytes that the host sends.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.line.0.extend(bytes);
    }

    /// The interruption of the server at one access: mostly none.
    fn preempt(&mut self) {
        let ticks = match self.noise.bits() % 16 {
            0 => self.noise.bits() % 25,
            1 | 2 => 1,
            _ => 0,
        };
        for _ in 0..ticks {
            self.tick();
        }
    }
}

type Shared = Rc<RefCell<Upper>>;

/// The flash as the server has it.
struct SlowFlash {
    flash: Rc<RefCell<Flash>>,
    upper: Shared,
}

impl ErrorType for SlowFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SlowFlash {
    const READ_SIZE: usize = Flash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        self.flash.borrow_mut().read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.borrow().capacity()
    }
}

impl SettingsFlash for SlowFlash {
    fn outputs_are_off(&self) -> bool {
        let mut upper = self.upper.borrow_mut();
        upper.guarded += u32::from(upper.outputs.enabled);
        !upper.outputs.enabled
    }
}

impl NorFlash for SlowFlash {
    const WRITE_SIZE: usize = Flash::WRITE_SIZE;
    const ERASE_SIZE: usize = Flash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.during(ERASE_TICKS);
        self.flash.borrow_mut().erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.during(1);
        self.flash.borrow_mut().write(offset, bytes)
    }
}

impl SlowFlash {
    /// Lets an operation take its time.
    fn during(&self, ticks: u32) {
        let mut upper = self.upper.borrow_mut();
        upper.preempt();
        upper.busy = true;
        upper.driven_while_busy += u32::from(upper.outputs.enabled);
        for _ in 0..ticks {
            upper.tick();
        }
        upper.busy = false;
    }
}

/// The port as the server has it.
struct Port<'a> {
    upper: &'a Shared,
    sent: &'a mut Vec<u8>,
}

impl Serial for Port<'_> {
    fn read(&mut self, _into: &mut [u8]) -> usize {
        0
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        self.upper.borrow_mut().preempt();
        self.sent.extend(bytes);
        bytes.len()
    }
}

/// All tasks.
pub struct Tasks {
    pub upper: Shared,
    pub flash: Rc<RefCell<Flash>>,
    server: Server<'static, 'static, f32, SlowFlash>,
    receiver: Receiver,
    next_id: u16,
    pub answers: BTreeMap<u16, Result<Reply, LinkError>>,
    /// Telemetry that the server has sent by itself.
    pub blocks: Vec<TelemetryBlock>,
    pub restarts: u32,
    /// Polls that the server is late by: it builds, or is not there.
    pub held_up: u32,
}

thread_local! {
    /// The log of the board of this thread's tasks.
    static LOG: RefCell<VecDeque<u8>> = const { RefCell::new(VecDeque::new()) };
}

/// Adds bytes to the board's log.
pub fn write_log(bytes: &[u8]) {
    LOG.with_borrow_mut(|log| log.extend(bytes));
}

/// Takes bytes of the log that a host has asked for.
fn take_log(bytes: &mut [u8], asked: bool) -> usize {
    LOG.with_borrow_mut(|log| {
        let count = if asked { bytes.len().min(log.len()) } else { 0 };
        for (place, byte) in bytes.iter_mut().zip(log.drain(..count)) {
            *place = byte;
        }
        count
    })
}

impl Tasks {
    pub fn new(settings: &StageSettings, seed: u64) -> Self {
        Self::with_flash(settings, seed, Flash::default(), None)
    }

    /// The tasks on a flash that holds something; `draft`: settings to look at, beside which the default ones are in force
    /// and the stored ones invalid.
    pub fn with_flash(
        settings: &StageSettings,
        seed: u64,
        flash: Flash,
        draft: Option<&StageSettings>,
    ) -> Self {
        let leak = |settings: &StageSettings| Box::leak(Box::new(settings.clone()));
        let (axes, operation) = settings.build().expect("valid settings").into_axes();
        let plan = PlanSettings::default().build(settings).expect("no motion");
        let back_buffer: &'static mut Axis<f32> = Box::leak(Box::new(axes[0].clone()));
        let axes = axes.map(|axis| -> &'static mut Axis<f32> { Box::leak(Box::new(axis)) });
        let queues: &'static mut Queues<'static, f32> = Box::leak(Box::new(Queues::new()));
        let (control_ends, intake_ends, ends) = queues.split();
        let mut control =
            Control::new(axes, operation, plan, settings.rate_hz as u32, control_ends);
        if draft.is_some() {
            control.start_faulted(FaultCode::SettingsInvalid);
        }
        let upper = Rc::new(RefCell::new(Upper {
            x: None,
            control,
            intake: Intake::new(intake_ends),
            supervision: Supervision::new([5e-4; 3]),
            line: Line::default(),
            commands: VecDeque::new(),
            requests: VecDeque::new(),
            seen: Snapshot::default(),
            noise: Noise::new(seed),
            outputs: Outputs::default(),
            pushed: 0,
            inputs: Inputs::default(),
            busy: false,
            driven_while_busy: 0,
            guarded: 0,
            torn: 0,
            from: [0; 3],
            was_running: false,
        }));
        let flash = Rc::new(RefCell::new(flash));
        let slow = SlowFlash {
            flash: Rc::clone(&flash),
            upper: Rc::clone(&upper),
        };
        let server = Server::new(ServerParts {
            ends,
            back_buffer,
            settings: leak(settings),
            draft: leak(draft.unwrap_or(settings)),
            keep_draft: draft.is_some(),
            provenance: Provenance::new(),
            store: Store::new(slow, 0),
            buffer: Box::leak(Box::new([0; BUFFER_BYTES])),
            capture: Box::leak(Box::new([0; 64])),
            board: "tasks",
            cycle_hz: 0,
            rates_hz: (2.5e3, 1.5e4),
            pulse_axes: [true, false, false],
            serial_axes: [true, false, false],
            number: NumberType::F32,
            log: Some(take_log),
        });
        let mut tasks = Self {
            upper,
            flash,
            server,
            receiver: Receiver::new(),
            next_id: 1,
            answers: BTreeMap::new(),
            blocks: Vec::new(),
            restarts: 0,
            held_up: 0,
        };
        tasks.ask(Body::Hello).expect("greets");
        tasks
    }

    /// Sends requests in one burst; returns the number of the first.
    pub fn send(&mut self, bodies: &[Body]) -> u16 {
        let first = self.next_id;
        for body in bodies {
            let request = Request {
                id: self.next_id,
                body: body.clone(),
            };
            self.next_id += 1;
            let mut buffer = [0; FRAME_BYTES];
            let bytes = frame::encode(&request, &mut buffer).expect("fits");
            self.upper.borrow_mut().receive(bytes);
        }
        first
    }

    /// Makes one request and waits for its answer.
    pub fn ask(&mut self, body: Body) -> Result<Reply, LinkError> {
        let id = self.send(&[body]);
        for _ in 0..500 {
            if let Some(answer) = self.answers.remove(&id) {
                return answer;
            }
            self.run(10);
        }
        panic!("request {id} was not answered");
    }

    /// Runs this many ticks at least, and the server after each run of the supervising task, unless it is held up.
    pub fn run(&mut self, ticks: u32) {
        let until = self.tick().wrapping_add(ticks);
        while (until.wrapping_sub(self.tick()) as i32) > 0 {
            let next = self.tick() / 10 * 10 + 10;
            while (next.wrapping_sub(self.tick()) as i32) > 0 {
                self.upper.borrow_mut().tick();
            }
            if self.held_up > 0 {
                self.held_up -= 1;
            } else {
                self.poll();
            }
        }
    }

    /// One tick, and the server if the supervising task has run in it.
    pub fn step(&mut self) {
        self.upper.borrow_mut().tick();
        if self.tick().is_multiple_of(10) {
            self.poll();
        }
    }

    pub fn tick(&self) -> u32 {
        self.upper.borrow().state().tick()
    }

    fn poll(&mut self) {
        let seen = self.upper.borrow().seen;
        let mut sent = Vec::new();
        let mut port = Port {
            upper: &self.upper,
            sent: &mut sent,
        };
        if self
            .server
            .poll(&mut port, &seen, TimingStatistics::default())
            == Poll::Reboot
        {
            self.restarts += 1;
        }
        for byte in sent {
            let Some(payload) = self.receiver.push(byte) else {
                continue;
            };
            match frame::decode(payload) {
                Ok(Message::Response(response)) => {
                    self.answers.insert(response.id, response.result);
                }
                Ok(Message::Notice(Notice::Telemetry(block))) => self.blocks.push(block),
                _ => {}
            }
        }
    }
}
