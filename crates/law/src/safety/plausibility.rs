//! The encoder compared with the plant: the motion that an output must have caused has to be seen.
//!
//! An encoder that dies lies to every other monitor too: with it, the axis neither leaves its reference nor is it too
//! fast. The output does not lie. What is compared is the voltage that has reached the axis, which is that of the
//! output through a lag of the plant's dead time. Three comparisons:
//!
//! - **No motion.** While the encoder stands (or dithers between two counts, as with one dead line), the voltage may
//!   change by what friction takes up before it yields visibly, or fall by what friction gives up as it eases under a vibration. What goes beyond moves a model, `v' = A u - B v`, from
//!   rest, and while nothing does, friction brakes it, except under an injected voltage, whose vibration releases what friction holds; when that has gone farther than a distance, the encoder is dead or the axis is blocked. The change counts from
//!   the last motion that was seen, because a load may be held at rest with any voltage; and in the sense in which the axis
//!   last slid, from the voltage at which it slid, beyond which friction takes up little more. In open loop nothing is held, so
//!   there the voltage itself counts too, beyond what friction can hold.
//! - **Not following.** Under control the net motion has to follow the reference, at least half as fast. While it does not, the
//!   voltage may grow by what friction takes up, and by what the law answers to a load that was seen to push the axis back. What
//!   goes beyond moves the model; when that is farther ahead of the motion shown than a distance, the encoder is dead. Counts
//!   that flicker, or go astray, are no net motion. A motion of some way shows that the axis is alive.
//! - **Wrong motion.** The model's speed with the largest load against it, and with the largest load behind it, are the
//!   bounds of the measured one; a bound that the axis passes goes along with it (a CUSUM test, Page 1954). An encoder or
//!   amplifier of the wrong sign, or an encoder that dies at speed, needs more load than there can be. Until the axis has
//!   once moved after enabling, a smaller one is the largest. The measured speed is that of [`Overspeed`], filtered over 8
//!   ticks, or noise of some counts would look like motion; the voltage lags by as much more.
//!
//! All of it is in integers, for every number type: the output is the sum of the converter's words, speeds are those of
//! the filter, shifted to the left as far as there is room. The comparison is made every fourth tick, of each axis in
//! another: the sums lose nothing by it.
//!
//! Without a model, an axis in open loop has a budget in volt-seconds in place of the distance. What friction holds is not known then:
//! for a while after a motion that was seen, only more voltage than there was at that motion is spent, since an axis that friction holds
//! still yields a little whenever the voltage changes.
//!
//! [`Overspeed`]: super::monitor::Overspeed

use super::monitor::{SPEED_FILTER_BITS, SPEED_FRACTION_BITS};
use crate::rounding;
use crate::units::{POSITION_FRACTION_BITS, Position};

/// Ticks from one comparison of an axis to the next, as a power of two.
const INTERVAL_BITS: u32 = 2;
/// The same as a number of ticks.
const INTERVAL_TICKS: f64 = (1u32 << INTERVAL_BITS) as f64;

/// Share of the output that is added to the largest load, for the error of the model's A: a quarter and a sixteenth.
const GAIN_ERROR_SHIFTS: (u32, u32) = (2, 4);

/// Time in which a distance of the model is forgotten, s, or down to half of it, for a power of two of ticks: what little
/// is left over does not add up for hours.
const FORGET_S: f64 = 0.3;

/// Largest speed, and largest gain of speed from one comparison to the next.
const MAX_SPEED: f64 = (1u32 << 28) as f64;

/// Time for which a motion shows, without a model, that the encoder is alive, s.
const ALIVE_S: f64 = 0.025;

/// Lag of the speed's filter, s, for each comparison in which a force that stops an axis comes through it: three at 1 kHz, one at 2 kHz,
/// none above, where it is over before what friction holds has changed.
const SETTLING_S: f64 = 0.003;

/// Time without a motion after which an axis rests if its reference does, s: longer than an encoder with gaps is silent.
const RESTS_S: f64 = 0.05;

/// Counts within which an encoder with one dead line dithers.
const DITHER_COUNTS: u32 = 2;

/// Comparisons over which the heading takes the mean of the motion, as a power of two.
const MEAN_BITS: u32 = 4;

/// Largest way, counts.
const LARGEST_WAY: f64 = (1u32 << 15) as f64;

/// Fraction bits of the force of a speed.
const THROWN_BITS: u32 = 16;

/// Fraction bits of a speed that a distance does without.
const DISTANCE_BITS: u32 = 8;

