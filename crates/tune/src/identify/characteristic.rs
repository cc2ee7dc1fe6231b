//! The nominal characteristic trajectory of an axis (NCT), which NCTF control follows: how it comes to rest by itself.
//!
//! Open loop, the axis is brought to speed and left alone. While it coasts, its speed over the distance to where it will
//! stop is the trajectory. Passes in both directions bring the axis back; the trajectory is their mean, and their scatter
//! says how well it is known. No model is fitted.
//! Source: Wahyudi, Sato and Shimokohbe, Precision Engineering 27 (2003).

use heapless::Vec as Points;
use quadrant_law::control::nctf::{CharacteristicPoint, MAX_POINTS};

use crate::record::Recording;
use crate::test_axis::{Drive, Experiment, ExperimentError, TestAxis};

/// Parameters of the test that finds the NCTF trajectory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CharacteristicSettings {
    /// Speed to coast from, mm/s.
    pub velocity_mm_s: f64,
    /// Largest voltage to reach it with, V.
    pub most_voltage_v: f64,
    /// Time for which the axis is driven, s: several of its time constants.
    pub drive_s: f64,
    /// Time for which it may coast, s.
    pub coast_s: f64,
    /// Passes, alternating in direction; at least 2.
    pub passes: usize,
}

impl Default for CharacteristicSettings {
    fn default() -> Self {
        Self {
            velocity_mm_s: 100.0,
            most_voltage_v: 5.0,
            drive_s: 0.03,
            coast_s: 0.3,
            passes: 6,
        }
    }
}

/// Result of the passes.
#[derive(Clone, Debug)]
pub struct Characteristic {
    /// Distance to the place of rest, mm, and the mean speed there, mm/s; both rising.
    pub trajectory: Vec<(f64, f64)>,
    /// RMS of the passes' deviation from the mean, of the mean.
    pub scatter: f64,
    /// Voltage that the axis was driven with, V.
    pub voltage_v: f64,
    pub recording: Recording,
}

/// Reasons for which no trajectory was found.
#[derive(Debug, thiserror::Error)]
pub enum CharacteristicError {
    /// The axis stays slow.
    #[error(
        "the axis reached {reached_mm_s:.1} mm/s at {voltage_v:.2} V, not the {requested_mm_s} mm/s asked for: ask for less, drive it longer, \
         or allow more voltage"
    )]
    Slow {
        /// Velocity reached, mm/s.
        reached_mm_s: f64,
        /// With which voltage, V.
        voltage_v: f64,
        /// Velocity asked for, mm/s.
        requested_mm_s: f64,
    },
    /// The axis does not come to rest.
    #[error(
        "the axis still moves at {velocity_mm_s:.2} mm/s at the end of a pass: let it coast for longer than {coast_s} s"
    )]
    Coasting {
        velocity_mm_s: f64,
        /// Time given to coast, s.
        coast_s: f64,
    },
    /// The recording is no test.
    #[error(
        "the recording has {passes} passes in which the axis is driven and then left alone; the trajectory takes 2"
    )]
    NoPasses { passes: usize },
    /// The run was stopped.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
}

/// Voltage of the first try, V.
const FIRST_V: f64 = 0.1;
/// Factor on the voltage from one try to the next.
const RAISE: f64 = 1.25;
/// Time over which a velocity is taken, s.
const VELOCITY_S: f64 = 2e-3;
/// Distances of the trajectory, even on a log scale.
const DISTANCES: usize = 60;
/// The smallest distance, in counts: below it the counts show.
const LEAST_COUNTS: f64 = 8.0;
/// Largest velocity that counts as rest, over the largest velocity of the record.
const REST_SHARE: f64 = 5e-3;

