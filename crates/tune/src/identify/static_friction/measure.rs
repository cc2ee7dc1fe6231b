//! The experiment: moves at constant velocity through the same stretch, both ways. Friction differs from place to place: what was
//! measured elsewhere at another velocity would look like friction that changes with the velocity.

use quadrant_law::reference::{MotionSettings, PointToPointSettings};

use super::map::{FrictionMap, FrictionRun};
use crate::identify::setting::SettingError;
use crate::record::Recording;
use crate::test_axis::{
    AxisInfo, Drive, Experiment, ExperimentError, Sides, TestAxis, approach_from,
};

/// Parameters of the measurement of the friction-velocity map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticFrictionSettings {
    /// Slowest and fastest velocity, mm/s.
    pub velocities_mm_s: (f64, f64),
    /// Number of velocities, even on a log scale.
    pub count: usize,
    /// Length over which the voltage is averaged, mm: a whole number of turns of the screw, whose ripple then cancels.
    pub stretch_mm: f64,
    /// Runs over less than that; none where all go over it.
    pub short: Option<ShortRuns>,
    /// Time after which a run's beginning is over, s: the slowest mode of the loop has died away. Fast runs take less where the travel is short.
    pub settling_s: f64,
    /// Acceleration of the moves, mm/s^2; of an axis that has less, its largest.
    pub acceleration_mm_s2: f64,
}

/// Slow runs over a part of the stretch, which would take the longest over all of it: the screw's ripple there, over its mean, is that of the
/// slowest run over the whole stretch that moved evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortRuns {
    /// Velocity below which a run is short, mm/s.
    pub below_mm_s: f64,
    /// Length over which its voltage is averaged, in the middle of the stretch, mm.
    pub stretch_mm: f64,
}

impl Default for StaticFrictionSettings {
    fn default() -> Self {
        Self {
            velocities_mm_s: (0.05, 40.0),
            count: 16,
            stretch_mm: 10.0,
            short: None,
            settling_s: 2.0,
            acceleration_mm_s2: 500.0,
        }
    }
}

/// Reasons for which no map was measured.
#[derive(Debug, thiserror::Error)]
pub enum StaticFrictionError {
    /// A setting that cannot be.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// A run does not fit into the travel.
    #[error(
        "a run at {velocity_mm_s:.2} mm/s needs {needed_mm:.0} mm, and there are {travel_mm:.0} mm: lower the fastest velocity or \
         the stretch"
    )]
    Travel {
        velocity_mm_s: f64,
        /// Travel that a run takes, mm.
        needed_mm: f64,
        travel_mm: f64,
    },
    /// A run was stopped.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
}

/// Jerk of the moves, mm/s^3.
const JERK_MM_S3: f64 = 2e4;
/// Length of the stretch over a short travel.
const STRETCH_SHARE: f64 = 0.4;
/// Stretch of short runs at least, mm: part of a short one would show too little.
const LEAST_SHORT_MM: f64 = 1.0;
/// Settling time at least, s, for which fast runs give up velocity.
const SHORT_SETTLING_S: f64 = 0.6;
/// Least length of a run before its stretch, mm: friction is that of sliding by then.
const SLIDING_MM: f64 = 0.5;
/// Share of the stretch by which a run may begin away from where it should.
const ASTRAY: f64 = 0.1;
/// Share of the largest velocity that a run takes at most.
const MOST_VELOCITY: f64 = 0.6;
/// Rounding of a length, mm.
const ROUNDING_MM: f64 = 1e-9;
/// Samples of a run's recording at least: about one a count of the encoder at the slowest velocities.
const SAMPLES: f64 = 20_000.0;
/// Parts into which the stretch is cut to see its scatter.
const PARTS: usize = 20;
/// Counts of the encoder over which the velocity is looked at for stick-slip.
const STICK_SLIP_COUNTS: f64 = 4.0;
/// Velocity over the reference's below which an axis sticks.
const MAX_STICK_RATIO: f64 = 0.3;
/// Velocity over the reference's above which it slips.
const MIN_SLIP_RATIO: f64 = 2.0;

