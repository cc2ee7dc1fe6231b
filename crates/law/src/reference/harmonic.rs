//! Sinusoidal motion.
//!
//! The phase is a 64-bit integer, so it neither drifts nor loses resolution. Its speed rises and falls smoothly at
//! the ends, so the axis starts and stops on the curve without a step of velocity or acceleration.

use core::f64::consts::TAU;

use super::motion::PlannedStroke;
use super::motion_state::MotionState;
use super::sample::{MotionScale, ReferenceSample};
use super::sine::{SINE_BITS, SinePolynomial};
use crate::rounding;
use crate::scalar::{Quantity, Scalar};
use crate::units::{POSITION_FRACTION_BITS, Position};

/// A sine as a person writes it: `amplitude sin(2 pi frequency t + phase)` about its centre.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
pub struct HarmonicSettings {
    /// Half the travel, mm.
    pub amplitude_mm: f64,
    /// Cycles per second at full speed, Hz.
    pub frequency_hz: f64,
    /// Phase at which the full-speed cycles begin, rad. The centre is where the start puts it.
    pub phase_rad: f64,
    /// Cycles at full speed; `None` goes on indefinitely.
    pub cycles: Option<f64>,
    /// Duration of the lead-in and of the lead-out, s.
    pub lead_s: f64,
}

impl HarmonicSettings {
    /// The sine whose largest velocity is `velocity_mm_s`.
    pub fn with_velocity(amplitude_mm: f64, velocity_mm_s: f64, cycles: f64, lead_s: f64) -> Self {
        Self {
            amplitude_mm,
            frequency_hz: velocity_mm_s / (TAU * amplitude_mm),
            phase_rad: 0.0,
            cycles: Some(cycles),
            lead_s,
        }
    }

    /// The largest velocity (mm/s) and acceleration (mm/s^2), lead-in included.
    pub(super) fn peaks(&self) -> (f64, f64) {
        let velocity = self.amplitude_mm * TAU * self.frequency_hz;
        // Phase speed rises at most at 3/2 of its mean rate; the two parts of the acceleration are in quadrature.
        let along = 1.5 * velocity / self.lead_s;
        let across = velocity * TAU * self.frequency_hz;
        (velocity, libm::hypot(along, across))
    }
}

/// A sine ready for the tick. [`Motion::build`](super::Motion::build) makes it.
///
/// ```
/// use quadrant_law::reference::{HarmonicSettings, Motion, MotionScale, MotionSettings, MotionState};
///
/// // 10 mm either way at up to 20 mm/s, one cycle, with half a second of lead-in.
/// let sine = HarmonicSettings::with_velocity(10.0, 20.0, 1.0, 0.5);
/// let motion = Motion::<f64>::build(&MotionSettings::Harmonic(sine), MotionScale::new(0.5e-3, 1e4));
/// let mut state = MotionState::default();
/// let mut farthest_mm = 0.0_f64;
/// while !motion.finished(&state) {
///     farthest_mm = farthest_mm.max(motion.step(&mut state).position.to_mm(0.5e-3).abs());
/// }
/// assert!((10.0..=20.0).contains(&farthest_mm));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonic<S: Scalar> {
    amplitude_counts: i32,
    amplitude_fraction: i32,
    start_phase: u32,
    start_swing: i64,
    phase_per_tick: u64,
    lead_ticks: u32,
    lead_step: u64,
    /// Ticks at full speed; more than can elapse when there is no end.
    cruise_ticks: u32,
    /// Tick after the lead-out, or [`NEVER`].
    end_tick: u32,
    velocity: S::Gain,
    centripetal: S::Gain,
    tangential: S::Gain,
    q30: S::Gain,
    polynomial: SinePolynomial,
    stroke: PlannedStroke,
}

/// The part of a harmonic motion that a tick lies in.
enum Lead {
    /// In the lead-in or the lead-out, at this tick from its standing end.
    Under { tick: u32, leaving: bool },
    /// Between lead-in and lead-out.
    FullSpeed,
    /// After the lead-out: at rest.
    Ended,
}

