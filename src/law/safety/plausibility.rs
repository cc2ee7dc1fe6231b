//! The encoder held against the plant: the motion that an output must have caused has to be seen.
//!
//! An encoder that dies lies to every other monitor too: with it, the axis neither leaves its reference nor is it too
//! fast. The output does not lie. Two comparisons, both on the voltage that has reached the axis, which is that of the
//! output through a lag of the plant's dead time:
//!
//! - **No motion.** While the encoder stays within a range, the voltage may change by what friction takes up there, [`Held`].
//!   What goes beyond moves a model, `v' = A u - B v`, from rest; when that has gone farther than a distance that was
//!   not seen, the encoder is dead or the axis is blocked. Counts that go to and fro are no motion: the
//!   change counts from the last time that the range grew, so that an encoder that flickers gains nothing once it has
//!   shown its range, and, with half as much again allowed, from when the range began. It begins again when it is wider than
//!   one that only an axis that moves goes through. Where the last motion of some way went one way and the voltage goes the
//!   other, friction may lose what it held without a motion, as under vibration. In open loop nothing is held, so there
//!   the voltage itself counts too, beyond what friction can hold. All of it twice: on what is shown at once, and on a
//!   running mean of it, which flickers less.
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

use super::monitor::{SPEED_FILTER_BITS, SPEED_FRACTION_BITS};
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

/// Comparisons over which the slow one takes the mean, as a power of two.
const SLOW_BITS: u32 = 4;

/// Growth of the range of motion that counts, 2^-8 counts: half a count of what is shown at once, and of the mean more than
/// the counts of noise leave in it.
const QUICK_STEP: i32 = 1 << (SPEED_FRACTION_BITS - 1);
const SLOW_STEP: i32 = 3 << (SPEED_FRACTION_BITS - 1);

/// Counts that a dead line shows, with noise, 2^-8 counts.
const DITHER: i32 = 4 << SPEED_FRACTION_BITS;

/// Share of what friction takes up that is added since the range began: a half.
const BASE_ERROR_SHIFT: u32 = 1;

/// Motion back that is a motion the other way, as a share of the range that only an axis that moves goes through: a quarter.
const TURN_SHIFT: u32 = 2;

/// Comparisons, as a power of two, in which a force that lasts becomes that of the load: a load that drifts changes it while
/// the law holds the axis where it is.
const LEAK_BITS: u32 = 12;

/// Largest range of motion that there is room for, counts.
const LARGEST_RANGE: u32 = 1 << 15;

/// Range of motion that only an axis that moves goes through, counts, where there is no model.
const ALIVE_COUNTS_WITHOUT_MODEL: u32 = 64;

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
    /// Change of the voltage that friction takes up within a range of motion.
    pub held: Held,
    /// Range of motion that only an axis that moves goes through, counts, at most 2^15.
    pub alive_counts: u32,
    /// Largest friction, V: what it may lose without a motion.
    pub friction_v: f64,
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
    /// The same for the mean of what is shown, mm.
    pub mean_distance_mm: f64,
    /// Gain of speed that no load explains and that is a fault, mm/s.
    pub velocity_mm_s: f64,
}

/// Change of the voltage that friction takes up while the axis stays within a range of motion: the least of some lines.
/// Settings time only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held(pub [HeldLine; HELD_LINES]);

/// One of these lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldLine {
    /// Change without motion, V.
    pub still_v: f64,
    /// Addition for each count of the range, V.
    pub per_count_v: f64,
}

/// Lines of [`Held`].
pub const HELD_LINES: usize = 3;

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
    held: [Line; HELD_LINES],
    /// Range of motion that only an axis that moves goes through, 2^-8 counts.
    alive: i32,
    friction: i32,
    breakaway: i32,
    /// Share of a speed that is lost, 2^-32.
    drag: i32,
    /// Right shift from a distance to what is forgotten of it.
    forget_shift: u32,
    distance: i32,
    mean_distance: i32,
    /// Largest load as the speed gained, at first and later.
    first_load: i32,
    load: i32,
    proving_counts: u32,
    velocity: i32,
}

