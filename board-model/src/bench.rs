//! The board with power on: a run of the image that a scenario steers as if at a bench.
//!
//! The model runs in a thread of its own and calls [`World`] at each stop. A scenario is straight code in another thread: while it
//! looks and acts the model waits, and [`Bench::run_for`] lets it go on.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;

use quadrant_link::frame::DELIMITER;
use rigless::device::ResetCause;
use rigless::emulator::{self, AccessKind, Driver, Host, Settled, Start, Stop};
use rigless::image::Image;
use rigless::session::Session;
use rigless::soc::Width;
use rigless::symbols::Symbols;
use rigless::time::VirtualNanos;

use crate::ad5754r::{self, Shared};
use crate::biss::{self, SharedEncoder};
use crate::board::{COUNTER, HSE_HZ, Nucleo, SharedLine};
use crate::log::Log;
use crate::stage::{Axis, INDEX_COUNTS, STEP_NS};
use crate::wiring::{At, Wiring};

/// TIM7_SR: the control tick acknowledges its interrupt there.
const TICK_STATUS: u64 = 0x4000_1410;
/// TIM7_CNT: the control tick looks at its time there.
const TICK_COUNTER: u64 = 0x4000_1424;
/// Time between two looks at the log, ns.
const LOG_NS: u64 = 1_000_000;

/// An image, and the board that it is for.
#[derive(Clone, Debug)]
pub struct Subject {
    /// Path of the image.
    pub image: PathBuf,
    /// The board.
    pub board: &'static Wiring,
    /// Instructions a second of virtual time. The models count instructions.
    pub instructions_per_s: u64,
}

/// Request of the scenario to the model's thread.
enum Order {
    Do(Task),
    RunUntil(Target),
}

/// The next stop of the scenario.
struct Target {
    /// At the latest, ns.
    at: u64,
    watch: Option<Watch>,
    /// Told the instant, and whether what was watched for came.
    reached: SyncSender<(u64, bool)>,
}

/// An event that a scenario waits for, looked for in the model's thread: a turn to the scenario's and back costs some milliseconds on
/// a busy computer.
struct Watch {
    step: u64,
    next: u64,
    came: Box<dyn FnMut(&World) -> bool + Send>,
}

impl std::fmt::Debug for Target {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ns", self.at)
    }
}

type Task = Box<dyn FnOnce(&mut World, &mut Session<Nucleo>, &mut dyn Host, VirtualNanos) + Send>;

/// Control ticks as their accesses show them.
#[derive(Clone, Copy, Debug)]
pub struct Ticks {
    /// Number of them.
    pub count: u64,
    /// Shortest and longest time from one to the next, ns.
    pub period_ns: (u64, u64),
    /// Fewest and most instructions from the acknowledge to the last look at the timer.
    pub instructions: (u64, u64),
    /// Sum of those instructions.
    pub total_instructions: u64,
    /// The last acknowledge, ns.
    pub last_ns: u64,
    begun: Option<u64>,
    taken: u64,
}

impl Default for Ticks {
    fn default() -> Self {
        Self {
            count: 0,
            period_ns: (u64::MAX, 0),
            instructions: (u64::MAX, 0),
            total_instructions: 0,
            last_ns: 0,
            begun: None,
            taken: 0,
        }
    }
}

impl Ticks {
    fn acknowledge(&mut self, now: u64, instructions: u64) {
        if self.last_ns != 0 {
            let period = now - self.last_ns;
            self.period_ns = (self.period_ns.0.min(period), self.period_ns.1.max(period));
        }
        if self.begun.is_some() && self.taken > 0 {
            self.instructions.0 = self.instructions.0.min(self.taken);
            self.instructions.1 = self.instructions.1.max(self.taken);
            self.total_instructions += self.taken;
            self.count += 1;
        }
        (self.last_ns, self.begun, self.taken) = (now, Some(instructions), 0);
    }
}

