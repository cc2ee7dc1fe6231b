//! Steps with a sense, of a counter that only counts upwards: a timer counts the steps, and captures its count at every edge of the
//! direction line.

/// State of a timer that counts step and direction, since it was read last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StepReading {
    /// The direction line, read before the rest: true while it is on.
    pub direction: bool,
    /// Steps so far, whatever their sense.
    pub raw: u16,
    /// The count at an edge of the direction line, if there was one.
    pub turned: Option<u16>,
    /// There was more than one edge.
    pub overrun: bool,
}

/// The sum of steps, each in its sense. A step with the direction line on counts backwards.
///
/// It must be read at least once in 32767 steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepCounter {
    raw: u16,
    count: u32,
    backwards: bool,
    /// The level was not that of `backwards` at the last reading, and its edge was not captured yet.
    differs: bool,
}

impl StepCounter {
    /// A sum of zero, for a counter that stands at `raw`, with the direction line on or off.
    pub const fn new(raw: u16, direction: bool) -> Self {
        Self {
            raw,
            count: 0,
            backwards: direction,
            differs: false,
        }
    }

    /// The sum, 32 bits wide and wrapping, and true if the sense of some steps is not known.
    ///
    /// An edge that comes between the reading of the count and that of the capture is allowed for: what it counts too much, the next
    /// reading takes back. So is one whose capture is still behind the input's filter, through which the level does not come.
    #[inline(always)]
    pub const fn read(&mut self, seen: StepReading) -> (u32, bool) {
        let mut lost = seen.overrun;
        if let Some(turned) = seen.turned {
            self.add(turned);
            self.backwards = !self.backwards;
            self.differs = false;
        } else if seen.direction == self.backwards {
            self.differs = false;
        } else if self.differs {
            lost = true;
            self.backwards = seen.direction;
            self.differs = false;
        } else {
            self.differs = true;
        }
        self.add(seen.raw);
        (self.count, lost)
    }

    #[inline(always)]
    const fn add(&mut self, raw: u16) {
        let steps = raw.wrapping_sub(self.raw).cast_signed() as i32;
        self.raw = raw;
        let signed = if self.backwards { -steps } else { steps };
        self.count = self.count.wrapping_add_signed(signed);
    }
}
