//! The stage as telemetry and capture see it.

use crate::law::scalar::Scalar;
use crate::law::stage::StageState;

/// Everything that can be read after a tick.
#[derive(Clone, Copy, Debug)]
pub struct Observation<'a, S: Scalar, const N: usize> {
    /// The stage as the tick left it.
    pub stage: &'a StageState<S, N>,
    /// Duration of the tick before, cycles of the board's tick timer.
    pub elapsed_cycles: u32,
    /// The tick was given a command.
    pub commanded: bool,
}

impl<S: Scalar, const N: usize> Observation<'_, S, N> {
    /// The number of the tick that has just ended, as a fault of that tick has it.
    #[inline(always)]
    pub const fn tick(&self) -> u32 {
        self.stage.tick().wrapping_sub(1)
    }
}
