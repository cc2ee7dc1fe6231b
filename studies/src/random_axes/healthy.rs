//! A healthy axis under its settings: it comes to rest after a knock, and no move within its limits is a fault.

use quadrant_law::reference::{MotionSettings, PointToPointSettings};
use quadrant_settings::AxisSettings;
use quadrant_sim::plant::AxisParameters;
use quadrant_tune::test_axis::{
    Drive, Experiment, ExperimentError, SimulatedTestAxis, TestAxis, approach, usable_mm,
};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::subject::Subject;

/// Result of knocks and moves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Largest RMS deviation of the axis at rest after a knock, over what a count and the encoder's noise explain.
    pub hum: Option<f64>,
    /// Moves within the limits that a fault ended.
    pub faults: usize,
    /// The first of them.
    pub fault: String,
}

/// Factors on friction as it was when the axis was commissioned: one with each move.
const FRICTION: [f64; 3] = [1.0, 0.7, 1.4];
/// Moves out and back.
const MOVES: usize = 12;
/// Share of the acceleration that the output limit allows beyond friction: the rest is the loop's.
const MOST_EFFORT: f64 = 0.6;
/// Share of the velocity limit: an axis overshoots, and what is faster than its limit is stopped here, not by the firmware.
const MOST_VELOCITY: f64 = 0.95;
/// Rest before a knock, its duration, and the rest after it, s.
const KNOCK_S: (f64, f64, f64) = (0.2, 4e-3, 3.0);
/// Voltages of a knock over friction: the next one where the axis may not be as fast as one makes it.
const KNOCK_RATIOS: [f64; 3] = [2.0, 1.5, 1.2];
/// Parts of a tenth of a second at its end that are looked at, but for the one with the most in it: a last slip into place is no hum.
const PARTS: usize = 20;
/// Noise of the encoder over the deviation that it may make in the loop.
const NOISE_RATIO: f64 = 2.0;

impl Health {
    /// True of an axis that hums.
    pub fn hums(&self) -> bool {
        self.hum.is_some_and(|ratio| ratio > 1.0)
    }

    /// Knocks and moves the axis of a subject, warmed as `parameters` say, under its settings.
    pub fn of(settings: &AxisSettings, subject: &Subject, parameters: &AxisParameters) -> Self {
        let mut health = Self::default();
        let axis = |friction: f64| {
            let parameters = parameters.clone().with_friction(friction);
            let travel_mm = subject.travel.half_mm();
            let mut axis =
                SimulatedTestAxis::new(0, parameters, !subject.seed).with_travel_mm(travel_mm);
            let applied = axis.apply(settings).map_err(|error| error.to_string());
            applied.map(|()| axis)
        };
        match axis(1.0).and_then(|axis| hum(&axis, parameters)) {
            Ok(hum) => health.hum = Some(hum),
            Err(fault) => health.note(fault),
        }
        let mut random = Xoshiro256PlusPlus::seed_from_u64(subject.seed);
        for friction in FRICTION {
            let moved = axis(friction).map(|mut axis| {
                let moves = MOVES / FRICTION.len();
                (0..moves)
                    .filter_map(|_| to_and_fro(&mut axis, parameters, &mut random).err())
                    .collect::<Vec<_>>()
            });
            match moved {
                Ok(faults) => faults.into_iter().for_each(|fault| {
                    health.note(format!("{fault} (friction x {friction})"));
                }),
                Err(refused) => health.note(refused),
            }
        }
        health
    }

    fn note(&mut self, fault: String) {
        self.faults += 1;
        if self.fault.is_empty() {
            self.fault = fault;
        }
    }
}

/// Level of friction, V.
fn friction_v(parameters: &AxisParameters) -> f64 {
    let levels = [&parameters.friction.positive, &parameters.friction.negative];
    levels
        .map(|way| way.curve.breakaway_v.max(way.curve.coulomb_v))
        .into_iter()
        .fold(0.0, f64::max)
}

