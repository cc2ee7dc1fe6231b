//! The half that is not realtime: supervision, server and settings in a thread, on the fast half's snapshots.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use heapless_queues::spsc::{Consumer, Producer, Queue};
use quadrant::app::glitch_monitor::GlitchReadings;
use quadrant::app::{Control, Poll, Snapshot, TimingStatistics};
use quadrant_host::machine::application::{BoardIdentity, SlowHalf, Start, start_halves};
use quadrant_host::machine::memory_flash::MemoryFlash;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_link::message::{Event, NumberType, text};
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};
use quadrant_sim::settings_file::{SettingsFile, defaults_at};

use crate::fault;
use crate::port::Port;

/// Time between two looks for a snapshot.
const PAUSE: Duration = Duration::from_micros(500);
/// The timer that measures ticks counts nanoseconds.
const IDENTITY: BoardIdentity = BoardIdentity {
    board: "linuxcnc",
    cycle_hz: 1_000_000_000,
    number: NumberType::F32,
};

/// Report of the fast half when a run of the slow one is due.
#[derive(Clone, Debug)]
pub(crate) struct Report {
    pub(crate) seen: Snapshot<f32>,
    pub(crate) timing: TimingStatistics,
    /// Number of the fault on the pins; 0 for none.
    pub(crate) fault: i32,
}

/// Gains of an axis that can be set live: P, I and D, viscous friction and inertia; V, mm and s.
pub(crate) type Gains = [f64; 5];

/// Gains that the pins ask for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wish {
    pub(crate) axis: AxisName,
    pub(crate) gains: Gains,
}

/// Result of a run of the slow half for the fast one.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    pub(crate) command: Option<Command>,
    pub(crate) frames: u32,
    pub(crate) glitches: GlitchReadings,
    /// The gains in force, and the number of wishes that they know of.
    pub(crate) gains: [Gains; 3],
    pub(crate) wishes: u32,
    /// The axes' previews, s.
    pub(crate) previews_s: [f64; 3],
}

/// One report: while it waits, newer ones are dropped, and the next is at most some ticks old.
pub(crate) type Reports = Queue<Report, 2>;
/// Answers that may wait for a tick.
pub(crate) type Answers = Queue<Answer, 8>;

/// Wishes that may wait.
pub(crate) type Wishes = Queue<Wish, 8>;

/// The fast half's ends of the queues.
pub(crate) struct FastEnds {
    pub(crate) wishes: Producer<'static, Wish, 8>,
    pub(crate) reports: Producer<'static, Report, 2>,
    pub(crate) answers: Consumer<'static, Answer, 8>,
    pub(crate) outputs_off: Arc<AtomicBool>,
    pub(crate) store_failed: Arc<AtomicBool>,
}

/// Files and address of a component.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place<'a> {
    /// The file that keeps stored settings; one that is not there is made.
    pub store: Option<&'a Path>,
    /// The settings (TOML) while nothing is stored; those of a machine that nobody has commissioned if there are none.
    pub defaults: Option<&'a Path>,
    /// Address of the link, `127.0.0.1:7711`; none for no link.
    pub address: Option<&'a str>,
    /// Control rate while nothing is stored and there are no defaults, Hz.
    pub rate_hz: f64,
}

/// The thread of the slow half; it ends with this.
#[derive(Debug)]
pub struct SlowThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for SlowThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // It has no result, and a panic has been printed.
            let _ = thread.join();
        }
    }
}

/// The parts of a component that has started.
pub(crate) struct Started {
    pub(crate) control: Control<'static, 'static, f32>,
    pub(crate) settings: StageSettings,
    pub(crate) ends: FastEnds,
    pub(crate) thread: SlowThread,
}

/// Starts the application, with the slow half in a thread of its own.
pub(crate) fn start(place: &Place<'_>) -> io::Result<Started> {
    let defaults = match place.defaults {
        // A pipe would be waited for.
        Some(path) if std::fs::metadata(path).is_ok_and(|data| !data.is_file()) => {
            let text = format!("defaults={}: it is no file", path.display());
            return Err(io::Error::other(text));
        }
        Some(path) => SettingsFile::read(path).map_err(io::Error::other)?.stage,
        None => StageSettings {
            rate_hz: place.rate_hz,
            ..defaults_at(place.rate_hz)
        },
    };
    let flash = place.store.map(MemoryFlash::kept_in).transpose()?;
    let flash = flash.unwrap_or_default();
    let begin = Start {
        defaults: &defaults,
        plan: &PlanSettings::default(),
        fault: None,
        identity: IDENTITY,
    };
    let (control, half, settings) = start_halves(begin, flash).map_err(io::Error::other)?;
    let port = Port::listen(place.address)?;
    let (reports, reports_out) = Box::leak(Box::new(Reports::new())).split();
    let (answers_in, answers) = Box::leak(Box::new(Answers::new())).split();
    let (wishes, wishes_out) = Box::leak(Box::new(Wishes::new())).split();
    let stop = Arc::new(AtomicBool::new(false));
    let outputs_off = Arc::new(AtomicBool::new(true));
    let store_failed = Arc::new(AtomicBool::new(false));
    let slow = Slow {
        half,
        port,
        reports: reports_out,
        answers: answers_in,
        wishes: wishes_out,
        served: 0,
        fault: 0,
        outputs_off: Arc::clone(&outputs_off),
        store_failed: Arc::clone(&store_failed),
    };
    let stopped = Arc::clone(&stop);
    let thread = thread::Builder::new()
        .name("quadrant".into())
        .spawn(move || slow.run(&stopped))?;
    Ok(Started {
        control,
        settings,
        ends: FastEnds {
            wishes,
            reports,
            answers,
            outputs_off,
            store_failed,
        },
        thread: SlowThread {
            stop,
            thread: Some(thread),
        },
    })
}

