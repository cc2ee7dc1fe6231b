//! An axis that experiments are run on.
//!
//! Identification asks a [`TestAxis`] for an [`Experiment`] and works on the [`Recording`] that comes back; one that is
//! read from a file is the same.

use std::ops::Range;

use quadrant_law::reference::MotionSettings;
use quadrant_law::safety::{Fault, FaultCode};
use quadrant_settings::{AxisSettings, SettingsError};

use super::error::MachineError;
use crate::record::Recording;

/// Source of the amplifier's voltage besides the injected one.
#[derive(Clone, Debug, PartialEq)]
pub enum Drive {
    /// None: the injected voltage alone drives.
    OpenLoop,
    /// The feedback law, along a motion from where the axis stands.
    ClosedLoop(MotionSettings),
}

/// Motion and voltage that an axis is recorded under.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Name, for progress and messages: "friction at 2 mm/s".
    pub name: String,
    /// Source of the voltage besides the injected one.
    pub drive: Drive,
    /// Voltage added at the amplifier's input, V, one value a control period from the first sample recorded; zero
    /// after the last. The experiment lasts until both this and the motion have ended.
    pub injection_v: Vec<f64>,
    /// Control periods in a sample of the recording, at least 1: voltages are the mean over them, positions are those
    /// at their beginning. An axis that cannot sample so often takes more.
    pub decimation: usize,
    /// Time after which the experiment is given up, s.
    pub time_limit_s: f64,
}

/// Data of an axis, as far as identification may know them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisInfo {
    /// Name in lower case: "x".
    pub name: &'static str,
    /// Rate of the control law, Hz.
    pub rate_hz: f64,
    /// Length of an encoder count, mm.
    pub resolution_mm: f64,
    /// Largest voltage of the amplifier, V.
    pub full_scale_v: f64,
    /// Travel either way from its middle, mm; an experiment that leaves it is stopped. Positions count from the middle.
    pub travel_mm: f64,
    /// Position in which the axis stood first, mm.
    pub start_mm: f64,
    /// Largest velocity, mm/s; an experiment in open loop that exceeds it is stopped, and a faster motion is refused.
    pub max_velocity_mm_s: f64,
    /// Largest acceleration, mm/s^2; a motion that exceeds it is refused.
    pub max_acceleration_mm_s2: f64,
}

impl AxisInfo {
    /// Returns the way to the nearer end from where the axis stood first, mm.
    pub fn first_room_mm(&self) -> f64 {
        self.travel_mm - self.start_mm.abs()
    }
}

/// An axis that experiments can be run on.
pub trait TestAxis {
    /// Returns the data of the axis.
    fn info(&self) -> AxisInfo;

    /// Returns the settings in force.
    fn settings(&self) -> &AxisSettings;

    /// Puts settings in force for the experiments that follow.
    ///
    /// # Errors
    /// Settings that are refused, here or by the machine, or a connection that is broken; the old ones stay in force.
    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError>;

    /// Switches the outputs off until the next experiment.
    ///
    /// # Errors
    /// Outputs that may still be on.
    fn switch_off(&mut self) -> Result<(), ExperimentError>;

    /// Runs an experiment from where the axis stands, and records it. `progress` receives the share that is done,
    /// 0 to 1, a few times a second. The outputs may stay on after it: the next one goes on with what the law remembers.
    ///
    /// # Errors
    /// The error that stopped the experiment.
    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError>;

    /// Returns the end of the last experiment's recording, up to where it was stopped; nothing if it was not, or nothing is left
    /// of it.
    fn interrupted(&self) -> Option<&Recording> {
        None
    }
}