/// End of a motion without one.
const NEVER: u32 = u32::MAX;

/// One, as a Q31 phase speed or lead progress.
const ONE: u32 = 1 << 31;

/// A sine times an amplitude split in counts and 2^-16 counts, in 2^-16 counts.
fn swing(sine: i32, counts: i32, fraction: i32) -> i64 {
    const SHIFT: u32 = SINE_BITS - POSITION_FRACTION_BITS;
    let product = |factor: i32| i64::from(sine) * i64::from(factor);
    ((product(counts) + (1 << (SHIFT - 1))) >> SHIFT) + (product(fraction) >> SINE_BITS)
}

/// `rate` times a Q31 factor.
fn scaled_phase(rate: u64, factor: u32) -> u64 {
    let factor = u64::from(factor);
    (((rate >> 32) * factor) << 1) + (((rate & 0xFFFF_FFFF) * factor) >> 31)
}

/// The product of two Q31 numbers from 0 to 1.
fn product(a: u32, b: u32) -> u32 {
    ((u64::from(a) * u64::from(b)) >> 31) as u32
}

impl<S: Scalar> Harmonic<S> {
    /// Builds the sine from validated settings. Settings time only.
    pub(super) fn build(settings: &HarmonicSettings, scale: MotionScale) -> Self {
        let amplitude = Position::from_mm(settings.amplitude_mm, scale.resolution_mm).0;
        let turns_per_tick = settings.frequency_hz / scale.rate_hz;
        let phase_per_tick = rounding::round(libm::scalbn(turns_per_tick, 64)) as u64;
        let ticks = |seconds: f64| rounding::round(seconds * scale.rate_hz) as u32;
        let lead_ticks = ticks(settings.lead_s).max(1);
        let cruise_ticks = settings
            .cycles
            .map(|cycles| ticks(cycles / settings.frequency_hz));
        // The lead-in covers half of what full speed would.
        let lead_turns = 0.5 * f64::from(lead_ticks) * turns_per_tick;
        let start_turns = settings.phase_rad / TAU - lead_turns;
        let start_turns = start_turns - rounding::floor(start_turns);
        let start_phase = rounding::round(libm::scalbn(start_turns, 32)) as u64 as u32;
        let angular = TAU * settings.frequency_hz;
        let unit = 1.0 / f64::from(1u32 << SINE_BITS);
        // Settings are refused whose amplitude does not fit.
        let amplitude_counts = (amplitude >> POSITION_FRACTION_BITS) as i32;
        let amplitude_fraction = (amplitude & ((1 << POSITION_FRACTION_BITS) - 1)) as i32;
        let lead_s = f64::from(lead_ticks) / scale.rate_hz;
        let gain = |value: f64, to| S::gain(value * unit, Quantity::Integer, to);
        Self {
            amplitude_counts,
            amplitude_fraction,
            start_phase,
            start_swing: swing(
                SinePolynomial::FIT.sine(start_phase),
                amplitude_counts,
                amplitude_fraction,
            ),
            phase_per_tick,
            lead_ticks,
            lead_step: (1 << 62) / u64::from(lead_ticks),
            cruise_ticks: cruise_ticks.unwrap_or(NEVER),
            end_tick: cruise_ticks.map_or(NEVER, |cruise| {
                cruise.saturating_add(2 * lead_ticks).min(NEVER - 1)
            }),
            velocity: gain(settings.amplitude_mm * angular, Quantity::Velocity),
            centripetal: gain(
                -settings.amplitude_mm * angular * angular,
                Quantity::Acceleration,
            ),
            tangential: gain(
                1.5 * settings.amplitude_mm * angular / lead_s,
                Quantity::Acceleration,
            ),
            q30: S::gain(unit, Quantity::Integer, Quantity::Fraction),
            polynomial: SinePolynomial::FIT,
            stroke: PlannedStroke::new(
                Position(amplitude.saturating_mul(2)),
                settings.amplitude_mm * angular / (scale.resolution_mm * scale.rate_hz),
            ),
        }
    }