/// One control tick as a probe at the pins and at the bus of the timers sees it.
#[derive(Clone, Copy, Debug)]
pub struct TickRecord {
    /// Counts that the program has read, x, y, z; those of 16 bits extended.
    pub counts: [u32; 3],
    /// Words loaded by the converter, x, y, z.
    pub codes: [i16; 3],
    /// Level of the enable line.
    pub enabled: bool,
}

/// Everything around the chip, on the model's side.
#[derive(Debug)]
pub struct World {
    wiring: &'static Wiring,
    orders: Receiver<Order>,
    target: Option<Target>,
    /// True if the axes move as their amplifiers' voltages say; else by `spin`.
    pub plant: bool,
    /// Speed of each encoder without a plant, counts/s.
    pub spin: [f64; 3],
    spun: [f64; 3],
    axes: [Axis; 3],
    /// Counts as the lines show them.
    pub shown: [i64; 3],
    edges: VecDeque<(u64, usize, i64)>,
    /// Pulses under way: time of the end, axis, line, level.
    pulses: Vec<(u64, usize, usize, bool)>,
    /// True if the encoders have an index.
    pub index: bool,
    next_step: u64,
    next_log: u64,
    /// Log of the firmware.
    pub log: Log,
    /// Control ticks since the scenario looked last.
    pub ticks: Ticks,
    /// Changes of the enable line: time in ns, level.
    pub enables: Vec<(u64, bool)>,
    /// Changes of the line ALARM: the same.
    pub alarms: Vec<(u64, bool)>,
    /// Levels of another control's lines that are yet to come: time in ns, line (step, direction), level.
    pub train: VecDeque<(u64, usize, bool)>,
    /// Feeds of the watchdog: the last one and the longest time between two, ns.
    pub feeds: (u64, u64),
    /// Restarts: time in ns, cause.
    pub resets: Vec<(u64, ResetCause)>,
    chip: Shared,
    encoder: SharedEncoder,
    /// Count of the serial encoder where x began; none while there is no such encoder.
    pub serial_start: Option<i64>,
    /// Shortest and longest time from the serial encoder's position to the tick that reads it, ns.
    pub ages: (u64, u64),
    counts: [u32; 3],
    /// Control ticks since the start, each complete.
    pub record: Vec<TickRecord>,
    /// Addresses whose writes are kept.
    pub trace: Option<std::ops::Range<u64>>,
    /// Writes within `trace`: time, address, value.
    pub traced: Vec<(u64, u64, u64)>,
}

/// A and B of a count.
fn quadrature(count: i64) -> [bool; 2] {
    match count.rem_euclid(4) {
        0 => [false, false],
        1 => [true, false],
        2 => [true, true],
        _ => [false, true],
    }
}

impl World {
    fn lines(&self, board: &mut Nucleo, now: VirtualNanos, axis: usize) {
        let [a, b] = quadrature(self.shown[axis]);
        // Half a turn away from the start.
        let index =
            self.index && (self.shown[axis] - INDEX_COUNTS / 2).rem_euclid(INDEX_COUNTS) == 0;
        for (line, level) in [a, b, index].into_iter().enumerate() {
            board.encoder_line(now, axis, line, level);
        }
    }

    /// Turns a line of an encoder over for a time.
    pub fn glitch(
        &mut self,
        board: &mut Nucleo,
        now: VirtualNanos,
        axis: usize,
        line: usize,
        ns: u64,
    ) {
        let level = quadrature(self.shown[axis])[line];
        board.encoder_line(now, axis, line, !level);
        self.pulses.push((now.0 + ns, axis, line, level));
    }

    /// Count of the serial encoder.
    pub fn serial_count(&self) -> i64 {
        biss::lock(&self.encoder).count
    }

    fn note_count(&mut self, axis: usize, read: u32) {
        let last = &mut self.counts[axis];
        *last = match self.wiring.encoders[axis].mask {
            u32::MAX => read,
            _ => last.wrapping_add_signed(
                (read as u16)
                    .wrapping_sub(*last as u16)
                    .cast_signed()
                    .into(),
            ),
        };
    }

