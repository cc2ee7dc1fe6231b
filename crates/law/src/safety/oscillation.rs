//! The monitor for oscillation: a loop that swings by itself, or that its own feedforward makes swing.
//!
//! It sees the tracking error and the reference in whole counts, every fourth tick, and finds four things:
//!
//! - **The friction feedforward harms.** While the reference goes to and fro, the error swings by more than the distance that the
//!   reference goes. A friction feedforward does this if it pushes an axis whose friction is smaller than identified, or is behind a
//!   spring. After three such strokes in a row it is reduced to nothing within 50 ms, *on trial*. If the error then swings by less than 7/8
//!   in strokes of the same kind, the feedforward was the cause. That is reported, and the feedforward returns slowly after 5 s and eight
//!   strokes, or 20 s. After the third time it stays off until the settings change or the outputs are off. If it was not the cause, now or
//!   while it is off, the axis is shaken from outside: the feedforward returns at once, and there is no other trial for a minute. It also
//!   returns at once with a stroke more than twice as long, in which it need not harm.
//! - **Slow or short motions**, where the settings say that friction fed forward does harm there: it fades within 50 ms by the largest speed
//!   of the reference in this stroke and the one before, and by the longer one of both, so that a reversal of a fast or long motion still
//!   has all of it. A stroke that begins after a tenth of a second at rest is fast and long until it turns: it is mostly a move, and what harms
//!   is a reversal of a small sine. Of a move or a sine of the plan, both are known from the start; an axis that rests after enabling has none.
//!   Friction that returns would act beside an integral that holds it, and throw the axis: the integral gives back what it has taken up.
//! - **Hum.** At rest, the error swings evenly at 20 Hz or more for a second. It is reported, and nothing is done.
//! - **Instability.** The error swings evenly for a second, each time by more than a limit and by more than twice the distance
//!   that the reference goes meanwhile. That is a fault.
//!
//! All of it is in integers, so that every number type finds the same, and without a division.

use crate::reference::PlannedStroke;
use crate::rounding;
use crate::scalar::{Quantity, Scalar};

/// Number of steps in which the friction feedforward is reduced to nothing.
const REDUCTION_STEPS: u8 = 100;
/// Time for all of them, s.
const REDUCING_S: f64 = 0.05;
/// Time for the way back, s.
const RETURN_S: f64 = 2.0;

/// Time for which the friction feedforward stays off after it has harmed, s.
const AWAY_S: f64 = 5.0;
/// Time after which the next trial may be made, s.
const PATIENCE_S: f64 = 60.0;

/// Strokes for which the friction feedforward stays off.
const AWAY_STROKES: u8 = 8;
/// Multiple of [`AWAY_S`] after which it returns without these strokes.
const MOST_AWAY: u32 = 4;

/// Longest stroke of a trial, s: a motion that has ended shows nothing.
const TRIAL_S: f64 = 5.0;

/// Window in which an oscillation is even, and time of rest before it counts as hum, s.
const WINDOW_S: f64 = 1.0;

/// Time at rest after which a stroke has nothing to do with the one before, s.
const PAUSE_S: f64 = 0.1;

/// Strokes one after the other at whose ends the error has swung too far, in them or from the one to the other.
const BAD_STROKES: u8 = 3;

/// Strokes of a trial until neither a stroke nor the one before began with the friction feedforward.
const MIXED_STROKES: u8 = 3;

/// Times after which what is added stays away.
const MOST_TIMES: u8 = 3;

/// Least swing that counts as harm, counts.
const LEAST_HARM: u32 = 16;

/// Least way back of the error that ends a swing, counts.
const LEAST_BACK: u32 = 3;

/// Least half cycles of a hum in a window.
const HUM_HALF_CYCLES: u32 = 40;
/// Least half cycles of an instability in a window.
const UNSTABLE_HALF_CYCLES: u32 = 6;

