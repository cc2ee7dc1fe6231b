//! Cancelling of a cut's vibration at multiples of the spindle's frequency.
//!
//! A milling cutter pushes the axis at the frequency of its spindle and at that of its teeth. For each of up to
//! [`HARMONICS`] multiples a vector `z`, V, turns with the spindle; its first part is put out, and it grows by the error:
//!
//! ```text
//! z <- z exp(j w Ts) + 2 rate Ts e / G(j w)         output: Re z
//! ```
//!
//! G is the response of the nominal closed loop from a voltage at the plant's input to the position: so the harmonic of the error
//! falls with the time constant 1 / rate. This is adaptive feedforward cancellation (Bodson, Sacks, Khosla, IEEE Trans. Autom.
//! Control 39:1939, 1994), with the oscillator and its two weights as one vector. The spindle's angle need not be known, its speed
//! must.
//!
//! Steps are [`STEP_TICKS`] control periods long, the axes one after the other. Between two steps the output goes along a straight
//! line to the place that the vectors will have then. A speed that changes is followed at a bounded rate, one multiple a step:
//! sine, cosine and response come from polynomials and tables, without a division.

mod response;

use miniconf::{TreeAny, TreeSchema};
use serde::{Deserialize, Serialize};

pub use self::response::{CancellingLoop, LEAST_MARGIN_DEG, STEP_TICKS};
use self::response::{NODES, node_turns};
use crate::law::reference::sine::{SINE_BITS, SinePolynomial};
use crate::law::scalar::{Quantity, Scalar};

/// Multiples of the spindle's frequency that are cancelled at most.
pub const HARMONICS: usize = 3;

/// Time constant with which a vector falls by itself, s: it keeps rounding from adding up.
const LEAK_S: f64 = 20.0;

/// The same while nothing may be cancelled, s.
const FADE_S: f64 = 0.1;

/// Units of a [`SpindleSpeed`] in a turn.
const TURN: f64 = 4_294_967_296.0;

/// Cancelling as a person sets it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TreeSchema, TreeAny)]
#[serde(deny_unknown_fields)]
pub struct CancellingSettings {
    /// Speed of the spindle until the link tells another, rpm; 0 for one that stands.
    pub spindle_rpm: f64,
    /// Largest rate at which a change of the speed is followed, rpm/s.
    pub ramp_rpm_s: f64,
    /// Teeth of the cutter.
    pub teeth: u8,
    /// Multiples that are cancelled: of the teeth, of the spindle, of twice the teeth.
    pub harmonics: u8,
    /// Rate at which a harmonic of the error falls, 1/s.
    pub rate_per_s: f64,
    /// Largest voltage of all harmonics together, V.
    pub limit_v: f64,
}

impl CancellingSettings {
    /// The multiples of the spindle's frequency, the most important first; 0 for none.
    fn multiples(&self) -> [u32; HARMONICS] {
        let teeth = u32::from(self.teeth);
        let mut all = if teeth > 1 {
            [teeth, 1, 2 * teeth]
        } else {
            [1, 2, 3]
        };
        for unused in all.iter_mut().skip(self.harmonics.into()) {
            *unused = 0;
        }
        all
    }
}

/// Largest speed of a spindle, rpm.
pub const MOST_RPM: f64 = 1e6;

/// A speed of the spindle, 2^-32 turns in a step. Zero: it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpindleSpeed(u32);

impl SpindleSpeed {
    /// The speed in rpm, either sense, at a control period. Settings time only.
    pub fn from_rpm(rpm: f64, period_s: f64) -> Self {
        // `as` saturates and turns NaN into zero.
        Self((libm::fabs(rpm) / 60.0 * period_s * f64::from(STEP_TICKS) * TURN) as u32)
    }
}

/// Cancelling ready for the tick.
#[derive(Clone, Debug, PartialEq)]
#[repr(C)]
pub struct Cancelling<S: Scalar> {
    on: bool,
    multiples: [u32; HARMONICS],
    speed: u32,
    /// Largest change of the speed in a step.
    ramp: u32,
    /// An error as the voltage that the table multiplies.
    per_mm: S::Gain,
    most: S,
    /// One over the ticks of a step.
    share: S::Gain,
    /// 2^-30.
    unit: S::Gain,
    keep: S,
    fade: S,
    /// Cosine and sine part of the growth of a vector by the error, over the frequency; zeros where nothing is cancelled.
    growth: [[S; 2]; NODES],
}

