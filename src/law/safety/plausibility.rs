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
//! - **Wrong motion.** The model's speed with the largest load against it, and with the largest load behind it, are the
//!   bounds of the measured one; a bound that the axis passes goes along with it (a CUSUM test, Page 1954). An encoder or
//!   amplifier of the wrong sign, or an encoder that dies at speed, needs more load than there can be. Until the axis has
//!   once moved after enabling, a smaller one is the largest. The measured speed is that of [`Overspeed`], filtered over 8
//!   ticks, or noise of some counts would look like motion; the voltage lags by as much more.
//!
//! All of it is in integers, whatever the number type: the output is the sum of the converter's words, speeds are those of
//! the filter, shifted to the left as far as there is room. The comparison is made every fourth tick, of each axis in
//! another: the sums lose nothing by it.
//!
//! Without a model, an axis in open loop has a budget in volt-seconds in place of the distance.
//!
//! [`Overspeed`]: super::monitor::Overspeed

use super::monitor::{DITHER_COUNTS, SPEED_FILTER_BITS, SPEED_FRACTION_BITS};
use crate::law::rounding;

/// Ticks from one comparison of an axis to the next, as a power of two.
const INTERVAL_BITS: u32 = 2;
const INTERVAL_TICKS: f64 = (1u32 << INTERVAL_BITS) as f64;

/// Share of the output that is added to the largest load, for the error of the model's A: a quarter and a sixteenth.
const GAIN_ERROR_SHIFTS: (u32, u32) = (2, 4);

/// Time in which a distance of the model is forgotten, s, or down to half of it, for a power of two of ticks: what little
/// is left over does not add up for hours.
const FORGET_S: f64 = 0.3;

/// Largest speed, and gain of speed from one comparison to the next, that there is room for.
const ROOM: f64 = (1u32 << 28) as f64;

/// Fraction bits of a speed that a distance does without.
const DISTANCE_BITS: u32 = 8;

/// Units of a volt where there is no model.
const UNITS_PER_VOLT: f64 = (1u32 << 18) as f64;

/// Fraction bits of the force of a converter's word.
const PUSH_BITS: u32 = 16;

/// Ticks between two looks at an axis.
pub(super) const DUE_TICKS: u32 = 1 << INTERVAL_BITS;

/// True in the ticks in which the axis of this index is compared.
#[inline(always)]
pub(crate) const fn is_due(tick: u32, index: usize) -> bool {
    tick & (DUE_TICKS - 1) == index as u32
}

/// The converter's words as a voltage. Settings time only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Words {
    /// Words that a volt is, negative if the amplifier is reversed.
    pub per_volt: f64,
    /// The word of zero volts.
    pub offset: i32,
}

/// The plant as far as the comparison needs it. Settings time only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlausibilityModel {
    /// A, mm/(V s^2).
    pub gain_mm_per_v_s2: f64,
    /// B, 1/s.
    pub damping_per_s: f64,
    /// Td, s.
    pub delay_s: f64,
    /// Largest output, V.
    pub limit_v: f64,
    /// Largest measured speed, mm/s.
    pub largest_mm_s: f64,
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

/// Compares the encoder's motion with what the output must have caused; the default finds nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Plausibility {
    /// The axis is known by a model; else there is only the budget of the open loop.
    modelled: bool,
    /// Left shift from the filtered speed to the unit of speeds.
    shift: u32,
    /// The sum of words of zero volts.
    offset: i32,
    /// A word as the speed gained in a tick, 2^-16: forces are in that unit, too.
    push: i32,
    /// Share of the way to the output that the lagging force goes, 2^-32.
    lag: i32,
    held: i32,
    breakaway: i32,
    /// Share of a speed that is lost, 2^-32.
    drag: i32,
    /// Right shift from a distance to what is forgotten of it.
    forget_shift: u32,
    distance: i32,
    /// Largest load as the speed gained, at first and later.
    first_load: i32,
    load: i32,
    proving_counts: u32,
    velocity: i32,
}

/// An axis at a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Low bits of the count.
    pub count: i32,
    /// Filtered speed, 2^-8 counts per tick.
    pub speed: i32,
    /// Sum of the converter's words so far; wraps.
    pub words: i32,
    /// The loop is open.
    pub open: bool,
}

