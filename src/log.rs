//! The event logger: one line per event, through defmt.
//!
//! `error`: the outputs are off, or will be. `warn`: somebody should look. `info`: something was done. `debug`: how it goes.
//! `trace`: every command. `docs/log.md` shows a run and says what the lines mean.

use core::sync::atomic::{AtomicU32, Ordering};

use quadrant::app::glitch_monitor::GlitchEvent;
use quadrant::app::rate_limiter::RateLimiter;
use quadrant::app::{ChangeDetector, Server, Snapshot, StateChange, TimingStatistics};
use quadrant::hal::ResetCause;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::Fault;
use quadrant_law::safety::oscillation::OscillationKind;
use quadrant_law::scalar::{Quantity, Scalar};
use quadrant_law::supervisor::Event;
use quadrant_law::supervisor::FrictionChange;
use quadrant_law::supervisor::Oscillated;
use quadrant_settings::StageSettings;

use crate::board::{self, SettingsFlash};

/// Lines of a kind in a second at 10 kHz: more are counted, not printed.
const LINES: u16 = 5;
/// Ticks of a second at 10 kHz.
const SECOND_TICKS: u32 = 10_000;

/// Lines for which the queue to the log had no room.
static LOST: AtomicU32 = AtomicU32::new(0);

/// An entry of the supervising task for the log.
#[derive(Clone, Copy)]
pub(crate) enum LogEntry<S> {
    /// An event of the supervisor.
    Event(Event),
    /// A glitch or a circle has ended.
    Glitch(GlitchEvent),
    /// A command went to the control law.
    Command(Command),
    /// The tracking errors, once a second.
    Status([S; 3]),
}

/// Logs version, board and reset cause.
pub(crate) fn started(cause: ResetCause) {
    defmt::info!(
        "quadrant {=str} on {=str}, started by {=str}",
        env!("CARGO_PKG_VERSION"),
        board::NAME,
        cause.as_str()
    );
    if cause.is_alarming() {
        defmt::warn!(
            "the run before this one was ended by {=str}",
            cause.as_str()
        );
    }
}

/// Logs the origin of the settings in force.
pub(crate) fn settings_loaded(settings: &StageSettings, number: u32, provenance: &str) {
    let mut paths = 0_usize;
    // An error of the tree would end the visit early, and show as a number that is too small.
    let _ = settings.list("", &mut |_| paths += 1);
    defmt::info!(
        "settings number {=u32} from flash: {=usize} paths, from {=str}",
        number,
        paths,
        provenance
    );
}

/// Warns if the settings in force are not those of a commissioned stage, and says what to do.
pub(crate) fn not_commissioned(settings: &StageSettings) {
    if let Some(axis) = settings.uncommissioned() {
        defmt::warn!(
            "{=str} has a law, but is not commissioned; the outputs stay off",
            axis.as_str()
        );
    } else if !settings.is_commissioned() {
        defmt::warn!(
            "not commissioned: no axis is; the outputs stay off; run `quadrant commission`, or load settings and store them"
        );
    }
}

/// Counts an entry that found no room.
pub(crate) fn lose_line() {
    LOST.store(
        LOST.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Relaxed,
    );
}

/// The topic of a line: each has its own share of the log.
#[derive(Clone, Copy)]
enum Topic {
    State,
    Refusals,
    Faults,
    Motion,
    Link,
    Settings,
    Losses,
    Glitches,
    Friction,
}

const TOPICS: [&str; 9] = [
    "the outputs",
    "refusals",
    "faults",
    "motion",
    "the link",
    "settings and captures",
    "losses",
    "glitches",
    "friction",
];

/// Limits the lines that a task prints.
struct LogLimiter {
    limiter: RateLimiter<{ TOPICS.len() }>,
}

impl LogLimiter {
    const fn new() -> Self {
        Self {
            limiter: RateLimiter::new(SECOND_TICKS, LINES),
        }
    }

    /// Logs the number of lines left out, when their window is over.
    fn settle(&mut self, tick: u32) {
        while let Some((topic, left_out)) = self.limiter.overdue(tick) {
            let about = TOPICS.get(topic).copied().unwrap_or("");
            defmt::warn!(
                "{=u32} more lines about {=str} were left out",
                left_out,
                about
            );
        }
    }

    fn admits(&mut self, topic: Topic, tick: u32) -> bool {
        self.settle(tick);
        self.limiter.admits(topic as usize, tick)
    }
}

/// Prints the entries of the supervising task.
pub(crate) struct Printer {
    limiter: LogLimiter,
    lost: u32,
}

impl Printer {
    pub(crate) const fn new() -> Self {
        Self {
            limiter: LogLimiter::new(),
            lost: 0,
        }
    }

