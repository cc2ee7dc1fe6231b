//! An axis of parts for one period, as a value or in its place.

use super::output::{Amplifier, OutputStage};
use super::{Axis, Commissioning, MAX_PREVIEW_TICKS};
use crate::cancelling::{CancellingLoop, CancellingSettings};
use crate::control::feedback::Feedback;
use crate::control::filter::Filters;
use crate::control::pid::{Pid, PidGains};
use crate::decimal::Decimal;
use crate::encoder::Encoder;
use crate::feedforward::{FeedforwardGains, FeedforwardKind};
use crate::friction::FrictionSettings;
use crate::friction::gms::FIRMWARE_ELEMENTS;
use crate::learning::Learning;
use crate::motion::ReferenceGenerator;
use crate::reference::{MotionScale, PulseReference};
use crate::safety::monitor::{Following, IndexSpacing, Overspeed, SignalLoss, speed_limit};
use crate::safety::oscillation::Oscillation;
use crate::safety::overload::Overload;
use crate::safety::plausibility::Plausibility;
use crate::safety::standstill::Standstill;
use crate::safety::travel::Travel;
use crate::scalar::{Quantity, Scalar};
use crate::units::POSITION_UNITS_PER_COUNT;
use core::fmt;

/// Puts the parts of an axis together, in place: no temporary is as large as an axis. Settings time only.
///
/// Parts that are not given are absent: no feedforward, no homing, no limits but the amplifier's, and a 32-bit encoder.
#[derive(Debug)]
pub struct AxisBuilder<'a, S: Scalar, const N: usize = FIRMWARE_ELEMENTS> {
    axis: &'a mut Axis<S, N>,
    resolution_mm: f64,
    period_s: f64,
    error: Option<AxisError>,
}

/// A part that an axis cannot be made with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AxisError {
    /// The length of an encoder count, mm: not above zero.
    Resolution(f64),
    /// The control period, s: not above zero.
    Period(f64),
    /// The output limit, V: not above zero, beyond the amplifier's full scale, or not given.
    OutputLimit(f64),
    /// A gain of the PID or the limit of its integral: negative, no finite number, or no proportional gain at all.
    Gains,
    /// The preview in ticks: more than [`MAX_PREVIEW_TICKS`].
    Preview(usize),
    /// The time constant of a bumpless offset, s: not above zero.
    Bumpless(f64),
}

impl fmt::Display for AxisError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Resolution(mm) => write!(f, "a count of {} mm is not above zero", Decimal(*mm)),
            Self::Period(s) => write!(f, "a control period of {} s is not above zero", Decimal(*s)),
            Self::OutputLimit(v) => write!(
                f,
                "an output limit of {} V is not above zero and within the amplifier's full scale",
                Decimal(*v)
            ),
            Self::Gains => f.write_str(
                "a gain or the integral's limit is negative or no finite number, or kp is zero",
            ),
            Self::Preview(ticks) => write!(
                f,
                "a preview of {ticks} ticks is longer than {MAX_PREVIEW_TICKS}"
            ),
            Self::Bumpless(s) => {
                write!(f, "a bumpless time of {} s is not above zero", Decimal(*s))
            }
        }
    }
}

impl core::error::Error for AxisError {}

/// True for a number above zero that is finite.
fn is_positive(value: f64) -> bool {
    value > 0.0 && value < f64::INFINITY
}

