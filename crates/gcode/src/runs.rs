//! Runs: stretches of the path that take one rise and one fall of speed, so that acceleration is carried through their joints.
//!
//! A long move is a run by itself: it reaches its speed, after any move. Short ones, of which curves are written, are
//! joined as long as they are tangent. A run that is faster somewhere than a move of it allows is divided about the slowest of them,
//! until none is.

use std::ops::Range;

use crate::interpret::Move;
use crate::speeds::Limits;
use crate::velocity_profile::{Pace, Phase, fastest};

/// Moves that follow each other, and the speed along them.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Run {
    pub(super) moves: Range<usize>,
    /// Speeds at its ends, mm/s.
    ends_mm_s: [f64; 2],
    /// Phases of the speed; their places count from the run's start.
    pub(super) phases: Vec<Phase>,
}

/// Ratio of neighbouring steps that the speeds of short moves are rounded down to, where the axes bound them and not the feed:
/// moves of one speed are one stretch.
const SPEED_RATIO: f64 = 1.05;

/// Bounds of the speed on a path.
struct Bounds<'m> {
    moves: &'m [Move],
    /// Largest speed on each move, mm/s, and its pace.
    on: Vec<(f64, Pace)>,
    /// Largest speed at each joint, mm/s; the two ends are at rest.
    at: Vec<f64>,
}

/// Divides a path into runs, the highest speeds at their ends from which every later one can be met.
pub(super) fn runs(limits: &Limits, moves: &[Move]) -> Vec<Run> {
    let (bounds, mut divided) = Bounds::new(limits, moves);
    let mut found: Vec<Run> = Vec::new();
    loop {
        let ranges = ranges(&divided);
        let ends = bounds.ends(&ranges);
        // What is as it was needs no new plan.
        let mut before = std::mem::take(&mut found).into_iter().peekable();
        let mut complete = true;
        for (range, ends_mm_s) in ranges.into_iter().zip(ends) {
            while before
                .next_if(|run| run.moves.start < range.start)
                .is_some()
            {}
            let same = before.next_if(|run| run.moves == range && run.ends_mm_s == ends_mm_s);
            let run = same.unwrap_or_else(|| bounds.run(range, ends_mm_s));
            for slow in bounds.too_fast(&run) {
                divided[slow.start] = true;
                divided[slow.end] = true;
                complete = false;
            }
            found.push(run);
        }
        if complete {
            return found;
        }
    }
}

