//! Experiments of a commissioning stay in the travel but for 2 % of it, with any axis, stroke and starting position, and however
//! wrong the first controller is.

use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_studies::random_axes::RandomAxis;
use quadrant_tune::commission::Guard;
use quadrant_tune::commission::bootstrap::{bootstrap_settings, zero_gain_settings};
use quadrant_tune::identify::motor_constant::{self, MotorConstant, MotorConstantSettings};
use quadrant_tune::test_axis::{Drive, Experiment, SimulatedTestAxis, TestAxis, Travel, approach};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Axes that are tried.
const AXES: u64 = 60;
/// First controllers that are tried on each axis.
const CONTROLLERS: usize = 3;
/// Motions under each controller.
const MOTIONS: usize = 3;
/// Factor by which the gain that a controller is made for may be wrong: the commissioning's own is within two.
const WRONG: f64 = 2.5;
/// Farthest place that is allowed, over the travel: of the 60 axes three go beyond one, by 0.1, 0.4 and 0.9 %, from near an end.
const MOST: f64 = 1.02;
/// Least way to the nearer end, mm: that with which a commissioning begins.
const LEAST_ROOM_MM: f64 = 2.0;

fn motion(random: &mut Xoshiro256PlusPlus, travel_mm: f64) -> MotionSettings {
    let max_velocity_mm_s = random.random_range(5.0..60.0);
    if random.random::<bool>() {
        MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: travel_mm * random.random_range(-2.0..2.0),
            max_velocity_mm_s,
            max_acceleration_mm_s2: 500.0,
            max_jerk_mm_s3: 2e4,
        })
    } else {
        let amplitude_mm = travel_mm * random.random_range(0.05..1.2);
        MotionSettings::Harmonic(HarmonicSettings::with_velocity(
            amplitude_mm,
            max_velocity_mm_s.min(3.0 * amplitude_mm),
            1.25,
            0.5,
        ))
    }
}

/// The axis of a seed, somewhere on its travel, and the settings to start from.
fn axis_of(seed: u64, random: &mut Xoshiro256PlusPlus) -> (SimulatedTestAxis, AxisSettings) {
    let axis = RandomAxis::new(seed);
    let negative_mm = 2.0 * axis.travel_mm * random.random_range(0.0..1.0);
    let travel = Travel {
        negative_mm: negative_mm.max(LEAST_ROOM_MM),
        positive_mm: (2.0 * axis.travel_mm - negative_mm).max(LEAST_ROOM_MM),
    };
    let mut base = StageSettings::simulated().axes[0].clone();
    base.encoder.resolution_mm = axis.parameters.resolution_mm;
    base.amplifier.full_scale_v = axis.parameters.full_scale_v;
    let test_axis = SimulatedTestAxis::new(0, axis.parameters, seed).with_travel(travel);
    (test_axis, base)
}

/// The open-loop test.
fn measure(test_axis: &mut dyn TestAxis, base: &AxisSettings) -> Option<MotorConstant> {
    test_axis.apply(&zero_gain_settings(base)).unwrap();
    let room_mm = test_axis.info().first_room_mm();
    let steps = MotorConstantSettings::default().fitted_to(room_mm);
    motor_constant::measure(test_axis, &steps, &mut |_| {}).ok()
}

/// Motions under controllers for an axis of another gain. Stopped or not: what counts is where the axis went.
fn drive(
    test_axis: &mut dyn TestAxis,
    base: &AxisSettings,
    motor: &MotorConstant,
    random: &mut Xoshiro256PlusPlus,
) {
    let info = test_axis.info();
    for _ in 0..CONTROLLERS {
        let gain = motor.gain_mm_per_v_s2 * WRONG.powf(random.random_range(-1.0..1.0));
        let settings = bootstrap_settings(base, gain, info.rate_hz);
        test_axis.apply(&settings).unwrap();
        let _ = approach(test_axis, 0.0);
        for _ in 0..MOTIONS {
            let experiment = Experiment {
                name: "a motion".to_owned(),
                drive: Drive::ClosedLoop(motion(random, info.travel_mm)),
                injection_v: Vec::new(),
                decimation: 10,
                time_limit_s: 10.0,
            };
            let _ = test_axis.perform(&experiment, &mut |_| {});
        }
    }
}

/// Runs the experiments of a seed under the guard; the farthest place of the table over the travel, and the numbers of experiments
/// that ended and that were stopped.
fn guarded(seed: u64) -> (f64, [usize; 2]) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(!seed);
    let (mut test_axis, base) = axis_of(seed, &mut random);
    let mut guard = Guard::new(&mut test_axis);
    if let Some(motor) = measure(&mut guard, &base) {
        let [ahead_v, back_v] = motor.directed_v;
        guard.slowed_by(motor.gain_mm_per_v_s2 * ahead_v.min(back_v));
        drive(&mut guard, &base, &motor, &mut random);
    }
    let ended = guard.runs.iter().filter(|run| run.ended).count();
    let counts = [ended, guard.runs.len() - ended];
    let half_mm = test_axis.info().travel_mm;
    (test_axis.farthest_mm() / half_mm, counts)
}

/// The same without the guard.
fn unguarded(seed: u64) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(!seed);
    let (mut test_axis, base) = axis_of(seed, &mut random);
    if let Some(motor) = measure(&mut test_axis, &base) {
        drive(&mut test_axis, &base, &motor, &mut random);
    }
    test_axis.farthest_mm() / test_axis.info().travel_mm
}

#[test]
fn no_experiment_leaves_the_travel_by_two_percent_with_any_axis_from_any_position() {
    let found: Vec<_> = (1..=AXES)
        .into_par_iter()
        .map(|seed| (seed, guarded(seed)))
        .collect();
    let [ended, stopped] = [0, 1].map(|which| -> usize {
        let counts = found.iter().map(|(_, (_, counts))| counts[which]);
        counts.sum()
    });
    let shares = found.iter().map(|(_, (share, _))| *share);
    println!(
        "{ended} experiments ended, {stopped} were stopped; at most {:.3} of the travel",
        shares.fold(0.0, f64::max)
    );
    let left: Vec<_> = found
        .iter()
        .filter(|(_, (share, _))| *share >= MOST)
        .collect();
    assert!(left.is_empty(), "seeds and shares of the travel: {left:?}");
    // Else nothing was tried.
    assert!(ended > 200 && stopped > 30, "{ended} {stopped}");
}

#[test]
fn without_the_guard_the_same_experiments_leave_it() {
    let left = (1..=AXES / 4)
        .into_par_iter()
        .filter(|seed| unguarded(*seed) > 1.0);
    let left = left.count() as u64;
    println!("{left} of {}", AXES / 4);
    assert!(left >= 3, "{left} of {}", AXES / 4);
}