/// A count, 2^-16 counts.
const ONE_COUNT: f64 = (1_u32 << 16) as f64;
/// Fraction bits of a number of steps.
const STEPS_SHIFT: u32 = 24;
/// A step with them.
const STEPS_SCALE: f64 = (1_u32 << STEPS_SHIFT) as f64;

/// Bound of errors and distances, counts.
const MOST_COUNTS: i64 = 1 << 24;

/// Ticks between two looks at an axis: those of [`is_due`](super::plausibility::is_due).
const LOOK_TICKS: f64 = super::plausibility::DUE_TICKS as f64;

/// Watches an axis for oscillation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Oscillation<S: Scalar> {
    /// Friction is fed forward, which can be reduced.
    feeds_friction: bool,
    /// Steps by which it is reduced in a look, and looks to a step on the way back.
    steps_per_look: u8,
    return_looks: u32,
    away_looks: u32,
    patience_looks: u32,
    trial_looks: u32,
    window_looks: u32,
    pause_looks: u32,
    /// Swing that is a fault, counts; the largest number for none.
    unstable_counts: u32,
    /// Speed of strokes on which no friction is fed forward, 2^-16 counts a tick, and their length, counts.
    slow: Fading,
    short: Fading,
    /// Share of what is added in a step.
    share: S::Gain,
}

/// Fading of the friction feedforward by a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Fading {
    /// Largest value at which none is fed forward; all of it from twice that on. 0: it does not fade.
    from: u32,
    /// Steps for each unit above it, 2^-24.
    steps_per_unit: u32,
}

/// Kind of an oscillation that was found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OscillationKind {
    /// The axis hums at rest.
    #[default]
    Hum,
    /// The friction fed forward made it; it is taken away, and comes back.
    Added,
    /// The friction fed forward made it for the third time; it stays away.
    AddedForGood,
}

/// An oscillation that was found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OscillationReading {
    /// Number of oscillations found so far; wraps.
    pub number: u8,
    /// Its kind.
    pub kind: OscillationKind,
    /// Half cycles seen.
    pub half_cycles: u32,
    /// Looks that they took.
    pub looks: u32,
    /// Looks in a second.
    pub looks_per_s: u32,
    /// Sum of the swings from one turn to the next, counts.
    pub swings: u32,
}

/// Motion of the axis in a look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OscillationInput {
    /// Tracking error, counts.
    pub error: i64,
    /// Position of the reference, counts.
    pub reference: i64,
    /// Sense in which the reference moves: -1, 0 or 1.
    pub sense: i8,
    /// Displacement of the reference in a tick, 2^-16 counts, in either sense.
    pub speed: u32,
    /// The axis is excited on purpose.
    pub excited: bool,
}

/// Treatment of the friction fed forward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Phase {
    /// All of it acts, unless it is on its way back.
    #[default]
    Watching,
    /// It is being reduced.
    Reducing,
    /// It is away, and the error is compared with that of before.
    Trial,
    /// It has harmed and stays away.
    Away,
    /// It has not harmed and comes back at once.
    Restoring,
}

/// The memory of the monitor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OscillationState {
    /// Steps by which the friction fed forward is reduced.
    reduced: u8,
    /// The same because the motion is slow.
    faded: u8,
    /// Steps by which it was reduced, or faded, when [`Oscillation::returned`] was asked for.
    left_out_before: u8,
    /// Strokes of the motion under way, if they are known.
    planned: Option<PlannedStroke>,
    pace: Pace,
    phase: Phase,
    /// Looks in the phase, and until the next trial.
    looks: u32,
    patience: u32,
    times: u8,
    /// Strokes of the trial.
    strokes: u8,
    bad: u8,
    /// The strokes that began the trial.
    before: Strokes,
    stroke: Stroke,
    /// The stroke before.
    stroke_before: Stroke,
    turns: Turns,
    reading: OscillationReading,
}