impl<'a, S: Scalar, const N: usize> AxisBuilder<'a, S, N> {
    /// Begins an axis in the place of one that is no longer used. An encoder count is `resolution_mm` long, a tick
    /// takes `period_s`.
    pub fn new(axis: &'a mut Axis<S, N>, resolution_mm: f64, period_s: f64) -> Self {
        let unit_mm = resolution_mm / POSITION_UNITS_PER_COUNT;
        axis.encoder = Encoder::new(32, false, i32::MAX);
        axis.unit_mm = S::gain(unit_mm, Quantity::Integer, Quantity::Length);
        axis.unit_mm_s = S::gain(unit_mm / period_s, Quantity::Integer, Quantity::Velocity);
        axis.feedback = Feedback::Pid(Pid::default());
        axis.filters = Filters::NONE;
        axis.feedforward.switch_off();
        axis.preview_ticks = 0;
        axis.amplifier = Amplifier::default();
        axis.bumpless_decay = S::ZERO;
        axis.overspeed = Overspeed::UNLIMITED;
        axis.signal_loss = SignalLoss::off();
        axis.plausibility = Plausibility::default();
        axis.overload = Overload::UNLIMITED;
        axis.oscillation = Oscillation::off();
        axis.index_spacing = IndexSpacing::default();
        axis.following = Following::unlimited();
        axis.travel = Travel::UNLIMITED;
        axis.standstill = Standstill::ALWAYS;
        axis.reduced_speed = u32::MAX;
        axis.generator = ReferenceGenerator::default();
        axis.commissioning = Commissioning::Done;
        axis.adapts = false;
        axis.learns = false;
        axis.learning = Learning::off();
        axis.cancels = false;
        axis.cancelling.switch_off();
        axis.feedforward_alone = false;
        axis.pulses = None;
        let builder = Self {
            axis,
            resolution_mm,
            period_s,
            error: None,
        };
        builder
            .require(
                is_positive(resolution_mm),
                AxisError::Resolution(resolution_mm),
            )
            .require(is_positive(period_s), AxisError::Period(period_s))
    }

    /// Keeps the first error.
    fn require(mut self, holds: bool, error: AxisError) -> Self {
        if !holds && self.error.is_none() {
            self.error = Some(error);
        }
        self
    }

    /// The encoder's counter; 32 bits unless given.
    #[must_use]
    pub fn encoder(self, encoder: Encoder) -> Self {
        self.axis.encoder = encoder;
        self
    }

    /// The output stage.
    #[must_use]
    pub fn output(self, stage: OutputStage) -> Self {
        self.axis.amplifier = Amplifier::build(&stage);
        self.require(
            is_positive(stage.limit_v) && stage.limit_v <= stage.full_scale_v,
            AxisError::OutputLimit(stage.limit_v),
        )
    }

    /// The feedback law, built for the same control period.
    #[must_use]
    pub fn feedback(self, feedback: Feedback<S>) -> Self {
        self.axis.feedback = feedback;
        self
    }

    /// The filters behind the feedback law, built for the same control period.
    #[must_use]
    pub fn filters(self, filters: Filters<S>) -> Self {
        self.axis.filters = filters;
        self
    }

    /// The feedforward, which looks `preview_ticks` ahead: the dead time of the plant.
    #[must_use]
    pub fn feedforward(
        self,
        kind: FeedforwardKind,
        gains: &FeedforwardGains,
        friction: &FrictionSettings,
        preview_ticks: usize,
    ) -> Self {
        self.axis
            .feedforward
            .build_over(kind, gains, friction, self.period_s);
        self.axis.preview_ticks = preview_ticks;
        self.require(
            preview_ticks <= MAX_PREVIEW_TICKS,
            AxisError::Preview(preview_ticks),
        )
    }

    /// The time constant with which the offset fades that makes a change of settings bumpless, s.
    #[must_use]
    pub fn bumpless(self, time_s: f64) -> Self {
        self.axis.bumpless_decay =
            S::quantise(libm::exp(-self.period_s / time_s), Quantity::Fraction);
        self.require(is_positive(time_s), AxisError::Bumpless(time_s))
    }

    /// The measured speed above which the axis is at fault, mm/s.
    #[must_use]
    pub fn overspeed_mm_s(self, limit_mm_s: f64) -> Self {
        let counts_per_tick = limit_mm_s * self.period_s / self.resolution_mm;
        self.overspeed(Overspeed::new(counts_per_tick))
    }

    /// The limit of the measured speed.
    #[must_use]
    pub fn overspeed(self, overspeed: Overspeed) -> Self {
        self.axis.overspeed = overspeed;
        self
    }

    /// The monitor of the encoder's signal.
    #[must_use]
    pub fn signal_loss(self, signal_loss: SignalLoss<S>) -> Self {
        self.axis.signal_loss = signal_loss;
        self
    }

