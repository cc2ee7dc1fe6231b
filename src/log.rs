//! What the firmware tells a person, through defmt: one line per event.
//!
//! `error`: the outputs are off, or will be. `warn`: somebody should look. `info`: something was done. `debug`: how it goes.
//! `trace`: every command. `docs/log.md` shows a run and says what the lines mean.

use core::sync::atomic::{AtomicU32, Ordering};

use embedded_storage::nor_flash::NorFlash;
use quadrant::app::rate_limiter::RateLimiter;
use quadrant::app::supervisor::Event;
use quadrant::app::{Journal, Meters, News, Server, Snapshot};
use quadrant::axis::CourseMode;
use quadrant::hal::ResetCause;
use quadrant::safety::{AxisName, Command, Fault};
use quadrant::scalar::{Quantity, Scalar};
use quadrant::settings::StageSettings;

use crate::board;

/// Lines of a kind in a second at 10 kHz: more are counted, not printed.
const LINES: u16 = 5;
const SECOND_TICKS: u32 = 10_000;

/// Lines for which the queue to the log had no room.
static LOST: AtomicU32 = AtomicU32::new(0);

/// What the supervising task has to say to a person.
#[derive(Clone, Copy)]
pub(crate) enum Line<S> {
    /// Something happened.
    Event(Event),
    /// A command went to the control law.
    Command(Command),
    /// All is as it was; the tracking errors.
    Status([S; 3]),
}

/// Says who starts, on what, and why.
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

/// Says which settings are in force.
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

/// Warns if the settings in force are the default ones, and says what to do.
pub(crate) fn not_commissioned(settings: &StageSettings) {
    if !settings.is_commissioned() {
        defmt::warn!(
            "not commissioned: no axis has a law, the outputs stay off; run `quadrant commission`, or load settings and store them"
        );
    }
}

/// Counts a line that found no room.
pub(crate) fn lose_line() {
    LOST.store(
        LOST.load(Ordering::Relaxed).wrapping_add(1),
        Ordering::Relaxed,
    );
}

/// What lines are about: each has its own share of the log.
#[derive(Clone, Copy)]
enum Topic {
    State,
    Refusals,
    Faults,
    Motion,
    Link,
    Settings,
    Losses,
}

const TOPICS: [&str; 7] = [
    "the outputs",
    "refusals",
    "faults",
    "motion",
    "the link",
    "settings and captures",
    "losses",
];

/// Thins what a task prints.
struct Thinner {
    limiter: RateLimiter<{ TOPICS.len() }>,
}

impl Thinner {
    const fn new() -> Self {
        Self {
            limiter: RateLimiter::new(SECOND_TICKS, LINES),
        }
    }

    /// Says how many lines were left out, when their time is over.
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

/// Prints what the supervising task found.
pub(crate) struct Printer {
    thinner: Thinner,
    lost: u32,
}

impl Printer {
    pub(crate) const fn new() -> Self {
        Self {
            thinner: Thinner::new(),
            lost: 0,
        }
    }