impl StaticFrictionSettings {
    /// A shorter stretch and slower runs where travel or limits do not hold the fastest.
    #[must_use]
    pub fn fitted_to(mut self, axis: &AxisInfo) -> Self {
        self = self.within(axis);
        let room_mm = room_mm(axis);
        let stretch_mm = self.stretch_mm.min(STRETCH_SHARE * room_mm);
        let shorter = stretch_mm / self.stretch_mm;
        self.stretch_mm = stretch_mm;
        self.short = self.short.map(|short| ShortRuns {
            stretch_mm: (shorter * short.stretch_mm).max(LEAST_SHORT_MM),
            ..short
        });
        let (slowest, fastest) = self.velocities_mm_s;
        let mut fastest = fastest.min(MOST_VELOCITY * axis.max_velocity_mm_s);
        while self.length_mm(fastest, room_mm) > room_mm && fastest > 2.0 * slowest {
            fastest *= 0.9;
        }
        self.velocities_mm_s = (slowest, fastest);
        self
    }

    /// The same with no more acceleration than the axis has.
    fn within(self, axis: &AxisInfo) -> Self {
        Self {
            acceleration_mm_s2: self.acceleration_mm_s2.min(axis.max_acceleration_mm_s2),
            ..self
        }
    }

    /// Time in which a run reaches its velocity, s.
    fn ramp_s(&self, velocity_mm_s: f64) -> f64 {
        velocity_mm_s / self.acceleration_mm_s2 + self.acceleration_mm_s2 / JERK_MM_S3
    }

    /// The time of all runs on an axis, both ways, s.
    pub fn lasts_s(&self, axis: &AxisInfo) -> f64 {
        let room_mm = room_mm(axis);
        let duration = |velocity: f64| 2.0 * self.length_mm(velocity, room_mm) / velocity;
        self.velocities().map(duration).sum()
    }

    fn check(&self) -> Result<(), StaticFrictionError> {
        let (slowest, fastest) = self.velocities_mm_s;
        let checks = [
            (
                "slowest velocity",
                slowest,
                slowest > 0.0,
                "it must be above zero, in mm/s",
            ),
            (
                "fastest velocity",
                fastest,
                fastest > slowest,
                "it must be above the slowest",
            ),
            (
                "velocities",
                self.count as f64,
                self.count >= 6,
                "five parameters take at least 6",
            ),
            (
                "stretch",
                self.stretch_mm,
                self.stretch_mm > 0.0,
                "it must be above zero, in mm",
            ),
            (
                "stretch of short runs",
                self.averaged_mm(0.0),
                self.averaged_mm(0.0) > 0.0,
                "it must be above zero, in mm",
            ),
            (
                "settling time",
                self.settling_s,
                self.settling_s >= 0.0,
                "it must be zero or more, in s",
            ),
        ];
        for (field, value, holds, expected) in checks {
            if !(value.is_finite() && holds) {
                return Err(SettingError {
                    field,
                    value,
                    expected,
                }
                .into());
            }
        }
        Ok(())
    }

    /// The velocities, slowest first.
    fn velocities(&self) -> impl Iterator<Item = f64> + use<> {
        let (slowest, fastest) = self.velocities_mm_s;
        let last = (self.count - 1) as f64;
        (0..self.count).map(move |index| slowest * (fastest / slowest).powf(index as f64 / last))
    }

    /// Length over which the voltage of a run is averaged, mm.
    fn averaged_mm(&self, velocity_mm_s: f64) -> f64 {
        let short = self
            .short
            .filter(|short| velocity_mm_s < short.below_mm_s)
            .map_or(f64::INFINITY, |short| short.stretch_mm);
        self.stretch_mm.min(short)
    }

    /// Length of a run in some room until it is at speed and steady, and friction that of sliding, mm; it is as long behind the stretch, where the
    /// run back begins.
    fn approach_mm(&self, velocity_mm_s: f64, room_mm: f64) -> f64 {
        // The mean velocity of a ramp is half of it.
        let ramp_mm = 0.5 * velocity_mm_s * self.ramp_s(velocity_mm_s);
        let settled_mm = |settling_s: f64| velocity_mm_s * settling_s + ramp_mm;
        let most_mm = 0.5 * (room_mm - self.averaged_mm(velocity_mm_s));
        settled_mm(self.settling_s)
            .max(SLIDING_MM)
            .min(most_mm)
            .max(settled_mm(self.settling_s.min(SHORT_SETTLING_S)))
    }