    /// Returns the part of the motion that a tick lies in.
    #[inline(always)]
    fn lead(&self, elapsed: u32) -> Lead {
        if elapsed < self.lead_ticks {
            return Lead::Under {
                tick: elapsed,
                leaving: false,
            };
        }
        let cruised = elapsed - self.lead_ticks;
        if cruised < self.cruise_ticks {
            return Lead::FullSpeed;
        }
        let past = cruised - self.cruise_ticks;
        if past < self.lead_ticks {
            Lead::Under {
                tick: self.lead_ticks - 1 - past,
                leaving: true,
            }
        } else {
            Lead::Ended
        }
    }

    #[inline(always)]
    pub(super) fn step(&self, state: &mut MotionState) -> ReferenceSample<S> {
        match self.lead(state.elapsed) {
            Lead::FullSpeed => self.turn(state, self.phase_per_tick).0,
            Lead::Under { tick, leaving } => self.step_lead(state, tick, leaving),
            Lead::Ended => ReferenceSample {
                velocity: S::ZERO,
                acceleration: S::ZERO,
                ..self.turn(state, 0).0
            },
        }
    }

    /// Turns the phase; returns the sample at full speed, and the cosine.
    #[inline(always)]
    fn turn(&self, state: &mut MotionState, phase: u64) -> (ReferenceSample<S>, i32) {
        state.phase = state.phase.wrapping_add(phase);
        let (sine, cosine) = self.polynomial.sine_and_cosine(self.phase(state));
        let swing = swing(sine, self.amplitude_counts, self.amplitude_fraction);
        let sample = ReferenceSample {
            position: Position(swing - self.start_swing),
            velocity: S::scale_integer(cosine, self.velocity),
            acceleration: S::scale_integer(sine, self.centripetal),
        };
        (sample, cosine)
    }

    fn phase(&self, state: &MotionState) -> u32 {
        ((state.phase >> 32) as u32).wrapping_add(self.start_phase)
    }

    /// A tick of the lead-in or lead-out, whose phase speed is a smooth step `p^2 (3 - 2 p)` of the progress `p`. Kept
    /// apart: most ticks run at full speed.
    #[inline(never)]
    fn step_lead(&self, state: &mut MotionState, tick: u32, leaving: bool) -> ReferenceSample<S> {
        // The middle of the tick, so that lead-in and lead-out are mirror images. lead_ticks fits 31 bits.
        let progress = ((u64::from(2 * tick + 1) * self.lead_step) >> 32) as u32;
        let square = product(progress, progress);
        let factor = 3 * u64::from(ONE) - 2 * u64::from(progress);
        let speed = ((u64::from(square) * factor) >> 31) as u32;
        let (full, cosine) = self.turn(state, scaled_phase(self.phase_per_tick, speed));

        let fraction = |q31: u32| S::scale_integer((q31 >> 1) as i32, self.q30);
        let ratio = fraction(speed);
        let centripetal = full
            .acceleration
            .times(ratio, Quantity::Fraction)
            .times(ratio, Quantity::Fraction);
        // The slope of the smooth step over its largest, 4 p (1 - p).
        let slope = fraction(((u64::from(progress) * u64::from(ONE - progress)) >> 29) as u32);
        let along = S::scale_integer(cosine, self.tangential).times(slope, Quantity::Fraction);
        ReferenceSample {
            velocity: full.velocity.times(ratio, Quantity::Fraction),
            acceleration: if leaving {
                centripetal - along
            } else {
                centripetal + along
            },
            ..full
        }
    }

    pub(super) const fn stroke(&self) -> PlannedStroke {
        self.stroke
    }

    /// True if the motion has an end.
    pub(super) const fn ends(&self) -> bool {
        self.end_tick != NEVER
    }

    pub(super) fn finished(&self, state: &MotionState) -> bool {
        state.elapsed >= self.end_tick && self.ends()
    }
}