    pub(crate) fn print<S: Scalar>(&mut self, tick: u32, line: Line<S>) {
        let lost = LOST.load(Ordering::Relaxed);
        if lost != self.lost && self.thinner.admits(Topic::Losses, tick) {
            defmt::warn!(
                "{=u32} lines were lost: they came faster than they are printed",
                lost.wrapping_sub(self.lost)
            );
            self.lost = lost;
        }
        match line {
            Line::Event(event) => {
                if self.thinner.admits(topic(event), tick) {
                    print_event(event);
                }
            }
            Line::Command(command) => print_command(command),
            Line::Status(errors) => {
                self.thinner.settle(tick);
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
        Event::MotionStarted | Event::MotionFinished => Topic::Motion,
        Event::Refused(..) => Topic::Refusals,
        Event::Faulted(_) | Event::Stopping(_) | Event::Held(_) => Topic::Faults,
    }
}

fn print_event(event: Event) {
    match event {
        Event::Enabled => defmt::info!("outputs enabled"),
        Event::Disabled => defmt::info!("outputs disabled"),
        Event::MotionStarted => defmt::info!("motion started"),
        Event::MotionFinished => defmt::info!("motion finished"),
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

/// Prints what the server went through.
pub(crate) struct Narrator {
    journal: Journal,
    thinner: Thinner,
}

impl Narrator {
    pub(crate) fn new() -> Self {
        Self {
            journal: Journal::default(),
            thinner: Thinner::new(),
        }
    }

    /// Tells what has changed since the last time. Once a poll of the server.
    pub(crate) fn tell<S: Scalar, F: NorFlash>(
        &mut self,
        server: &Server<'_, '_, S, F>,
        seen: &Snapshot<S>,
        meters: Meters,
    ) {
        let tick = seen.tick;
        self.thinner.settle(tick);
        for news in self.journal.look(tick, &seen.view, server.vitals(), meters) {
            if !self.thinner.admits(topic_of(news), tick) {
                continue;
            }
            match news {
                // The sum of what there is to say of settings needs the server.
                News::Stored => defmt::info!(
                    "settings stored: {=usize} paths, from {=str}",
                    server.paths(),
                    server.provenance().as_str()
                ),
                News::LateTicks(ticks) => defmt::warn!(
                    "{=u32} control ticks ended late; the longest took {=u32} cycles of its timer",
                    ticks,
                    meters.longest_tick_cycles
                ),
                other => print_news(other),
            }
        }
    }
}

const fn topic_of(news: News) -> Topic {
    match news {
        News::Began(..) | News::Ended(..) | News::Homed(_) | News::NotHomed(_) => Topic::Motion,
        News::Greeted | News::Silent | News::Back => Topic::Link,
        News::Applied | News::Stored | News::Captured(_) => Topic::Settings,
        News::BadFrames(_) | News::SamplesLost(_) | News::EventsLost(_) | News::LateTicks(_) => {
            Topic::Losses
        }
    }
}

fn print_news(news: News) {
    match news {
        News::Began(axis, CourseMode::Home) => defmt::info!("{=str}: homing", axis.as_str()),
        News::Homed(axis) => defmt::info!("{=str}: homed", axis.as_str()),
        News::NotHomed(axis) => {
            defmt::warn!(
                "{=str}: homing ended without a home position",
                axis.as_str()
            );
        }
        News::Began(axis, mode) => defmt::debug!("{=str}: {=str}", axis.as_str(), verb(mode)),
        News::Ended(axis, mode) => {
            defmt::debug!("{=str}: {=str} has ended", axis.as_str(), verb(mode));
        }
        News::Greeted => defmt::info!("link: a host says hello"),
        News::Silent => defmt::info!("link: the host has been silent for 3 s"),
        News::Back => defmt::info!("link: the host is back"),
        News::Applied => defmt::info!("settings applied"),
        News::Captured(number) => defmt::info!("capture {=u16} is complete", number),
        News::BadFrames(frames) => {
            defmt::warn!("link: {=u32} frames were damaged or no message", frames);
        }
        News::SamplesLost(samples) => defmt::warn!(
            "link: {=u32} samples of the telemetry were lost: it asks for more than the link carries",
            samples
        ),
        News::EventsLost(events) => {
            defmt::warn!("link: {=u32} notices to the host were lost", events);
        }
        News::Stored | News::LateTicks(_) => {}
    }
}

const fn verb(mode: CourseMode) -> &'static str {
    match mode {
        CourseMode::Hold => "holding",
        CourseMode::Plan => "moving",
        CourseMode::Jog => "jogging",
        CourseMode::Home => "homing",
        CourseMode::Stream => "following a stream",
        CourseMode::Stopping => "braking",
        CourseMode::OpenLoop => "injected voltage in open loop",
    }
}

/// Warns that the server has not been polled for so long, from the task that would let the watchdog bite.
pub(crate) fn warn_of_watchdog(silent_ms: u32) {
    defmt::warn!(
        "the server has made no progress for {=u32} ms: at twice that the watchdog ends this run",
        silent_ms
    );
}
