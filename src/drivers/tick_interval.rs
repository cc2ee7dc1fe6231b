//! The time from one control tick to the next.

/// Finds control ticks that begin late: something masked their interrupt, or ticks were lost.
#[derive(Clone, Debug)]
pub struct TickInterval {
    longest: u32,
    last: u32,
}

impl TickInterval {
    /// A tick is due every `period` cycles of a counter that never stops, the first one that long after `now`.
    ///
    /// A tick may begin a quarter of the period late, and no later: the positions that it reads are those of that moment,
    /// and the law takes them for those of its tick.
    pub fn new(period: u32, now: u32) -> Self {
        Self {
            longest: period.saturating_add(period / 4),
            last: now,
        }
    }

    /// A tick begins at `now`. Returns true if that is too long after the one before.
    #[inline(always)]
    pub fn is_late(&mut self, now: u32) -> bool {
        let since = now.wrapping_sub(self.last);
        self.last = now;
        since > self.longest
    }
}