/// The memory of the comparison.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PlausibilityState {
    /// Count and sum of words at the last comparison.
    count: i32,
    words: i32,
    /// Force that has reached the axis.
    force: i32,
    /// That force at the last motion that was seen.
    anchor: i32,
    /// Counts since.
    travelled: i32,
    /// Speed and distance of the model since.
    modelled: i32,
    distance: i32,
    /// Counts since enabling, and true once they have gone far enough.
    way: i32,
    proved: bool,
    /// Speeds of the model with the largest load against it, and behind it.
    least: i32,
    most: i32,
}

impl Plausibility {
    /// The comparison with a model, of an encoder with counts of `resolution_mm`, in ticks of `period_s`. Settings time only.
    pub fn new(model: &PlausibilityModel, words: Words, resolution_mm: f64, period_s: f64) -> Self {
        let interval_s = INTERVAL_TICKS * period_s;
        // A speed in the filter's unit.
        let filtered = period_s / resolution_mm * f64::from(1u32 << SPEED_FRACTION_BITS);
        let push = model.gain_mm_per_v_s2 * interval_s * filtered;
        let largest = (model.largest_mm_s.max(model.velocity_mm_s) * filtered)
            .max(push * model.limit_v)
            .max(1.0);
        let shift = whole_log2(ROOM / largest);
        let unit = f64::from(1u32 << shift);
        let force = |volts: f64| rounding::round(push * volts * unit) as i32;
        let filter_s = period_s * (f64::from(1u32 << SPEED_FILTER_BITS) + 0.5 * INTERVAL_TICKS);
        let counts_per_speed = unit * f64::from(1u32 << (SPEED_FRACTION_BITS - DISTANCE_BITS));
        Self {
            modelled: true,
            shift,
            lag: share(interval_s / (model.delay_s + filter_s)),
            held: force(model.held_v),
            breakaway: force(model.breakaway_v),
            drag: share(model.damping_per_s * interval_s),
            forget_shift: whole_log2(FORGET_S / interval_s),
            distance: rounding::round(model.distance_mm / resolution_mm * counts_per_speed) as i32,
            first_load: force(model.first_load_v),
            load: force(model.load_v),
            proving_counts: (model.proving_mm / resolution_mm) as u32,
            velocity: rounding::round(model.velocity_mm_s * filtered * unit) as i32,
            ..Self::of_words(words, push * unit)
        }
    }

    /// A budget of `budget_v_s` volt-seconds beyond `breakaway_v`, in open loop, for an axis of which there is no model.
    /// Settings time only.
    pub fn without_model(budget_v_s: f64, breakaway_v: f64, words: Words, period_s: f64) -> Self {
        let units = |value: f64| rounding::round(value * UNITS_PER_VOLT) as i32;
        Self {
            // There is no telling what friction takes up.
            held: i32::MAX,
            breakaway: units(breakaway_v),
            forget_shift: whole_log2(FORGET_S / (INTERVAL_TICKS * period_s)),
            distance: units(budget_v_s / period_s) >> DISTANCE_BITS,
            ..Self::of_words(words, UNITS_PER_VOLT)
        }
    }

    /// The converter's words as forces; a volt is `per_volt` of them.
    fn of_words(words: Words, per_volt: f64) -> Self {
        let scale = f64::from(1u32 << PUSH_BITS) / INTERVAL_TICKS;
        Self {
            offset: words.offset << INTERVAL_BITS,
            push: rounding::round(per_volt / words.per_volt * scale) as i32,
            ..Self::default()
        }
    }

    /// A memory of an axis whose outputs are off until now: anything may have moved it.
    #[inline(always)]
    pub fn start(&self, shown: Shown) -> PlausibilityState {
        let speed = shown.speed.wrapping_shl(self.shift);
        PlausibilityState {
            count: shown.count,
            words: shown.words,
            least: speed,
            most: speed,
            ..PlausibilityState::default()
        }
    }