/// Units of a volt where there is no model.
const UNITS_PER_VOLT: f64 = (1u32 << 18) as f64;

/// Fraction bits of the force of a converter's word.
const PUSH_BITS: u32 = 16;

/// Ticks between two looks at an axis.
pub(super) const DUE_TICKS: u32 = 1 << INTERVAL_BITS;

/// True in the ticks in which the axis of this index is compared.
pub(crate) const fn is_due(tick: u32, index: usize) -> bool {
    tick & (DUE_TICKS - 1) == index as u32
}

/// The converter's words as a voltage. Settings time only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputScale {
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
    /// The same of a change towards zero, as far as there was that much voltage when the axis came to rest, V. As much is held of an axis
    /// that came to rest while its law braked it.
    pub eased_v: f64,
    /// The same of a voltage that fell to zero and beyond, on the other side, of an axis that rests, V.
    pub regained_v: f64,
    /// What friction takes up while the axis stands, in the sense in which it last slid, beyond the voltage at which it slid, V.
    pub stuck_v: f64,
    /// The same while an axis that slides does not follow, V.
    pub sliding_v: f64,
    /// The same of an axis that was turned around, or has not moved, V.
    pub turned_v: f64,
    /// The largest that is believed of such an axis, with any motion that it has shown, V.
    pub most_turned_v: f64,
    /// Voltage with which the law answers a displacement, V/mm, at most.
    pub answer_v_per_mm: f64,
    /// Voltage with which the law answers a speed, V s/mm, at most.
    pub answer_v_s_per_mm: f64,
    /// Motion the other way that turns an axis around, mm.
    pub turn_mm: f64,
    /// Motion of an axis that did not follow that shows that it is alive, mm.
    pub alive_mm: f64,
    /// Distance of the model ahead of what is shown that is a fault while the axis does not follow, mm.
    pub ahead_mm: f64,
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
    eased: i32,
    regained: i32,
    stuck: i32,
    sliding: i32,
    turned: i32,
    most_turned: i32,
    /// Force with which the law answers a count, and a speed, the latter in 2^-16.
    answer: i32,
    answer_to_speed: i32,
    /// Ways, 2^-8 counts.
    turn: i32,
    alive: i32,
    /// As `distance`.
    ahead: i32,
    breakaway: i32,
    /// Comparisons after a motion in which only more than the force at that motion counts, in open loop.
    alive_for: u32,
    /// Comparisons after a motion, while the reference stands, in which the force that stopped the axis comes through the lag.
    settling: u32,
    /// Comparisons without a motion after which an axis rests if its reference does.
    rests_after: u32,
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
    /// Position of the reference, 2^-8 counts; wraps.
    pub reference: i32,
    /// The loop is open.
    pub open: bool,
    /// A voltage is injected, in open loop or in closed loop.
    pub excited: bool,
}

impl Shown {
    /// The low bits of a position of the reference, 2^-8 counts.
    pub(crate) const fn reference(position: Position) -> i32 {
        (position.0 >> (POSITION_FRACTION_BITS - SPEED_FRACTION_BITS)) as i32
    }
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
    /// Comparisons and counts since.
    silent: u32,
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
    /// Reference at the last comparison.
    reference: i32,
    heading: Heading,
    /// What the axis is behind its reference in the positive sense, and in the negative one.
    forth: Lag,
    back: Lag,
}

/// The sense in which an axis slides, from the running mean of its motion. Ways are in 2^-8 counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Heading {
    /// 1 or -1; zero until the axis has moved.
    sense: i32,
    /// Force when the axis last went on in that sense.
    level: i32,
    /// Motion that the mean does not yet have, and the mean since the axis last went on.
    pending: i32,
    away: i32,
}

/// What an axis is behind its reference in one sense; senses, forces and speeds as seen from there. Ways are in 2^-8 counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Lag {
    /// Way of the reference that the axis has not followed by half.
    behind: i32,
    /// Force from which a growth counts, and true if the axis slides in this sense.
    base: i32,
    slides: bool,
    /// What friction takes up of the growth if it does not.
    turned: i32,
    /// Way of the axis since it was behind, the farthest of it the other way, and the least speed beside the reference's.
    way: i32,
    pushed: i32,
    thrown: i32,
    /// Speed of the model, and how far it is ahead of the motion shown.
    modelled: i32,
    ahead: i32,
}