    /// The comparison of the encoder with the plant.
    #[must_use]
    pub fn plausibility(self, plausibility: Plausibility) -> Self {
        self.axis.plausibility = plausibility;
        self
    }

    /// The load that the motor withstands.
    #[must_use]
    pub fn overload(self, overload: Overload) -> Self {
        self.axis.overload = overload;
        self
    }

    /// The monitor for oscillation.
    #[must_use]
    pub fn oscillation(self, oscillation: Oscillation<S>) -> Self {
        self.axis.oscillation = oscillation;
        self
    }

    /// Learning of the friction feedforward's scale.
    #[must_use]
    pub fn learning(self, learning: Learning<S>) -> Self {
        self.axis.learns = learning.is_on();
        self.axis.learning = learning;
        self.axis.adapts = self.axis.learns | self.axis.cancels;
        self
    }

    /// Cancelling of a cut's vibration.
    #[must_use]
    pub fn cancelling(self, parts: Option<(&CancellingSettings, &impl CancellingLoop)>) -> Self {
        if let Some((settings, of)) = parts {
            self.axis.cancelling.build_over(settings, of, self.period_s);
        }
        self.axis.cancels = self.axis.cancelling.is_on();
        self.axis.adapts = self.axis.learns | self.axis.cancels;
        self
    }

    /// The distance of the encoder's index pulses.
    #[must_use]
    pub fn index_spacing(self, index_spacing: IndexSpacing) -> Self {
        self.axis.index_spacing = index_spacing;
        self
    }

    /// The limit of the tracking error.
    #[must_use]
    pub fn following(self, following: Following<S>) -> Self {
        self.axis.following = following;
        self
    }

    /// The soft limits, in force once the axis is homed.
    #[must_use]
    pub fn travel(self, travel: Travel) -> Self {
        self.axis.travel = travel;
        self
    }

    /// The measured speed below which the axis stands, counts per tick; half a count is added for the quantisation.
    #[must_use]
    pub fn standstill(self, counts_per_tick: f64) -> Self {
        self.axis.standstill = Standstill::new(counts_per_tick);
        self
    }

    /// The limit of the measured speed until the axis is homed, counts per tick; half a count is added for the
    /// quantisation. With it, the axis starts no motion but jogs and homing until then.
    #[must_use]
    pub fn reduced_speed(self, counts_per_tick: Option<f64>) -> Self {
        self.axis.reduced_speed = counts_per_tick.map_or(u32::MAX, speed_limit);
        self
    }

    /// The reference generator, for motions beside the plan's.
    #[must_use]
    pub fn generator(self, generator: ReferenceGenerator<S>) -> Self {
        self.axis.generator = generator;
        self
    }

    /// The reference of another control's pulses, built for the same control period.
    #[must_use]
    pub fn pulses(self, pulses: Option<PulseReference<S>>) -> Self {
        self.axis.pulses = pulses;
        self
    }

    /// Puts out the feedforward alone, to be added to the force of another drive.
    #[must_use]
    pub fn feedforward_alone(self, alone: bool) -> Self {
        self.axis.feedforward_alone = alone;
        self
    }

    /// The standing of the settings; [`Commissioning::Done`] unless given.
    #[must_use]
    pub fn commissioning(self, commissioning: Commissioning) -> Self {
        self.axis.commissioning = commissioning;
        self
    }

    /// Ends the axis. A refused one puts out nothing.
    ///
    /// # Errors
    /// The first part that was refused.
    pub fn try_build(self) -> Result<(), AxisError> {
        let driven = self.axis.amplifier.limit > S::ZERO;
        let built = self.require(driven, AxisError::OutputLimit(0.0));
        match built.error {
            None => Ok(()),
            Some(error) => {
                built.axis.amplifier = Amplifier::default();
                Err(error)
            }
        }
    }
}

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
        let is_limit = (0.0..f64::INFINITY).contains(&integral_limit_v);
        self.feedback(Feedback::Pid(pid))
            .require(gains.is_valid() && is_limit, AxisError::Gains)
    }
}
