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
//! must, within a per cent.
//!
//! Steps are [`STEP_TICKS`] control periods long, the axes one after the other. Between two steps the output goes along a straight
//! line to the place that the vectors will have then. A speed that changes is followed at a bounded rate, one multiple a step:
//! sine, cosine and response come from polynomials and tables, without a division.
//!
//! **Guard.** `p`, the sum of Re (G z), is the error that the vectors take away. Where the error goes against it, so that the mean of
//! `-p (e + a p)` is above a floor, the vectors are too large: they are unlearnt much faster than they are learnt. `q`, the sum of Im (G z), is
//! that error a quarter of a turn later. Where the mean of `q e` stays large beside that of `p^2`, the axis responds in quadrature to G, and the
//! vectors turn in place of falling: they are unlearnt as well.
//!
//! **Slip.** The vector of the teeth turns against its own frequency where the spindle is not as fast as its speed setting. The speed
//! follows that rotation, within 1.2 % of the set speed.

mod nodes;

use core::f64::consts::TAU;

pub use self::nodes::{CancellingLoop, LEAST_MARGIN_DEG, Node, STEP_TICKS};
use self::nodes::{NODES, node_turns};
use crate::reference::sine::{SINE_BITS, SinePolynomial};
use crate::rounding;
use crate::scalar::{Quantity, Scalar};

/// Multiples of the spindle's frequency that are cancelled at most.
pub const HARMONICS: usize = 3;

/// Time constant with which a vector falls by itself, s: it keeps rounding from adding up.
const LEAK_S: f64 = 20.0;

/// The same while nothing may be cancelled, s.
const FADE_S: f64 = 0.1;

/// Time of each of the guard's two means, s, or as many turns of the teeth's vector, if those take longer.
const GUARD_S: f64 = 0.03;
/// Time of each of these means in turns of the teeth's vector.
const GUARD_TURNS: f64 = 1.0;
/// Time in which the guard unlearns the vectors, s.
const UNLEARN_S: f64 = 0.04;
/// Largest excess of the vectors over the vibration, as a share.
const EXCESS: f64 = 0.06;
/// Floor of the guard, mm RMS: a reversal may have less in common with a vibration by chance.
const FLOOR_MM: f64 = 1e-3;

/// Least ratio of the error in quadrature to what the vectors take away, at which the axis responds in quadrature.
const QUADRATURE_RATIO: f64 = 3.0;
/// Cotangent of the least phase, 60 degrees, at which the axis responds in quadrature: [`LEAST_MARGIN_DEG`] allows less.
const QUADRATURE_COTANGENT: f64 = 0.577;
const _: () = assert!(
    LEAST_MARGIN_DEG == 30.0,
    "60 degrees are a right angle less this margin"
);
/// Time of a response in quadrature after which the vectors are unlearnt, s: a speed setting with an error of 1 %, or a ramp, looks
/// the same for a time.
const QUADRATURE_S: f64 = 0.3;
/// Steps in quadrature that one step without it cancels.
const IN_PHASE_STEPS: u16 = 4;

/// Factor from lengths to the guard's unit, 1/mm. The guard limits a length to a quarter of a millimetre.
const UNITS_PER_MM: f64 = 4.0;

/// Largest slip that is followed, as right shifts of the set speed, which add up to 1.2 % of it.
const SLIP_SHIFTS: (u32, u32) = (7, 8);

/// Steps from one look at the rotation to the next.
const LOOK_STEPS: u8 = 64;
/// Time over which the rotation is averaged, s.
const ROTATION_S: f64 = 0.15;
/// Rate at which the slip follows the rotation, over the rate at which the vector grows.
const SLIP_SHARE: f64 = 1.0 / 3.0;

/// Least rotation that is detected, rad/s.
const LEAST_ROTATION: f64 = 0.25;
/// Number of rotations that are distinguished: each is twice the one before.
const ROTATIONS: usize = 7;

/// A vector below this, or below the others, says nothing about the speed, V.
const LEAST_V: f64 = 0.01;

/// Factor on a growth, so that fixed point has room for its part across the vector.
const GROWTH_SCALE: f64 = 256.0;

