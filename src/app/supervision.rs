//! The supervising task: passes or refuses requests of the operator at the machine, and finds events to report.

use super::Snapshot;
use super::friction_monitor::FrictionMonitor;
use super::glitch_monitor::{GlitchEvent, GlitchMonitor, GlitchReadings, MAX_GLITCH_EVENTS};
use super::oscillation_report::OscillationReport;
use quadrant_law::command::Command;
use quadrant_law::scalar::Scalar;
use quadrant_law::supervisor::{Decision, Event, Supervisor};

/// The result of one run of the supervising task.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Supervised {
    /// The command for the control law's next tick.
    pub command: Option<Command>,
    /// The events found.
    pub events: heapless::Vec<Event, MAX_EVENTS>,
    /// Glitches and circles that have ended.
    pub glitches: heapless::Vec<GlitchEvent, MAX_GLITCH_EVENTS>,
    /// True once a second: the tracking errors are due in the log.
    pub status_due: bool,
}

/// Most events of one run: those of a [`Decision`], and a change of friction and an oscillation of each axis.
const MAX_EVENTS: usize = 11;

/// The supervising task's state.
#[derive(Clone, Debug)]
pub struct Supervision {
    supervisor: Supervisor,
    glitches: GlitchMonitor,
    friction: FrictionMonitor,
    oscillations: OscillationReport,
    runs: u32,
}

/// Runs per status: one a second at 10 kHz.
const STATUS_RUNS: u32 = 1_000;

impl Supervision {
    /// Returns the task before its first run. `resolution_mm` are the lengths of the encoders' counts.
    pub fn new(resolution_mm: [f64; 3]) -> Self {
        let resolution_mm = resolution_mm.map(|length| length as f32);
        Self {
            supervisor: Supervisor::default(),
            glitches: GlitchMonitor::new(resolution_mm),
            friction: FrictionMonitor::default(),
            oscillations: OscillationReport::new(resolution_mm),
            runs: 0,
        }
    }

    /// Judges the machine, and a request of the operator if there is one.
    pub fn run<S: Scalar>(
        &mut self,
        snapshot: &Snapshot<S>,
        request: Option<Command>,
    ) -> Supervised {
        let Decision { command, events } = self.supervisor.step(snapshot.view, request);
        self.runs = self.runs.wrapping_add(1);
        let changes = self
            .friction
            .step(snapshot)
            .map(|change| change.map(Event::FrictionChanged));
        let oscillations = self
            .oscillations
            .step(snapshot)
            .map(|found| found.map(Event::Oscillated));
        Supervised {
            command,
            events: events
                .into_iter()
                .chain(changes)
                .chain(oscillations)
                .flatten()
                .collect(),
            glitches: self.glitches.step(snapshot),
            status_due: self.runs.is_multiple_of(STATUS_RUNS),
        }
    }

    /// The glitch monitor's latest results, for [`Control::show_glitches`](super::Control::show_glitches).
    pub const fn glitch_readings(&self) -> GlitchReadings {
        self.glitches.readings()
    }
}
