//! The servo firmware: an RTIC application, thin on purpose.
//!
//! What is computed lives in the library, what touches registers in `board`. Here is only who does what, when, and at
//! which priority:
//!
//! | task      | priority | when                          | does |
//! |-----------|----------|-------------------------------|------|
//! | control   | highest  | every control tick            | encoders in, law, amplifiers out, deadline check |
//! | supervise | middle   | every tenth control tick      | lets requests through or refuses them |
//! | log       | low      | when supervise has something  | prints through defmt |
//! | idle      | none     | the rest of the time          | what the board asks for |
#![cfg_attr(target_os = "none", no_std, no_main)]
// Registers are the only reason for `unsafe`, and `board` is their only place.
#![deny(unsafe_code)]

#[cfg(all(
    target_os = "none",
    any(feature = "board-mps2", feature = "board-nucleo-f446re")
))]
#[allow(unsafe_code)]
mod board;
#[cfg(all(
    target_os = "none",
    any(feature = "board-mps2", feature = "board-nucleo-f446re")
))]
mod job;

#[cfg(all(
    target_os = "none",
    not(any(feature = "board-mps2", feature = "board-nucleo-f446re"))
))]
compile_error!("choose a board: `board-mps2` or `board-nucleo-f446re` (`cargo xtask build` does)");

#[cfg(all(
    target_os = "none",
    any(feature = "board-mps2", feature = "board-nucleo-f446re")
))]
#[rtic::app(
    device = crate::board::device,
    peripherals = false,
    dispatchers = [DISPATCHER_0, DISPATCHER_1, DISPATCHER_2]
)]
mod app {
    use core::sync::atomic::{AtomicU32, Ordering};

    use heapless::spsc::{Consumer, Producer, Queue};
    use quadrant::friction::gms::FIRMWARE_ELEMENTS;
    use quadrant::hal::{Amplifiers as _, Encoders as _};
    use quadrant::safety::{AxisName, Command};
    use quadrant::scalar::{Quantity, Scalar};
    use quadrant::stage::{Inputs, Plan, Stage, StageState};
    use quadrant::supervisor::{Event, PERIOD_TICKS, StageView, Supervisor};

    use crate::board::{self, Amplifiers, Board, Encoders, Idle, Operator, Outcome, Tick};
    use crate::job;

    /// What the control law computes with.
    #[cfg(not(feature = "scalar-fixed"))]
    type Number = f32;
    /// What the control law computes with.
    #[cfg(feature = "scalar-fixed")]
    type Number = quadrant::scalar::Fixed;

    /// Runs of the supervising task per status line of the log: one a second at 10 kHz.
    const STATUS_DIVIDER: u32 = 1_000;

    /// Control ticks begun: the time of everything else.
    static TICK: AtomicU32 = AtomicU32::new(0);
    /// Control ticks that ended after the next one was due.
    static OVERRUNS: AtomicU32 = AtomicU32::new(0);
    /// The longest a control tick took, in cycles of its timer.
    static LONGEST: AtomicU32 = AtomicU32::new(0);

    defmt::timestamp!("{=u32:010}", TICK.load(Ordering::Relaxed));

    /// What control tells the supervising task.
    #[derive(Clone, Copy)]
    pub(crate) struct Sample {
        view: StageView,
        errors: [Number; 3],
    }

    /// What the supervising task has to say to a person.
    #[derive(Clone, Copy)]
    pub(crate) enum Line {
        /// Something happened.
        Event(Event),
        /// All is as it was; the tracking errors.
        Status([Number; 3]),
    }

    #[shared]
    struct Shared {}

    #[local]
    struct Local {
        stage: Stage<Number>,
        plan: Plan<Number>,
        state: StageState<Number>,
        amplifiers: Amplifiers,
        encoders: Encoders,
        operator: Operator,
        tick: Tick,
        idle: Idle,
        requests_in: Producer<'static, Command>,
        requests_out: Consumer<'static, Command>,
        commands_in: Producer<'static, Command>,
        commands_out: Consumer<'static, Command>,
        samples_in: Producer<'static, Sample>,
        samples_out: Consumer<'static, Sample>,
        lines_in: Producer<'static, Line>,
        lines_out: Consumer<'static, Line>,
        supervisor: Supervisor,
    }