    fn plan_edges(&mut self, board: &mut Nucleo, now: u64) {
        let enabled = board.is_enabled();
        let volts = ad5754r::lock(&self.chip).volts();
        for (axis, volts) in volts.into_iter().enumerate() {
            let target = if self.plant {
                self.axes[axis].step(if enabled { volts } else { 0.0 });
                self.axes[axis].count()
            } else {
                self.spun[axis] += self.spin[axis] * STEP_NS as f64 * 1e-9;
                self.spun[axis].floor() as i64
            };
            if axis == 0
                && let Some(start) = self.serial_start
            {
                biss::lock(&self.encoder).count = start + target;
            }
            let change = target - self.shown[axis];
            for k in 0..change.abs() {
                let at = now + STEP_NS * k as u64 / change.unsigned_abs();
                self.edges
                    .push_back((at, axis, self.shown[axis] + change.signum() * (k + 1)));
            }
        }
        self.edges.make_contiguous().sort_by_key(|edge| edge.0);
    }

    fn note_outputs(&mut self, board: &mut Nucleo, now: u64) {
        for (changes, at) in [
            (&mut self.enables, self.wiring.enable),
            (&mut self.alarms, self.wiring.pulses.alarm),
        ] {
            let level = board.level(at);
            if changes.last().is_none_or(|last| last.1 != level) {
                changes.push((now, level));
            }
        }
    }

    fn note_resets(&mut self, session: &mut Session<Nucleo>, now: VirtualNanos) {
        let known = self.resets.len();
        if session.resets().len() == known && now.0 != 0 {
            return;
        }
        let new = session.resets()[known..]
            .iter()
            .map(|reset| (reset.at.0, reset.cause));
        self.resets.extend(new);
        self.ticks = Ticks::default();
        self.feeds.0 = 0;
        let board = session.board_mut();
        board.drive_all(now);
        for axis in 0..3 {
            self.lines(board, now, axis);
        }
        for line in 0..2 {
            board.pulse_line(now, line, false);
        }
    }
}

