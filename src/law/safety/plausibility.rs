//! The encoder held against the plant: the motion that an output must have caused has to be seen.
//!
//! An encoder that dies lies to every other monitor too: with it, the axis neither leaves its reference nor is it too
//! fast. The output does not lie. Two comparisons, both on the voltage that has reached the axis, which is that of the
//! output through a lag of the plant's dead time:
//!
//! - **No motion.** While the encoder stands (or dithers between two counts, as with one dead line), the voltage may
//!   change by what friction takes up before it yields visibly. What goes beyond moves a model, `v' = A u - B v`, from
//!   rest; when that has gone farther than a distance, the encoder is dead or the axis is blocked. The change counts from
//!   the last motion that was seen, because a load may be held at rest with any voltage. In open loop nothing is held, so
//!   there the voltage itself counts too, beyond what friction can hold.
//! - **Wrong motion.** What the model's speed gained in a tick, less what the axis' did, is the doing of friction and
//!   load. It is summed beyond the largest load, towards each side (a CUSUM test, Page 1954); an encoder or amplifier of
//!   the wrong sign, or an encoder that dies at speed, needs more load than there can be. Until the axis has once moved
//!   after enabling, a smaller one is the limit.
//!
//! Without a model, an axis in open loop has a budget in volt-seconds in place of the distance.

use crate::law::scalar::{Quantity, Scalar};

/// Counts within which an encoder with one dead line dithers.
pub(super) const DITHER_COUNTS: u32 = 2;

/// Share of the output that is added to the largest load: the error of the model's A.
const GAIN_ERROR: f64 = 0.3;

/// Time in which a distance of the model is forgotten, s: what little is left over does not add up for hours.
const FORGET_S: f64 = 0.2;

/// The plant as far as the comparison needs it. Settings time only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlausibilityModel {
    /// A, mm/(V s^2).
    pub gain_mm_per_v_s2: f64,
    /// B, 1/s.
    pub damping_per_s: f64,
    /// Td, s.
    pub delay_s: f64,
    /// Change of the voltage that need not show as motion, in closed loop, V.
    pub held_v: f64,
    /// Voltage that need not show as motion, in open loop, V.
    pub breakaway_v: f64,
    /// Largest load, V at the amplifier's input.
    pub load_v: f64,
    /// The same until the axis has moved by `proving_mm` after enabling, V.
    pub first_load_v: f64,
    /// Motion after enabling that shows that the signs are right, mm.
    pub proving_mm: f64,
    /// Distance of the model without motion of the encoder that is a fault, mm.
    pub distance_mm: f64,
    /// Gain of speed that no load explains and that is a fault, mm/s.
    pub velocity_mm_s: f64,
}

/// Compares the encoder's motion with what the output must have caused.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Plausibility<S: Scalar> {
    /// The axis is known by a model; else there is only the budget of the open loop.
    modelled: bool,
    /// Share of the way to the output that the lagging voltage goes in a tick.
    lag: S,
    held: S,
    breakaway: S,
    /// A voltage as the speed gained in a tick.
    push: S::Gain,
    /// Share of a speed that is left after a tick.
    glide: S,
    /// Share of a speed that is lost in a tick.
    drag: S,
    /// A speed as the distance of a tick.
    advance: S::Gain,
    /// Share of the distance that is left after a tick.
    memory: S,
    distance: S,
    /// Steps of the encoder as a speed.
    counts: S::Gain,
    /// Largest load as the speed gained in a tick, at first and later, and what the output adds to it.
    first_load: S,
    load: S,
    proving_counts: u32,
    gain_error: S,
    velocity: S,
}

/// The memory of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlausibilityState<S> {
    /// Voltage that has reached the axis, V.
    voltage: S,
    /// That voltage at the last motion that was seen, V.
    anchor: S,
    /// Counts since.
    travelled: i32,
    /// Counts since enabling, and true once they have gone far enough.
    way: i32,
    proved: bool,
    /// Speed and distance of the model since, mm/s and mm; without a model, V and V s.
    modelled: S,
    distance: S,
    /// Step of the encoder in the tick before, counts.
    before: i32,
    /// Speed gained beyond what a load may explain, towards each side, mm/s.
    missing: S,
    excess: S,
}

impl<S: Scalar> Plausibility<S> {
    /// The comparison with a model, of an encoder with counts of `resolution_mm`, every `period_s`. Settings time only.
    pub fn new(model: &PlausibilityModel, resolution_mm: f64, period_s: f64) -> Self {
        let volts = |value| S::quantise(value, Quantity::Voltage);
        let share = |value| S::quantise(value, Quantity::Fraction);
        let drag = (model.damping_per_s * period_s).min(1.0);
        let push = model.gain_mm_per_v_s2 * period_s;
        Self {
            modelled: true,
            lag: share(period_s / (model.delay_s + period_s)),
            held: volts(model.held_v),
            breakaway: volts(model.breakaway_v),
            push: S::gain(push, Quantity::Voltage, Quantity::Velocity),
            glide: share(1.0 - drag),
            drag: share(drag),
            advance: S::gain(period_s, Quantity::Velocity, Quantity::Length),
            memory: share(1.0 - (period_s / FORGET_S).min(1.0)),
            distance: S::quantise(model.distance_mm, Quantity::Length),
            counts: S::gain(
                resolution_mm / period_s,
                Quantity::Integer,
                Quantity::Velocity,
            ),
            first_load: S::quantise(push * model.first_load_v, Quantity::Velocity),
            load: S::quantise(push * model.load_v, Quantity::Velocity),
            proving_counts: (model.proving_mm / resolution_mm) as u32,
            gain_error: share(GAIN_ERROR),
            velocity: S::quantise(model.velocity_mm_s, Quantity::Velocity),
        }
    }