/// Largest speeds of the reference, 2^-16 counts a tick, and its ways, counts: in this stroke and the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Pace {
    /// Sense of the stroke; 0 until there is one.
    sense: i8,
    most: u32,
    most_before: u32,
    /// Position at which the stroke began, counts.
    from: i32,
    way: u32,
    way_before: u32,
    /// Looks since it came to rest.
    rested: u32,
}

/// The way of the reference in one sense, and of the error meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Stroke {
    sense: i8,
    looks: u32,
    from: i32,
    to: i32,
    least: i32,
    most: i32,
}

/// Two strokes of the reference, forth and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Strokes {
    /// Distance between the ends of the error, and way of the reference, counts.
    swing: u32,
    way: u32,
    /// Looks in the second.
    looks: u32,
}

/// The turns of the error in a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Turns {
    /// The error rises.
    rises: bool,
    /// The last turn, and the farthest place since.
    last: Place,
    extreme: Place,
    /// Looks since the last turn, and of the half cycle before it.
    age: u32,
    interval: u32,
    /// Largest swing of late, counts.
    envelope: u32,
    /// Looks in the window; half cycles, even ones, and those as large as an instability; of the even ones, the sum of the swings, counts,
    /// and of the looks.
    looks: u32,
    half_cycles: u32,
    even: u32,
    large: u32,
    swings: u32,
    even_looks: u32,
    /// The reference has moved in the window.
    moved: bool,
    /// The hum has been reported.
    reported: bool,
}

/// Error and reference, counts, some looks after the last turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Place {
    error: i32,
    reference: i32,
    age: u32,
}

impl<S: Scalar> Oscillation<S> {
    /// A monitor of an axis with or without friction fed forward, whose error may not swing by `unstable_counts` or more for a
    /// second. Settings time only.
    pub fn new(feeds_friction: bool, unstable_counts: f64, period_s: f64) -> Self {
        let look_s = period_s * LOOK_TICKS;
        let looks = |time_s: f64| rounding::round(time_s / look_s).max(1.0) as u32;
        let steps = f64::from(REDUCTION_STEPS);
        Self {
            feeds_friction,
            steps_per_look: rounding::ceil(steps * look_s / REDUCING_S).clamp(1.0, steps) as u8,
            return_looks: looks(RETURN_S / steps),
            away_looks: looks(AWAY_S),
            patience_looks: looks(PATIENCE_S),
            trial_looks: looks(TRIAL_S),
            window_looks: looks(WINDOW_S),
            pause_looks: looks(PAUSE_S),
            unstable_counts: rounding::round(unstable_counts) as u32,
            slow: Fading::default(),
            short: Fading::default(),
            share: S::gain(1.0 / steps, Quantity::Integer, Quantity::Multiplier),
        }
    }

    /// The same, which leaves out the friction feedforward on strokes up to so many counts a tick, and has all of it from twice that on. Settings
    /// time only.
    #[must_use]
    pub fn feeding_from(mut self, counts_per_tick: f64) -> Self {
        self.slow = Fading::from(counts_per_tick * ONE_COUNT);
        self
    }

    /// The same by the length of strokes, counts. Settings time only.
    #[must_use]
    pub fn feeding_beyond(mut self, counts: f64) -> Self {
        self.short = Fading::from(counts);
        self
    }

    /// A monitor that finds nothing.
    pub fn off() -> Self {
        Self {
            unstable_counts: u32::MAX,
            window_looks: u32::MAX,
            ..Self::default()
        }
    }

    /// Forgets everything but what has been reported: the outputs are off. Where friction fed forward fades, there is none until a motion
    /// shows that it is to be.
    pub(crate) fn restart(&self, state: &mut OscillationState) {
        let faded = if self.may_ever_fade() {
            REDUCTION_STEPS
        } else {
            0
        };
        *state = OscillationState {
            reading: state.reading,
            faded,
            left_out_before: faded,
            ..OscillationState::default()
        };
    }