impl Driver<Nucleo> for World {
    fn on_settled(&mut self, session: &mut Session<Nucleo>, _: &mut dyn Host, settled: Settled) {
        let Settled::Access { access, value } = settled else {
            return;
        };
        let now = access.virtual_time;
        if access.kind == AccessKind::Read {
            if let Some(axis) = self
                .wiring
                .encoders
                .iter()
                .position(|encoder| encoder.base + COUNTER == access.address)
            {
                self.note_count(axis, value as u32);
            }
            if access.address == TICK_COUNTER
                && let Some(begun) = self.ticks.begun
            {
                self.ticks.taken = access.instruction_count - begun;
            }
            return;
        }
        if self
            .trace
            .as_ref()
            .is_some_and(|range| range.contains(&access.address))
        {
            self.traced.push((now.0, access.address, value));
        }
        match access.address {
            TICK_STATUS => {
                if self.ticks.begun.is_some() {
                    let (counts, codes) = (self.counts, ad5754r::lock(&self.chip).codes());
                    let enabled = session.board_mut().is_enabled();
                    self.record.push(TickRecord {
                        counts,
                        codes,
                        enabled,
                    });
                }
                self.ticks.acknowledge(now.0, access.instruction_count);
                let age = now.0 - biss::lock(&self.encoder).latched_ns;
                self.ages = (self.ages.0.min(age), self.ages.1.max(age));
            }
            address if address == self.wiring.watchdog_key && access.value & 0xFFFF == 0xAAAA => {
                if self.feeds.0 != 0 {
                    self.feeds.1 = self.feeds.1.max(now.0 - self.feeds.0);
                }
                self.feeds.0 = now.0;
            }
            address if self.wiring.ports.contains(&address) => {
                let board = session.board_mut();
                self.note_outputs(board, now.0);
                // MODER, AFRL, AFRH: the lines of the encoders reach their timers, or no longer.
                if matches!(address & 0x3FF, 0 | 0x20 | 0x24) {
                    for axis in 0..3 {
                        self.lines(board, now, axis);
                    }
                }
            }
            _ => {}
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<Nucleo>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        let now = stop.at.0;
        self.note_resets(session, stop.at);
        let board = session.board_mut();
        self.note_outputs(board, now);
        if now >= self.next_step {
            self.next_step = now + STEP_NS;
            self.plan_edges(board, now);
        }
        while let Some(&(_, axis, count)) = self.edges.front().filter(|edge| edge.0 <= now) {
            self.edges.pop_front();
            self.shown[axis] = count;
            self.lines(board, stop.at, axis);
        }
        while let Some(&(_, line, level)) = self.train.front().filter(|edge| edge.0 <= now) {
            self.train.pop_front();
            board.pulse_line(stop.at, line, level);
        }
        while let Some(place) = self.pulses.iter().position(|pulse| pulse.0 <= now) {
            let (_, axis, line, level) = self.pulses.remove(place);
            board.encoder_line(stop.at, axis, line, level);
        }
        if now >= self.next_log {
            self.next_log = now + LOG_NS;
            self.log.drain(host, now);
        }
        if let Some(mut target) = self.target.take() {
            let came = target.watch.as_mut().is_some_and(|watch| {
                let due = now >= watch.next;
                if due {
                    watch.next = now + watch.step;
                }
                due && (watch.came)(self)
            });
            if came || now >= target.at {
                target.reached.send((now, came)).ok()?;
            } else {
                self.target = Some(target);
            }
        }
        while self.target.is_none() {
            match self.orders.recv().ok()? {
                Order::Do(task) => task(self, session, host, stop.at),
                Order::RunUntil(target) if target.at > now => self.target = Some(target),
                Order::RunUntil(target) => target.reached.send((now, false)).ok()?,
            }
        }
        let mut next = self.next_step.min(self.next_log);
        if let Some(target) = &self.target {
            next = next.min(target.at);
            next = target
                .watch
                .iter()
                .fold(next, |next, watch| next.min(watch.next));
        }
        next = self.edges.front().map_or(next, |edge| next.min(edge.0));
        next = self.train.front().map_or(next, |edge| next.min(edge.0));
        next = self
            .pulses
            .iter()
            .fold(next, |next, pulse| next.min(pulse.0));
        Some(VirtualNanos(next.max(now + 1)))
    }
}

/// A run of the image.
pub struct Bench {
    /// The board's wiring.
    pub wiring: &'static Wiring,
    orders: SyncSender<Order>,
    model: Option<JoinHandle<Result<(), String>>>,
    /// The converter.
    pub chip: Shared,
    /// The link's line.
    pub line: SharedLine,
    /// The serial encoder.
    pub encoder: SharedEncoder,
    now: u64,
}

impl Bench {
    /// Switches the board on, with an image and the contents of the settings' sectors; blank if there are none.
    pub fn start(image: &Subject, settings: Option<&[u8]>) -> Self {
        Self::start_with_clock(image, settings, HSE_HZ)
    }

    /// The same with another rate at OSC_IN, Hz; 0 for none.
    pub fn start_with_clock(image: &Subject, settings: Option<&[u8]>, hse_hz: u64) -> Self {
        let (orders, received) = sync_channel(0);
        let (chip, line) = (Shared::default(), SharedLine::default());
        let encoder = SharedEncoder::default();
        let wiring = image.board;
        let (image, settings) = (image.clone(), settings.map(<[u8]>::to_vec));
        let around = (chip.clone(), line.clone(), encoder.clone());
        let run = move || run(&image, settings, hse_hz, &around, received);
        let model = std::thread::Builder::new()
            .name("chip".into())
            .stack_size(16 << 20)
            .spawn(run);
        Self {
            wiring,
            orders,
            model: Some(model.expect("a thread")),
            chip,
            line,
            encoder,
            now: 0,
        }
    }

    fn order(&mut self, order: Order) {
        if self.orders.send(order).is_err() {
            self.give_up();
        }
    }