    /// The length of a run in some room, mm; the room's itself where that is too short.
    fn length_mm(&self, velocity_mm_s: f64, room_mm: f64) -> f64 {
        self.averaged_mm(velocity_mm_s) + 2.0 * self.approach_mm(velocity_mm_s, room_mm)
    }
}

/// Length of a run at most, mm, about the middle of the travel: pre-sliding friction is measured there, too.
fn room_mm(axis: &AxisInfo) -> f64 {
    Sides::Both.room_mm(axis.travel_mm)
}

/// Measures the map on the axis under test, under the settings that are in force.
///
/// # Errors
/// Settings that cannot be, too little travel, or a run that is stopped.
pub fn measure(
    test_axis: &mut dyn TestAxis,
    settings: &StaticFrictionSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<(FrictionMap, Vec<Recording>), StaticFrictionError> {
    settings.check()?;
    let settings = &settings.within(&test_axis.info());
    let room_mm = room_mm(&test_axis.info());
    for velocity_mm_s in settings.velocities() {
        let needed_mm = settings.length_mm(velocity_mm_s, room_mm);
        if needed_mm > room_mm + ROUNDING_MM {
            return Err(StaticFrictionError::Travel {
                velocity_mm_s,
                needed_mm,
                travel_mm: room_mm,
            });
        }
    }
    let all_s = settings.lasts_s(&test_axis.info());
    let mut done_s = 0.0;
    let mut velocities_mm_s = Vec::new();
    let mut recordings: Vec<Recording> = Vec::new();
    for velocity_mm_s in settings.velocities() {
        let length_mm = settings.length_mm(velocity_mm_s, room_mm);
        for direction in [1.0, -1.0] {
            let from_mm = -0.5 * direction * length_mm;
            let astray_mm = ASTRAY * settings.averaged_mm(velocity_mm_s);
            approach_from(test_axis, recordings.last(), from_mm, astray_mm)?;
            let run_s = length_mm / velocity_mm_s;
            let recording = test_axis.perform(
                &Experiment {
                    name: format!("friction at {:.3} mm/s", direction * velocity_mm_s),
                    drive: Drive::ClosedLoop(MotionSettings::PointToPoint(PointToPointSettings {
                        distance_mm: direction * length_mm,
                        max_velocity_mm_s: velocity_mm_s,
                        max_acceleration_mm_s2: settings.acceleration_mm_s2,
                        max_jerk_mm_s3: JERK_MM_S3,
                    })),
                    injection_v: Vec::new(),
                    decimation: ((run_s * test_axis.info().rate_hz / SAMPLES) as usize).max(1),
                    time_limit_s: 10.0 + 1.5 * run_s,
                },
                &mut |share| progress((done_s + share * run_s) / all_s),
            )?;
            done_s += run_s;
            velocities_mm_s.push(direction * velocity_mm_s);
            recordings.push(recording);
        }
    }
    let resolution_mm = test_axis.info().resolution_mm;
    Ok((
        settings.map(&velocities_mm_s, &recordings, resolution_mm),
        recordings,
    ))
}

impl StaticFrictionSettings {
    /// The map of recorded runs at velocities, the slowest first.
    fn map(
        &self,
        velocities_mm_s: &[f64],
        recordings: &[Recording],
        resolution_mm: f64,
    ) -> FrictionMap {
        let mut map = FrictionMap::default();
        for sign in [1.0, -1.0] {
            let mut ripple = None;
            // The fastest first: the last one over the whole stretch is the one to which the short ones are held.
            for (&velocity_mm_s, recording) in velocities_mm_s.iter().zip(recordings).rev() {
                if sign * velocity_mm_s < 0.0 {
                    continue;
                }
                let is_short = self.averaged_mm(velocity_mm_s.abs()) < self.stretch_mm;
                let held_to = ripple.as_ref().filter(|_| is_short);
                let Some(run) = evaluate(recording, self, velocity_mm_s, resolution_mm, held_to)
                else {
                    continue;
                };
                if !is_short && !run.stick_slip {
                    ripple = Some(Ripple { recording, run });
                }
                map.runs.push(run);
            }
        }
        map.runs
            .sort_by(|a, b| a.velocity_mm_s.total_cmp(&b.velocity_mm_s));
        map.mark_shaken();
        map
    }
}

/// The screw's ripple, as a run over the whole stretch shows it.
struct Ripple<'a> {
    recording: &'a Recording,
    run: FrictionRun,
}