/// A multiple of the spindle's frequency.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Harmonic<S> {
    /// The vector, V.
    vector: [S; 2],
    /// Cosine and sine of its angle in a step, a little shortened.
    turn: [S; 2],
    /// Its growth by the error.
    growth: [S; 2],
}

/// The memory of cancelling.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CancellingState<S: Scalar> {
    /// The output of the last tick, V, and its change in a tick.
    voltage: S,
    slope: S,
    harmonics: [Harmonic<S>; HARMONICS],
    /// Speed that is followed, and the one that was told over the link.
    speed: u32,
    told: Option<SpindleSpeed>,
    /// The next harmonic to be tuned to the speed, and harmonics that are to be.
    next: u8,
    stale: u8,
    fading: bool,
    /// The output was at its limit since the last step.
    saturated: bool,
}

/// The standing of the axis at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// It follows a plan or a stream.
    Fed,
    /// It stands, or its motion is none of the work's.
    Idle,
}

impl<S: Scalar> Cancelling<S> {
    /// Cancelling on an axis, for a control period, in the place of one that is no longer used. Settings time only.
    #[inline(never)]
    pub fn build_over(
        &mut self,
        settings: &CancellingSettings,
        axis: &CancellingLoop,
        period_s: f64,
    ) {
        let step_s = period_s * f64::from(STEP_TICKS);
        let fraction = |value| S::quantise(value, Quantity::Fraction);
        self.on = true;
        self.multiples = settings.multiples();
        self.speed = SpindleSpeed::from_rpm(settings.spindle_rpm, period_s).0;
        let SpindleSpeed(ramp) = SpindleSpeed::from_rpm(settings.ramp_rpm_s * step_s, period_s);
        self.ramp = ramp.max(1);
        self.per_mm = S::gain(1.0, Quantity::Length, Quantity::Voltage);
        self.most = S::quantise(settings.limit_v, Quantity::Voltage);
        self.share = S::gain(
            1.0 / f64::from(STEP_TICKS),
            Quantity::Voltage,
            Quantity::Voltage,
        );
        self.unit = S::gain(
            libm::scalbn(1.0, -(SINE_BITS as i32)),
            Quantity::Integer,
            Quantity::Fraction,
        );
        self.keep = fraction(1.0 - step_s / LEAK_S);
        self.fade = fraction(libm::exp(-step_s / FADE_S));
        for (index, node) in self.growth.iter_mut().enumerate() {
            let growth = axis.growth(node_turns(index) / step_s, settings.rate_per_s, period_s);
            *node = growth.map_or([S::ZERO; 2], |growth| {
                [growth.re, growth.im].map(|part| S::quantise(part, Quantity::Multiplier))
            });
        }
    }

    /// No cancelling. The table stays: to clear it would take longer.
    pub(crate) fn switch_off(&mut self) {
        self.on = false;
    }

    /// None at all, to be [built over](Self::build_over).
    pub(crate) fn off() -> Self {
        Self {
            on: false,
            multiples: [0; HARMONICS],
            speed: 0,
            ramp: 0,
            per_mm: S::Gain::default(),
            most: S::ZERO,
            share: S::Gain::default(),
            unit: S::Gain::default(),
            keep: S::ZERO,
            fade: S::ZERO,
            growth: [[S::ZERO; 2]; NODES],
        }
    }

    /// True if there is cancelling.
    #[inline(always)]
    pub const fn is_on(&self) -> bool {
        self.on
    }

    /// A memory of an axis at rest that knows the speed which was told.
    pub(crate) fn start(&self, state: &CancellingState<S>) -> CancellingState<S> {
        CancellingState {
            told: state.told,
            speed: self.wanted(state),
            stale: HARMONICS as u8,
            ..CancellingState::default()
        }
    }

    /// The speed to be followed.
    #[inline(always)]
    fn wanted(&self, state: &CancellingState<S>) -> u32 {
        match state.told {
            Some(SpindleSpeed(told)) => told,
            None => self.speed,
        }
    }