/// A force that is a line over the range of motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Line {
    still: i32,
    per_count: i32,
}

impl Line {
    /// The force at a range of motion, 2^-8 counts.
    #[inline(always)]
    fn at(self, range: i32) -> i32 {
        let more = (i64::from(self.per_count) * i64::from(range)) >> SPEED_FRACTION_BITS;
        self.still.saturating_add(more as i32)
    }
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
    /// Position, 2^-8 counts; wraps.
    position: i32,
    /// The comparisons with what the axis shows at once, and with what it shows on average.
    quick: Standing,
    slow: Standing,
    /// Counts since enabling, and true once they have gone far enough.
    way: i32,
    proved: bool,
    /// Speeds of the model with the largest load against it, and behind it.
    least: i32,
    most: i32,
}

/// The memory of an axis that stands as far as can be told. Positions and ranges are in 2^-8 counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Standing {
    /// Force and position that are compared; the position wraps.
    force: i32,
    position: i32,
    /// Position and force where the range of motion began, and its ends, from there.
    origin: i32,
    base: i32,
    low: i32,
    high: i32,
    /// Force when the range last grew, and the ends of the motion since.
    anchor: i32,
    least: i32,
    most: i32,
    /// Sense of the last motion of some way, 1 or -1, or zero; and the farthest position of it.
    heading: i32,
    farthest: i32,
    /// Speed and distance of the model.
    modelled: i32,
    distance: i32,
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
            lag: share(interval_s / (model.delay_s + filter_s + 0e-3)),
            held: model.held.0.map(|line| Line {
                still: force(line.still_v),
                per_count: force(line.per_count_v),
            }),
            alive: (model.alive_counts.min(LARGEST_RANGE) << SPEED_FRACTION_BITS) as i32,
            breakaway: force(model.breakaway_v),
            friction: force(model.friction_v),
            drag: share(model.damping_per_s * interval_s),
            forget_shift: whole_log2(FORGET_S / interval_s),
            distance: rounding::round(model.distance_mm / resolution_mm * counts_per_speed) as i32,
            mean_distance: rounding::round(
                model.mean_distance_mm / resolution_mm * counts_per_speed,
            ) as i32,
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
            held: [Line {
                still: i32::MAX,
                per_count: 0,
            }; HELD_LINES],
            alive: (ALIVE_COUNTS_WITHOUT_MODEL << SPEED_FRACTION_BITS) as i32,
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
            position: shown.speed << SPEED_FILTER_BITS,
            quick: Standing {
                position: shown.speed << SPEED_FILTER_BITS,
                origin: shown.speed << SPEED_FILTER_BITS,
                ..Standing::default()
            },
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
        state.position = state
            .position
            .wrapping_add(counts.wrapping_shl(SPEED_FRACTION_BITS));
        if !self.modelled {
            state.force = pushed;
            let quick = &mut state.quick;
            quick.force = pushed;
            return !shown.open
                | self.stands(quick, state.position, (QUICK_STEP, self.distance), true);
        }
        state.force += part(pushed.saturating_sub(state.force), self.lag);
        let (quick, slow) = (&mut state.quick, &mut state.slow);
        quick.force = state.force;
        slow.force += state.force.saturating_sub(slow.force) >> SLOW_BITS;
        // As far behind as the filtered speed is.
        let position = state
            .position
            .wrapping_sub(shown.speed << SPEED_FILTER_BITS);
        let mean = position.wrapping_sub(slow.position) >> SLOW_BITS;
        let mean = slow.position.wrapping_add(mean);
        let stands = self.stands(
            quick,
            state.position,
            (QUICK_STEP, self.distance),
            shown.open,
        ) & self.stands(slow, mean, (SLOW_STEP, self.mean_distance), shown.open);
        let speed = shown.speed.wrapping_shl(self.shift);
        self.moves_along(state, counts, speed) & stands
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

    /// False if the encoder stands though the axis must have moved. `step` is the growth of the range of motion that counts,
    /// `most` the distance of the model that is a fault.
    #[inline(always)]
    fn stands(
        &self,
        state: &mut Standing,
        position: i32,
        (step, most): (i32, i32),
        open: bool,
    ) -> bool {
        let moved = position.wrapping_sub(state.position);
        state.position = position;
        let grows = self.widen(state, step);
        let force = state.force;
        let changed = force.saturating_sub(state.anchor);
        let range = state.most.saturating_sub(state.least);
        let of_anchor = beyond(changed, self.held(range, changed, state.heading));
        // In open loop; a dead line's counts are no motion.
        let wider = range.saturating_sub(DITHER).max(0);
        let more = self.held(wider, 0, 0).saturating_sub(self.held(0, 0, 0));
        state.anchor += changed >> LEAK_BITS;
        let changed = force.saturating_sub(state.base);
        let range = state.high.saturating_sub(state.low).saturating_add(step);
        let held = self.held(range, changed, state.heading);
        let of_base = beyond(changed, held.saturating_add(held >> BASE_ERROR_SHIFT));
        state.base += changed >> LEAK_BITS;
        let mut force_left = larger(of_anchor, of_base);
        if open && force_left == 0 {
            let more = if self.modelled { more } else { 0 };
            force_left = beyond(force, self.breakaway.saturating_add(more));
        }
        state.modelled = if grows & (of_base == 0) {
            0
        } else if self.modelled {
            let lost = part(state.modelled, self.drag);
            state
                .modelled
                .saturating_add(force_left.saturating_sub(lost))
        } else {
            force_left
        };
        let mut ahead = state.modelled >> (DISTANCE_BITS - INTERVAL_BITS);
        if self.modelled && (ahead != 0) & (moved ^ ahead >= 0) {
            let seen = moved.wrapping_shl(self.shift) >> SPEED_FRACTION_BITS;
            let left = ahead.saturating_sub(seen);
            ahead = if left ^ ahead >= 0 { left } else { 0 };
        }
        // Kept through motion: an encoder with gaps shows some.
        let forgotten = state.distance >> self.forget_shift;
        state.distance = (state.distance - forgotten).saturating_add(ahead);
        state.distance.saturating_abs() <= most
    }

    /// Takes a position into the range of motion; true if that grows by it.
    #[inline(always)]
    fn widen(&self, state: &mut Standing, step: i32) -> bool {
        let mut away = state.position.wrapping_sub(state.origin);
        let grows =
            (away > state.high.saturating_add(step)) | (away < state.low.saturating_sub(step));
        if grows {
            (state.low, state.high) = (state.low.min(away), state.high.max(away));
            (state.least, state.most) = (away, away);
            state.anchor = state.force;
            if state.high.saturating_sub(state.low) > self.alive {
                (state.origin, state.base) = (state.position, state.force);
                state.farthest = state.farthest.saturating_sub(away);
                (state.low, state.high) = (0, 0);
                (state.least, state.most) = (0, 0);
                away = 0;
            }
        }
        (state.least, state.most) = (state.least.min(away), state.most.max(away));
        let turn = self.alive >> TURN_SHIFT;
        let back = away.saturating_sub(state.farthest);
        if back.saturating_abs() > turn && (back ^ state.heading < 0) | (state.heading == 0) {
            state.heading = back.signum();
            state.farthest = away;
        } else if back ^ state.heading >= 0 && state.heading != 0 {
            state.farthest = away;
        }
        grows
    }

    /// The change of force that friction takes up within a range of motion.
    #[inline(always)]
    fn held(&self, range: i32, changed: i32, heading: i32) -> i32 {
        let [first, second, third] = self.held;
        let held = first.at(range).min(second.at(range)).min(third.at(range));
        let unloads = (changed ^ heading < 0) & (heading != 0);
        if unloads {
            held.saturating_add(self.friction)
        } else {
            held
        }
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
        for standing in [&mut self.quick, &mut self.slow] {
            (standing.modelled, standing.distance) = (0, 0);
        }
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

/// The one of two values that is farther from zero.
#[inline(always)]
fn larger(a: i32, b: i32) -> i32 {
    if a.saturating_abs() >= b.saturating_abs() {
        a
    } else {
        b
    }
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