/// Share of the travel that motions use.
const USED: f64 = 0.9;
/// The same on a short travel, where the tracking error takes a larger part.
const USED_OF_SHORT: f64 = 0.7;
/// Travel either way below which it is short, mm.
const SHORT_MM: f64 = 200.0;
/// Share of the room in a direction after which an axis in open loop is stopped: it coasts on by as much again, and more.
const OPEN_LOOP: f64 = 0.4;
/// The same towards an end that is nearer than [`NEAR_END`]: what it coasts does not shrink with the room.
const OPEN_LOOP_NEAR: f64 = 0.2;
/// Distance of this end over the travel.
const NEAR_END: f64 = 0.52;

/// Returns the travel that planned motions use of a travel either way, mm.
pub fn usable_mm(travel_mm: f64) -> f64 {
    // Between the two, the rest to the ends is that of the longest travel.
    let rest = (1.0 - USED) * SHORT_MM;
    (USED * travel_mm).min((USED_OF_SHORT * travel_mm).max(travel_mm - rest))
}

/// Sides of the travel that passes go through, there and back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The positive one, from the middle.
    Positive,
    /// Both, from the negative end: of a short travel.
    Both,
}

/// Share of what is used of both sides: a pass begins somewhat beside its place.
const OF_BOTH: f64 = 0.92;

impl Sides {
    /// Both, or the positive one.
    pub const fn of(both: bool) -> Self {
        if both { Self::Both } else { Self::Positive }
    }

    /// Length of a pass at most on a travel either way, mm.
    pub fn room_mm(self, travel_mm: f64) -> f64 {
        usable_mm(travel_mm)
            * match self {
                Self::Positive => 1.0,
                Self::Both => 2.0 * OF_BOTH,
            }
    }

    /// Position at which the axis stands before the first pass, mm.
    pub fn start_mm(self, travel_mm: f64) -> f64 {
        match self {
            Self::Positive => 0.0,
            Self::Both => -OF_BOTH * usable_mm(travel_mm),
        }
    }
}

/// Smallest and largest position of a motion, from where it begins, mm; none if that is not known beforehand.
pub fn span_mm(motion: &MotionSettings) -> Option<Range<f64>> {
    match motion {
        MotionSettings::Hold => Some(0.0..0.0),
        MotionSettings::PointToPoint(to) => Some(to.distance_mm.min(0.0)..to.distance_mm.max(0.0)),
        // With any phase.
        MotionSettings::Harmonic(sine) if sine.phase_rad == 0.0 => {
            Some(-sine.amplitude_mm..sine.amplitude_mm)
        }
        MotionSettings::Harmonic(sine) => Some(-2.0 * sine.amplitude_mm..2.0 * sine.amplitude_mm),
    }
}

/// Returns how far from where it begins an axis may go under a motion, mm: to the end of its travel towards which the motion goes,
/// and to the nearer one under a motion both ways, or none. Towards the other end its following error holds it.
pub fn room_mm(travel_mm: f64, here_mm: f64, motion: &MotionSettings) -> f64 {
    let (ahead_mm, back_mm) = (travel_mm - here_mm, travel_mm + here_mm);
    match span_mm(motion) {
        Some(span) if span.start == 0.0 && span.end > 0.0 => ahead_mm,
        Some(span) if span.end == 0.0 && span.start < 0.0 => back_mm,
        _ => ahead_mm.min(back_mm),
    }
}

/// Returns the positions between which an axis in open loop stays that stands at `here_mm`, mm.
pub fn open_loop_mm(travel_mm: f64, here_mm: f64) -> (f64, f64) {
    let room = |to_end_mm: f64| {
        let share = if to_end_mm < NEAR_END * travel_mm {
            OPEN_LOOP_NEAR
        } else {
            OPEN_LOOP
        };
        share * to_end_mm.max(0.0)
    };
    (
        here_mm - room(travel_mm + here_mm),
        here_mm + room(travel_mm - here_mm),
    )
}

