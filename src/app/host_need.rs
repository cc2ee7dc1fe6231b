//! The host that a motion needs: every one that it has started, or, if the settings say so, one that has no end of its own or
//! that it feeds.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::motion::MotionMode;
use quadrant_law::safety::HostNeeded;
use quadrant_law::scalar::Scalar;
use quadrant_law::stage::{Plan, StageState};

/// Ticks without a valid request after which a host counts as lost: half a second.
pub const fn link_timeout_ticks(rate_hz: u32) -> u32 {
    rate_hz / 2
}

/// Bits of all axes.
const AXES: u8 = 0b111;

/// The motions that need their host, and how long it has been silent. Kept by the control interrupt, so that no other task
/// can keep it from ending them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HostNeed {
    timeout_ticks: u32,
    /// A bit for each axis.
    motions: u8,
    /// Valid requests so far.
    frames: u32,
    /// Ticks since the last one.
    silent: u32,
}

impl HostNeed {
    /// No motion, at a control rate.
    pub(super) const fn new(rate_hz: u32) -> Self {
        Self {
            timeout_ticks: link_timeout_ticks(rate_hz),
            motions: 0,
            frames: 0,
            silent: 0,
        }
    }

    /// Receives the number of valid requests so far.
    #[inline(always)]
    pub(super) fn note_requests(&mut self, frames: u32) {
        self.silent = if self.frames == frames {
            self.silent.saturating_add(1)
        } else {
            0
        };
        self.frames = frames;
    }

    /// True if a motion needs its host.
    #[inline(always)]
    pub(super) const fn is_needed(&self) -> bool {
        self.motions != 0
    }

    /// True if a motion needs its host, and it is silent.
    #[inline(always)]
    pub(super) const fn is_lost(&self) -> bool {
        self.is_needed() && self.silent > self.timeout_ticks
    }

    /// Takes note of a command of the host.
    pub(super) fn start<S: Scalar>(
        &mut self,
        command: Command,
        needed: HostNeeded,
        plan: &Plan<S>,
    ) {
        let every = needed == HostNeeded::EveryMotion;
        let of_plan = || {
            AxisName::ALL
                .into_iter()
                .filter(|&axis| every || !plan[axis].ends())
                .fold(0, |bits, axis| bits | bit(axis))
        };
        self.motions |= match command {
            // An injection may start the plan, too; of axes that stay where they are, nothing is kept.
            Command::Run | Command::StartInjection => of_plan(),
            Command::StartMove(axis) | Command::Home(axis) if every => bit(axis),
            Command::Jog(axis, _) => bit(axis),
            Command::StartStream => AXES,
            _ => 0,
        };
    }

    /// Forgets the motions that have ended, after a tick.
    #[cold]
    #[inline(never)]
    pub(super) fn update<S: Scalar>(&mut self, state: &StageState<S, FIRMWARE_ELEMENTS>) {
        for (name, axis) in state.axes().named() {
            let moves = matches!(
                axis.mode(),
                MotionMode::Jog | MotionMode::Plan | MotionMode::Stream | MotionMode::Home
            );
            if !moves {
                self.motions &= !bit(name);
            }
        }
    }
}

/// Bit of an axis.
const fn bit(axis: AxisName) -> u8 {
    1 << axis as u8
}
