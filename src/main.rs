//! The servo firmware: an RTIC application, thin on purpose.
//!
//! Computation is in the library, registers are in `board`. Here are the tasks and their priorities:
//!
//! | task      | priority | when                          | does |
//! |-----------|----------|-------------------------------|------|
//! | control   | highest  | every control tick            | encoders in, law, amplifiers out, deadline check |
//! | supervise | middle   | every tenth control tick      | receives from the link, passes or refuses requests, watches glitches |
//! | serve     | low      | after supervise               | answers a host's requests |
//! | show      | low      | when supervise has something  | prints through defmt |
//! | idle      | none     | the rest of the time          | what the board asks for |
#![cfg_attr(target_os = "none", no_std, no_main)]
// Registers are the only reason for `unsafe`, and `board` is their only place.
#![deny(unsafe_code)]

#[cfg(all(target_os = "none", feature = "firmware"))]
#[allow(unsafe_code)]
mod board;
#[cfg(all(target_os = "none", feature = "firmware"))]
mod boot;
#[cfg(all(target_os = "none", feature = "firmware"))]
mod log;

#[cfg(all(target_os = "none", not(feature = "firmware")))]
compile_error!("choose a board, `board-nucleo-f446re` or another (`cargo xtask build` does)");

#[cfg(all(target_os = "none", feature = "firmware"))]
#[rtic::app(
    device = crate::board::device,
    peripherals = false,
    dispatchers = [DISPATCHER_0, DISPATCHER_1, DISPATCHER_2]
)]
mod app {
    use core::sync::atomic::{AtomicU32, Ordering};

    use heapless_queues::spsc::{Consumer, Producer, Queue};
    use quadrant::app::Translated;
    use quadrant::app::glitch_monitor::GlitchReadings;
    use quadrant::app::start_record::LASTING_RUNS;
    use quadrant::app::{
        Control, Inputs, Intake, Liveness, Poll, Server, Snapshot, Supervision, TimingStatistics,
    };
    use quadrant::hal::{self, Amplifiers as _, Encoders as _, Switches as _, Watchdog as _};
    use quadrant_law::axes::AxisName;
    use quadrant_law::command::Command;
    use quadrant_law::safety::AxisSwitches;
    use quadrant_law::supervisor::Event;
    use quadrant_link::message::NumberType;

    use crate::board::{
        self, Amplifiers, Board, Encoders, Idle, Operator, Outcome, Pulses, Serial, SettingsFlash,
        Switches, Tick, Watchdog,
    };
    use crate::boot::{self, StaticStorage};
    use crate::log::{self, EventLogger, LogEntry, Printer};

    /// The number type of the control law.
    #[cfg(not(feature = "scalar-fixed"))]
    type Number = f32;
    /// The number type of the control law.
    #[cfg(feature = "scalar-fixed")]
    type Number = quadrant_law::scalar::Fixed;
    /// The number type's name on the link.
    #[cfg(not(feature = "scalar-fixed"))]
    const NUMBER: NumberType = NumberType::F32;
    /// The number type's name on the link.
    #[cfg(feature = "scalar-fixed")]
    const NUMBER: NumberType = NumberType::Fixed;

    /// Control ticks begun: the time of everything else.
    pub(crate) static TICK: AtomicU32 = AtomicU32::new(0);
    /// Control ticks that began late, or ended after the next one was due.
    static OVERRUNS: AtomicU32 = AtomicU32::new(0);
    /// Duration of the longest control tick, in cycles of its timer.
    static LONGEST: AtomicU32 = AtomicU32::new(0);
    /// Polls of the server.
    static POLLS: AtomicU32 = AtomicU32::new(0);
    /// Valid requests of a host so far.
    static FRAMES: AtomicU32 = AtomicU32::new(0);

    defmt::timestamp!("{=u32:010}", TICK.load(Ordering::Relaxed));

    #[shared]
    struct Shared {
        /// The supervising task's latest snapshot, for the server.
        seen: Snapshot<Number>,
        /// The link's port: the supervising task receives, the server sends.
        port: Port,
    }

    /// The link's port.
    pub struct Port(Serial);