    /// Forgets what was found under other settings; the motion under way goes on.
    pub(crate) fn forget(&self, state: &mut OscillationState) {
        let faded = if self.may_ever_fade() { state.faded } else { 0 };
        *state = OscillationState {
            reading: state.reading,
            faded,
            left_out_before: faded,
            planned: state.planned,
            pace: state.pace,
            ..OscillationState::default()
        };
    }

    /// The share of the friction feedforward that acts, a [`Quantity::Multiplier`], while it is reduced.
    pub fn share(&self, state: &OscillationState) -> S {
        S::scale_integer(i32::from(REDUCTION_STEPS - state.left_out()), self.share)
    }

    /// The share of the friction feedforward, a [`Quantity::Multiplier`], that acts again since this was asked for; zero if less acts.
    pub(crate) fn returned(&self, state: &mut OscillationState) -> S {
        let left_out = state.left_out();
        let before = core::mem::replace(&mut state.left_out_before, left_out);
        S::scale_integer(i32::from(before.saturating_sub(left_out)), self.share)
    }

    /// True if a stroke of unknown end begins now, after a rest, and friction that had faded returns with it; then all of it acts.
    pub(crate) fn returns_from_rest(&self, state: &mut OscillationState) -> bool {
        let returns = (state.faded > 0)
            & (state.reduced == 0)
            & state.planned.is_none()
            & self.has_paused(state);
        if returns {
            (state.faded, state.left_out_before) = (0, 0);
        }
        returns
    }

    /// True of an axis whose next stroke has nothing to do with the one before.
    fn has_paused(&self, state: &OscillationState) -> bool {
        (state.pace.rested >= self.pause_looks) | (state.pace.sense == 0)
    }

    /// Looks at the axis; returns false if it is not stable.
    #[inline(never)]
    pub fn step(&self, state: &mut OscillationState, input: OscillationInput) -> bool {
        if self.may_ever_fade() {
            self.fade(state, input);
        }
        if input.excited {
            state.stroke = Stroke::default();
            state.stroke_before = Stroke::default();
            state.bad = 0;
            let reported = state.turns.reported;
            state.turns = Turns {
                reported,
                ..Turns::default()
            };
            return true;
        }
        let error = input.error.clamp(-MOST_COUNTS, MOST_COUNTS) as i32;
        let reference = input.reference as i32;
        if self.feeds_friction {
            self.follow(state, error, reference, input.sense);
        }
        self.count(state, error, reference, input.sense != 0)
    }

    /// Fades the friction feedforward by the largest speed, and by the way, in this stroke and the one before; at rest it stays.
    #[cold]
    #[inline(never)]
    fn fade(&self, state: &mut OscillationState, input: OscillationInput) {
        let OscillationInput { sense, speed, .. } = input;
        let reference = input.reference as i32;
        let has_paused = self.has_paused(state);
        let pace = &mut state.pace;
        if sense == 0 {
            pace.rested = pace.rested.saturating_add(1);
            return;
        }
        if (sense != pace.sense) | has_paused {
            (pace.most_before, pace.way_before) = match state.planned {
                Some(planned) => (planned.speed, planned.counts),
                None if has_paused => (u32::MAX, u32::MAX),
                None => (pace.most, pace.way),
            };
            pace.sense = sense;
            pace.from = reference;
            (pace.most, pace.way) = (0, 0);
        }
        pace.rested = 0;
        pace.most = pace.most.max(speed);
        pace.way = reference.wrapping_sub(pace.from).unsigned_abs();
        let most = pace.most.max(pace.most_before);
        let target = self.steps(most, pace.way.max(pace.way_before));
        let (least, most) = (
            state.faded.saturating_sub(self.steps_per_look),
            state.faded.saturating_add(self.steps_per_look),
        );
        state.faded = target.max(least).min(most);
    }

