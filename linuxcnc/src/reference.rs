//! From LinuxCNC's command to the law's reference: position, velocity and acceleration now, and after the axis' preview.
//!
//! The command that LinuxCNC puts out in a period is where the joint is to be one period later: its following error compares a
//! reading with the command of the period before, and so does `pid`. One period of the preview is therefore known, and only the rest is
//! extrapolated.

use quadrant_law::reference::ReferenceSample;
use quadrant_law::units::{POSITION_UNITS_PER_COUNT, Position};

/// Most ticks by which a command can be delayed.
pub const MOST_DELAY_TICKS: usize = 31;

/// Periods of the preview that the command knows, less the half for which an output is held on average.
const KNOWN_PERIODS: f64 = 0.5;

/// The way to the reference after the preview.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preview {
    /// By the command's velocity and acceleration: the feedback's reference is the command.
    #[default]
    Extrapolate,
    /// The feedback's reference is the command of some ticks ago: nothing is guessed, and the axis lags by that time.
    Delay,
}

/// LinuxCNC's command for a joint, mm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CommandPins {
    /// Distance of the command from the joint's feedback.
    pub ahead_mm: f64,
    /// Its velocity, mm/s.
    pub velocity_mm_s: f64,
}

/// Makes the reference of a joint.
#[derive(Clone, Debug)]
pub struct CommandReference {
    units_per_mm: f64,
    rate_hz: f64,
    /// Time from what is known of the command to the end of the preview, s.
    extrapolated_s: f64,
    /// Ticks by which the command is delayed besides the axis' own preview, so that all joints lag by the same.
    delay_ticks: Option<usize>,
    /// The command of the last tick, 2^-16 counts of the law, and its velocity.
    units: f64,
    velocity_mm_s: f64,
    past: [ReferenceSample<f32>; MOST_DELAY_TICKS + 1],
    place: usize,
}

/// The reference of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Led {
    /// Position of the feedback's reference now; none where the law delays it by itself.
    pub now: Option<Position>,
    /// The reference after the preview.
    pub ahead: ReferenceSample<f32>,
}

impl CommandReference {
    /// For a count of `resolution_mm`, without a preview.
    pub fn new(resolution_mm: f64, rate_hz: f64, preview: Preview) -> Self {
        Self {
            units_per_mm: POSITION_UNITS_PER_COUNT / resolution_mm,
            rate_hz,
            extrapolated_s: 0.0,
            delay_ticks: (preview == Preview::Delay).then_some(0),
            units: 0.0,
            velocity_mm_s: 0.0,
            past: [ReferenceSample::default(); MOST_DELAY_TICKS + 1],
            place: 0,
        }
    }

    /// Takes the axis' preview, and by how many ticks it is shorter than the longest of all axes.
    pub fn preview(&mut self, preview_s: f64, wait_ticks: usize) {
        match &mut self.delay_ticks {
            Some(delay) => *delay = wait_ticks.min(MOST_DELAY_TICKS),
            None => self.extrapolated_s = preview_s - KNOWN_PERIODS / self.rate_hz,
        }
    }

    /// One tick. `measured` is the joint's count in this tick; `begins`: no earlier command counts.
    pub fn step(&mut self, pins: CommandPins, measured: i64, begins: bool) -> Led {
        let velocity = if begins { 0.0 } else { pins.velocity_mm_s };
        let acceleration = if begins {
            0.0
        } else {
            (velocity - self.velocity_mm_s) * self.rate_hz
        };
        self.velocity_mm_s = velocity;
        let units = measured as f64 * POSITION_UNITS_PER_COUNT + pins.ahead_mm * self.units_per_mm;
        let before = if begins { units } else { self.units };
        self.units = units;
        let time_s = self.extrapolated_s;
        let way_mm = (velocity + 0.5 * acceleration * time_s) * time_s;
        let mut ahead = ReferenceSample {
            position: Position((units + way_mm * self.units_per_mm) as i64),
            velocity: (velocity + acceleration * time_s) as f32,
            acceleration: acceleration as f32,
        };
        let Some(delay) = self.delay_ticks else {
            return Led {
                now: Some(Position(before as i64)),
                ahead,
            };
        };
        if begins {
            self.past = [ahead; MOST_DELAY_TICKS + 1];
        }
        self.place = (self.place + 1) % self.past.len();
        self.past[self.place] = ahead;
        ahead = self.past[self.place.wrapping_sub(delay) % self.past.len()];
        Led { now: None, ahead }
    }
}
