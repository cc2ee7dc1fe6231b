//! The feedback law of an axis: which one it is, and what they all share.

use crate::hint::cold_path;

use super::cascade::Cascade;
use super::nctf::Nctf;
use super::npid::NonlinearPid;
use super::pid::Pid;
use super::schedule::ScheduledPid;
use super::sliding_mode::SlidingMode;
use super::terms::{FeedbackInput, FeedbackState, FeedbackTerms};
use crate::scalar::Scalar;

/// The feedback laws by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(
    feature = "names",
    derive(
        strum::AsRefStr,
        strum::EnumString,
        strum::VariantArray,
        strum::VariantNames,
        strum::EnumCount
    ),
    strum(serialize_all = "kebab-case")
)]
pub enum LawKind {
    /// PID without an integral.
    Pd,
    /// Proportional, integral and derivative of the error.
    Pid,
    /// PID behind the nonlinear gain.
    NPid,
    /// PID with gains that depend on the reference's speed.
    Scheduled,
    /// P position loop around a PI velocity loop.
    Cascade,
    /// Sliding mode with a boundary layer.
    SlidingMode,
    /// Nominal characteristic trajectory following.
    Nctf,
}

impl LawKind {
    /// All laws, in the order of their tables.
    #[cfg(feature = "names")]
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .unwrap();

    /// The name of it in tables and figures.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pd => "PD",
            Self::Pid => "PID",
            Self::NPid => "N-PID",
            Self::Scheduled => "gain scheduling",
            Self::Cascade => "cascade P/PI",
            Self::SlidingMode => "sliding mode",
            Self::Nctf => "NCTF",
        }
    }
}

/// A law ready for the tick. `StageSettings::build` of the settings makes it.
// The variants differ in size by their tables, and an axis is made once.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq)]
pub enum Feedback<S: Scalar> {
    /// PID, or PD: a PID whose integral is held at zero.
    Pid(Pid<S>),
    /// PID behind the nonlinear gain.
    NPid(NonlinearPid<S>),
    /// PID with scheduled gains.
    Scheduled(ScheduledPid<S>),
    /// P position loop around a PI velocity loop.
    Cascade(Cascade<S>),
    /// Sliding mode with a boundary layer.
    SlidingMode(SlidingMode<S>),
    /// Nominal characteristic trajectory following.
    Nctf(Nctf<S>),
}

impl<S: Scalar> Feedback<S> {
    /// True if the law reads the velocity of the reference.
    pub const fn needs_velocity(&self) -> bool {
        matches!(self, Self::Scheduled(_) | Self::Cascade(_))
    }

    /// Adopts the memory of another law, or of this one with other gains: the next step, from the error given (mm),
    /// leaves the derivative as it is, and the integral goes on from its volts.
    pub fn take_over(&self, state: &mut FeedbackState<S>, error: S) {
        match self {
            Self::Pid(pid) => pid.take_over(state, error),
            Self::NPid(law) => law.pid.take_over(state, law.gain.scaled_error(error)),
            Self::Scheduled(law) => law.pid.take_over(state, error),
            Self::Cascade(law) => law.inner.rate.take_over(state, error),
            Self::SlidingMode(law) => law.inner.rate.take_over(state, error),
            Self::Nctf(law) => law.inner.rate.take_over(state, error),
        }
    }

    /// One control period; output and `base` together stay within +-`limit`, all in V.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut FeedbackState<S>,
        input: FeedbackInput<S>,
        base: S,
        limit: S,
    ) -> FeedbackTerms<S> {
        // What is hinted as rare works as well: the first two have the registers to themselves.
        match self {
            Self::Pid(pid) => pid.step(state, input.error, base, limit),
            Self::NPid(law) => {
                let error = law.gain.scaled_error(input.error);
                law.pid.step(state, error, base, limit)
            }
            Self::Scheduled(law) => {
                cold_path();
                law.step(state, input, base, limit)
            }
            Self::Cascade(law) => {
                cold_path();
                law.step(state, input, base, limit)
            }
            Self::SlidingMode(law) => {
                cold_path();
                law.step(state, input.error, base, limit)
            }
            Self::Nctf(law) => {
                cold_path();
                law.step(state, input.error, base, limit)
            }
        }
    }
}