    /// Steps by which the friction feedforward is reduced on strokes of a speed, 2^-16 counts a tick, and a length, counts.
    fn steps(&self, speed: u32, counts: u32) -> u8 {
        self.slow.steps(speed).max(self.short.steps(counts))
    }

    /// True if there are motions on which less friction is fed forward.
    #[inline(always)]
    fn may_ever_fade(&self) -> bool {
        self.feeds_friction & (self.slow.from | self.short.from > 0)
    }

    /// Takes the strokes of the motion that begins, if they are known. Of the first one after enabling, no friction acts yet that could fade.
    pub fn plan(&self, state: &mut OscillationState, planned: Option<PlannedStroke>) {
        state.planned = planned;
        let Some(planned) = planned else {
            return;
        };
        if self.may_ever_fade() && state.pace.most == 0 {
            state.faded = self.steps(planned.speed, planned.counts);
            state.left_out_before = state.left_out();
        }
        state.pace.sense = 0;
    }

    /// Follows the strokes of the reference, and reduces or restores the friction feedforward.
    #[inline(always)]
    fn follow(&self, state: &mut OscillationState, error: i32, reference: i32, sense: i8) {
        state.looks = state.looks.saturating_add(1);
        state.patience = state.patience.saturating_sub(1);
        let ended = if sense == 0 {
            None
        } else {
            state.stroke.step(error, reference, sense)
        };
        let judged = ended.map(|stroke| {
            let before = core::mem::replace(&mut state.stroke_before, stroke);
            let strokes = Strokes {
                swing: stroke.swing_with(&before),
                way: stroke.reach().max(before.reach()),
                looks: stroke.looks,
            };
            let bad = strokes.swing > strokes.way && strokes.swing > LEAST_HARM;
            state.bad = if bad { state.bad.saturating_add(1) } else { 0 };
            strokes
        });
        match state.phase {
            Phase::Watching => {
                if state.reduced > 0 && state.looks >= self.return_looks {
                    state.reduced -= 1;
                    state.looks = 0;
                }
                if let Some(strokes) = judged
                    && state.bad >= BAD_STROKES
                    && state.patience == 0
                {
                    state.before = strokes;
                    state.enter(Phase::Reducing);
                }
            }
            Phase::Reducing => {
                state.reduced = state
                    .reduced
                    .saturating_add(self.steps_per_look)
                    .min(REDUCTION_STEPS);
                if state.reduced == REDUCTION_STEPS {
                    state.enter(Phase::Trial);
                }
            }
            Phase::Trial => self.judge_trial(state, judged),
            Phase::Away => {
                let strokes = state.strokes.saturating_add(u8::from(judged.is_some()));
                state.strokes = strokes;
                if let Some(now) = judged {
                    if now.is_like(&state.before) && !now.is_better_than(&state.before) {
                        return self.restore(state);
                    }
                    if now.way > state.before.way.saturating_mul(2) {
                        return state.enter(Phase::Restoring);
                    }
                }
                let shortest = if strokes < AWAY_STROKES {
                    self.away_looks.saturating_mul(MOST_AWAY)
                } else {
                    self.away_looks
                };
                if state.looks >= shortest && state.times < MOST_TIMES {
                    state.enter(Phase::Watching);
                }
            }
            Phase::Restoring => {
                state.reduced = state.reduced.saturating_sub(self.steps_per_look);
                if state.reduced == 0 {
                    state.enter(Phase::Watching);
                }
            }
        }
    }

    /// Judges by the strokes that ended whether the friction feedforward was the cause.
    fn judge_trial(&self, state: &mut OscillationState, judged: Option<Strokes>) {
        let Some(now) = judged else {
            if state.looks >= self.trial_looks {
                state.enter(Phase::Watching);
            }
            return;
        };
        state.looks = 0;
        state.strokes += 1;
        if state.strokes < MIXED_STROKES {
            return;
        }
        if !now.is_like(&state.before) || !now.is_better_than(&state.before) {
            self.restore(state);
        } else if state.strokes > MIXED_STROKES {
            state.times = state.times.saturating_add(1);
            let kind = if state.times < MOST_TIMES {
                OscillationKind::Added
            } else {
                OscillationKind::AddedForGood
            };
            self.report(state, kind, (1, now.looks, state.before.swing));
            state.enter(Phase::Away);
        }
    }