    /// One step, [`STEP_TICKS`] control periods long, with the tracking error of the last tick, mm.
    #[inline(always)]
    pub(crate) fn step(&self, state: &mut CancellingState<S>, error: S, cut: Cut) {
        let fading = cut == Cut::Idle;
        if state.speed != self.wanted(state) || state.fading != fading {
            self.follow(state, fading);
        }
        if state.stale > 0 {
            self.tune(state);
        }
        let held = core::mem::take(&mut state.saturated) | fading;
        let error = if held { S::ZERO } else { error }.scale(self.per_mm);
        let most = self.most;
        let mut ahead = S::ZERO;
        for harmonic in &mut state.harmonics {
            let [cosine, sine] = harmonic.turn;
            let turned = |[x, y]: [S; 2]| {
                x.times(cosine, Quantity::Fraction) - y.times(sine, Quantity::Fraction)
            };
            let [x, y] = harmonic.vector;
            let [by_x, by_y] = harmonic.growth;
            let grown = [
                turned([x, y]) + error.times(by_x, Quantity::Multiplier),
                turned([y, -x]) + error.times(by_y, Quantity::Multiplier),
            ];
            harmonic.vector = grown.map(|part| part.within(most));
            ahead = ahead + turned(harmonic.vector);
        }
        state.slope = (ahead.within(most) - state.voltage).scale(self.share);
    }

    /// The voltage of a tick.
    #[inline(always)]
    pub(crate) fn advance(&self, state: &mut CancellingState<S>) -> S {
        let voltage = state.voltage;
        state.voltage = voltage + state.slope;
        voltage
    }

    /// Mean voltage of the ticks since the last step, V, half a tick early.
    #[inline(always)]
    pub(crate) fn mean(&self, state: &CancellingState<S>) -> S {
        state.voltage - state.slope - state.slope
    }

    /// Takes a step towards the wanted speed.
    #[cold]
    #[inline(never)]
    fn follow(&self, state: &mut CancellingState<S>, fading: bool) {
        let wanted = self.wanted(state);
        let now = state.speed;
        let by = now.abs_diff(wanted).min(self.ramp);
        state.speed = if wanted > now {
            now.saturating_add(by)
        } else {
            now.saturating_sub(by)
        };
        state.fading = fading;
        state.stale = HARMONICS as u8;
    }

    /// Tunes the next harmonic to the speed.
    #[cold]
    #[inline(never)]
    fn tune(&self, state: &mut CancellingState<S>) {
        let place = usize::from(state.next);
        state.stale = state.stale.saturating_sub(1);
        state.next = if place + 1 < HARMONICS {
            state.next + 1
        } else {
            0
        };
        let mut harmonics = state.harmonics.iter_mut().zip(self.multiples);
        let Some((harmonic, multiple)) = harmonics.nth(place) else {
            return;
        };
        let turns = state.speed.saturating_mul(multiple);
        let growth = self.growth_at(turns);
        harmonic.growth = growth.unwrap_or_default();
        let keep = if growth.is_some() && !state.fading {
            self.keep
        } else {
            self.fade
        };
        let (sine, cosine) = SinePolynomial::FIT.sine_and_cosine(turns);
        harmonic.turn = [cosine, sine]
            .map(|part| S::scale_integer(part, self.unit).times(keep, Quantity::Fraction));
    }

    /// The growth at a frequency, 2^-32 turns in a step; none where nothing is cancelled.
    #[inline(always)]
    fn growth_at(&self, turns: u32) -> Option<[S; 2]> {
        let (index, place) = response::interval(turns)?;
        let [low, high] = self.growth.get(index..)?.first_chunk::<2>()?;
        let off = [S::ZERO; 2];
        if *low == off || *high == off {
            return None;
        }
        let place = S::scale_integer(place, self.unit);
        let [[x, y], [to_x, to_y]] = [*low, *high];
        Some([
            x + (to_x - x).times(place, Quantity::Fraction),
            y + (to_y - y).times(place, Quantity::Fraction),
        ])
    }
}

impl<S: Scalar> CancellingState<S> {
    /// Takes the speed of the spindle over.
    pub(crate) fn tell(&mut self, speed: SpindleSpeed) {
        self.told = Some(speed);
    }

    /// Takes note that the output is at its limit.
    #[inline(always)]
    pub(crate) fn saturate(&mut self) {
        self.saturated = true;
    }

    /// The voltage of the next tick, V. For telemetry.
    pub fn voltage(&self) -> f32 {
        self.voltage.to_f32(Quantity::Voltage)
    }
}