impl Plausibility {
    /// The comparison with a model, of an encoder with counts of `resolution_mm`, in ticks of `period_s`. Settings time only.
    pub fn new(
        model: &PlausibilityModel,
        words: OutputScale,
        resolution_mm: f64,
        period_s: f64,
    ) -> Self {
        let interval_s = INTERVAL_TICKS * period_s;
        // A speed in the filter's unit.
        let filtered = period_s / resolution_mm * f64::from(1u32 << SPEED_FRACTION_BITS);
        let push = model.gain_mm_per_v_s2 * interval_s * filtered;
        let largest = (model.largest_mm_s.max(model.velocity_mm_s) * filtered)
            .max(push * model.limit_v)
            .max(1.0);
        let shift = whole_log2(MAX_SPEED / largest);
        let unit = f64::from(1u32 << shift);
        let force = |volts: f64| rounding::round(push * volts * unit) as i32;
        let filter_s = period_s * (f64::from(1u32 << SPEED_FILTER_BITS) + 0.5 * INTERVAL_TICKS);
        let counts_per_speed = unit * f64::from(1u32 << (SPEED_FRACTION_BITS - DISTANCE_BITS));
        let distance = |mm: f64| rounding::round(mm / resolution_mm * counts_per_speed) as i32;
        let way = |mm: f64| {
            let counts = (mm / resolution_mm).min(LARGEST_WAY);
            rounding::round(counts * f64::from(1u32 << SPEED_FRACTION_BITS)) as i32
        };
        let thrown = f64::from(1u32 << THROWN_BITS);
        let answer_to_speed = rounding::round(push * model.answer_v_s_per_mm / filtered * thrown);
        Self {
            modelled: true,
            shift,
            lag: share(interval_s / (model.delay_s + filter_s)),
            held: force(model.held_v),
            eased: force(model.eased_v),
            regained: force(model.regained_v),
            stuck: force(model.stuck_v),
            sliding: force(model.sliding_v),
            turned: force(model.turned_v),
            most_turned: force(model.most_turned_v),
            answer: force(model.answer_v_per_mm * resolution_mm),
            answer_to_speed: answer_to_speed as i32,
            turn: way(model.turn_mm),
            alive: way(model.alive_mm),
            ahead: distance(model.ahead_mm),
            breakaway: force(model.breakaway_v),
            drag: share(model.damping_per_s * interval_s),
            settling: (filter_s / SETTLING_S) as u32,
            rests_after: (RESTS_S / interval_s) as u32,
            forget_shift: whole_log2(FORGET_S / interval_s),
            distance: distance(model.distance_mm),
            first_load: force(model.first_load_v),
            load: force(model.load_v),
            proving_counts: (model.proving_mm / resolution_mm) as u32,
            velocity: rounding::round(model.velocity_mm_s * filtered * unit) as i32,
            ..Self::of_words(words, push * unit)
        }
    }

    /// A budget of `budget_v_s` volt-seconds beyond `breakaway_v`, in open loop, for an axis of which there is no model.
    /// Settings time only.
    pub fn without_model(
        budget_v_s: f64,
        breakaway_v: f64,
        words: OutputScale,
        period_s: f64,
    ) -> Self {
        let units = |value: f64| rounding::round(value * UNITS_PER_VOLT) as i32;
        Self {
            // What friction takes up is unknown.
            held: i32::MAX,
            breakaway: units(breakaway_v),
            alive_for: (ALIVE_S / (INTERVAL_TICKS * period_s)) as u32,
            forget_shift: whole_log2(FORGET_S / (INTERVAL_TICKS * period_s)),
            distance: units(budget_v_s / period_s) >> DISTANCE_BITS,
            ..Self::of_words(words, UNITS_PER_VOLT)
        }
    }