    /// Brings back what was not the cause.
    fn restore(&self, state: &mut OscillationState) {
        state.patience = self.patience_looks;
        state.enter(Phase::Restoring);
    }

    /// Counts the turns of the error; returns false if it is not stable.
    #[inline(always)]
    fn count(&self, state: &mut OscillationState, error: i32, reference: i32, moves: bool) -> bool {
        let turns = &mut state.turns;
        turns.moved |= moves;
        turns.step(error, reference, self.unstable_counts);
        if turns.looks < self.window_looks {
            return true;
        }
        let seen = *turns;
        turns.begin_window();
        let mostly = |part: u32| part.saturating_mul(8) >= seen.half_cycles.saturating_mul(7);
        if !mostly(seen.even) || seen.half_cycles < UNSTABLE_HALF_CYCLES {
            turns.reported &= seen.moved;
            return true;
        }
        if mostly(seen.large) {
            return false;
        }
        if seen.moved {
            return true;
        }
        if seen.half_cycles < HUM_HALF_CYCLES {
            turns.reported = false;
        } else if !core::mem::replace(&mut turns.reported, true) {
            let found = (seen.even, seen.even_looks, seen.swings);
            self.report(state, OscillationKind::Hum, found);
        }
        true
    }

    fn report(&self, state: &mut OscillationState, kind: OscillationKind, found: (u32, u32, u32)) {
        let (half_cycles, looks, swings) = found;
        state.reading = OscillationReading {
            number: state.reading.number.wrapping_add(1),
            kind,
            half_cycles,
            looks,
            looks_per_s: self.window_looks,
            swings,
        };
    }
}

impl Fading {
    fn from(value: f64) -> Self {
        let from = rounding::round(value).min(f64::from(u32::MAX / 2));
        Self {
            from: from as u32,
            // Rounded up: what is left at 0 is nothing.
            steps_per_unit: rounding::ceil(f64::from(REDUCTION_STEPS) * STEPS_SCALE / from.max(1.0))
                .min(f64::from(u32::MAX)) as u32,
        }
    }

    /// Steps by which the friction feedforward is reduced at a value.
    #[inline(always)]
    fn steps(self, value: u32) -> u8 {
        let missing = (self.from * 2).saturating_sub(value).min(self.from);
        let steps = (u64::from(missing) * u64::from(self.steps_per_unit)) >> STEPS_SHIFT;
        steps.min(u64::from(REDUCTION_STEPS)) as u8
    }
}

impl OscillationReading {
    /// Frequency, Hz. It divides; not for the tick.
    pub fn frequency_hz(&self) -> f32 {
        let half_cycles = self.half_cycles as f32 * self.looks_per_s as f32;
        half_cycles / (2.0 * self.looks.max(1) as f32)
    }

    /// Mean amplitude, counts. It divides; not for the tick.
    pub fn amplitude_counts(&self) -> f32 {
        self.swings as f32 / (2.0 * self.half_cycles.max(1) as f32)
    }
}

impl OscillationState {
    /// True if more or less of the friction feedforward acts than when [`Oscillation::returned`] was asked for.
    pub(crate) fn has_changed(&self) -> bool {
        self.left_out_before != self.left_out()
    }

    /// True if all of it acted then.
    pub(crate) fn was_whole(&self) -> bool {
        self.left_out_before == 0
    }

    /// Steps by which it is reduced, or faded.
    fn left_out(&self) -> u8 {
        self.reduced.max(self.faded)
    }