/// The ranges of moves between the joints at which a path is divided.
fn ranges(divided: &[bool]) -> Vec<Range<usize>> {
    let joints: Vec<usize> = (0..divided.len()).filter(|&joint| divided[joint]).collect();
    joints.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

impl<'m> Bounds<'m> {
    /// The bounds of a path, and the joints at which it is divided at least.
    fn new(limits: &Limits, moves: &'m [Move]) -> (Self, Vec<bool>) {
        let mut on: Vec<(f64, Pace)> = moves.iter().map(|step| limits.on(step)).collect();
        let mut divided = vec![false; moves.len() + 1];
        for (index, step) in moves.iter().enumerate() {
            let (speed, pace) = &mut on[index];
            if step.segment.length_mm() < 2.0 * pace.change_mm(0.0, *speed) {
                *speed = stepped(*speed, step.feed_mm_s);
            } else {
                divided[index] = true;
                divided[index + 1] = true;
            }
        }
        let mut at = vec![0.0; moves.len() + 1];
        for (index, pair) in moves.windows(2).enumerate() {
            let allowed = on[index].0.min(on[index + 1].0);
            let through = limits.through(&pair[0], &pair[1]);
            at[index + 1] = allowed.min(through);
            divided[index + 1] |= through < allowed;
        }
        for end in [0, moves.len()] {
            divided[end] = true;
        }
        (Self { moves, on, at }, divided)
    }

    fn length_mm(&self, range: &Range<usize>) -> f64 {
        let moves = self.moves[range.clone()].iter();
        moves.map(|step| step.segment.length_mm()).sum()
    }

    /// The pace that all moves of a range allow.
    fn pace(&self, range: &Range<usize>) -> Pace {
        let paces = self.on[range.clone()].iter().map(|(_, pace)| *pace);
        paces
            .reduce(|one, other| Pace {
                acceleration_mm_s2: one.acceleration_mm_s2.min(other.acceleration_mm_s2),
                jerk_mm_s3: one.jerk_mm_s3.min(other.jerk_mm_s3),
            })
            .unwrap_or(self.on[0].1)
    }

    /// The speeds at both ends of each range, mm/s.
    fn ends(&self, ranges: &[Range<usize>]) -> Vec<[f64; 2]> {
        let mut at: Vec<f64> = ranges.iter().map(|range| self.at[range.start]).collect();
        at.push(0.0);
        let reach = |index: usize, from_mm_s: f64, most_mm_s: f64| {
            let range = &ranges[index];
            most_mm_s.min(
                self.pace(range)
                    .reach_mm_s(from_mm_s, most_mm_s, self.length_mm(range)),
            )
        };
        // Backwards, so that every joint can be braked for; then forwards, so that it can be reached.
        for index in (0..ranges.len()).rev() {
            at[index] = reach(index, at[index + 1], at[index]);
        }
        for index in 0..ranges.len() {
            at[index + 1] = reach(index, at[index], at[index + 1]);
        }
        at.windows(2).map(|pair| [pair[0], pair[1]]).collect()
    }

    fn run(&self, moves: Range<usize>, ends_mm_s: [f64; 2]) -> Run {
        let speeds = self.on[moves.clone()].iter().map(|(speed, _)| *speed);
        let most_mm_s = speeds.fold(0.0, f64::max);
        let length_mm = self.length_mm(&moves);
        Run {
            phases: self.pace(&moves).phases(ends_mm_s, most_mm_s, length_mm),
            moves,
            ends_mm_s,
        }
    }

    /// The stretches of equal speed on which a run is too fast: the slowest of them, and those between faster ones.
    fn too_fast(&self, run: &Run) -> Vec<Range<usize>> {
        let speed = |range: &Range<usize>| self.on[range.start].0;
        let stretches: Vec<Range<usize>> = self.on[run.moves.clone()]
            .chunk_by(|one, other| one.0 == other.0)
            .scan(run.moves.start, |start, stretch| {
                let range = *start..*start + stretch.len();
                *start = range.end;
                Some(range)
            })
            .collect();
        if stretches.len() == 1 {
            return Vec::new();
        }
        let mut end_mm = 0.0;
        let mut exceeded = |range: &Range<usize>| {
            let begin_mm = end_mm;
            end_mm += self.length_mm(range);
            fastest(&run.phases, begin_mm..end_mm) > speed(range) * (1.0 + ROUNDING)
        };
        let exceeded: Vec<bool> = stretches.iter().map(&mut exceeded).collect();
        let within = |index: usize| exceeded[index].then(|| speed(&stretches[index]));
        let slowest = (0..stretches.len())
            .filter_map(within)
            .fold(f64::INFINITY, f64::min);
        let faster =
            |index: usize, than: f64| stretches.get(index).is_none_or(|range| speed(range) > than);
        (0..stretches.len())
            .filter(|&index| {
                let between = |own| {
                    own == slowest || faster(index.wrapping_sub(1), own) && faster(index + 1, own)
                };
                within(index).is_some_and(between)
            })
            .map(|index| stretches[index].clone())
            .collect()
    }
}

/// Share of a speed that is rounding.
const ROUNDING: f64 = 1e-10;

/// A speed below the feed, rounded down to a step of its scale.
fn stepped(speed_mm_s: f64, feed_mm_s: Option<f64>) -> f64 {
    if feed_mm_s.is_some_and(|feed| speed_mm_s >= feed) {
        return speed_mm_s;
    }
    let steps = (speed_mm_s.ln() / SPEED_RATIO.ln()).floor();
    SPEED_RATIO.powf(steps).min(speed_mm_s)
}