    /// Compares what the axis shows with what it showed the last time; returns true if the motion can come of the output.
    #[inline(always)]
    pub fn step(&self, state: &mut PlausibilityState, shown: Shown) -> bool {
        let counts = shown.count.wrapping_sub(state.count);
        let words = shown.words.wrapping_sub(state.words);
        (state.count, state.words) = (shown.count, shown.words);
        let pushed = words.wrapping_sub(self.offset);
        let pushed = ((i64::from(pushed) * i64::from(self.push)) >> PUSH_BITS) as i32;
        if self.modelled {
            state.force += part(pushed.saturating_sub(state.force), self.lag);
            let speed = shown.speed.wrapping_shl(self.shift);
            self.moves_along(state, counts, speed) & self.stands(state, counts, shown.open)
        } else {
            state.force = pushed;
            !shown.open | self.stands(state, counts, shown.open)
        }
    }

    /// False if the speed changes as no load changes it.
    #[inline(always)]
    fn moves_along(&self, state: &mut PlausibilityState, counts: i32, speed: i32) -> bool {
        let mut load = self.load;
        if !state.proved {
            state.way = state.way.saturating_add(counts);
            state.proved = state.way.unsigned_abs() > self.proving_counts;
            load = self.first_load;
        }
        let force = state.force;
        let size = force.saturating_abs();
        load = load
            .saturating_add(size >> GAIN_ERROR_SHIFTS.0)
            .saturating_add(size >> GAIN_ERROR_SHIFTS.1);
        let gained = force.saturating_sub(part(speed, self.drag));
        let least = state.least.saturating_add(gained).saturating_sub(load);
        let most = state.most.saturating_add(gained).saturating_add(load);
        state.least = least.max(speed);
        state.most = most.min(speed);
        (state.least.saturating_sub(speed) <= self.velocity)
            & (speed.saturating_sub(state.most) <= self.velocity)
    }

    /// False if the encoder stands though the axis must have moved.
    #[inline(always)]
    fn stands(&self, state: &mut PlausibilityState, counts: i32, open: bool) -> bool {
        state.travelled = state.travelled.saturating_add(counts);
        if state.travelled.unsigned_abs() > DITHER_COUNTS {
            state.travelled = 0;
            state.anchor = state.force;
            state.modelled = 0;
        } else {
            let mut force = beyond(state.force.saturating_sub(state.anchor), self.held);
            if open && force == 0 {
                force = beyond(state.force, self.breakaway);
            }
            state.modelled = if self.modelled {
                let lost = part(state.modelled, self.drag);
                state.modelled.saturating_add(force.saturating_sub(lost))
            } else {
                force
            };
        }
        // Kept through motion: an encoder with gaps shows some.
        let forgotten = state.distance >> self.forget_shift;
        state.distance = (state.distance - forgotten)
            .saturating_add(state.modelled >> (DISTANCE_BITS - INTERVAL_BITS));
        state.distance.saturating_abs() <= self.distance
    }
}

impl PlausibilityState {
    /// Leaves a mean word out of the output since the last comparison: one that nothing but a load answers.
    #[inline(always)]
    pub(crate) fn leave_out(&mut self, word: i32) {
        self.words = self.words.wrapping_add(word << INTERVAL_BITS);
    }

    /// Goes on from another origin of the count.
    pub fn recount(&mut self, count: i32) {
        self.count = count;
    }

    /// Begins a standstill anew: the loop is opened.
    pub fn forget_standstill(&mut self) {
        self.travelled = 0;
        self.modelled = 0;
        self.distance = 0;
    }
}

/// A share of less than a half, 2^-32. Settings time only.
fn share(value: f64) -> i32 {
    rounding::round(value.min(0.49) * f64::from(u32::MAX)) as i32
}

/// The binary logarithm, rounded down, within 0 to 20. Settings time only.
fn whole_log2(value: f64) -> u32 {
    let fits = |bits: &u32| f64::from(1u32 << bits) <= value;
    (1..=20).take_while(fits).count() as u32
}

/// The share of a value, rounded down.
#[inline(always)]
fn part(value: i32, share: i32) -> i32 {
    ((i64::from(value) * i64::from(share)) >> 32) as i32
}

/// The part of a value beyond `dead` either way.
#[inline(always)]
fn beyond(value: i32, dead: i32) -> i32 {
    if value > dead {
        value - dead
    } else if value < -dead {
        value + dead
    } else {
        0
    }
}
