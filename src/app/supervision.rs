//! The supervising task: lets requests of the operator at the machine through, and finds what there is to tell.

use super::Snapshot;
use crate::app::supervisor::{Decision, Event, StageView, Supervisor};
use crate::law::safety::Command;
use crate::law::scalar::Scalar;

/// What one run of the supervising task found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supervised {
    /// For the control law's next tick.
    pub command: Option<Command>,
    /// What happened.
    pub events: [Option<Event>; 4],
    /// This run is the one in a second that tells how the axes follow.
    pub status_due: bool,
}

/// The supervising task's memory.
#[derive(Clone, Copy, Debug, Default)]
pub struct Supervision {
    supervisor: Supervisor,
    runs: u32,
}

/// Runs per status: one a second at 10 kHz.
const STATUS_RUNS: u32 = 1_000;

impl Supervision {
    /// Looks at the machine, and at a request of the operator if there is one; `commissioned` as
    /// [`Server::is_commissioned`](super::Server::is_commissioned) has it.
    pub fn run<S: Scalar>(
        &mut self,
        snapshot: &Snapshot<S>,
        request: Option<Command>,
        commissioned: bool,
    ) -> Supervised {
        let view = StageView {
            commissioned,
            ..snapshot.view
        };
        let Decision { command, events } = self.supervisor.step(view, request);
        self.runs = self.runs.wrapping_add(1);
        Supervised {
            command,
            events,
            status_due: self.runs.is_multiple_of(STATUS_RUNS),
        }
    }
}