    /// True while less than all of the friction feedforward acts.
    pub fn is_reduced(&self) -> bool {
        self.left_out() > 0
    }

    /// The oscillation that was found last.
    pub fn reading(&self) -> OscillationReading {
        self.reading
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.looks = 0;
        self.strokes = 0;
        self.bad = 0;
    }
}

impl Stroke {
    /// Takes the next look; returns the stroke that ends with it.
    #[inline(always)]
    fn step(&mut self, error: i32, reference: i32, sense: i8) -> Option<Self> {
        if sense == self.sense {
            self.looks = self.looks.saturating_add(1);
            self.to = reference;
            self.least = self.least.min(error);
            self.most = self.most.max(error);
            return None;
        }
        let ended = core::mem::replace(
            self,
            Self {
                sense,
                looks: 1,
                from: reference,
                to: reference,
                least: error,
                most: error,
            },
        );
        (ended.sense != 0).then_some(ended)
    }

    /// The distance between the ends of the error in this stroke and the one before, counts.
    fn swing_with(&self, before: &Self) -> u32 {
        if before.sense == 0 {
            return self.most.abs_diff(self.least);
        }
        let (least, most) = (self.least.min(before.least), self.most.max(before.most));
        most.abs_diff(least)
    }

    /// The distance of the reference, counts.
    fn reach(&self) -> u32 {
        self.to.wrapping_sub(self.from).unsigned_abs()
    }
}

impl Strokes {
    /// True if way and time are those of others within a quarter.
    fn is_like(&self, other: &Self) -> bool {
        let near = |this: u32, other: u32| this.abs_diff(other) <= other >> 2;
        near(self.way, other.way) & near(self.looks, other.looks)
    }

    /// True if the error swings by less than seven eighths of what it did in others.
    fn is_better_than(&self, other: &Self) -> bool {
        self.swing.saturating_mul(8) < other.swing.saturating_mul(7)
    }
}

impl Turns {
    /// Takes the next look: the error turns where it comes back by a quarter of its swings, and by some counts.
    #[inline(always)]
    fn step(&mut self, error: i32, reference: i32, unstable_counts: u32) {
        self.looks = self.looks.saturating_add(1);
        self.age = self.age.saturating_add(1);
        let back = if self.rises {
            self.extreme.error - error
        } else {
            error - self.extreme.error
        };
        let here = Place {
            error,
            reference,
            age: self.age,
        };
        if back <= 0 {
            self.extreme = here;
        } else if back.unsigned_abs() >= (self.envelope >> 2).max(LEAST_BACK) {
            self.turn(unstable_counts);
            self.extreme = Place {
                age: self.age,
                ..here
            };
        }
    }

    /// Takes the farthest place for a turn.
    fn turn(&mut self, unstable_counts: u32) {
        let Place {
            error,
            reference,
            age: interval,
        } = self.extreme;
        let swing = error.abs_diff(self.last.error);
        let way = reference.wrapping_sub(self.last.reference).unsigned_abs();
        let about = interval.abs_diff(self.interval) <= (self.interval >> 2) + 1;
        self.half_cycles = self.half_cycles.saturating_add(1);
        if about & (swing >= self.envelope >> 1) {
            self.even = self.even.saturating_add(1);
            self.swings = self.swings.saturating_add(swing);
            self.even_looks = self.even_looks.saturating_add(interval);
        }
        let large = (swing >= unstable_counts) & (swing >= way.saturating_mul(2));
        self.large = self.large.saturating_add(u32::from(large));
        self.envelope = (self.envelope - (self.envelope >> 3)).max(swing);
        self.last = self.extreme;
        self.interval = interval;
        self.age -= interval;
        self.rises = !self.rises;
    }

    fn begin_window(&mut self) {
        self.looks = 0;
        self.half_cycles = 0;
        self.even = 0;
        self.large = 0;
        self.swings = 0;
        self.even_looks = 0;
        self.moved = false;
    }
}
