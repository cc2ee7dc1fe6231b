//! The judgement that an axis stands while its outputs are off, by an encoder that may be noisy.
//!
//! The measured speed is filtered over 8 ticks. Noise of three counts RMS leaves 0.4 counts per tick of it, which is more than a slow
//! motion makes. Noise changes that speed up and down from tick to tick; a motion, and a jump that the filter forgets, change it one way. So
//! the size of the changes that alternate is measured, and where it is that of noise, the speed is filtered over 64 ticks more: of three
//! counts RMS 0.02 counts per tick are left.

use super::monitor::speed_limit;

/// The second filter works over 2^6 ticks.
const FILTER_BITS: u32 = 6;
/// Least size of the alternating changes with which the second filter is used, 2^-8 counts per tick: that of one count RMS is 12.
const MIN_NOISE: u32 = 8;

/// The judgement of whether an axis stands.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Standstill {
    /// Largest speed, 2^-8 counts per tick.
    limit: u32,
}

/// The memory of the judgement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct StandstillState {
    /// Speed of the last tick, 2^-8 counts per tick.
    last: i32,
    /// Change of the speed up to the last tick.
    change: i32,
    /// Speed by the second filter, 2^-14 counts per tick: it stays below 2^30.
    filtered: i32,
    /// Size of the alternating changes: of as many of all changes larger ones as of others.
    noise: u32,
}

impl Standstill {
    /// An axis that stands at any speed.
    pub(crate) const ALWAYS: Self = Self { limit: u32::MAX };

    /// A limit in counts per tick; half a count is added for the quantisation. Settings time only.
    pub(crate) fn new(counts_per_tick: f64) -> Self {
        Self {
            limit: speed_limit(counts_per_tick),
        }
    }

    /// Takes the speed of a tick, 2^-8 counts per tick, and returns true if the axis stands. `begins` where the ticks before were not taken.
    pub(crate) fn step(&self, state: &mut StandstillState, speed: i32, begins: bool) -> bool {
        if begins {
            *state = StandstillState {
                last: speed,
                change: 0,
                filtered: speed << FILTER_BITS,
                noise: state.noise,
            };
        }
        let change = speed.wrapping_sub(state.last);
        let alternates = (change ^ state.change) < 0;
        state.noise = if alternates && change.unsigned_abs() > state.noise {
            state.noise + 1
        } else {
            state.noise.saturating_sub(1)
        };
        state.last = speed;
        state.change = change;
        let filtered = state.filtered >> FILTER_BITS;
        state.filtered += speed - filtered;
        let judged = if state.noise > MIN_NOISE {
            filtered
        } else {
            speed
        };
        judged.unsigned_abs() <= self.limit
    }
}