impl Ripple<'_> {
    /// Mean voltage between two positions over that of the run, V; none where the run was not there.
    fn between_v(&self, one_mm: f64, other_mm: f64) -> Option<f64> {
        let between = one_mm.min(other_mm)..one_mm.max(other_mm);
        let recording = self.recording;
        let there: Vec<f64> = recording
            .reference_mm
            .iter()
            .zip(&recording.voltage_v)
            .filter(|(reference, _)| between.contains(*reference))
            .map(|(_, voltage)| *voltage)
            .collect();
        (!there.is_empty()).then(|| mean(&there) - self.run.voltage_v)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Evaluates a run at a velocity over its stretch, the middle of it, without the screw's ripple if that is known.
fn evaluate(
    recording: &Recording,
    settings: &StaticFrictionSettings,
    velocity_mm_s: f64,
    resolution_mm: f64,
    ripple: Option<&Ripple<'_>>,
) -> Option<FrictionRun> {
    let direction = velocity_mm_s.signum();
    // That of the travel, but for what the axis stood beside its place.
    let middle_mm = 0.5 * (recording.reference_mm.first()? + recording.reference_mm.last()?);
    let half_mm = 0.5 * direction * settings.averaged_mm(velocity_mm_s.abs());
    let (begin_mm, end_mm) = (middle_mm - half_mm, middle_mm + half_mm);
    let passed = |limit_mm: f64| {
        recording
            .reference_mm
            .iter()
            .position(|reference| direction * (reference - limit_mm) >= 0.0)
    };
    let stretch = passed(begin_mm)?..passed(end_mm)?;
    let (positions, voltages) = (
        &recording.position_mm[stretch.clone()],
        &recording.voltage_v[stretch.clone()],
    );
    if voltages.len() < 2 * PARTS {
        return None;
    }
    let count = positions.len() as f64 - 1.0;
    let measured =
        (positions[positions.len() - 1] - positions[0]) / (count * recording.sample_time_s);
    let length = voltages.len() / PARTS;
    let references = &recording.reference_mm[stretch];
    let parts: Vec<f64> = voltages
        .chunks_exact(length)
        .zip(references.chunks_exact(length))
        .map(|(voltages, references)| {
            let rippled = ripple.and_then(|it| it.between_v(references[0], references[length - 1]));
            mean(voltages) - rippled.unwrap_or(0.0)
        })
        .collect();
    let rippled = ripple.and_then(|it| it.between_v(begin_mm, end_mm));
    let voltage_v = mean(voltages) - rippled.unwrap_or(0.0);
    // Parts opposite each other on the screw have opposite ripple: their mean scatters without it.
    let pairs: Vec<f64> = (0..PARTS / 2)
        .map(|index| 0.5 * (parts[index] + parts[index + PARTS / 2]))
        .collect();
    let variance = pairs
        .iter()
        .map(|pair| (pair - mean(&pairs)).powi(2))
        .sum::<f64>()
        / (pairs.len() - 1) as f64;
    let stick_slip = sticks_and_slips(
        positions,
        velocity_mm_s,
        recording.sample_time_s,
        resolution_mm,
    );
    Some(FrictionRun {
        velocity_mm_s: measured,
        voltage_v,
        deviation_v: (variance / pairs.len() as f64)
            .sqrt()
            .max(LEAST_DEVIATION_V),
        stick_slip,
    })
}

/// True if the velocity over a few counts falls to a share of its mean somewhere, and rises to a multiple elsewhere.
fn sticks_and_slips(
    positions: &[f64],
    velocity_mm_s: f64,
    sample_time_s: f64,
    resolution_mm: f64,
) -> bool {
    let sample_mm = velocity_mm_s * sample_time_s;
    let span = ((STICK_SLIP_COUNTS * resolution_mm / sample_mm.abs()).ceil() as usize).max(1);
    let shares = positions
        .windows(span + 1)
        .map(|window| (window[span] - window[0]) / (span as f64 * sample_mm));
    let (least, most) = shares.fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), share| (share.min(least), share.max(most)),
    );
    least < MAX_STICK_RATIO && most > MIN_SLIP_RATIO
}

/// A scatter below which a mean is not believed to be, V.
const LEAST_DEVIATION_V: f64 = 1e-6;
