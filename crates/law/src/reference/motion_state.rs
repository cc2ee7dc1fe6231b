//! The memory of a motion.

use crate::units::Position;

/// The running sums of a move, from jerk to position, and the next impulse.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Chain {
    pub(super) jerk: i128,
    pub(super) acceleration: i128,
    pub(super) velocity: i128,
    pub(super) position: i128,
    pub(super) impulse: u8,
}

/// The memory of a motion: its origin and its progress.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionState {
    pub(super) origin: Position,
    pub(super) elapsed: u32,
    pub(super) phase: u64,
    pub(super) chain: Chain,
}

impl MotionState {
    /// Before the first tick of a motion that starts at `origin`.
    pub fn start(origin: Position) -> Self {
        Self {
            origin,
            ..Self::default()
        }
    }

    /// Ticks since the start; stays at the largest number rather than wrap.
    pub fn elapsed(&self) -> u32 {
        self.elapsed
    }
}
