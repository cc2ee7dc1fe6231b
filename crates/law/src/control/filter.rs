//! Structural filters: notch or second-order low-pass behind the feedback law, for axes with a resonance.
//!
//! ```text
//!        h s^2/w^2 + 2 d g s/w + 1
//! F(s) = -------------------------     g = centre gain, h = gain at high frequency
//!          s^2/w^2 + 2 d s/w + 1
//! ```
//!
//! `h` = 1 is a notch, whose gain at w is g; `h` = 0 with g = 0 is a second-order low-pass. The gain at rest is always one,
//! so that the filter takes nothing from the integral.
//!
//! Filters act on the law's output before the feedforward is added: the loop must not excite the mode, and the filter's lag
//! belongs to the loop. The feedforward follows a smooth reference, which excites little, and every lag in it would be a
//! tracking error.
//!
//! # Form
//! Two trapezoidal integrators in a loop (state-variable form), which is the bilinear transform prewarped at w to the last
//! digit. A direct form puts the poles of a slow filter at z = 1 by a difference of nearly equal numbers: at 30 Hz and
//! 10 kHz a rounding of its state comes out 2800 times larger, here by 1 / (2 d tan(w T / 2)), 50 to 500 times, and of a notch
//! at rest not at all. Source: Zavalishin, *The Art of VA Filter
//! Design*, 2018, ch. 4.

use heapless::Vec;

use crate::scalar::{Quantity, Scalar};

/// Filters of an axis at most.
pub const MAX_FILTERS: usize = 2;

/// A filter as a person writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct FilterSettings {
    /// w / (2 pi), Hz: 1 to 0.45 of the control rate.
    pub frequency_hz: f64,
    /// d, damping ratio of the denominator, 0.1 to 2: half the width of a notch over its frequency.
    pub damping: f64,
    /// g, 0 to 1: the gain of a notch at its frequency.
    pub centre_gain: f64,
    /// h, 0 to 1: one for a notch, zero for a low-pass.
    pub high_frequency_gain: f64,
}

/// The filters as a person writes them: one to [`MAX_FILTERS`].
pub type FilterList = Vec<FilterSettings, MAX_FILTERS>;

impl FilterSettings {
    /// A notch of gain `depth` at its frequency.
    pub const fn notch(frequency_hz: f64, damping: f64, depth: f64) -> Self {
        Self {
            frequency_hz,
            damping,
            centre_gain: depth,
            high_frequency_gain: 1.0,
        }
    }

    /// A second-order low-pass.
    pub const fn low_pass(frequency_hz: f64, damping: f64) -> Self {
        Self {
            frequency_hz,
            damping,
            centre_gain: 0.0,
            high_frequency_gain: 0.0,
        }
    }

    /// `tan(w T / 2)`.
    pub fn warped(&self, period_s: f64) -> f64 {
        libm::tan(core::f64::consts::PI * self.frequency_hz * period_s)
    }

    /// True if every number is finite and above zero where it must be.
    pub fn is_valid(&self) -> bool {
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let positive = |x: f64| x.is_finite() && x > 0.0;
        positive(self.frequency_hz)
            && positive(self.damping)
            && share(self.centre_gain)
            && share(self.high_frequency_gain)
    }
}

/// The memory of one filter, V.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct FilterState<S> {
    /// First integrator times 2 d: the band-pass part, no larger than a sine that goes in.
    band: S,
    /// Second integrator: the low-pass part.
    low: S,
}

/// One filter ready for the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Filter<S: Scalar> {
    /// `1 / (1 + t (t + 2 d))`, with `t = tan(w T / 2)`.
    hold: S::Gain,
    /// `2 d t` times that.
    drive: S::Gain,
    /// `t / (2 d)`.
    integrate: S::Gain,
    /// `g - h`.
    centre: S::Gain,
    /// `1 - h`.
    roll_off: S::Gain,
}

impl<S: Scalar> Filter<S> {
    fn build(settings: &FilterSettings, period_s: f64) -> Self {
        let gain = |value| S::gain(value, Quantity::Voltage, Quantity::Voltage);
        let (t, width) = (settings.warped(period_s), 2.0 * settings.damping);
        let hold = 1.0 / (1.0 + t * (t + width));
        Self {
            hold: gain(hold),
            drive: gain(hold * t * width),
            integrate: gain(t / width),
            centre: gain(settings.centre_gain - settings.high_frequency_gain),
            roll_off: gain(1.0 - settings.high_frequency_gain),
        }
    }

    #[inline(always)]
    fn step(&self, state: &mut FilterState<S>, input: S) -> S {
        let band = state.band.scale(self.hold) + (input - state.low).scale(self.drive);
        let low = state.low + band.scale(self.integrate);
        state.band = band + band - state.band;
        state.low = low + low - state.low;
        input + band.scale(self.centre) + (low - input).scale(self.roll_off)
    }
}

/// The memory of an axis' filters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FiltersState<S>([FilterState<S>; MAX_FILTERS]);

/// The filters of an axis ready for the tick. Without any, the output is the law's to the bit.
///
/// ```
/// use quadrant_law::control::filter::{FilterSettings, Filters, FiltersState};
///
/// let notch = [FilterSettings::notch(100.0, 0.5, 0.1)];
/// let filters = Filters::<f64>::build(&notch, 1e-4);
/// let mut state = FiltersState::default();
/// // Of a steady voltage all comes through.
/// let last = (0..2000).map(|_| filters.step(&mut state, 1.0)).last();
/// assert!((last.unwrap() - 1.0).abs() < 1e-9);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Filters<S: Scalar>(Vec<Filter<S>, MAX_FILTERS>);

impl<S: Scalar> Filters<S> {
    /// No filter.
    pub const NONE: Self = Self(Vec::new());

    /// Makes the filters for a control period. Settings time only.
    pub fn build(settings: &[FilterSettings], period_s: f64) -> Self {
        let filters = settings.iter().take(MAX_FILTERS);
        Self(filters.map(|each| Filter::build(each, period_s)).collect())
    }

    /// One control period: the law's output, V, behind the filters.
    #[inline(always)]
    pub fn step(&self, state: &mut FiltersState<S>, output: S) -> S {
        let mut output = output;
        for (filter, state) in self.0.iter().zip(&mut state.0) {
            output = filter.step(state, output);
        }
        output
    }

    /// Shifts the filters by a steady voltage, V: they put out that much more, at once.
    pub(crate) fn shift(&self, state: &mut FiltersState<S>, voltage: S) {
        for filter in &mut state.0 {
            filter.low = filter.low + voltage;
        }
    }

    /// Takes the filters to where they are at rest behind a steady output, V: the next step from it changes nothing.
    pub fn settle(&self, state: &mut FiltersState<S>, output: S) {
        let settled = FilterState {
            band: S::ZERO,
            low: output,
        };
        *state = FiltersState([settled; MAX_FILTERS]);
    }
}