/// Reason why an experiment was stopped.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The motion cannot be built.
    #[error("{experiment}: the motion is refused: {source}")]
    Motion {
        /// Name of the experiment.
        experiment: String,
        /// The error that caused this.
        source: SettingsError,
    },
    /// The control law switched off.
    #[error("{experiment}: fault {number} at tick {tick}: {cause}; {remedy}", number = .fault.code.number(),
        tick = .fault.tick, cause = .fault.code.cause(), remedy = .fault.code.remedy())]
    Fault {
        /// Name of the experiment.
        experiment: String,
        /// Fault of the law.
        fault: Fault,
    },
    /// The axis cannot do this.
    #[error("{experiment}: {reason}")]
    Impossible {
        /// Name of the experiment.
        experiment: String,
        /// Description of what is missing, or failed.
        reason: String,
    },
    /// A person asked to stop, or the machine keeps its outputs off for a reason that is none of this axis: no other experiment is tried.
    #[error("interrupted in {experiment}: {done}")]
    Interrupted {
        /// Name of the experiment.
        experiment: String,
        /// State of the axes since, or the machine's reason.
        done: String,
    },
    /// The axis left what it may use of its travel: less than half in open loop, where nothing brings it back.
    #[error(
        "{experiment}: after {time_s:.3} s the axis left what this may use of its travel of +-{travel_mm:.2} mm; \
         give it more travel, or a weaker or shorter excitation"
    )]
    Travel {
        /// Name of the experiment.
        experiment: String,
        /// Travel either way, mm.
        travel_mm: f64,
        /// Time from the first sample, s.
        time_s: f64,
    },
    /// The axis ran too fast.
    #[error(
        "{experiment}: the axis exceeded {max_velocity_mm_s} mm/s after {time_s:.3} s; raise max_velocity_mm_s, if it may be that fast, or \
         give it a weaker or shorter excitation"
    )]
    Overspeed {
        /// Name of the experiment.
        experiment: String,
        /// Limit that was exceeded.
        max_velocity_mm_s: f64,
        /// Time from the first sample, s.
        time_s: f64,
    },
    /// The experiment took too long.
    #[error("{experiment}: not ended after {time_limit_s} s: {reason}")]
    TimedOut {
        /// Name of the experiment.
        experiment: String,
        /// Limit that was exceeded.
        time_limit_s: f64,
        /// Part of the experiment that was still to come.
        reason: &'static str,
    },
}

impl ExperimentError {
    /// The fault that ended the experiment; none if something else did.
    pub fn fault(&self) -> Option<FaultCode> {
        match self {
            Self::Fault { fault, .. } => Some(fault.code),
            _ => None,
        }
    }

    /// True if the axis was stopped because it moved too far or too fast.
    pub fn ran_off(&self) -> bool {
        matches!(self, Self::Travel { .. } | Self::Overspeed { .. })
            || self.fault() == Some(FaultCode::Overspeed)
    }

    /// True if the axis was stopped because it was not where it should have been: under another controller it may be.
    pub fn strayed(&self) -> bool {
        self.ran_off() || self.fault() == Some(FaultCode::FollowingError)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use quadrant_law::reference::{HarmonicSettings, PointToPointSettings};

    #[test]
    fn a_motion_may_go_to_the_end_of_the_travel_that_it_goes_towards() {
        let by = |distance_mm| {
            MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s: 20.0,
                max_acceleration_mm_s2: 200.0,
                max_jerk_mm_s3: 4000.0,
            })
        };
        // From near one end to near the other, as a pass on a short travel goes.
        assert_eq!(room_mm(20.0, -12.9, &by(25.8)), 32.9);
        assert_eq!(room_mm(20.0, 12.9, &by(-25.8)), 32.9);
        assert!((room_mm(20.0, 12.9, &by(5.0)) - 7.1).abs() < 1e-12);
        let sine = MotionSettings::Harmonic(HarmonicSettings::with_velocity(2.0, 20.0, 1.0, 0.2));
        assert!((room_mm(20.0, 12.9, &sine) - 7.1).abs() < 1e-12);
        assert!((room_mm(20.0, -12.9, &MotionSettings::Hold) - 7.1).abs() < 1e-12);
    }
}
