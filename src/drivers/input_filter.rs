//! The digital filter of a timer's inputs, as STM32 timers have it: an edge counts once N samples in a row agree.
//!
//! Source: RM0390, TIMx_CCMR1, bits ICxF, and TIMx_CR1, bits CKD.

/// Settings of ICxF: by how much the sampling clock is divided, and how many samples must agree. The first four sample
/// the timer's own clock, the others the filter clock that CKD makes of it.
const SETTINGS: [(u32, u32); 16] = [
    (1, 1),
    (1, 2),
    (1, 4),
    (1, 8),
    (2, 6),
    (2, 8),
    (4, 6),
    (4, 8),
    (8, 6),
    (8, 8),
    (16, 5),
    (16, 6),
    (16, 8),
    (32, 5),
    (32, 6),
    (32, 8),
];

/// Settings below this sample the timer's clock, independent of CKD.
const UNDIVIDED: usize = 4;

/// A timer's filter: the value of ICxF, and what it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InputFilter {
    /// The value of ICxF, 0 to 15.
    pub icf: u8,
    /// Pulses shorter than this do not pass, ns, rounded up. Edges are late by as much.
    pub rejects_ns: u32,
}

impl InputFilter {
    /// The strongest filter that lets every level of at least `level_ns` pass; `timer_hz` is the timer's clock, and
    /// CKD divides it by `ckd` (1, 2 or 4) for the filter.
    ///
    /// Levels pass with a sample to spare, as the signal is not in step with the clock.
    pub const fn strongest(timer_hz: u32, ckd: u32, level_ns: u32) -> Self {
        let mut best = Self {
            icf: 0,
            rejects_ns: 0,
        };
        let mut icf = 1;
        while icf < SETTINGS.len() {
            let (divider, samples) = SETTINGS[icf];
            let ckd = if icf < UNDIVIDED { 1 } else { ckd };
            let passes_ns = nanoseconds((samples + 1) * divider * ckd, timer_hz);
            let rejects_ns = nanoseconds(samples * divider * ckd, timer_hz);
            if passes_ns <= level_ns && rejects_ns > best.rejects_ns {
                best = Self {
                    icf: icf as u8,
                    rejects_ns,
                };
            }
            icf += 1;
        }
        best
    }
}

/// The time of some clock cycles, ns, rounded up.
const fn nanoseconds(cycles: u32, clock_hz: u32) -> u32 {
    (cycles as u64 * 1_000_000_000).div_ceil(clock_hz as u64) as u32
}

/// The fastest an encoder may count, per second: an axis at 250 mm/s with 0.5 um per count, and twice that, as the
/// control law believes an encoder up to twice the axis' largest velocity.
pub const FASTEST_COUNTS_PER_S: u32 = 1_000_000;

/// The shortest level of a line of a quadrature encoder, ns, at `counts_per_s` (above zero): two counts if the signal is
/// perfect; taken as half of that, as mark, space and phase of a real one are off.
pub const fn shortest_level_ns(counts_per_s: u32) -> u32 {
    1_000_000_000 / counts_per_s
}
