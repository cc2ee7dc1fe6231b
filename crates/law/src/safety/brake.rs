//! A holding brake (safe brake control, SBC, of IEC 61800-5-2): a current releases it, springs apply it.
//!
//! ```text
//!   Applied --enabled--> Releasing --release time--> Released --Disable, or the end of a stop--> Applying --apply time--> off
//!      ^                                                                                                        |
//!      +------------- outputs off, for any reason and in the same tick <---------------------------------------+
//! ```
//!
//! The law holds the axes while the brake moves, so that a hanging axis does not fall between brake and law. No motion
//! starts meanwhile.

/// The times that the brake takes, in ticks; zero, as without a brake, for none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Brake {
    /// From the current to a brake that does not hold.
    pub release_ticks: u32,
    /// From the end of the current to a brake that holds.
    pub apply_ticks: u32,
}

/// The state of the brake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BrakeState {
    /// No current: it holds.
    #[default]
    Applied,
    /// Current on, for so many ticks before it no longer holds.
    Releasing(u32),
    /// Current on: it does not hold.
    Released,
    /// Current off, for so many ticks before it holds.
    Applying(u32),
}

impl BrakeState {
    /// True if the current is on.
    pub const fn has_current(self) -> bool {
        matches!(self, Self::Releasing(_) | Self::Released)
    }

    /// True while the brake takes its time.
    pub const fn is_moving(self) -> bool {
        matches!(self, Self::Releasing(_) | Self::Applying(_))
    }

    /// Begins to release it.
    pub(crate) const fn release(&mut self, brake: Brake) {
        *self = Self::Releasing(brake.release_ticks);
    }

    /// Begins to apply it; returns false if there is no time to wait for.
    pub(crate) const fn apply(&mut self, brake: Brake) -> bool {
        if !matches!(self, Self::Applying(_)) {
            *self = Self::Applying(brake.apply_ticks);
        }
        brake.apply_ticks > 0
    }

    /// Lets a tick pass; returns true if the brake holds now and the outputs can go off.
    pub(crate) const fn step(&mut self) -> bool {
        *self = match *self {
            Self::Releasing(0) => Self::Released,
            Self::Releasing(left) => Self::Releasing(left - 1),
            Self::Applying(0) => return true,
            Self::Applying(left) => Self::Applying(left - 1),
            other => other,
        };
        false
    }
}