    fn give_up(&mut self) -> ! {
        let ended = self.model.take().map(JoinHandle::join);
        panic!("the chip model ended: {ended:?}");
    }

    /// Acts on the board and its surroundings, or looks at them, at the present instant.
    pub fn with<R: Send + 'static>(
        &mut self,
        act: impl FnOnce(&mut World, &mut Nucleo, VirtualNanos) -> R + Send + 'static,
    ) -> R {
        self.with_session(move |world, session, _, now| act(world, session.board_mut(), now))
    }

    /// The same with what else belongs to the run.
    pub fn with_session<R: Send + 'static>(
        &mut self,
        act: impl FnOnce(&mut World, &mut Session<Nucleo>, &mut dyn Host, VirtualNanos) -> R
        + Send
        + 'static,
    ) -> R {
        let (answer, answered) = sync_channel(1);
        self.order(Order::Do(Box::new(move |world, session, host, now| {
            let _ = answer.send(act(world, session, host, now));
        })));
        match answered.recv() {
            Ok(answer) => answer,
            Err(_) => self.give_up(),
        }
    }

    /// Lets time pass, s.
    pub fn run_for(&mut self, seconds: f64) {
        self.run(seconds, None);
    }

    /// Lets time pass until something has come, looking every `step` seconds, `limit` seconds at most. Returns whether it did.
    pub fn run_until(
        &mut self,
        limit: f64,
        step: f64,
        came: impl FnMut(&World) -> bool + Send + 'static,
    ) -> bool {
        let watch = Watch {
            step: (step * 1e9) as u64,
            next: self.now,
            came: Box::new(came),
        };
        self.run(limit, Some(watch))
    }

    /// Lets time pass until the board has sent the end of a frame, and something else if it comes first.
    pub fn run_until_frame(
        &mut self,
        limit: f64,
        step: f64,
        mut or: impl FnMut(&World) -> bool + Send + 'static,
    ) -> bool {
        let line = self.line.clone();
        self.run_until(limit, step, move |world| {
            let line = line.lock().expect("the line");
            line.from_board.contains(&DELIMITER) || or(world)
        })
    }

    fn run(&mut self, seconds: f64, watch: Option<Watch>) -> bool {
        let at = self.now + (seconds * 1e9) as u64;
        let (reached, reports) = sync_channel(1);
        self.order(Order::RunUntil(Target { at, watch, reached }));
        let Ok((now, came)) = reports.recv() else {
            self.give_up();
        };
        // A stop may be late by an instruction.
        self.now = if came { now } else { at };
        came
    }

    /// Present instant, ns.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Drives a pin from outside.
    pub fn drive(&mut self, at: At, high: bool) {
        self.with(move |_, board, now| board.drive(now, at, high));
    }

    /// Count and captured count of an encoder's timer.
    pub fn counter(&mut self, axis: usize) -> (u32, u32) {
        self.with(move |_, board, now| board.counter(now, axis))
    }

    /// Turns encoders at speeds in counts/s.
    pub fn spin(&mut self, spin: [f64; 3]) {
        self.with(move |world, _, _| world.spin = spin);
    }

    /// Lines of the firmware's log so far.
    pub fn log(&mut self) -> Vec<String> {
        self.with_session(|world, _, host, now| {
            world.log.drain(host, now.0);
            world.log.lines.clone()
        })
    }

    /// Ticks since this was asked for last.
    pub fn ticks(&mut self) -> Ticks {
        self.with(|world, _, _| {
            let ticks = world.ticks;
            world.ticks = Ticks {
                last_ns: ticks.last_ns,
                begun: ticks.begun,
                taken: ticks.taken,
                ..Ticks::default()
            };
            ticks
        })
    }

    /// Rates of SYSCLK, HCLK, PCLK1, PCLK2, timers of APB 1, timers of APB 2, Hz.
    pub fn clocks(&mut self) -> [u64; 6] {
        self.with(|_, board, _| board.clocks())
    }

    /// Contents of the settings' sectors.
    pub fn settings_flash(&mut self) -> Vec<u8> {
        let (start, sector) = self.wiring.settings;
        self.with_session(move |_, _, host, _| {
            let word = |offset| host.read(start + offset, Width::W32).unwrap_or(0) as u32;
            (0..2 * sector)
                .step_by(4)
                .map(word)
                .flat_map(u32::to_le_bytes)
                .collect()
        })
    }

    /// Complaints of chip and converter: accesses that no model answers, rules of the manual that were violated.
    pub fn complaints(&mut self) -> Vec<String> {
        let mut all = self.with_session(|_, session, _, _| {
            let mut all: Vec<String> = session.unmapped().iter().map(ToString::to_string).collect();
            all.extend(
                session
                    .refused()
                    .iter()
                    .map(|(at, why)| format!("refused {at:#x}: {why}")),
            );
            all.extend(
                session
                    .undefined()
                    .iter()
                    .map(|(at, what)| format!("undefined {at:#x}: {what:?}")),
            );
            all.extend(
                session
                    .unimplemented()
                    .iter()
                    .map(|(at, what)| format!("not modelled {at:#x}: {what:?}")),
            );
            all.extend(
                session
                    .unrouted()
                    .iter()
                    .map(|what| format!("unrouted {what:?}")),
            );
            all.extend(
                session
                    .told()
                    .map(|what| format!("{} {}: {}", what.instance, what.register, what.reason)),
            );
            all
        });
        let known = self.wiring.known;
        all.retain(|text| !known.iter().any(|part| text.contains(part)));
        let chip = ad5754r::lock(&self.chip);
        all.extend(
            chip.complaints
                .iter()
                .map(|(at, what)| format!("AD5754R at {} us: {what}", at / 1000)),
        );
        let encoder = biss::lock(&self.encoder);
        all.extend(
            encoder
                .complaints
                .iter()
                .map(|(at, what)| format!("encoder at {} us: {what}", at / 1000)),
        );
        all
    }
}

