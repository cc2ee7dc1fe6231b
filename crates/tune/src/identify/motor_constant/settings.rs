//! The parts of a test of the motor constant.

use crate::record::Recording;

/// Parameters of the test of acceleration per volt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorConstantSettings {
    /// Lower level of the first test, V; it is raised until the axis slides.
    pub first_level_v: f64,
    /// Largest lower level, V.
    pub most_level_v: f64,
    /// Time at each level, s.
    pub dwell_s: f64,
    /// Levels in a pass.
    pub levels: usize,
    /// Time in which the voltage rises before the first level, s; 0 for none. A motor on a soft spring does not jump then.
    pub rise_s: f64,
    /// Upper level over the lower.
    pub upper_ratio: f64,
    /// Passes, alternating in direction; at least 2.
    pub passes: usize,
}

impl Default for MotorConstantSettings {
    fn default() -> Self {
        Self {
            first_level_v: 0.02,
            most_level_v: 5.0,
            dwell_s: 0.008,
            levels: 24,
            rise_s: 0.0,
            upper_ratio: 2.5,
            passes: 4,
        }
    }
}

/// Largest travel of the usual test, mm.
const ROOM_MM: f64 = 40.0;
/// Shortest dwell over the usual one.
const MIN_DWELL_RATIO: f64 = 0.4;
/// Fewest levels, a multiple of two.
const LEAST_LEVELS: usize = 14;
/// Factor on the dwell after a test that was stopped because it went too far.
const DWELL_REDUCTION: f64 = 0.75;
/// Shortest dwell, s.
const LEAST_DWELL_S: f64 = 0.0015;
/// Upper level over the lower in a gentle test.
const GENTLE_RATIO: f64 = 1.6;
/// Time in which the voltage of a gentle test rises, s: one and a half periods of a mode of 30 Hz.
const RISE_S: f64 = 0.05;
/// Time at rest between passes, s.
pub(super) const REST_S: f64 = 0.1;
/// Voltage from which on a sample belongs to a pass, V.
pub(super) const DRIVING_V: f64 = 0.01;

impl MotorConstantSettings {
    /// Shorter levels where the travel, either way, is short: the way goes with the square of the time.
    #[must_use]
    pub fn fitted_to(self, travel_mm: f64) -> Self {
        let share = (travel_mm / ROOM_MM).sqrt().clamp(MIN_DWELL_RATIO, 1.0);
        Self {
            dwell_s: share * self.dwell_s,
            ..self
        }
    }

    /// Time of one test, s.
    pub fn lasts_s(&self) -> f64 {
        self.passes as f64 * (self.rise_s + self.levels as f64 * self.dwell_s + REST_S)
    }

    /// Mean of the levels over the lower one.
    pub(super) fn mean_ratio(&self) -> f64 {
        0.5 * (1.0 + self.upper_ratio)
    }

    /// A voltage that rises first, to levels that are nearer to each other.
    #[must_use]
    pub(super) fn gentle(self) -> Self {
        Self {
            rise_s: RISE_S,
            upper_ratio: GENTLE_RATIO,
            ..self
        }
    }

    /// True for a test whose voltage rises first.
    pub(super) fn is_gentle(&self) -> bool {
        self.rise_s > 0.0
    }

    /// Fewer levels, down to those that a pass takes, then shorter ones.
    #[must_use]
    pub(super) fn shortened(self) -> Self {
        let levels = (self.levels * 2 / 3).max(LEAST_LEVELS);
        let dwell_s = if levels == self.levels {
            (DWELL_REDUCTION * self.dwell_s).max(LEAST_DWELL_S)
        } else {
            self.dwell_s
        };
        Self {
            levels,
            dwell_s,
            ..self
        }
    }

    /// The settings of a recorded test: its first pass shows how many levels it has, and how long each lasted.
    pub fn of(recording: &Recording) -> Self {
        let usual = Self::default();
        let drives = |volts: &&f64| volts.abs() > DRIVING_V;
        let driven = recording
            .voltage_v
            .iter()
            .skip_while(|volts| !drives(volts));
        let pass: Vec<f64> = driven.take_while(drives).map(|volts| volts.abs()).collect();
        let found = Levels::of(&pass);
        let changes = pass[found.first..]
            .windows(2)
            .filter(|pair| found.is_upper(pair[0]) != found.is_upper(pair[1]));
        let levels = changes.count() + 1;
        Self {
            dwell_s: (pass.len() - found.first) as f64 * recording.sample_time_s / levels as f64,
            levels,
            rise_s: found.first as f64 * recording.sample_time_s,
            upper_ratio: found.upper_v / found.lower_v.max(DRIVING_V),
            ..usual
        }
    }
}

/// The two levels of a pass.
pub(super) struct Levels {
    lower_v: f64,
    upper_v: f64,
    /// Samples before the first one, while the voltage rises.
    pub(super) first: usize,
}

impl Levels {
    /// Of the magnitudes of a pass' voltage, V: the upper level comes first, and the lower one last.
    pub(super) fn of(pass_v: &[f64]) -> Self {
        let mut found = Self {
            lower_v: pass_v.last().copied().unwrap_or_default(),
            upper_v: pass_v.iter().copied().fold(0.0, f64::max),
            first: 0,
        };
        let first = pass_v.iter().position(|volts| found.is_upper(*volts));
        found.first = first.unwrap_or_default();
        found
    }

    /// True for a voltage, V, that is nearer to the upper level.
    fn is_upper(&self, volts: f64) -> bool {
        volts > 0.5 * (self.lower_v + self.upper_v)
    }
}

pub(super) fn dwell(settings: &MotorConstantSettings, rate_hz: f64) -> usize {
    ((settings.dwell_s * rate_hz).round() as usize).max(4)
}
