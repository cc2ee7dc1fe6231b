//! An ordinary motion: moves to and fro at several velocities, and a brisk sine.

use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};

use crate::record::Recording;
use crate::test_axis::{Drive, Experiment, ExperimentError, TestAxis};

/// Velocities of the moves, mm/s: each there and back.
const VELOCITIES_MM_S: [f64; 6] = [5.0, 80.0, 10.0, 40.0, 20.0, 120.0];
/// Length of each move, mm; slow ones are shorter by time.
const LENGTH_MM: f64 = 60.0;
/// Longest time of a move, s.
const LONGEST_S: f64 = 2.0;
/// Length of a move over the travel either way.
const TRAVEL_SHARE: f64 = 0.8;
/// Velocity of a move over the velocity limit.
const VELOCITY_SHARE: f64 = 0.8;
/// Shortest time of a move, s.
const SHORTEST_S: f64 = 0.2;
/// Acceleration of the moves, mm/s^2.
const ACCELERATION_MM_S2: f64 = 1500.0;
/// Jerk of the moves, mm/s^3.
const JERK_MM_S3: f64 = 5e4;
/// Amplitude of the sine, mm: its inertia is felt while it slides, away from the reversals.
const SINE_AMPLITUDE_MM: f64 = 20.0;
/// Largest velocity of the sine, mm/s.
const SINE_VELOCITY_MM_S: f64 = 180.0;
/// Factor on its velocity for each try, while it asks for more acceleration than the axis has.
const SLOWING: f64 = 0.9;
/// Cycles of the sine.
const SINE_CYCLES: f64 = 8.0;
/// Lead-in and lead-out of the sine, s.
const SINE_LEAD_S: f64 = 0.5;

/// Moves the axis under the settings in force, `rounds` times, and joins the recordings.
///
/// # Errors
/// A move that is stopped.
pub fn shuttle(
    test_axis: &mut dyn TestAxis,
    rounds: usize,
    progress: &mut dyn FnMut(f64),
) -> Result<Recording, ExperimentError> {
    let info = test_axis.info();
    let room_mm = LENGTH_MM.min(TRAVEL_SHARE * info.travel_mm);
    let fastest_mm_s = (room_mm / SHORTEST_S).min(VELOCITY_SHARE * info.max_velocity_mm_s);
    let there_and_back = VELOCITIES_MM_S.into_iter().flat_map(|velocity_mm_s| {
        let velocity_mm_s = velocity_mm_s.min(fastest_mm_s);
        let distance_mm = room_mm.min(velocity_mm_s * LONGEST_S);
        [distance_mm, -distance_mm].map(|distance_mm| {
            MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm,
                max_velocity_mm_s: velocity_mm_s,
                max_acceleration_mm_s2: ACCELERATION_MM_S2.min(info.max_acceleration_mm_s2),
                max_jerk_mm_s3: JERK_MM_S3,
            })
        })
    });
    let amplitude_mm = SINE_AMPLITUDE_MM.min(0.5 * room_mm);
    let at = |velocity_mm_s: f64| {
        HarmonicSettings::with_velocity(amplitude_mm, velocity_mm_s, SINE_CYCLES, SINE_LEAD_S)
    };
    let mut velocity_mm_s = SINE_VELOCITY_MM_S.min(fastest_mm_s);
    while MotionSettings::Harmonic(at(velocity_mm_s)).peaks().1 > info.max_acceleration_mm_s2 {
        velocity_mm_s *= SLOWING;
    }
    let sine = MotionSettings::Harmonic(at(velocity_mm_s));
    let round: Vec<MotionSettings> = there_and_back.chain([sine]).collect();
    let motions: Vec<MotionSettings> = (0..rounds).flat_map(|_| round.clone()).collect();
    let mut joined = Recording::default();
    for (index, motion) in motions.iter().enumerate() {
        let experiment = Experiment {
            name: "moving to and fro".to_owned(),
            drive: Drive::ClosedLoop(*motion),
            injection_v: Vec::new(),
            decimation: 1,
            time_limit_s: 60.0,
        };
        let recording = test_axis.perform(&experiment, &mut |share| {
            progress((index as f64 + share) / motions.len() as f64);
        })?;
        joined.append(recording);
    }
    Ok(joined)
}