/// Runs the image until the bench is dropped.
fn run(
    image: &Subject,
    settings: Option<Vec<u8>>,
    hse_hz: u64,
    (chip, line, encoder): &(Shared, SharedLine, SharedEncoder),
    orders: Receiver<Order>,
) -> Result<(), String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    let elf = std::fs::read(&image.image).map_err(|e| text(&e))?;
    let symbols = Symbols::read(&elf, |address| address).map_err(|e| text(&e))?;
    let mut images = vec![Image::read(&image.image, None).map_err(|e| text(&e))?];
    if let Some(bytes) = settings {
        images.push(
            Image::new(
                Path::new("settings.bin"),
                bytes,
                Some(image.board.settings.0),
            )
            .map_err(|e| text(&e))?,
        );
    }
    let board = Nucleo::new(image, chip, line, encoder, hse_hz).map_err(|e| text(&e))?;
    let session = Session::new(Box::new(board), 0, VirtualNanos(0)).map_err(|e| text(&e))?;
    let world = World {
        wiring: image.board,
        orders,
        target: None,
        plant: false,
        spin: [0.0; 3],
        spun: [0.0; 3],
        axes: Default::default(),
        shown: [0; 3],
        edges: VecDeque::new(),
        pulses: Vec::new(),
        index: true,
        next_step: 0,
        next_log: 0,
        log: Log::new(&elf, symbols.get("_SEGGER_RTT").ok())?,
        ticks: Ticks::default(),
        enables: Vec::new(),
        alarms: Vec::new(),
        train: VecDeque::new(),
        feeds: (0, 0),
        resets: Vec::new(),
        chip: chip.clone(),
        encoder: encoder.clone(),
        serial_start: None,
        ages: (u64::MAX, 0),
        counts: [0; 3],
        record: Vec::new(),
        trace: None,
        traced: Vec::new(),
    };
    let mut start = Start::new(&images);
    start.semihosting = false;
    emulator::run(session, &start, world)
        .map(drop)
        .map_err(|e| text(&e))
}