    #[init(local = [
        requests: Queue<Command, 4> = Queue::new(),
        commands: Queue<Command, 4> = Queue::new(),
        samples: Queue<Sample, 4> = Queue::new(),
        lines: Queue<Line, 16> = Queue::new(),
    ])]
    fn init(cx: init::Context) -> (Shared, Local) {
        // Tables are filled and bounds are searched before the first tick is due.
        let job = job::take(board::job());
        let stage = job::built(job.stage.build::<Number, FIRMWARE_ELEMENTS>());
        let plan = job::built(job.plan.build::<Number>(&job.stage));
        let rate_hz = job.stage.rate_hz as u32;
        defmt::info!("{=u32} control ticks per second, outputs off", rate_hz);
        let Board {
            encoders,
            operator,
            amplifiers,
            tick,
            idle,
        } = Board::init(cx.core, rate_hz);
        let (requests_in, requests_out) = cx.local.requests.split();
        let (commands_in, commands_out) = cx.local.commands.split();
        let (samples_in, samples_out) = cx.local.samples.split();
        let (lines_in, lines_out) = cx.local.lines.split();
        let local = Local {
            stage,
            plan,
            state: StageState::default(),
            amplifiers,
            encoders,
            operator,
            tick,
            idle,
            requests_in,
            requests_out,
            commands_in,
            commands_out,
            samples_in,
            samples_out,
            lines_in,
            lines_out,
            supervisor: Supervisor::default(),
        };
        (Shared {}, local)
    }

    /// Reads the encoders, computes, writes the amplifiers.
    ///
    /// The contract: done before the next tick is due. It is checked at the end of every tick, and nothing that could
    /// panic, divide by a helper or compute in f64 can be reached from here (`cargo xtask prove-no-panic`).
    #[task(binds = CONTROL_TICK, priority = 4, local = [
        stage, plan, state, encoders, operator, amplifiers, tick, requests_in, commands_out, samples_in,
        deadline_missed: bool = false,
    ])]
    fn control(cx: control::Context) {
        cx.local.tick.acknowledge();
        let inputs = Inputs {
            counts: cx.local.encoders.counts(),
            command: cx.local.commands_out.dequeue(),
            settings_changed: false,
            deadline_missed: *cx.local.deadline_missed,
        };
        let state = cx.local.state;
        let outputs = cx.local.stage.tick(cx.local.plan, state, &inputs);
        cx.local.amplifiers.write(outputs.codes, outputs.enabled);

        TICK.store(state.tick(), Ordering::Relaxed);
        if let Some(request) = cx.local.operator.request() {
            // A full queue drops the newest request: whoever asks too fast asks again.
            let _ = cx.local.requests_in.enqueue(request);
        }
        if state.tick().is_multiple_of(PERIOD_TICKS) {
            // A supervising task that is late finds the oldest samples and misses the newest.
            let _ = cx.local.samples_in.enqueue(Sample {
                view: StageView {
                    safety: state.safety(),
                    running: state.is_running(),
                },
                errors: state.axes().each_ref().map(|axis| axis.telemetry().error),
            });
            let _ = supervise::spawn();
        }

        let elapsed = cx.local.tick.elapsed_cycles();
        if elapsed > LONGEST.load(Ordering::Relaxed) {
            LONGEST.store(elapsed, Ordering::Relaxed);
        }
        *cx.local.deadline_missed = elapsed >= cx.local.tick.period_cycles();
        if *cx.local.deadline_missed {
            OVERRUNS.store(
                OVERRUNS.load(Ordering::Relaxed).wrapping_add(1),
                Ordering::Relaxed,
            );
        }
    }

    /// Lets requests through to the control law, or refuses them, and tells the log what happened.
    #[task(priority = 2, local = [samples_out, requests_out, commands_in, lines_in, supervisor, runs: u32 = 0])]
    async fn supervise(cx: supervise::Context) {
        while let Some(sample) = cx.local.samples_out.dequeue() {
            let request = cx.local.requests_out.dequeue();
            let decision = cx.local.supervisor.step(sample.view, request);
            if let Some(command) = decision.command {
                // Control empties this queue ten times as fast as it is filled.
                let _ = cx.local.commands_in.enqueue(command);
            }
            *cx.local.runs = cx.local.runs.wrapping_add(1);
            let status = cx
                .local
                .runs
                .is_multiple_of(STATUS_DIVIDER)
                .then_some(Line::Status(sample.errors));
            for line in decision
                .events
                .into_iter()
                .flatten()
                .map(Line::Event)
                .chain(status)
            {
                // A log that is late loses its newest lines; nothing waits for it.
                let _ = cx.local.lines_in.enqueue(line);
                let _ = log::spawn();
            }
        }
    }

    /// Prints.
    #[task(priority = 1, local = [lines_out])]
    async fn log(cx: log::Context) {
        while let Some(line) = cx.local.lines_out.dequeue() {
            match line {
                Line::Event(event) => log_event(event),
                Line::Status(errors) => {
                    let [x, y, z] = errors.map(|error| 1e3 * error.to_f32(Quantity::Length));
                    defmt::info!(
                        "tracking error x {=f32} um, y {=f32} um, z {=f32} um",
                        x,
                        y,
                        z
                    );
                }
            }
        }
    }

    fn log_event(event: Event) {
        match event {
            Event::Enabled => defmt::info!("outputs enabled"),
            Event::Disabled => defmt::info!("outputs disabled"),
            Event::MotionStarted => defmt::info!("motion started"),
            Event::MotionFinished => defmt::info!("motion finished"),
            Event::Refused(_, refusal) => defmt::warn!("request refused: {=str}", refusal.as_str()),
            Event::Faulted(fault) => defmt::error!(
                "fault {=u8} on {=str} at tick {=u32}, outputs are off: {=str}; {=str}",
                fault.code.number(),
                fault.axis.map_or("the stage", AxisName::as_str),
                fault.tick,
                fault.code.cause(),
                fault.code.remedy()
            ),
        }
    }

    #[idle(local = [idle])]
    fn idle(cx: idle::Context) -> ! {
        loop {
            if let Some(finished) = cx.local.idle.turn() {
                defmt::info!(
                    "finished: {=u32} ticks, {=u32} overruns, longest {=u32} cycles, {=u32} us of firmware time",
                    finished.ticks,
                    OVERRUNS.load(Ordering::Relaxed),
                    LONGEST.load(Ordering::Relaxed),
                    finished.microseconds
                );
                board::halt(Outcome::Done);
            }
        }
    }
}

/// On a host there is nothing to control: say what to do instead.
#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "This is the firmware; it runs on a microcontroller, not here.\n\
         Build it:   cargo xtask build --board nucleo-f446re    (or --board mps2)\n\
         Emulate it: cargo xtask emulate\n\
         By hand it takes a target and the feature of a board:\n\
         cargo build --release --target thumbv7em-none-eabihf --features board-nucleo-f446re"
    );
    std::process::exit(2);
}