    /// The converter's words as forces; a volt is `per_volt` of them.
    fn of_words(words: OutputScale, per_volt: f64) -> Self {
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
            reference: shown.reference,
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
        let pushed = scaled(pushed, self.push, PUSH_BITS);
        if self.modelled {
            state.force += part(pushed.saturating_sub(state.force), self.lag);
            let speed = shown.speed.wrapping_shl(self.shift);
            let stands = (shown.reference == state.reference) & !shown.open;
            let rests = stands & (state.silent >= self.rests_after);
            let regained = if rests { self.regained } else { 0 };
            let follows = self.follows(state, counts, speed, shown);
            self.moves_along(state, counts, speed)
                & self.stands(state, counts, shown, regained)
                & follows
        } else {
            state.force = pushed;
            !shown.open | self.stands(state, counts, shown, 0)
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

    /// False if the net motion does not follow the reference though the force grows.
    #[inline(always)]
    fn follows(
        &self,
        state: &mut PlausibilityState,
        counts: i32,
        speed: i32,
        shown: Shown,
    ) -> bool {
        let requested = shown.reference.wrapping_sub(state.reference);
        let moved = counts.saturating_mul(1 << SPEED_FRACTION_BITS);
        state.reference = shown.reference;
        state.heading.turn(moved, state.force, self.turn);
        let step = Step {
            requested,
            moved,
            speed,
            force: state.force,
            heading: state.heading.sense,
            level: state.heading.level,
        };
        if (requested == 0) & !shown.open & (state.silent < self.settling) {
            state.anchor = state.force;
        }
        if shown.open {
            (state.forth, state.back) = (Lag::default(), Lag::default());
            return true;
        }
        self.keeps_up(&mut state.forth, step) & self.keeps_up(&mut state.back, step.reversed())
    }

    /// False if the axis must have gone farther in a sense than it shows.
    #[inline(always)]
    fn keeps_up(&self, lag: &mut Lag, step: Step) -> bool {
        let Step { moved, force, .. } = step;
        // Where the reference goes the other way, the axis need not lead it.
        let kept = if step.requested < 0 {
            moved >> 1
        } else {
            moved << 1
        };
        lag.behind = lag
            .behind
            .saturating_add(step.requested)
            .saturating_sub(kept);
        let alive = lag.way.saturating_sub(lag.pushed) > self.alive;
        if (lag.behind <= 0) | alive {
            let slides = step.heading > 0;
            *lag = Lag {
                base: if slides {
                    force.max(step.level).max(self.sliding)
                } else {
                    force
                },
                slides,
                // It slides the other way at this level, however far the settings' friction is from its own.
                turned: step
                    .level
                    .saturating_abs()
                    .saturating_mul(2)
                    .max(self.turned)
                    .min(self.most_turned),
                modelled: lag.modelled,
                ..Lag::default()
            };
        } else {
            lag.way = lag.way.saturating_add(moved);
            lag.pushed = lag.pushed.min(lag.way);
            let wished = self.speed(step.requested).max(0) >> INTERVAL_BITS;
            lag.thrown = lag.thrown.min(step.speed.saturating_sub(wished));
            lag.slides &= step.heading > 0;
        }
        let taken = if lag.slides {
            self.sliding
        } else {
            lag.turned.max(self.turned)
        };
        let pushed = scaled(lag.pushed, self.answer, SPEED_FRACTION_BITS);
        let thrown = scaled(lag.thrown, self.answer_to_speed, THROWN_BITS);
        let excess = force
            .saturating_sub(lag.base)
            .saturating_sub(taken)
            .saturating_add(pushed)
            .saturating_add(thrown);
        lag.ahead -= lag.ahead >> self.forget_shift;
        if excess <= 0 {
            lag.modelled = step.speed.min(0);
        } else {
            let lost = part(lag.modelled, self.drag);
            lag.modelled = lag.modelled.saturating_add(excess.saturating_sub(lost));
            let shown = self.speed(moved) >> SPEED_FRACTION_BITS;
            let gained = (lag.modelled >> (DISTANCE_BITS - INTERVAL_BITS)).saturating_sub(shown);
            lag.ahead = lag.ahead.saturating_add(gained).max(0);
        }
        lag.ahead <= self.ahead
    }

    /// A motion between two comparisons in the unit of speeds, for as many ticks.
    fn speed(&self, moved: i32) -> i32 {
        moved.saturating_mul(1 << self.shift)
    }

    /// The force beyond that at which the axis slid, and what friction takes up of it.
    #[inline(always)]
    fn beyond_sliding(&self, state: &PlausibilityState) -> i32 {
        let Heading { sense, level, .. } = state.heading;
        // A load may have moved the axis against its law, and one that slips may do so while its law brakes it: friction holds it as before.
        let forth = state.anchor.max(level).saturating_add(self.stuck);
        let back = state.anchor.min(level).saturating_sub(self.stuck);
        let forth = state.force.saturating_sub(forth.max(self.eased));
        let back = state.force.saturating_sub(back.min(-self.eased));
        match sense {
            1 => forth.max(0),
            -1 => back.min(0),
            _ => 0,
        }
    }

    /// The change of the force since the axis stands, beyond what friction takes up of it; of one towards zero friction may take up as
    /// much as there was, since under a vibration it eases without a motion, and then `regained`.
    #[inline(always)]
    fn beyond_held(&self, state: &PlausibilityState, regained: i32) -> i32 {
        let eased = state.anchor.max(-self.eased).min(self.eased);
        let change = state.force.saturating_sub(state.anchor);
        let forth = self.held.max(regained - eased);
        let back = self.held.max(regained + eased);
        change.saturating_sub(forth).max(0) + change.saturating_add(back).min(0)
    }

    /// False if the encoder stands though the axis must have moved.
    #[inline(always)]
    fn stands(
        &self,
        state: &mut PlausibilityState,
        counts: i32,
        shown: Shown,
        regained: i32,
    ) -> bool {
        state.travelled = state.travelled.saturating_add(counts);
        if state.travelled.unsigned_abs() > DITHER_COUNTS {
            state.travelled = 0;
            state.silent = 0;
            state.anchor = state.force;
            state.modelled = 0;
        } else {
            state.silent = state.silent.saturating_add(1);
            let held = self.beyond_held(state, regained);
            let mut force = larger(held, self.beyond_sliding(state));
            if shown.open && force == 0 {
                let mut allowed = self.breakaway;
                if state.silent < self.alive_for {
                    allowed = allowed.max(state.anchor.saturating_mul(state.force.signum()));
                }
                force = beyond(state.force, allowed);
            }
            state.modelled = if !self.modelled {
                force
            } else if force == 0 && !shown.excited {
                // Friction, which takes it up, brakes the model, too: pulses within a count do not add up.
                beyond(state.modelled, self.held)
            } else {
                let lost = part(state.modelled, self.drag);
                state.modelled.saturating_add(force.saturating_sub(lost))
            };
        }
        // Kept through motion: an encoder with gaps shows some.
        let forgotten = state.distance >> self.forget_shift;
        state.distance = (state.distance - forgotten)
            .saturating_add(state.modelled >> (DISTANCE_BITS - INTERVAL_BITS));
        state.distance.saturating_abs() <= self.distance
    }
}

/// What an axis did since the last comparison, in one sense.
#[derive(Clone, Copy)]
struct Step {
    /// Ways of the reference and of the axis, 2^-8 counts.
    requested: i32,
    moved: i32,
    speed: i32,
    force: i32,
    /// Sense in which the axis slides, and the force at which it did.
    heading: i32,
    level: i32,
}

impl Step {
    #[inline(always)]
    fn reversed(self) -> Self {
        Self {
            requested: self.requested.saturating_neg(),
            moved: self.moved.saturating_neg(),
            speed: self.speed.saturating_neg(),
            force: self.force.saturating_neg(),
            heading: -self.heading,
            level: self.level.saturating_neg(),
        }
    }
}

impl Heading {
    /// Takes a motion under a force; one of more than `turn` the other way turns the axis around.
    #[inline(always)]
    fn turn(&mut self, moved: i32, force: i32, turn: i32) {
        self.pending = self.pending.saturating_add(moved);
        let mean = self.pending >> MEAN_BITS;
        self.pending -= mean;
        self.away = self.away.saturating_add(mean);
        let goes_on = self.sense * self.away.signum() > 0;
        let way = if goes_on {
            1 << SPEED_FRACTION_BITS
        } else {
            turn
        };
        if self.away.saturating_abs() >= way {
            self.sense = self.away.signum();
            self.level = force;
            self.away = 0;
        }
    }
}

impl PlausibilityState {
    /// Leaves a mean word out of the output since the last comparison: one that nothing but a load answers.
    pub(crate) fn leave_out(&mut self, word: i32) {
        self.words = self.words.wrapping_add(word << INTERVAL_BITS);
    }

    /// Goes on from another origin of the count.
    pub fn recount(&mut self, count: i32) {
        let offset = count.wrapping_sub(self.count);
        self.count = count;
        self.reference = self
            .reference
            .wrapping_add(offset.wrapping_shl(SPEED_FRACTION_BITS));
    }

    /// Begins a standstill again: the loop is opened.
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
fn part(value: i32, share: i32) -> i32 {
    ((i64::from(value) * i64::from(share)) >> 32) as i32
}

/// The product of a value and a factor with fraction bits, rounded down, within what there is room for.
fn scaled(value: i32, factor: i32, fraction_bits: u32) -> i32 {
    let product = (i64::from(value) * i64::from(factor)) >> fraction_bits;
    product.clamp(i32::MIN.into(), i32::MAX.into()) as i32
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