/// The gains of an axis; the viscous one is the mean of both directions.
fn gains_of(axis: &AxisSettings) -> Gains {
    let pid = &axis.feedback.pid;
    let gains = &axis.feedforward.gains;
    let sliding = &axis.friction.sliding;
    let viscous = sliding.positive.viscous_v_s_per_mm + sliding.negative.viscous_v_s_per_mm;
    [
        pid.kp_v_per_mm,
        pid.ki_v_per_mm_s,
        pid.kd_v_s_per_mm,
        0.5 * gains.viscous * viscous,
        gains.inertia_v_s2_per_mm,
    ]
}

/// Sets the gains of an axis. A viscous one that stays leaves the directions as they differ.
fn set(axis: &mut AxisSettings, gains: Gains) {
    let [.., viscous, _] = gains_of(axis);
    let pid = &mut axis.feedback.pid;
    let asked;
    [
        pid.kp_v_per_mm,
        pid.ki_v_per_mm_s,
        pid.kd_v_s_per_mm,
        asked,
        axis.feedforward.gains.inertia_v_s2_per_mm,
    ] = gains;
    if asked != viscous {
        axis.feedforward.gains.viscous = 1.0;
        axis.friction.sliding.positive.viscous_v_s_per_mm = asked;
        axis.friction.sliding.negative.viscous_v_s_per_mm = asked;
    }
}

/// Everything that the thread owns.
struct Slow {
    half: SlowHalf<f32>,
    port: Port,
    reports: Consumer<'static, Report, 2>,
    answers: Producer<'static, Answer, 8>,
    wishes: Consumer<'static, Wish, 8>,
    /// Wishes served so far; wraps.
    served: u32,
    /// The fault that was reported last.
    fault: i32,
    outputs_off: Arc<AtomicBool>,
    /// The file does not keep what a host has stored.
    store_failed: Arc<AtomicBool>,
}

impl Slow {
    fn run(mut self, stop: &AtomicBool) {
        while !stop.load(Ordering::Relaxed) {
            match self.reports.dequeue() {
                Some(report) => self.serve(&report),
                None => thread::sleep(PAUSE),
            }
        }
    }

    /// One run on a report.
    fn serve(&mut self, report: &Report) {
        let off = self.outputs_off.load(Ordering::Relaxed);
        self.half.flash().set_outputs_off(off);
        while let Some(wish) = self.wishes.dequeue() {
            self.served = self.served.wrapping_add(1);
            if let Err(error) = self
                .half
                .server()
                .change(wish.axis, |axis| set(axis, wish.gains))
            {
                eprintln!("quadrant: the gains of {} stay: {error}", wish.axis);
            }
        }
        self.report_fault(report);
        let after = self.half.run(&report.seen, report.timing, &mut self.port);
        if after == Poll::Reboot {
            eprintln!(
                "quadrant: a host asks for a restart: unload the component and load it again"
            );
            self.half.server().go_on();
        }
        let failure = self.half.flash().failure();
        let failed = self.store_failed.swap(failure.is_some(), Ordering::Relaxed);
        if let Some(failure) = failure
            && !failed
        {
            eprintln!("quadrant: {failure}");
        }
        self.answer();
    }

    /// Prints a fault that appears on the pins, and sends one that the law does not know to the host.
    fn report_fault(&mut self, report: &Report) {
        let before = std::mem::replace(&mut self.fault, report.fault);
        if report.fault == before {
            return;
        }
        let Some([cause, remedy]) = fault::text(report.fault) else {
            return;
        };
        let number = report.fault;
        eprintln!("quadrant: fault {number}: {cause}; {remedy}");
        if number >= fault::NOT_ENABLED {
            let text = text(format_args!(
                "fault {number} under LinuxCNC: {cause}; {remedy}"
            ));
            self.half
                .server()
                .push_event(report.seen.tick, Event::Refused(text));
        }
    }

    /// Passes the commands of this run on, as far as there is room; the rest goes with the next.
    fn answer(&mut self) {
        for round in 0.. {
            if !self.answers.ready() {
                return;
            }
            let command = self.half.take_command();
            if command.is_none() && round > 0 {
                return;
            }
            let axes = &self.half.server().acting().axes;
            let gains = axes.each_ref().map(gains_of);
            let previews_s = axes.each_ref().map(|axis| axis.feedforward.preview_s);
            let answer = Answer {
                gains,
                previews_s,
                wishes: self.served,
                command,
                frames: self.half.frames(),
                glitches: self.half.glitch_readings(),
            };
            // There is room: only this side fills it.
            let _ = self.answers.enqueue(answer);
        }
    }
}