    #[local]
    struct Local {
        control: &'static mut Control<'static, 'static, Number>,
        server: &'static mut Server<'static, 'static, Number, SettingsFlash>,
        amplifiers: Amplifiers,
        encoders: Encoders,
        switches: Switches,
        pulses: Pulses,
        operator: Operator,
        intake: &'static mut Intake<'static>,
        watchdog: Watchdog,
        tick: Tick,
        idle: Idle,
        supervision: Supervision,
        liveness: Liveness,
        requests_in: Producer<'static, Command, 4>,
        requests_out: Consumer<'static, Command, 4>,
        commands_in: Producer<'static, Command, 4>,
        commands_out: Consumer<'static, Command, 4>,
        snapshots_in: Producer<'static, &'static mut Snapshot<Number>, 4>,
        snapshots_out: Consumer<'static, &'static mut Snapshot<Number>, 4>,
        free_snapshots_in: Producer<'static, &'static mut Snapshot<Number>, 4>,
        free_snapshots_out: Consumer<'static, &'static mut Snapshot<Number>, 4>,
        glitches_in: Producer<'static, GlitchReadings, 2>,
        glitches_out: Consumer<'static, GlitchReadings, 2>,
        events_in: Producer<'static, (u32, Event), 16>,
        events_out: Consumer<'static, (u32, Event), 16>,
        lines_in: Producer<'static, LogEntry<Number>, 16>,
        lines_out: Consumer<'static, LogEntry<Number>, 16>,
        event_logger: EventLogger,
    }