/// Units of a [`SpindleSpeed`] in a turn.
const TURN: f64 = 4_294_967_296.0;

/// Cancelling as a person sets it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct CancellingSettings {
    /// Speed of the spindle until the link sets another, rpm; 0 for one that stands.
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
    /// The defaults of the settings.
    pub const DEFAULT: Self = Self {
        spindle_rpm: 0.0,
        ramp_rpm_s: 1e4,
        teeth: 2,
        harmonics: 3,
        rate_per_s: 6.0,
        limit_v: 0.3,
    };

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

impl Default for CancellingSettings {
    fn default() -> Self {
        Self::DEFAULT
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
    guard: Guard<S>,
    follower: Follower<S>,
    /// Cosine and sine part of the growth of a vector by the error, over the frequency; zeros where nothing is cancelled.
    growth: [[S; 2]; NODES],
    /// The same of the error that a vector takes away, of a volt and in the guard's unit.
    response: [[S; 2]; NODES],
}

/// The guard's constants.
#[derive(Clone, Debug, Default, PartialEq)]
struct Guard<S: Scalar> {
    per_unit: S::Gain,
    one: S,
    excess: S,
    /// Share of the way to a new value that a mean goes in a step: the largest, and that of 2^-31 turns in a step.
    share: S,
    share_of_turn: S::Gain,
    floor: S,
    unlearn: S,
    quadrature_ratio: S::Gain,
    quadrature_cotangent: S::Gain,
    /// Largest count of steps in which the axis responds in quadrature: beyond half of them the vectors are unlearnt.
    quadrature_steps: u16,
}

/// The constants of the slip's follower.
#[derive(Clone, Debug, Default, PartialEq)]
struct Follower<S: Scalar> {
    grown: S::Gain,
    per_volt: S::Gain,
    /// Share of the way to a new value that a mean goes from one look to the next.
    share: S,
    /// Square of the least vector, and the part across a vector of a square, that the least rotation makes.
    least: S,
    rotation: S,
    /// The error that the vector's growth takes away in a step, at half of the rate that is set.
    slow: S,
    /// Change of the slip in a look at the least rotation, over what the vector's growth takes away in a step.
    change: S::Gain,
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
    /// The error that a volt of it takes away.
    response: [S; 2],
}

/// The memory of cancelling.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CancellingState<S: Scalar> {
    /// The output of the last tick, V, and its change in a tick.
    voltage: S,
    slope: S,
    harmonics: [Harmonic<S>; HARMONICS],
    /// Speed that is followed.
    speed: u32,
    /// Speed that was set over the link.
    link_speed: Option<SpindleSpeed>,
    /// The next harmonic to be tuned to the speed, and harmonics that are to be.
    next: u8,
    stale: u8,
    fading: bool,
    /// The output was at its limit since the last step.
    saturated: bool,
    /// Steps since the last look at the rotation.
    steps: u8,
    /// Share of the way to a new value that a mean of the guard goes in a step.
    share: S,
    /// Means of the harm that the vectors do, the second one of the first, squares of the guard's unit.
    harm_now: S,
    harm: S,
    /// The same two means of the error times the one that the vectors take away a quarter of a turn later; and the mean of the square of what they
    /// take away.
    quadrature_now: S,
    quadrature: S,
    size: S,
    /// Steps in which the axis has responded in quadrature, less [`IN_PHASE_STEPS`] for each in which it has not.
    quadrature_steps: u16,
    /// Growth across the vector of the teeth since the last look; its mean, and that of the vector's square.
    across: S,
    rotation: S,
    square: S,
    /// Deviation of the spindle's speed from the set one, 2^-32 turns in a step.
    slip: i32,
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
        axis: &impl CancellingLoop,
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
        let nodes = self.growth.iter_mut().zip(&mut self.response);
        for (index, (growth, response)) in nodes.enumerate() {
            let found = axis.node(node_turns(index) / step_s, settings.rate_per_s, period_s);
            let parts = |value: [f64; 2]| value.map(|part| S::quantise(part, Quantity::Multiplier));
            *growth = found.map_or([S::ZERO; 2], |node| parts(node.growth));
            *response = found.map_or([S::ZERO; 2], |node| {
                parts(node.response.map(|part| part * UNITS_PER_MM))
            });
        }
        let number = |value| S::quantise(value, Quantity::Multiplier);
        let floor = FLOOR_MM * UNITS_PER_MM;
        self.guard = Guard {
            per_unit: S::gain(UNITS_PER_MM, Quantity::Length, Quantity::Multiplier),
            one: number(1.0),
            excess: fraction(EXCESS),
            share: fraction(-libm::expm1(-step_s / GUARD_S)),
            share_of_turn: S::gain(
                2.0 / (GUARD_TURNS * TURN),
                Quantity::Integer,
                Quantity::Fraction,
            ),
            floor: number(floor * floor),
            unlearn: fraction(libm::exp(-step_s / UNLEARN_S)),
            quadrature_ratio: S::gain(QUADRATURE_RATIO, Quantity::Multiplier, Quantity::Multiplier),
            quadrature_cotangent: S::gain(
                QUADRATURE_COTANGENT,
                Quantity::Multiplier,
                Quantity::Multiplier,
            ),
            // `as` saturates.
            quadrature_steps: rounding::round(2.0 * QUADRATURE_S / step_s) as u16,
        };
        let look_s = step_s * f64::from(LOOK_STEPS);
        let per_volt = 1.0 / settings.limit_v.max(LEAST_V);
        // Growth times response, which it is multiplied by, is 2 rate Ts.
        let turns = SLIP_SHARE * look_s * LEAST_ROTATION / (2.0 * UNITS_PER_MM * TAU);
        self.follower = Follower {
            grown: S::gain(
                GROWTH_SCALE * per_volt,
                Quantity::Voltage,
                Quantity::Multiplier,
            ),
            per_volt: S::gain(per_volt, Quantity::Voltage, Quantity::Multiplier),
            share: fraction(-libm::expm1(-look_s / ROTATION_S)),
            least: S::quantise(LEAST_V * LEAST_V * per_volt, Quantity::Voltage),
            rotation: number(LEAST_ROTATION * step_s * GROWTH_SCALE * f64::from(LOOK_STEPS)),
            slow: number(settings.rate_per_s * step_s * UNITS_PER_MM),
            change: S::gain(
                turns * TURN / f64::from(self.multiples[0].max(1)),
                Quantity::Multiplier,
                Quantity::Integer,
            ),
        };
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
            guard: Guard::default(),
            follower: Follower::default(),
            growth: [[S::ZERO; 2]; NODES],
            response: [[S::ZERO; 2]; NODES],
        }
    }

    /// True if there is cancelling.
    pub const fn is_on(&self) -> bool {
        self.on
    }

    /// Forgets all but the set speed: the axis is at rest.
    pub(crate) fn start(&self, state: &mut CancellingState<S>) {
        *state = CancellingState {
            link_speed: state.link_speed,
            speed: self.speed_setting(state),
            stale: HARMONICS as u8,
            ..CancellingState::default()
        };
    }

    /// The speed to be followed.
    #[inline(always)]
    fn speed_setting(&self, state: &CancellingState<S>) -> u32 {
        match state.link_speed {
            Some(SpindleSpeed(speed)) => speed,
            None => self.speed,
        }
    }

    /// One step, [`STEP_TICKS`] control periods long, with the tracking error of the last tick, mm.
    #[inline(always)]
    pub(crate) fn step(&self, state: &mut CancellingState<S>, error: S, cut: Cut) {
        let fading = cut == Cut::Idle;
        if state.speed != self.speed_setting(state) || state.fading != fading {
            self.follow(state, fading);
        }
        if state.stale > 0 {
            self.tune(state);
        }
        let held = core::mem::take(&mut state.saturated) | fading;
        let error = if held { S::ZERO } else { error };
        self.weigh(state, error);
        let error = error.scale(self.per_mm);
        let most = self.most;
        let mut ahead = S::ZERO;
        let mut across = S::ZERO;
        for (place, harmonic) in state.harmonics.iter_mut().enumerate() {
            let [cosine, sine] = harmonic.turn;
            let turned = |[x, y]: [S; 2]| {
                x.times(cosine, Quantity::Fraction) - y.times(sine, Quantity::Fraction)
            };
            let [x, y] = harmonic.vector;
            let [by_x, by_y] = harmonic
                .growth
                .map(|by| error.times(by, Quantity::Multiplier));
            if place == 0 {
                let grown = |by: S| by.scale(self.follower.grown);
                across = x.times(grown(by_y), Quantity::Multiplier)
                    - y.times(grown(by_x), Quantity::Multiplier);
            }
            let grown = [turned([x, y]) + by_x, turned([y, -x]) + by_y];
            harmonic.vector = grown.map(|part| part.within(most));
            ahead = ahead + turned(harmonic.vector);
        }
        state.slope = (ahead.within(most) - state.voltage).scale(self.share);
        state.across = state.across + across;
        state.steps += 1;
        if state.steps >= LOOK_STEPS {
            self.follow_slip(state);
        }
    }

    /// Weighs the error against what the vectors take away, and unlearns vectors that are too large, or to which the axis responds in quadrature.
    #[inline(always)]
    fn weigh(&self, state: &mut CancellingState<S>, error: S) {
        let guard = &self.guard;
        let product = |one: S, other: S| one.times(other, Quantity::Multiplier);
        let mut taken = S::ZERO;
        let mut later = S::ZERO;
        for harmonic in &state.harmonics {
            let ([x, y], [by_x, by_y]) = (harmonic.vector, harmonic.response);
            taken = taken + product(x, by_x) - product(y, by_y);
            later = later + product(x, by_y) + product(y, by_x);
        }
        let taken = taken.within(guard.one);
        let later = later.within(guard.one);
        let error = error.scale(guard.per_unit).within(guard.one);
        let allowed = error + taken.times(guard.excess, Quantity::Fraction);
        // Two means, one behind the other: of a reversal's error little is left that the vibration makes ripple.
        let mean = |mean: S, new: S| mean + (new - mean).times(state.share, Quantity::Fraction);
        state.harm_now = mean(state.harm_now, -product(taken, allowed));
        state.harm = mean(state.harm, state.harm_now);
        state.quadrature_now = mean(state.quadrature_now, product(later, error));
        state.quadrature = mean(state.quadrature, state.quadrature_now);
        state.size = mean(state.size, product(taken, taken));
        let quadrature = state.quadrature.magnitude();
        let responds_in_quadrature = (quadrature > guard.floor)
            & (quadrature > state.size.scale(guard.quadrature_ratio))
            & (quadrature.scale(guard.quadrature_cotangent) + state.harm > S::ZERO);
        state.quadrature_steps = if responds_in_quadrature {
            state
                .quadrature_steps
                .saturating_add(1)
                .min(guard.quadrature_steps)
        } else {
            state.quadrature_steps.saturating_sub(IN_PHASE_STEPS)
        };
        if state.harm > guard.floor || state.quadrature_steps > guard.quadrature_steps / 2 {
            for harmonic in &mut state.harmonics {
                let unlearnt = |part: S| part.times(guard.unlearn, Quantity::Fraction);
                harmonic.vector = harmonic.vector.map(unlearnt);
            }
        }
    }

    /// Looks at the rotation of the teeth's vector, if it is the largest and grows at half the rate that is set or more, and takes the
    /// slip a step further where it is more than the least.
    #[cold]
    #[inline(never)]
    fn follow_slip(&self, state: &mut CancellingState<S>) {
        let follower = &self.follower;
        state.steps = 0;
        let across = core::mem::take(&mut state.across);
        let mut others = S::ZERO;
        let mut square = S::ZERO;
        let mut taken = S::ZERO;
        for harmonic in state.harmonics.iter().rev() {
            others = others + square;
            let ([x, y], [re, im]) = (harmonic.growth, harmonic.response);
            taken = x.times(re, Quantity::Multiplier) - y.times(im, Quantity::Multiplier);
            let [x, y] = harmonic.vector;
            let part = |part: S| part.times(part.scale(follower.per_volt), Quantity::Multiplier);
            square = part(x) + part(y);
        }
        let mean = |mean: S, new: S| mean + (new - mean).times(follower.share, Quantity::Fraction);
        state.rotation = mean(state.rotation, across);
        state.square = mean(state.square, square);
        let harms = state.harm > self.guard.floor;
        if harms || square < follower.least || square < others || taken < follower.slow {
            return;
        }
        let rotation = state.rotation.magnitude();
        let mut bar = state.square.times(follower.rotation, Quantity::Multiplier);
        let mut change = 0;
        let mut next = taken.round_scaled(follower.change);
        for _ in 0..ROTATIONS {
            if rotation > bar {
                change = next;
            }
            bar = bar + bar;
            next = next.saturating_add(next);
        }
        if change == 0 {
            return;
        }
        let set = self.speed_setting(state);
        let most = ((set >> SLIP_SHIFTS.0) + (set >> SLIP_SHIFTS.1)) as i32;
        let slip = if state.rotation > S::ZERO {
            state.slip.saturating_add(change)
        } else {
            state.slip.saturating_sub(change)
        };
        state.slip = slip.min(most).max(-most);
        state.stale = HARMONICS as u8;
    }

    /// The voltage of a tick.
    pub(crate) fn advance(&self, state: &mut CancellingState<S>) -> S {
        let voltage = state.voltage;
        state.voltage = voltage + state.slope;
        voltage
    }

    /// Mean voltage of the ticks since the last step, V, half a tick early.
    pub(crate) fn mean(&self, state: &CancellingState<S>) -> S {
        state.voltage - state.slope - state.slope
    }

    /// Takes a step towards the set speed.
    #[cold]
    #[inline(never)]
    fn follow(&self, state: &mut CancellingState<S>, fading: bool) {
        let set_speed = self.speed_setting(state);
        let now = state.speed;
        if now != set_speed {
            state.slip = 0;
        }
        let by = now.abs_diff(set_speed).min(self.ramp);
        state.speed = if set_speed > now {
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
        let speed = state.speed.saturating_add_signed(state.slip);
        let turns = speed.saturating_mul(multiple);
        if place == 0 {
            let share = S::scale_integer((turns >> 1) as i32, self.guard.share_of_turn);
            state.share = share.limit(S::ZERO, self.guard.share);
        }
        let found = self.nodes_at(turns);
        (harmonic.growth, harmonic.response) = found.unwrap_or_default();
        let keep = if found.is_some() && !state.fading {
            self.keep
        } else {
            self.fade
        };
        let (sine, cosine) = SinePolynomial::FIT.sine_and_cosine(turns);
        harmonic.turn = [cosine, sine]
            .map(|part| S::scale_integer(part, self.unit).times(keep, Quantity::Fraction));
    }

    /// Growth and response at a frequency, 2^-32 turns in a step; none where nothing is cancelled.
    #[inline(always)]
    fn nodes_at(&self, turns: u32) -> Option<([S; 2], [S; 2])> {
        let (index, place) = nodes::interval(turns)?;
        let place = S::scale_integer(place, self.unit);
        let between = |table: &[[S; 2]; NODES]| {
            let [low, high] = table.get(index..)?.first_chunk::<2>()?;
            let off = [S::ZERO; 2];
            if *low == off || *high == off {
                return None;
            }
            let [[x, y], [to_x, to_y]] = [*low, *high];
            Some([
                x + (to_x - x).times(place, Quantity::Fraction),
                y + (to_y - y).times(place, Quantity::Fraction),
            ])
        };
        Some((between(&self.growth)?, between(&self.response)?))
    }
}

impl<S: Scalar> CancellingState<S> {
    /// Sets the speed of the spindle.
    pub(crate) fn set_speed(&mut self, speed: SpindleSpeed) {
        self.link_speed = Some(speed);
    }

    /// Takes note that the output is at its limit.
    pub(crate) fn saturate(&mut self) {
        self.saturated = true;
    }

    /// The voltage of the next tick, V. For telemetry.
    pub fn voltage(&self) -> f32 {
        self.voltage.to_f32(Quantity::Voltage)
    }
}
