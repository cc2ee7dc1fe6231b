//! The rate limiter of the log: a number of lines of a kind in a window, then a count of the rest.

/// The state of one kind of lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Kind {
    /// The tick at which the present window began.
    begun: u32,
    /// Lines let through in this window.
    printed: u16,
    /// Lines left out and not reported yet.
    left_out: u32,
}

/// Lets at most `lines` lines of each of `KINDS` kinds through in `window_ticks` ticks.
///
/// A fixed cost and no memory that grows, at any rate. Ask [`overdue`](Self::overdue) before
/// [`admits`](Self::admits), and now and then while nothing happens: what was left out is reported then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RateLimiter<const KINDS: usize> {
    window_ticks: u32,
    lines: u16,
    kinds: [Kind; KINDS],
}

impl<const KINDS: usize> RateLimiter<KINDS> {
    /// Returns a limiter before the first line.
    pub const fn new(window_ticks: u32, lines: u16) -> Self {
        let kind = Kind {
            begun: 0,
            printed: 0,
            left_out: 0,
        };
        Self {
            window_ticks,
            lines,
            kinds: [kind; KINDS],
        }
    }

    /// Returns true if a line of a kind may be printed at a tick. Kinds from `KINDS` on are not limited.
    pub fn admits(&mut self, kind: usize, tick: u32) -> bool {
        let Some(of_kind) = self.kinds.get_mut(kind) else {
            return true;
        };
        if tick.wrapping_sub(of_kind.begun) >= self.window_ticks {
            of_kind.begun = tick;
            of_kind.printed = 0;
        }
        let admitted = of_kind.printed < self.lines;
        if admitted {
            of_kind.printed += 1;
        } else {
            of_kind.left_out = of_kind.left_out.saturating_add(1);
        }
        admitted
    }

    /// Returns a kind whose window is over, and the number of its lines left out; each is reported once.
    pub fn overdue(&mut self, tick: u32) -> Option<(usize, u32)> {
        let window = self.window_ticks;
        let over = |kind: &Kind| kind.left_out != 0 && tick.wrapping_sub(kind.begun) >= window;
        let (index, kind) = self
            .kinds
            .iter_mut()
            .enumerate()
            .find(|(_, kind)| over(kind))?;
        Some((index, core::mem::take(&mut kind.left_out)))
    }
}
