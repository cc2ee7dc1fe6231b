//! A path with its speed: where the tool is to be at every moment.

use crate::gcode::blending::round;
use crate::gcode::error::ProgramError;
use crate::gcode::interpret::{Move, Program};
use crate::gcode::segment::Vector;
use crate::gcode::speeds::Limits;
use crate::gcode::velocity_profile::Phase;

/// Longest program, s: its samples for three axes and two controllers take half a gigabyte.
const MOST_S: f64 = 600.0;
/// Moves before and after the present one on which the nearest point is looked for.
const NEIGHBOURS: usize = 2;

#[derive(Clone, Debug)]
pub struct Trajectory {
    moves: Vec<Move>,
    phases: Vec<TimedPhase>,
    duration_s: f64,
}

#[derive(Clone, Copy, Debug)]
struct TimedPhase {
    index: usize,
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
        let moves = round(program.moves.clone(), limits.corner_deviation_mm);
        let (on, joints) = limits.speeds(&moves);
        let mut phases = Vec::new();
        let mut start_s = 0.0;
        for (index, step) in moves.iter().enumerate() {
            let (most, pace) = on[index];
            let ends = [joints[index], joints[index + 1]];
            for phase in pace.phases(ends, most, step.element.length_mm()) {
                phases.push(TimedPhase {
                    index,
                    start_s,
                    phase,
                });
                start_s += phase.duration_s;
            }
        }
        if start_s > MOST_S {
            return Err(ProgramError::TooLong {
                duration_s: start_s,
                most_s: MOST_S,
            });
        }
        Ok(Self {
            moves,
            phases,
            duration_s: start_s,
        })
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
        self.moves.iter().map(|step| step.element.length_mm()).sum()
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
            self.phases.get(current).map_or(
                Place {
                    index: 0,
                    along_mm: 0.0,
                    speed_mm_s: 0.0,
                },
                |timed| {
                    let since = (time_s - timed.start_s).min(timed.phase.duration_s);
                    let (along, speed_mm_s) = timed.phase.at(since);
                    Place {
                        index: timed.index,
                        along_mm: along.clamp(0.0, self.moves[timed.index].element.length_mm()),
                        speed_mm_s,
                    }
                },
            )
        })
    }

    /// The point at a place, mm.
    pub fn point(&self, place: &Place) -> Vector {
        self.moves[place.index].element.point(place.along_mm)
    }

    /// The vector from the path to a point, mm: from the nearest point of the path about a place.
    pub fn deviation(&self, place: &Place, point: &Vector) -> Vector {
        let first = place.index.saturating_sub(NEIGHBOURS);
        let last = (place.index + NEIGHBOURS).min(self.moves.len() - 1);
        let mut nearest = point - self.point(place);
        for index in first..=last {
            let element = &self.moves[index].element;
            let from_mm = match index.cmp(&place.index) {
                std::cmp::Ordering::Less => element.length_mm(),
                std::cmp::Ordering::Equal => place.along_mm,
                std::cmp::Ordering::Greater => 0.0,
            };
            let deviation = point - element.point(element.nearest(point, from_mm));
            if deviation.norm_squared() < nearest.norm_squared() {
                nearest = deviation;
            }
        }
        nearest
    }
}