    #[init(local = [
        storage: StaticStorage<Number> = StaticStorage::new(),
        requests: Queue<Command, 4> = Queue::new(),
        commands: Queue<Command, 4> = Queue::new(),
        snapshots: Queue<&'static mut Snapshot<Number>, 4> = Queue::new(),
        free_snapshots: Queue<&'static mut Snapshot<Number>, 4> = Queue::new(),
        snapshot_buffers: [Option<Snapshot<Number>>; 3] = [None; 3],
        glitches: Queue<GlitchReadings, 2> = Queue::new(),
        events: Queue<(u32, Event), 16> = Queue::new(),
        lines: Queue<LogEntry<Number>, 16> = Queue::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        let mut board = Board::init(cx.core);
        let crashed = boot::report_crash(board.reset_cause);
        let cycle_hz = board.tick.cycle_hz();
        let boot::Machine {
            control,
            intake,
            server,
            rate_hz,
            encoders,
        } = boot::machine(cx.local.storage, board.flash, crashed, cycle_hz, NUMBER);
        defmt::info!("{=u32} control ticks per second, outputs off", rate_hz);
        let (requests_in, requests_out) = cx.local.requests.split();
        let (commands_in, commands_out) = cx.local.commands.split();
        let (snapshots_in, snapshots_out) = cx.local.snapshots.split();
        let (mut free_snapshots_in, free_snapshots_out) = cx.local.free_snapshots.split();
        for buffer in cx.local.snapshot_buffers {
            // The queue has places for all.
            let _ = free_snapshots_in.enqueue(buffer.get_or_insert_default());
        }
        let (glitches_in, glitches_out) = cx.local.glitches.split();
        let (events_in, events_out) = cx.local.events.split();
        let (lines_in, lines_out) = cx.local.lines.split();
        // First: it waits for its own clock, and the first tick would be late.
        board.watchdog.start();
        board.encoders.prepare(&encoders, rate_hz);
        board.tick.start(rate_hz);
        let local = Local {
            control,
            server,
            amplifiers: board.amplifiers,
            encoders: board.encoders,
            switches: board.switches,
            pulses: board.pulses,
            operator: board.operator,
            intake,
            watchdog: board.watchdog,
            tick: board.tick,
            idle: board.idle,
            supervision: Supervision::new(encoders.map(|encoder| encoder.resolution_mm)),
            liveness: Liveness::new(rate_hz),
            requests_in,
            requests_out,
            commands_in,
            commands_out,
            snapshots_in,
            snapshots_out,
            free_snapshots_in,
            free_snapshots_out,
            glitches_in,
            glitches_out,
            events_in,
            events_out,
            lines_in,
            lines_out,
            event_logger: EventLogger::new(),
        };
        let shared = Shared {
            seen: Snapshot::default(),
            port: Port(board.serial),
        };
        (shared, local)
    }

    /// Reads the encoders, computes, writes the amplifiers.
    ///
    /// The contract: begun when it is due, and done before the next one is. Both are checked in every tick, and nothing that could
    /// panic, divide by a helper or compute in f64 can be reached from here (`cargo xtask prove-no-panic`).
    #[task(binds = CONTROL_TICK, priority = 4, local = [
        control, encoders, switches, pulses, operator, amplifiers, tick, requests_in, commands_out, snapshots_in,
        free_snapshots_out, glitches_out, deadline_missed: bool = false,
    ])]
    fn control(cx: control::Context) {
        let began_late = cx.local.tick.begin();
        cx.local.amplifiers.begin();
        // A tick that begins late because of the one before it is that one's fault, and counted there.
        let delayed = began_late && !*cx.local.deadline_missed;
        let mut switches = cx.local.switches.read();
        let mismatches = cx.local.amplifiers.mismatches();
        if mismatches.contains(&true) {
            for (axis, differs) in AxisName::ALL.into_iter().zip(mismatches) {
                if differs {
                    switches = switches.with_axis(axis, AxisSwitches::OUTPUT_MISMATCH);
                }
            }
        }
        // Behind a pointer of unknown value: each access then is one from a base register. Where control lies is known when the
        // image is linked, and the compiler would make every address of two halves.
        let control = core::hint::black_box(&mut **cx.local.control);
        control.note_requests(FRAMES.load(Ordering::Relaxed));
        let mut inputs = Inputs {
            readings: cx.local.encoders.read().into(),
            switches,
            deadline_missed: began_late || *cx.local.deadline_missed,
            ..Inputs::default()
        };
        inputs.command = cx.local.pulses.step(control);
        if inputs.command.is_none() && cx.local.commands_out.ready() {
            inputs.command = cx.local.commands_out.dequeue();
        }
        let outputs = control.tick(&mut inputs);
        cx.local.amplifiers.write(&outputs);

        TICK.store(control.state().tick(), Ordering::Relaxed);
        if let Some(request) = cx.local.operator.request() {
            // A full queue drops the newest request: a host that asks too fast repeats it.
            let _ = cx.local.requests_in.enqueue(request);
        }
        let elapsed = cx.local.tick.elapsed_cycles();
        if control.observe(elapsed) {
            // A supervising task that is late finds the oldest snapshots and misses the newest.
            if let Some(snapshot) = cx.local.free_snapshots_out.dequeue() {
                control.take_snapshot(snapshot);
                // The queue has places for all that there are.
                let _ = cx.local.snapshots_in.enqueue(snapshot);
            }
            let _ = supervise::spawn();
            if let Some(readings) = cx.local.glitches_out.dequeue() {
                control.show_glitches(readings);
            }
        }

        let elapsed = cx.local.tick.elapsed_cycles();
        if elapsed > LONGEST.load(Ordering::Relaxed) {
            LONGEST.store(elapsed, Ordering::Relaxed);
        }
        *cx.local.deadline_missed = elapsed >= cx.local.tick.period_cycles();
        if *cx.local.deadline_missed || delayed {
            OVERRUNS.store(
                OVERRUNS.load(Ordering::Relaxed).wrapping_add(1),
                Ordering::Relaxed,
            );
        }
    }

    /// Receives from the link; passes the operator's requests to the control law or refuses them, reports events to log and
    /// server, and feeds the watchdog while all tasks make progress.
    #[task(priority = 2, shared = [seen, port], local = [
        intake, snapshots_out, free_snapshots_in, requests_out, commands_in, glitches_in, events_in, lines_in, watchdog, supervision, liveness,
        runs: u32 = 0,
    ])]
    async fn supervise(mut cx: supervise::Context) {
        let received = cx.shared.port.lock(|port| cx.local.intake.run(&mut port.0));
        FRAMES.store(cx.local.intake.frames(), Ordering::Relaxed);
        if let Some(urgent) = received.urgent {
            let waiting = core::iter::from_fn(|| cx.local.requests_out.dequeue());
            let command = Intake::overtake(urgent, waiting);
            // Before anything else, so that there is room.
            let _ = cx.local.commands_in.enqueue(command);
            print(cx.local.lines_in, LogEntry::Command(command));
        }
        while let Some(snapshot) = cx.local.snapshots_out.dequeue() {
            let request = cx.local.requests_out.dequeue();
            let supervised = cx.local.supervision.run(snapshot, request);
            if let Some(command) = supervised.command {
                cx.local.intake.note(command);
                // Control empties this queue ten times as fast as it is filled.
                let _ = cx.local.commands_in.enqueue(command);
                print(cx.local.lines_in, LogEntry::Command(command));
            }
            for event in supervised.events {
                // A server or a log that is late loses its newest; nothing waits for them.
                let _ = cx.local.events_in.enqueue((snapshot.tick, event));
                print(cx.local.lines_in, LogEntry::Event(event));
            }
            for glitch in &supervised.glitches {
                print(cx.local.lines_in, LogEntry::Glitch(*glitch));
            }
            if !supervised.glitches.is_empty() {
                // Control empties this queue at its next snapshot.
                let _ = cx
                    .local
                    .glitches_in
                    .enqueue(cx.local.supervision.glitch_readings());
            }
            if supervised.status_due {
                let errors = snapshot.axes.map(|axis| axis.error);
                print(cx.local.lines_in, LogEntry::Status(errors));
            }
            *cx.local.runs = cx.local.runs.saturating_add(1);
            if *cx.local.runs == LASTING_RUNS {
                boot::forget_starts();
            }
            let polls = POLLS.load(Ordering::Relaxed);
            if cx.local.liveness.check(snapshot.tick, polls) {
                cx.local.watchdog.feed(snapshot.view.safety.drives());
            }
            if let Some(silent_ms) = cx.local.liveness.warning_ms() {
                log::warn_of_watchdog(silent_ms);
            }
            cx.shared.seen.lock(|seen| *seen = *snapshot);
            // The queue has places for all that there are.
            let _ = cx.local.free_snapshots_in.enqueue(snapshot);
        }
        let _ = serve::spawn();
    }

    /// Answers a host's requests.
    #[task(priority = 1, shared = [seen, port], local = [server, events_out, event_logger])]
    async fn serve(mut cx: serve::Context) {
        POLLS.store(
            POLLS.load(Ordering::Relaxed).wrapping_add(1),
            Ordering::Relaxed,
        );
        while let Some((tick, event)) = cx.local.events_out.dequeue() {
            cx.local
                .server
                .push_event(tick, Translated::translated(event));
        }
        let seen = cx.shared.seen.lock(|seen| *seen);
        let timing = TimingStatistics {
            overruns: OVERRUNS.load(Ordering::Relaxed),
            longest_tick_cycles: LONGEST.load(Ordering::Relaxed),
        };
        let mut port = Sender(&mut cx.shared.port);
        let poll = cx.local.server.poll(&mut port, &seen, timing);
        cx.local.event_logger.log(cx.local.server, &seen, timing);
        if poll == Poll::Reboot {
            defmt::info!("restart, as a host has asked");
            boot::forget_starts();
            board::restart();
        }
    }

    /// The link's port as the server has it: it only sends.
    struct Sender<'a, M>(&'a mut M);

    impl<M: rtic::Mutex<T = Port>> hal::Serial for Sender<'_, M> {
        fn read(&mut self, _into: &mut [u8]) -> usize {
            0
        }

        fn write(&mut self, bytes: &[u8]) -> usize {
            self.0.lock(|port| hal::Serial::write(&mut port.0, bytes))
        }

        fn has_sent(&mut self) -> bool {
            self.0.lock(|port| hal::Serial::has_sent(&mut port.0))
        }
    }

    /// Passes an entry to the log, which prints when nothing more urgent is to be done.
    fn print(lines: &mut Producer<'static, LogEntry<Number>, 16>, line: LogEntry<Number>) {
        if lines.enqueue(line).is_err() {
            log::lose_line();
        }
        let _ = show::spawn();
    }

    /// Prints the log's entries.
    #[task(priority = 1, local = [lines_out, printer: Printer = Printer::new()])]
    async fn show(cx: show::Context) {
        while let Some(line) = cx.local.lines_out.dequeue() {
            cx.local.printer.print(TICK.load(Ordering::Relaxed), line);
        }
    }

    #[idle(local = [idle])]
    fn idle(cx: idle::Context) -> ! {
        board::release_float_registers();
        loop {
            if let Some(finished) = cx.local.idle.turn() {
                defmt::info!(
                    "finished: {=u32} ticks, {=u32} overruns, longest {=u32} cycles, {=u32} us of firmware time",
                    finished.ticks,
                    OVERRUNS.load(Ordering::Relaxed),
                    LONGEST.load(Ordering::Relaxed),
                    finished.microseconds
                );
                defmt::info!(
                    "stack: at most {=usize} of {=usize} bytes were used",
                    board::stack::high_water(),
                    board::stack::size()
                );
                board::halt(Outcome::Done);
            }
        }
    }
}

/// Explains how to build the firmware: on a host there is nothing to control.
#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "This is the firmware; it runs on a microcontroller, not here.\n\
         Build it:   cargo xtask build --board nucleo-f446re    (or --board mps2)\n\
         Emulate it: cargo xtask emulate\n\
         By hand it takes a target and the feature of a board:\n\
         cargo build --profile firmware --target thumbv7em-none-eabihf --features board-nucleo-f446re"
    );
    std::process::exit(2);
}