/// Runs passes with rising voltage until the speed is reached, and evaluates them.
///
/// # Errors
/// An axis that stays slow or does not come to rest; a run that is stopped.
pub fn measure(
    test_axis: &mut dyn TestAxis,
    settings: &CharacteristicSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<Characteristic, CharacteristicError> {
    let axis = test_axis.info();
    let mut voltage_v = FIRST_V;
    loop {
        let recording = test_axis.perform(
            &Experiment {
                name: format!("coasting after {voltage_v:.2} V"),
                drive: Drive::OpenLoop,
                injection_v: passes(settings, voltage_v, axis.rate_hz),
                decimation: 1,
                time_limit_s: 60.0,
            },
            progress,
        )?;
        let reached_mm_s = velocities(&recording)
            .into_iter()
            .fold(0.0, |most: f64, v| most.max(v.abs()));
        if reached_mm_s >= settings.velocity_mm_s {
            return evaluate(recording, axis.resolution_mm);
        }
        if voltage_v * RAISE > settings.most_voltage_v {
            return Err(CharacteristicError::Slow {
                reached_mm_s,
                voltage_v,
                requested_mm_s: settings.velocity_mm_s,
            });
        }
        voltage_v *= RAISE;
    }
}

/// The voltage of all passes, V.
fn passes(settings: &CharacteristicSettings, voltage_v: f64, rate_hz: f64) -> Vec<f64> {
    let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
    (0..settings.passes)
        .flat_map(|pass| {
            let sign = if pass.is_multiple_of(2) { 1.0 } else { -1.0 };
            std::iter::repeat_n(sign * voltage_v, samples(settings.drive_s))
                .chain(std::iter::repeat_n(0.0, samples(settings.coast_s)))
        })
        .collect()
}

/// Samples over which a velocity is taken.
fn span(recording: &Recording) -> usize {
    ((VELOCITY_S / recording.sample_time_s).round() as usize).max(2)
}

/// The velocity about each sample, mm/s; as many as there are whole spans.
fn velocities(recording: &Recording) -> Vec<f64> {
    let span = span(recording);
    let time_s = span as f64 * recording.sample_time_s;
    recording
        .position_mm
        .windows(span + 1)
        .map(|window| (window[span] - window[0]) / time_s)
        .collect()
}

/// Evaluates a recording of passes.
///
/// # Errors
/// A recording without passes, or of an axis that does not come to rest in them.
pub fn evaluate(
    recording: Recording,
    resolution_mm: f64,
) -> Result<Characteristic, CharacteristicError> {
    let drive = |index: usize| recording.voltage_v[index].abs() > 1e-6;
    let mut coasts: Vec<std::ops::Range<usize>> = Vec::new();
    for index in 1..recording.len() {
        if drive(index - 1) && !drive(index) {
            coasts.push(index..recording.len());
        } else if !drive(index - 1)
            && drive(index)
            && let Some(coast) = coasts.last_mut()
        {
            coast.end = index;
        }
    }
    if coasts.len() < 2 {
        return Err(CharacteristicError::NoPasses {
            passes: coasts.len(),
        });
    }
    let curves: Vec<Vec<(f64, f64)>> = coasts
        .iter()
        .map(|coast| coasting(&recording.slice(coast.clone())))
        .collect::<Result<_, _>>()?;
    // What all passes have.
    let farthest = curves
        .iter()
        .map(|curve| curve.first().map_or(0.0, |&(distance, _)| distance))
        .fold(f64::INFINITY, f64::min);
    let nearest = LEAST_COUNTS * resolution_mm;
    if farthest <= nearest {
        return Err(CharacteristicError::NoPasses { passes: 0 });
    }
    let mut trajectory = Vec::new();
    let mut deviation = 0.0;
    for index in 0..DISTANCES {
        let place = index as f64 / (DISTANCES - 1) as f64;
        let distance = nearest * (farthest / nearest).powf(place);
        let speeds: Vec<f64> = curves
            .iter()
            .map(|curve| speed_at(curve, distance))
            .collect();
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        let squares: f64 = speeds
            .iter()
            .map(|speed| (speed / mean - 1.0).powi(2))
            .sum();
        deviation += squares / speeds.len() as f64;
        // Noise must not make it fall.
        let before = trajectory.last().map_or(0.0, |&(_, speed)| speed);
        trajectory.push((distance, mean.max(before)));
    }
    let driven = recording
        .voltage_v
        .iter()
        .fold(0.0, |most: f64, v| most.max(v.abs()));
    Ok(Characteristic {
        trajectory,
        scatter: (deviation / DISTANCES as f64).sqrt(),
        voltage_v: driven,
        recording,
    })
}

/// Distance to the place of rest and speed there, from the largest speed on.
fn coasting(coast: &Recording) -> Result<Vec<(f64, f64)>, CharacteristicError> {
    let velocities = velocities(coast);
    let speed = |index: usize| velocities[index].abs();
    let fastest =
        (0..velocities.len()).fold(0, |best, i| if speed(i) > speed(best) { i } else { best });
    let last = velocities.last().map_or(0.0, |velocity| velocity.abs());
    if velocities.is_empty() || last > REST_SHARE * speed(fastest) {
        return Err(CharacteristicError::Coasting {
            velocity_mm_s: last,
            coast_s: coast.duration_s(),
        });
    }
    let half = span(coast) / 2;
    let end = coast.position_mm[coast.len() - 1];
    Ok((fastest..velocities.len())
        .map(|index| ((end - coast.position_mm[index + half]).abs(), speed(index)))
        .collect())
}

/// The speed at a distance, interpolated; the curve's distances fall.
fn speed_at(curve: &[(f64, f64)], distance: f64) -> f64 {
    let after = curve.partition_point(|&(there, _)| there > distance);
    match (
        after.checked_sub(1).map(|index| curve[index]),
        curve.get(after),
    ) {
        (Some((far, fast)), Some(&(near, slow))) if far > near => {
            slow + (fast - slow) * (distance - near) / (far - near)
        }
        (Some((_, speed)), _) | (None, Some(&(_, speed))) => speed,
        (None, None) => 0.0,
    }
}

impl Characteristic {
    /// Returns the error at which the measured trajectory falls below a straight line through the origin of slope
    /// `slope_per_s`, mm; `None` if it never does.
    pub fn knee_mm(&self, slope_per_s: f64) -> Option<f64> {
        let above = |&(distance, speed): &(f64, f64)| speed > slope_per_s * distance;
        let last = self.trajectory.iter().rposition(above)?;
        self.trajectory.get(last + 1).map(|&(distance, _)| distance)
    }

    /// The trajectory for control: a straight line of slope `slope_per_s`, 1/s, as far as it lies below the measured one,
    /// which friction makes infinitely steep at the origin; then the measured one, and at most `most_mm_s`.
    pub fn points(
        &self,
        slope_per_s: f64,
        most_mm_s: f64,
    ) -> Points<CharacteristicPoint, MAX_POINTS> {
        let point = |error_mm: f64, velocity_mm_s: f64| CharacteristicPoint {
            error_mm,
            velocity_mm_s,
        };
        let straight = || Points::from_iter([point(most_mm_s / slope_per_s, most_mm_s)]);
        let Some(knee_mm) = self.knee_mm(slope_per_s) else {
            return straight();
        };
        let beyond: Vec<_> = self
            .trajectory
            .iter()
            .filter(|&&(distance, speed)| distance >= knee_mm && speed < most_mm_s)
            .collect();
        let Some(&&(first, speed)) = beyond.first() else {
            return straight();
        };
        let mut points: Points<CharacteristicPoint, MAX_POINTS> =
            Points::from_iter([point(speed / slope_per_s, speed)]);
        let rest = MAX_POINTS - 1;
        for index in 1..=rest {
            let (distance, speed) = *beyond[index * (beyond.len() - 1) / rest];
            let before = points[points.len() - 1];
            if distance > first.max(before.error_mm) && speed >= before.velocity_mm_s {
                // There is room for each.
                let _ = points.push(point(distance, speed));
            }
        }
        points
    }
}
