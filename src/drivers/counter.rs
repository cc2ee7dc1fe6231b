//! Counters of 16 bits, made as wide as the control law wants them, and what a capture register says of them.

/// A 16-bit counter that is read often enough, as a 32-bit one.
///
/// "Often enough" is at least once in 32767 counts either way: at 10 kHz and 0.5 um per count that is 160 m/s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExtendedCounter {
    count: u32,
}

impl ExtendedCounter {
    /// A counter that stands at `count`.
    #[inline(always)]
    pub const fn at(count: u32) -> Self {
        Self { count }
    }

    /// The count now, 32 bits wide and wrapping, from the 16 bits read.
    #[inline(always)]
    pub const fn read(&mut self, raw: u16) -> u32 {
        let moved = raw.wrapping_sub(self.count as u16).cast_signed();
        self.count = self.count.wrapping_add_signed(moved as i32);
        self.count
    }

    /// The count at the last [`read`](Self::read).
    #[inline(always)]
    pub const fn count(&self) -> u32 {
        self.count
    }

    /// The count at which the hardware captured `raw`, at most 32767 counts away from the last [`read`](Self::read).
    #[inline(always)]
    pub const fn captured(&self, raw: u16) -> u32 {
        let away = raw.wrapping_sub(self.count as u16).cast_signed();
        self.count.wrapping_add_signed(away as i32)
    }
}
