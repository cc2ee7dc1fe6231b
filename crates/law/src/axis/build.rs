//! An axis as a value, of parts for one period.

use super::{Axis, AxisBuilder, AxisError};
use crate::control::feedback::Feedback;
use crate::control::pid::{Pid, PidGains};
use crate::reference::MotionScale;
use crate::scalar::Scalar;

impl<S: Scalar, const N: usize> Axis<S, N> {
    /// Makes an axis and returns it: `parts` gives its parts to the builder. Settings time only.
    ///
    /// Resolution and period are those of `scale`; a [`Motion`](crate::reference::Motion) for the axis is built with
    /// the same. The axis passes over the stack, some kilobytes; [`AxisBuilder::new`] makes one in place.
    ///
    /// # Errors
    /// The first part that was refused.
    pub fn build(
        scale: MotionScale,
        parts: impl for<'a> FnOnce(AxisBuilder<'a, S, N>) -> AxisBuilder<'a, S, N>,
    ) -> Result<Self, AxisError> {
        let mut axis = Self::blank();
        let builder = AxisBuilder::new(&mut axis, scale.resolution_mm, scale.period_s());
        parts(builder).try_build()?;
        Ok(axis)
    }
}

impl<S: Scalar, const N: usize> AxisBuilder<'_, S, N> {
    /// A PID as the feedback law, built for the axis' period. The integral stays within +-`integral_limit_v`; with a
    /// limit of zero it is a PD.
    #[must_use]
    pub fn pid(self, gains: &PidGains, integral_limit_v: f64) -> Self {
        let pid = Pid::build(gains, integral_limit_v, self.period_s);
        self.feedback(Feedback::Pid(pid))
    }
}