    pub(crate) fn print<S: Scalar>(&mut self, tick: u32, line: LogEntry<S>) {
        let lost = LOST.load(Ordering::Relaxed);
        if lost != self.lost && self.limiter.admits(Topic::Losses, tick) {
            defmt::warn!(
                "{=u32} lines were lost: they came faster than they are printed",
                lost.wrapping_sub(self.lost)
            );
            self.lost = lost;
        }
        match line {
            LogEntry::Event(event) => {
                if self.limiter.admits(topic(event), tick) {
                    print_event(event);
                }
            }
            LogEntry::Glitch(event) => {
                if self.limiter.admits(Topic::Glitches, tick) {
                    print_glitch(event);
                }
            }
            LogEntry::Command(command) => print_command(command),
            LogEntry::Status(errors) => {
                self.limiter.settle(tick);
                let [x, y, z] = errors.map(|error| 1e3 * error.to_f32(Quantity::Length));
                defmt::debug!(
                    "tracking error x {=f32} um, y {=f32} um, z {=f32} um",
                    x,
                    y,
                    z
                );
            }
        }
    }
}

const fn topic(event: Event) -> Topic {
    match event {
        Event::Enabled | Event::Disabled => Topic::State,
        Event::MotionStarted | Event::MotionFinished | Event::MovedWhileOff(_) => Topic::Motion,
        Event::Refused(..) => Topic::Refusals,
        Event::Faulted(_) | Event::Stopping(_) | Event::Held(_) => Topic::Faults,
        Event::FrictionChanged(_) | Event::Oscillated(_) => Topic::Friction,
    }
}

fn print_event(event: Event) {
    match event {
        Event::Enabled => defmt::info!("outputs enabled"),
        Event::Disabled => defmt::info!("outputs disabled"),
        Event::MotionStarted => defmt::info!("motion started"),
        Event::MotionFinished => defmt::info!("motion finished"),
        Event::MovedWhileOff(axis) => {
            defmt::warn!("{=str} moves though the outputs are off", axis.as_str());
        }
        Event::FrictionChanged(change) => print_friction(change),
        Event::Oscillated(found) => print_oscillation(found),
        Event::Refused(_, refusal) => match refusal.axis() {
            Some(axis) => {
                defmt::warn!(
                    "request refused: {=str}: {=str}",
                    axis.as_str(),
                    refusal.as_str()
                );
            }
            None => defmt::warn!("request refused: {=str}", refusal.as_str()),
        },
        Event::Faulted(fault) => print_fault(fault, "outputs are off"),
        Event::Stopping(fault) => print_fault(fault, "the axes brake"),
        Event::Held(fault) => print_fault(fault, "the axes brake and hold"),
    }
}

/// Micrometres and degrees to one digit.
fn tenths(value: f32) -> f32 {
    let rounding = if value < 0.0 { -0.5 } else { 0.5 };
    (10.0 * value + rounding) as i32 as f32 / 10.0
}

fn print_glitch(event: GlitchEvent) {
    match event {
        GlitchEvent::Reversal {
            axis,
            tick,
            height_um,
        } => defmt::info!(
            "{=str}: reversal at tick {=u32}: glitch {=f32} um",
            axis.as_str(),
            tick,
            tenths(height_um)
        ),
        GlitchEvent::Circle(circle) => defmt::info!(
            "circle: worst {=f32} um at {=f32} deg",
            tenths(circle.deviation_um),
            tenths(circle.angle_deg)
        ),
    }
}

fn print_friction(change: FrictionChange) {
    let (axis, times) = (change.axis.as_str(), f32::from(change.percent) / 100.0);
    if change.needs_maintenance {
        defmt::warn!(
            "friction of {=str} is {=f32} times what was commissioned: look after guide, drive and lubrication, or commission again",
            axis,
            times
        );
    } else {
        defmt::info!(
            "friction of {=str} is {=f32} times what was commissioned",
            axis,
            times
        );
    }
}

fn print_oscillation(found: Oscillated) {
    let (axis, um) = (found.axis.as_str(), found.micrometres);
    let hertz = f32::from(found.decihertz) / 10.0;
    match found.kind {
        OscillationKind::Hum => defmt::warn!(
            "{=str} hums at rest, {=u16} um at {=f32} Hz: lower the gains, or look for what shakes it",
            axis,
            um,
            hertz
        ),
        OscillationKind::Added => defmt::warn!(
            "the feedforward of {=str} made it swing, {=u16} um at {=f32} Hz, and is taken away for a while: check its kind and gains",
            axis,
            um,
            hertz
        ),
        OscillationKind::AddedForGood => defmt::warn!(
            "the feedforward of {=str} made it swing, {=u16} um at {=f32} Hz, and is off until the outputs are off: check its kind and gains",
            axis,
            um,
            hertz
        ),
    }
}

fn print_fault(fault: Fault, reaction: &str) {
    defmt::error!(
        "fault {=u8} on {=str} at tick {=u32}, {=str}: {=str}; {=str}",
        fault.code.number(),
        fault.axis.map_or("the stage", AxisName::as_str),
        fault.tick,
        reaction,
        fault.code.cause(),
        fault.code.remedy()
    );
}

