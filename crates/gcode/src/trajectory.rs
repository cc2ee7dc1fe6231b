//! A path with its speed: where the tool is to be at every moment.

use crate::blending::round;
use crate::error::ProgramError;
use crate::interpret::{Move, Program};
use crate::runs::runs;
use crate::segment::{Segment, Vector};
use crate::speeds::Limits;
use crate::velocity_profile::Phase;

/// Longest program, s: its samples for three axes and two controllers take half a gigabyte.
const MOST_S: f64 = 600.0;
/// Length of the path, either way, on which the nearest point is looked for, over the distance from the present one: the nearest
/// point is at most twice as far from that, and a path about a corner is longer than its chord.
const SEARCHED: f64 = 4.0;

#[derive(Clone, Debug)]
pub struct Trajectory {
    moves: Vec<Move>,
    /// Start of each move in its run, mm.
    starts_mm: Vec<f64>,
    phases: Vec<TimedPhase>,
    duration_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct TimedPhase {
    /// First and last move of its run.
    first: usize,
    last: usize,
    start_s: f64,
    phase: Phase,
}

/// A place on the path at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Index in [`Trajectory::moves`].
    pub index: usize,
    /// Distance along it, mm.
    pub along_mm: f64,
    /// Speed along the path, mm/s.
    pub speed_mm_s: f64,
}

impl Trajectory {
    /// Plans a program's motion.
    ///
    /// # Errors
    /// Limits out of range, a move that leaves the travel, or a program that takes too long.
    pub fn plan(program: &Program, limits: &Limits) -> Result<Self, ProgramError> {
        limits.check()?;
        for step in &program.moves {
            limits.check_travel(step)?;
        }
        let moves = round(&program.moves, limits.corner_deviation_mm);
        let mut planned = Self {
            starts_mm: Vec::with_capacity(moves.len()),
            phases: Vec::new(),
            duration_s: 0.0,
            moves,
        };
        planned.rest(0, 0.0, program.rest_s);
        for run in runs(limits, &planned.moves) {
            let (first, last) = (run.moves.start, run.moves.end - 1);
            let mut end_mm = 0.0;
            for step in &planned.moves[run.moves] {
                planned.starts_mm.push(end_mm);
                end_mm += step.segment.length_mm();
            }
            for phase in run.phases {
                planned.append(first, last, phase);
            }
            planned.rest(
                last,
                planned.moves[last].segment.length_mm(),
                planned.moves[last].rest_s,
            );
        }
        if planned.duration_s > MOST_S {
            return Err(ProgramError::TooLong {
                duration_s: planned.duration_s,
                most_s: MOST_S,
            });
        }
        Ok(planned)
    }

    fn append(&mut self, first: usize, last: usize, phase: Phase) {
        self.phases.push(TimedPhase {
            first,
            last,
            start_s: self.duration_s,
            phase,
        });
        self.duration_s += phase.duration_s;
    }

    /// Adds a rest on a move.
    fn rest(&mut self, index: usize, along_mm: f64, duration_s: f64) {
        if duration_s > 0.0 {
            let start_mm = self.starts_mm.get(index).copied().unwrap_or(0.0);
            self.append(index, index, Phase::rest(start_mm + along_mm, duration_s));
        }
    }

    /// The moves of the path, rounded corners among them.
    pub fn moves(&self) -> &[Move] {
        &self.moves
    }

    /// Duration, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Length of the path, mm.
    pub fn length_mm(&self) -> f64 {
        self.moves.iter().map(|step| step.segment.length_mm()).sum()
    }

    /// The places at equal times, `rate_hz` a second, from the start to the end, both included.
    pub fn places(&self, rate_hz: f64) -> impl Iterator<Item = Place> + '_ {
        let count = (self.duration_s * rate_hz).ceil() as usize;
        let mut current = 0;
        (0..=count).map(move |tick| {
            let time_s = (tick as f64 / rate_hz).min(self.duration_s);
            while self
                .phases
                .get(current + 1)
                .is_some_and(|next| next.start_s <= time_s)
            {
                current += 1;
            }
            match self.phases.get(current) {
                Some(timed) => self.place(timed, time_s),
                None => Place {
                    index: 0,
                    along_mm: 0.0,
                    speed_mm_s: 0.0,
                },
            }
        })
    }

    fn place(&self, timed: &TimedPhase, time_s: f64) -> Place {
        let since = (time_s - timed.start_s).min(timed.phase.duration_s);
        let (along_mm, speed_mm_s) = timed.phase.at(since);
        let starts = &self.starts_mm[timed.first..=timed.last];
        let begun = starts.partition_point(|start_mm| *start_mm <= along_mm);
        let index = timed.first + begun.saturating_sub(1);
        let along_mm = along_mm - self.starts_mm[index];
        Place {
            index,
            along_mm: along_mm.clamp(0.0, self.moves[index].segment.length_mm()),
            speed_mm_s,
        }
    }

    /// The point at a place, mm.
    pub fn point(&self, place: &Place) -> Vector {
        self.moves[place.index].segment.point(place.along_mm)
    }

    /// The vector from the path to a point, mm: from the nearest point of the path about a place.
    pub fn deviation(&self, place: &Place, point: &Vector) -> Vector {
        let mut nearest = point - self.point(place);
        let searched_mm = SEARCHED * nearest.norm();
        let mut consider = |segment: &Segment, from_mm: f64| {
            let deviation = point - segment.point(segment.nearest(point, from_mm));
            if deviation.norm_squared() < nearest.norm_squared() {
                nearest = deviation;
            }
        };
        let present = &self.moves[place.index].segment;
        consider(present, place.along_mm);
        let mut before_mm = place.along_mm;
        for step in self.moves[..place.index].iter().rev() {
            if before_mm > searched_mm {
                break;
            }
            consider(&step.segment, step.segment.length_mm());
            before_mm += step.segment.length_mm();
        }
        let mut ahead_mm = present.length_mm() - place.along_mm;
        for step in &self.moves[place.index + 1..] {
            if ahead_mm > searched_mm {
                break;
            }
            consider(&step.segment, 0.0);
            ahead_mm += step.segment.length_mm();
        }
        nearest
    }
}
