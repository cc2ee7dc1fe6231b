//! Keeps a log readable: so many lines of a kind in a while, then how many more there were.

/// What is kept of a kind of lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Kind {
    /// The tick at which the present while began.
    begun: u32,
    /// Lines let through since.
    printed: u16,
    /// Lines left out that nobody has been told of.
    left_out: u32,
}

/// Lets at most `lines` lines of each of `KINDS` kinds through in `window_ticks` ticks.
///
/// A fixed cost and no memory that grows, whatever the rate. Ask [`overdue`](Self::overdue) before
/// [`admits`](Self::admits), and now and then while nothing happens: what was left out is reported then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RateLimiter<const KINDS: usize> {
    window_ticks: u32,
    lines: u16,
    kinds: [Kind; KINDS],
}

impl<const KINDS: usize> RateLimiter<KINDS> {
    /// Nothing was printed yet.
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

    /// Whether a line of a kind, below `KINDS`, may be printed at a tick. Lines of other kinds may.
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

    /// A kind whose while is over and of which lines were left out, and how many; it is not reported twice.
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