/// A move at random velocity and acceleration up to the limits, and back.
fn to_and_fro(
    axis: &mut SimulatedTestAxis,
    parameters: &AxisParameters,
    random: &mut Xoshiro256PlusPlus,
) -> Result<(), String> {
    let (limits, output_v) = (
        axis.settings().limits,
        axis.settings().amplifier.output_limit_v,
    );
    let usable = 0.8 * usable_mm(axis.info().travel_mm);
    let distance_mm = usable * random.random::<f64>().mul_add(0.9, 0.1);
    let max_velocity_mm_s =
        MOST_VELOCITY * limits.max_velocity_mm_s * random.random_range(0.2..1.0);
    let spare_v = output_v
        - 1.4 * friction_v(parameters)
        - max_velocity_mm_s * parameters.damping_per_s / parameters.gain_mm_per_v_s2;
    let able_mm_s2 = MOST_EFFORT * parameters.gain_mm_per_v_s2 * spare_v.max(0.0);
    let max_acceleration_mm_s2 =
        (limits.max_acceleration_mm_s2 * random.random_range(0.2..1.0)).min(able_mm_s2);
    for distance_mm in [distance_mm, -distance_mm] {
        let motion = PointToPointSettings {
            distance_mm,
            max_velocity_mm_s,
            max_acceleration_mm_s2,
            max_jerk_mm_s3: 100.0 * max_acceleration_mm_s2,
        };
        let outcome = axis.perform(
            &Experiment {
                name: format!(
                    "{distance_mm:.2} mm at {max_velocity_mm_s:.0} mm/s and {max_acceleration_mm_s2:.0} mm/s^2"
                ),
                drive: Drive::ClosedLoop(MotionSettings::PointToPoint(motion)),
                injection_v: Vec::new(),
                decimation: 10,
                time_limit_s: 120.0,
            },
            &mut |_| {},
        );
        if let Err(error) = outcome {
            // The next move begins in the middle again.
            let _ = approach(axis, 0.0);
            return Err(error.to_string());
        }
    }
    Ok(())
}

/// RMS deviation from lines of a tenth of a second, over what a count and the noise explain.
fn hum(axis: &SimulatedTestAxis, parameters: &AxisParameters) -> Result<f64, String> {
    for ratio in KNOCK_RATIOS {
        let knock_v = ratio * friction_v(parameters);
        match knocked(axis.clone(), parameters, knock_v) {
            Err(error) if error.ran_off() => {}
            outcome => return outcome.map_err(|error| error.to_string()),
        }
    }
    Err("every knock makes it too fast".to_owned())
}

/// The same after knocks of a voltage.
fn knocked(
    mut axis: SimulatedTestAxis,
    parameters: &AxisParameters,
    knock_v: f64,
) -> Result<f64, ExperimentError> {
    let info = axis.info();
    let samples = |seconds: f64| (seconds * info.rate_hz) as usize;
    let noise_mm = NOISE_RATIO * parameters.imperfections.encoder_noise_mm;
    let still_mm = info.resolution_mm.hypot(noise_mm);
    let mut most = 0.0_f64;
    for sign in [1.0, -1.0] {
        let (before_s, knock_s, after_s) = KNOCK_S;
        let mut loads_v = vec![0.0; samples(before_s)];
        loads_v.resize(samples(before_s + knock_s), sign * knock_v);
        axis.load(loads_v);
        let held = Experiment {
            name: "knock".to_owned(),
            drive: Drive::ClosedLoop(MotionSettings::Hold),
            injection_v: vec![0.0; samples(before_s + knock_s + after_s)],
            decimation: 1,
            time_limit_s: 10.0,
        };
        let recording = axis.perform(&held, &mut |_| {})?;
        let tenth = samples(0.1);
        let begin = recording.len().saturating_sub(PARTS * tenth);
        let parts = recording.position_mm[begin..].chunks_exact(tenth);
        let squares: Vec<f64> = parts.map(|part| about_a_line(part).powi(2)).collect();
        let largest = squares.iter().copied().fold(0.0, f64::max);
        let others = squares.iter().sum::<f64>() - largest;
        most = most.max((others / (PARTS - 1) as f64).sqrt() / still_mm);
    }
    Ok(most)
}

/// RMS deviation from the best straight line: what creeps is no hum.
fn about_a_line(part: &[f64]) -> f64 {
    let count = part.len() as f64;
    let middle = 0.5 * (count - 1.0);
    let mean = part.iter().sum::<f64>() / count;
    let moments = part
        .iter()
        .enumerate()
        .fold((0.0, 0.0), |(xy, xx), (index, mm)| {
            let x = index as f64 - middle;
            (xy + x * (mm - mean), xx + x * x)
        });
    let slope = moments.0 / moments.1;
    let squares = part
        .iter()
        .enumerate()
        .map(|(index, mm)| (mm - mean - slope * (index as f64 - middle)).powi(2));
    (squares.sum::<f64>() / count).sqrt()
}
