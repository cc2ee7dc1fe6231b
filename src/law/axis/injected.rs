//! An axis whose amplifier a host drives, the law being off.

use super::{Axis, AxisState, PREVIEW_ROOM};
use crate::law::control::feedback::{FeedbackState, FeedbackTerms};
use crate::law::course::CourseMode;
use crate::law::feedforward::{FeedforwardState, FeedforwardTerms};
use crate::law::safety::AxisSwitches;
use crate::law::scalar::Scalar;
use crate::law::units::{DacCode, Position};

/// A speed in 2^-8 counts as a displacement.
const SPEED_SHIFT: u32 = crate::law::units::POSITION_FRACTION_BITS - 8;

impl<S: Scalar, const N: usize> Axis<S, N> {
    /// Opens the loop of an axis at rest.
    pub(crate) fn open_loop(&self, state: &mut AxisState<S, N>) {
        self.course.open(&mut state.course);
    }

    /// Takes the injected voltage away. A loop that was open is closed: it brakes from the motion that the axis has.
    pub(crate) fn end_injection(&self, state: &mut AxisState<S, N>) {
        state.injected = S::ZERO;
        if state.mode() == CourseMode::OpenLoop {
            // As after enabling: what the law remembers is of before, and its error is zero now.
            state.feedback = FeedbackState::default();
            state.springs = FeedforwardState::default();
            state.transfer = S::ZERO;
            self.stop(state);
        }
    }

    /// Lets the reference go along with the axis, so that the loop can be closed at any tick; says whether the axis is where
    /// it may be.
    #[cold]
    #[inline(never)]
    pub(super) fn refer_open(
        &self,
        state: &mut AxisState<S, N>,
        switches: AxisSwitches,
        tick: u32,
    ) -> bool {
        let here = state.encoder.position();
        let speed = i64::from(state.speed()) << SPEED_SHIFT;
        let ahead_by = |ticks: i64| here + Position(ticks * speed);
        let preview = self.preview_ticks as i64;
        for age in 0..PREVIEW_ROOM {
            let slot = (tick as usize).wrapping_sub(age) % PREVIEW_ROOM;
            state.preview[slot] = ahead_by(preview - age as i64);
        }
        state.ahead = ahead_by(preview);
        state.displacement = Position(speed);
        state.displacement_before = state.displacement;
        let velocity = S::scale_integer(state.displacement.clipped(), self.unit_mm_s);
        state.velocity = velocity;
        let telemetry = &mut state.telemetry;
        telemetry.reference = here;
        telemetry.error = S::ZERO;
        telemetry.velocity = velocity;
        self.confine(state, switches)
    }

    /// Puts the injected voltage out.
    #[cold]
    #[inline(never)]
    pub(super) fn drive_open(&self, state: &mut AxisState<S, N>) -> DacCode {
        let limit = self.amplifier.limit;
        let output = state.injected.limit(-limit, limit);
        let feedback = FeedbackTerms {
            saturated: output != state.injected,
            ..FeedbackTerms::default()
        };
        self.put_out(state, feedback, FeedforwardTerms::default(), output)
    }
}