    /// A budget of `budget_v_s` volt-seconds beyond `breakaway_v`, in open loop, for an axis of which there is no model.
    /// Settings time only.
    pub fn without_model(budget_v_s: f64, breakaway_v: f64, period_s: f64) -> Self {
        Self {
            modelled: false,
            lag: S::quantise(1.0, Quantity::Fraction),
            // There is no telling what friction takes up.
            held: S::quantise(f64::from(f32::MAX), Quantity::Voltage),
            breakaway: S::quantise(breakaway_v, Quantity::Voltage),
            push: S::gain(1.0, Quantity::Voltage, Quantity::Velocity),
            advance: S::gain(period_s, Quantity::Velocity, Quantity::Length),
            memory: S::quantise(1.0 - (period_s / FORGET_S).min(1.0), Quantity::Fraction),
            distance: S::quantise(budget_v_s, Quantity::Length),
            ..Self::default()
        }
    }

    /// A comparison that finds nothing.
    pub fn off() -> Self {
        Self::default()
    }

    /// Takes a step of the encoder, counts, and the output that was in force before it, V; returns true if the one can
    /// come of the other. `open`: the loop is open.
    #[inline(always)]
    pub fn step(
        &self,
        state: &mut PlausibilityState<S>,
        counts: i32,
        output: S,
        open: bool,
    ) -> bool {
        if self.modelled {
            self.compare(state, counts, output, open)
        } else if open && self.distance > S::ZERO {
            state.voltage = output;
            self.stands(state, counts, open)
        } else {
            true
        }
    }

    #[inline(never)]
    fn compare(
        &self,
        state: &mut PlausibilityState<S>,
        counts: i32,
        output: S,
        open: bool,
    ) -> bool {
        let voltage = state.voltage;
        state.voltage = voltage + (output - voltage).times(self.lag, Quantity::Fraction);
        self.moves_along(state, counts) & self.stands(state, counts, open)
    }

    /// False if the speed changes as no load changes it.
    #[inline(always)]
    fn moves_along(&self, state: &mut PlausibilityState<S>, counts: i32) -> bool {
        let gained = S::scale_integer(counts.wrapping_sub(state.before), self.counts);
        state.before = counts;
        let speed = S::scale_integer(counts, self.counts);
        let pushed = state.voltage.scale(self.push);
        let due = pushed - speed.times(self.drag, Quantity::Fraction) - gained;
        state.way = state.way.saturating_add(counts);
        state.proved |= state.way.unsigned_abs() > self.proving_counts;
        let load = if state.proved {
            self.load
        } else {
            self.first_load
        };
        let load = load
            + pushed
                .magnitude()
                .times(self.gain_error, Quantity::Fraction);
        state.missing = beyond_zero(state.missing + due - load);
        state.excess = beyond_zero(state.excess - due - load);
        (state.missing <= self.velocity) & (state.excess <= self.velocity)
    }

    /// False if the encoder stands though the axis must have moved.
    #[inline(always)]
    fn stands(&self, state: &mut PlausibilityState<S>, counts: i32, open: bool) -> bool {
        state.travelled = state.travelled.saturating_add(counts);
        if state.travelled.unsigned_abs() > DITHER_COUNTS {
            state.travelled = 0;
            state.anchor = state.voltage;
            state.modelled = S::ZERO;
        } else {
            let mut force = beyond(state.voltage - state.anchor, self.held);
            if open && force == S::ZERO {
                force = beyond(state.voltage, self.breakaway);
            }
            state.modelled =
                state.modelled.times(self.glide, Quantity::Fraction) + force.scale(self.push);
        }
        // Kept through motion: an encoder with gaps shows some.
        state.distance = state.distance.times(self.memory, Quantity::Fraction)
            + state.modelled.scale(self.advance);
        state.distance.magnitude() <= self.distance
    }
}

impl<S: Scalar> PlausibilityState<S> {
    /// Begins a standstill anew: the loop is opened.
    pub(crate) fn forget_standstill(&mut self) {
        self.travelled = 0;
        self.modelled = S::ZERO;
        self.distance = S::ZERO;
    }
}

/// The value, or zero if it is negative.
#[inline(always)]
fn beyond_zero<S: Scalar>(value: S) -> S {
    if value > S::ZERO { value } else { S::ZERO }
}

/// The part of a value beyond `dead` either way.
#[inline(always)]
fn beyond<S: Scalar>(value: S, dead: S) -> S {
    if value > dead {
        value - dead
    } else if value < -dead {
        value + dead
    } else {
        S::ZERO
    }
}