fn print_command(command: Command) {
    match command {
        Command::Enable => defmt::trace!("command: enable"),
        Command::Disable => defmt::trace!("command: disable"),
        Command::ResetFault => defmt::trace!("command: reset the fault"),
        Command::Run => defmt::trace!("command: run the plan"),
        Command::Stop => defmt::trace!("command: stop"),
        Command::Home(axis) => defmt::trace!("command: home {=str}", axis.as_str()),
        Command::Jog(axis, _) => defmt::trace!("command: jog {=str}", axis.as_str()),
        Command::StartMove(axis) => defmt::trace!("command: move {=str}", axis.as_str()),
        Command::StartStream => defmt::trace!("command: start the stream"),
        Command::StartInjection => defmt::trace!("command: start the injected voltage"),
    }
}

/// Logs the changes of the slow half.
pub(crate) struct EventLogger {
    changes: ChangeDetector,
    limiter: LogLimiter,
}

impl EventLogger {
    pub(crate) fn new() -> Self {
        Self {
            changes: ChangeDetector::default(),
            limiter: LogLimiter::new(),
        }
    }

    /// Logs the changes since the last call. Once a poll of the server.
    pub(crate) fn log<S: Scalar>(
        &mut self,
        server: &Server<'static, 'static, S, SettingsFlash>,
        seen: &Snapshot<S>,
        timing: TimingStatistics,
    ) {
        let tick = seen.tick;
        self.limiter.settle(tick);
        for change in self
            .changes
            .compare(tick, &seen.view, server.statistics(), timing)
        {
            if !self.limiter.admits(topic_of(change), tick) {
                continue;
            }
            match change {
                // The sum of what there is to say of settings needs the server.
                StateChange::Stored => defmt::info!(
                    "settings stored: {=usize} paths, from {=str}",
                    server.paths(),
                    server.provenance().as_str()
                ),
                StateChange::LateTicks(ticks) => defmt::warn!(
                    "{=u32} control ticks were late; the longest took {=u32} cycles of its timer",
                    ticks,
                    timing.longest_tick_cycles
                ),
                other => print_change(other),
            }
        }
    }
}

const fn topic_of(change: StateChange) -> Topic {
    match change {
        StateChange::Began(..)
        | StateChange::Ended(..)
        | StateChange::Homed(_)
        | StateChange::NotHomed(_) => Topic::Motion,
        StateChange::Greeted | StateChange::Silent | StateChange::Back => Topic::Link,
        StateChange::Applied | StateChange::Stored | StateChange::Captured(_) => Topic::Settings,
        StateChange::BadFrames(_)
        | StateChange::SamplesLost(_)
        | StateChange::EventsLost(_)
        | StateChange::LateTicks(_) => Topic::Losses,
    }
}

fn print_change(change: StateChange) {
    match change {
        StateChange::Began(axis, MotionMode::Home) => defmt::info!("{=str}: homing", axis.as_str()),
        StateChange::Homed(axis) => defmt::info!("{=str}: homed", axis.as_str()),
        StateChange::NotHomed(axis) => {
            defmt::warn!(
                "{=str}: homing ended without a home position",
                axis.as_str()
            );
        }
        StateChange::Began(axis, mode) => {
            defmt::debug!("{=str}: {=str}", axis.as_str(), verb(mode))
        }
        StateChange::Ended(axis, mode) => {
            defmt::debug!("{=str}: {=str} has ended", axis.as_str(), verb(mode));
        }
        StateChange::Greeted => defmt::info!("link: a host says hello"),
        StateChange::Silent => defmt::info!("link: the host has been silent for 3 s"),
        StateChange::Back => defmt::info!("link: the host is back"),
        StateChange::Applied => defmt::info!("settings applied"),
        StateChange::Captured(number) => defmt::info!("capture {=u16} is complete", number),
        StateChange::BadFrames(frames) => {
            defmt::warn!("link: {=u32} frames were damaged or no message", frames);
        }
        StateChange::SamplesLost(samples) => defmt::warn!(
            "link: {=u32} samples of the telemetry were lost: it asks for more than the link carries",
            samples
        ),
        StateChange::EventsLost(events) => {
            defmt::warn!("link: {=u32} notices to the host were lost", events);
        }
        StateChange::Stored | StateChange::LateTicks(_) => {}
    }
}

const fn verb(mode: MotionMode) -> &'static str {
    match mode {
        MotionMode::Hold => "holding",
        MotionMode::Plan => "moving",
        MotionMode::Jog => "jogging",
        MotionMode::Home => "homing",
        MotionMode::Stream => "following a stream",
        MotionMode::Stopping => "braking",
        MotionMode::OpenLoop => "injected voltage in open loop",
    }
}

/// Warns of a server that is not polled, from the task that feeds the watchdog.
pub(crate) fn warn_of_watchdog(silent_ms: u32) {
    defmt::warn!(
        "the server has made no progress for {=u32} ms: at twice that the watchdog ends this run",
        silent_ms
    );
}
