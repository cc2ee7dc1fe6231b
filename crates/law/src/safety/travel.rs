//! The travel of an axis: soft limits of the measured position, and of where a stop would end.

use super::fault::FaultCode;
use crate::reference::{Ramp, Velocity};
use crate::scalar::Scalar;
use crate::units::Position;

/// A range of positions, made for one comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Range {
    low: Position,
    span: u64,
}

impl Range {
    /// From `low` to `high`; empty if they are out of order.
    const fn new(low: Position, high: Position) -> Self {
        let span = high.0.saturating_sub(low.0);
        Self {
            low,
            // Counts the positions, so that zero is none.
            span: if span < 0 { 0 } else { span as u64 + 1 },
        }
    }

    const fn holds(self, position: Position) -> bool {
        (position.0.wrapping_sub(self.low.0) as u64) < self.span
    }

    /// The upper end; one below the lower end if the range is empty.
    const fn high(self) -> Position {
        Position(self.low.0.wrapping_add_unsigned(self.span).wrapping_sub(1))
    }
}

/// The soft limits of an axis. In force once it is homed.
#[derive(Clone, Debug, PartialEq)]
pub struct Travel {
    /// For the measured position, and for where a stop ends.
    allowed: Range,
    /// For the reference: within it a stop from any allowed velocity ends in time.
    clear: Range,
    /// Largest growth of the speed in a tick, as a displacement.
    growth: Position,
}

/// The memory of the soft limits: an axis that was enabled outside may come back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TravelState {
    /// The axis has been inside since it was enabled.
    inside: bool,
}

impl Travel {
    /// Limits that no machine reaches.
    pub const UNLIMITED: Self = {
        let everywhere = Range::new(Position(i64::MIN / 4), Position(i64::MAX / 4));
        Self {
            allowed: everywhere,
            clear: everywhere,
            growth: Position::ZERO,
        }
    };

    /// From `low` to `high`, for references that move by at most `fastest` in a tick, and by at most `growth` more than in
    /// the tick before, and for stops along `ramp`. Settings time only.
    pub fn new<S: Scalar>(
        low: Position,
        high: Position,
        fastest: Position,
        growth: Position,
        ramp: &Ramp<S>,
    ) -> Self {
        let stop = stop_from(ramp, fastest + growth);
        Self {
            allowed: Range::new(low, high),
            clear: Range::new(low + stop, high - stop),
            growth,
        }
    }

    /// True if the axis is inside its travel and could stop before the ends: [`step`](Self::step) then finds nothing.
    pub(crate) fn is_clear(&self, reference: Position, measured: Position) -> bool {
        self.clear.holds(reference) && self.allowed.holds(measured)
    }

    /// True if a position is inside the travel.
    pub(crate) const fn holds(&self, measured: Position) -> bool {
        self.allowed.holds(measured)
    }

    /// Takes the reference, its displacement in this tick, and the measured position. A fault that is found calls for a
    /// stop along `ramp`.
    pub fn step<S: Scalar>(
        &self,
        state: &mut TravelState,
        ramp: &Ramp<S>,
        reference: Position,
        displacement: Position,
        measured: Position,
    ) -> Result<(), FaultCode> {
        if self.allowed.holds(measured) {
            state.inside = true;
        } else if state.inside {
            return Err(FaultCode::TravelExceeded);
        }
        let (room, speed) = if displacement.0 > 0 {
            (self.allowed.high() - reference, displacement)
        } else if displacement.0 < 0 {
            (reference - self.allowed.low, -displacement)
        } else {
            return Ok(());
        };
        // The stop begins after the next tick, which may be faster by the growth.
        if stop_from(ramp, speed + self.growth).0 > room.0 {
            Err(FaultCode::PredictedSoftLimit)
        } else {
            Ok(())
        }
    }
}

impl TravelState {
    /// Takes note that the axis is inside its travel.
    pub(crate) fn enter(&mut self) {
        self.inside = true;
    }
}

/// The distance of a tick at this speed, and of a stop after it.
fn stop_from<S: Scalar>(ramp: &Ramp<S>, speed: Position) -> Position {
    ramp.stopping_distance(Velocity::from_displacement(speed))
        .saturating_add(speed)
}
