//! The vibration of the axis, and the gate that takes friction's feedforward back under it.
//!
//! A cut that shakes the axis takes friction's hysteresis away: the mean of friction over a period of the vibration is no step
//! at a reversal, but rises with the velocity. The velocity of the tracking error between two corner frequencies is squared
//! and averaged; of its amplitude `a`, beyond what the encoder's own noise shows, the gate is `g = 1 / (1 + (a / a1)^2)`. There
//! is no division: `g` goes to the solution of `g (1 + (a / a1)^2) = 1` by a share of the difference in each step. A step sees the mean
//! of several errors: of the encoder's noise, which they do not share, less is then folded into the band.

use crate::scalar::{Quantity, Scalar};

/// Corner frequencies of the band, Hz: above the loop's own motions, and below most of the encoder's noise.
const BAND_HZ: (f64, f64) = (40.0, 150.0);

/// Time constant of the mean square, s.
const MEAN_S: f64 = 0.05;

/// Time constant of the gate at rest, s; under vibration it is quicker.
const GATE_S: f64 = 0.02;

/// Noise of the encoder that is no vibration, RMS, counts: its quantisation is 0.29.
const NOISE_COUNTS: f64 = 0.5;
/// Threshold over the power of this noise.
const NOISE_MARGIN: f64 = 2.0;

/// Largest amplitude that does not close the gate, over the amplitude that halves it: reversals shake the axis a little, too.
const QUIET_SHARE: f64 = 0.5;

/// Largest velocity that counts, over that of the half gate: it bounds the step of the gate.
const MOST_VELOCITY: f64 = 5.0;
/// Largest square of the amplitude that counts, over that of the half gate.
const MOST_POWER: f64 = 20.0;

/// The gate ready for the tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Gate<S: Scalar> {
    /// A displacement in a step as a velocity over that of the half gate, by the share of the low-pass.
    velocity: S::Gain,
    low: S,
    high: S::Gain,
    keep: S,
    take: S::Gain,
    threshold: S,
    share: S::Gain,
    most: (S, S),
}

/// The memory of the gate.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct GateState<S: Scalar> {
    /// Sum of the errors of this step so far.
    sum: S,
    /// Sum of the errors of the last step.
    sum_before: S,
    low: S,
    slow: S,
    power: S,
    /// The gate, less 1.
    deviation: S,
}

impl<S: Scalar> Gate<S> {
    /// Makes a gate that is one half at an amplitude of `half_mm_s`, for an encoder with counts of `resolution_mm` and steps of
    /// `errors` errors. Settings time only.
    pub(super) fn build(half_mm_s: f64, resolution_mm: f64, step_s: f64, errors: u8) -> Self {
        let errors = f64::from(errors);
        let pole = |hz: f64| libm::exp(-core::f64::consts::TAU * hz * step_s);
        let (slow, low) = (pole(BAND_HZ.0), pole(BAND_HZ.1));
        let mean = libm::exp(-step_s / MEAN_S);
        // Noise of the counts through the difference and the low-pass, as the square of an amplitude.
        let noise_mm_s = NOISE_COUNTS * resolution_mm / step_s / half_mm_s;
        let noise =
            4.0 * (1.0 - low) * (1.0 - low) / (1.0 + low) * noise_mm_s * noise_mm_s / errors;
        let number = |value| S::quantise(value, Quantity::Multiplier);
        let share = |value| S::gain(value, Quantity::Multiplier, Quantity::Multiplier);
        let fraction = |value| S::quantise(value, Quantity::Fraction);
        Self {
            velocity: S::gain(
                (1.0 - low) / (errors * step_s * half_mm_s),
                Quantity::Length,
                Quantity::Multiplier,
            ),
            low: fraction(low),
            high: share(1.0 - slow),
            keep: fraction(mean),
            take: share(2.0 * (1.0 - mean)),
            threshold: number((NOISE_MARGIN * noise).clamp(QUIET_SHARE * QUIET_SHARE, MOST_POWER)),
            share: share((step_s / GATE_S).min(1.0 / (1.0 + MOST_POWER))),
            most: (number(MOST_VELOCITY), number(MOST_POWER)),
        }
    }

    /// One step with the errors since the last; returns by how much the gate has changed.
    #[inline(always)]
    pub(super) fn step(&self, state: &mut GateState<S>) -> S {
        let (most_velocity, most_power) = self.most;
        let sum = core::mem::replace(&mut state.sum, S::ZERO);
        let moved = sum - state.sum_before;
        state.sum_before = sum;
        let low = state.low.times(self.low, Quantity::Fraction) + moved.scale(self.velocity);
        state.low = low.within(most_velocity);
        let band = state.low - state.slow;
        state.slow = state.slow + band.scale(self.high);
        let square = band.times(band, Quantity::Multiplier);
        state.power = state.power.times(self.keep, Quantity::Fraction) + square.scale(self.take);
        let beyond = (state.power - self.threshold).limit(S::ZERO, most_power);
        let target = state.deviation.times(beyond, Quantity::Multiplier) + beyond;
        let before = state.deviation;
        state.deviation = before - (before + target).scale(self.share);
        state.deviation - before
    }
}

impl<S: Scalar> GateState<S> {
    /// Takes a tracking error of the next step, mm.
    pub(super) fn add_error(&mut self, error: S) {
        self.sum = self.sum + error;
    }

    /// The gate less 1, within -1 to 0, a [`Quantity::Multiplier`].
    pub(super) fn deviation(&self) -> S {
        self.deviation
    }
}
