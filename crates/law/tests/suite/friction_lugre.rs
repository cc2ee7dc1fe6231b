//! LuGre: its exact step, its bounds, its losses.

use proptest::prelude::*;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::bristle::Bristle;
use quadrant_law::friction::lugre::{Lugre, LugreParameters};
use quadrant_law::friction::stribeck::StribeckCurve;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};

use quadrant_test_support::{any_f32, repeatable};

const PERIOD_S: f64 = 1e-4;
const CURVE: StribeckCurve = StribeckCurve {
    coulomb_v: 0.12,
    breakaway_v: 0.15,
    stribeck_velocity_mm_s: 1.0,
    exponent: 1.0,
};
const STIFFNESS: f64 = 15.0;
const DAMPING: f64 = 0.002;

fn build<S: Scalar>(damping_v_s_per_mm: f64) -> Lugre<S> {
    let parameters = LugreParameters {
        stiffness_v_per_mm: STIFFNESS,
        damping_v_s_per_mm,
    };
    Lugre::build(&parameters, &PerDirection::both(CURVE), PERIOD_S)
}

/// One period at a velocity in mm/s.
fn step<S: Scalar>(model: &Lugre<S>, state: &mut Bristle<S>, velocity: f64) -> f64 {
    let displacement = S::quantise(velocity * PERIOD_S, Quantity::Length);
    let speed = S::quantise(velocity.abs(), Quantity::Velocity);
    let force = model.step(state, displacement, speed);
    force.to_f64(Quantity::Voltage)
}

/// The step by the formula: sigma0 z, and the whole force.
fn exact(bristle: &mut f64, velocity: f64, damping: f64) -> f64 {
    let level = CURVE.level_v(velocity);
    let left = (-STIFFNESS * velocity.abs() * PERIOD_S / level).exp();
    let before = *bristle;
    if velocity != 0.0 {
        let target = level.copysign(velocity);
        *bristle = target + (before - target) * left;
    }
    *bristle + damping / STIFFNESS * (*bristle - before) / PERIOD_S
}

#[test]
fn at_constant_velocity_it_is_the_exact_exponential() {
    let model = build::<f64>(0.0);
    for velocity in [1e-4, 0.01, 1.0, 10.0, -3.0] {
        let mut state = Bristle::default();
        for tick in 1..=2000 {
            let force = step(&model, &mut state, velocity);
            let level = CURVE.level_v(velocity);
            let travelled = velocity.abs() * PERIOD_S * f64::from(tick);
            let closed = level.copysign(velocity) * -(-STIFFNESS * travelled / level).exp_m1();
            // The share per step is linear up to the table's first node.
            assert!((force - closed).abs() < 1e-3 * level, "{force} {closed}");
        }
    }
}

#[test]
fn the_equation_is_solved_as_the_period_shrinks() {
    // dz/dt = v - sigma0 |v| z / s(v) along a sine, by small explicit steps, in V.
    let velocity = |time: f64| 3.0 * (20.0 * time).cos();
    let (fine, mut bristle) = (PERIOD_S / 200.0, 0.0);
    let model = build::<f64>(0.0);
    let mut state = Bristle::default();
    for tick in 0..10_000 {
        for part in 0..200 {
            let v = velocity((f64::from(tick) + (f64::from(part) + 0.5) / 200.0) * PERIOD_S);
            bristle += fine * STIFFNESS * (v - v.abs() * bristle / CURVE.level_v(v));
        }
        let v = velocity((f64::from(tick) + 0.5) * PERIOD_S);
        let force = step(&model, &mut state, v);
        assert!((force - bristle).abs() < 5e-4, "{tick}: {force} {bristle}");
    }
}

#[test]
fn sigma1_damps_the_bending() {
    let (mut damped, mut plain) = (Bristle::default(), Bristle::default());
    let (with, without) = (build::<f64>(DAMPING), build::<f64>(0.0));
    for tick in 0..1000 {
        let before = plain.force();
        let velocity = 0.5 * (0.03 * f64::from(tick)).sin();
        let bend = step(&without, &mut plain, velocity) - before;
        let extra = step(&with, &mut damped, velocity) - plain.force();
        let expected = DAMPING / STIFFNESS * bend / PERIOD_S;
        assert!((extra - expected).abs() < 1e-12, "{extra} {expected}");
    }
    // Far below the level the bristles bend as fast as the motion: dz/dt = v.
    let mut state = Bristle::default();
    let first = step(&with, &mut state, 0.1);
    assert!(
        (first - (15.0 * 1e-5 + DAMPING * 0.1)).abs() < 1e-6,
        "{first}"
    );
}

#[test]
fn at_rest_nothing_changes() {
    let model = build::<f32>(DAMPING);
    let mut state = Bristle::default();
    for _ in 0..100 {
        step(&model, &mut state, 0.5);
    }
    let held = state.force();
    assert_eq!(model.step(&mut state, 0.0, 0.0), held);
    assert_eq!(model.step(&mut state, f32::NAN, 1.0), held);
    assert_eq!(state.force(), held);
}

/// Largest deviation from the formula in `f64` over a second of a sine, V.
fn deviation<S: Scalar>() -> f64 {
    let model = build::<S>(DAMPING);
    let (mut state, mut bristle, mut worst) = (Bristle::default(), 0.0, 0.0f64);
    for tick in 0..30_000 {
        let velocity = 10.0 * (3.3e-4 * f64::from(tick)).cos();
        let force = step(&model, &mut state, velocity);
        worst = worst.max((force - exact(&mut bristle, velocity, DAMPING)).abs());
    }
    worst
}

#[test]
fn tables_follow_the_formula_in_every_number_type() {
    let [double, single, fixed] =
        [deviation::<f64>(), deviation::<f32>(), deviation::<Fixed>()].map(|volts| 1e6 * volts);
    println!("LuGre, uV off: f64 {double:.2}, f32 {single:.2}, fixed {fixed:.2}");
    assert!(double < 75.0 && single < 75.0 && fixed < 75.0);
    assert!((fixed - double).abs() < 5.0 && (single - double).abs() < 5.0);
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn the_bristles_stay_within_the_level(
        path in prop::collection::vec((any_f32(), any_f32()), 100),
    ) {
        let model = build::<f32>(DAMPING);
        let mut state = Bristle::default();
        // A change of twice the level in one step, damped.
        let most = 0.15 * (1.0 + 2.0 * DAMPING / (STIFFNESS * PERIOD_S)) as f32;
        for (displacement, speed) in path {
            let force = model.step(&mut state, displacement, speed.magnitude());
            prop_assert!(force.abs() <= 1.0001 * most, "{force}");
            prop_assert!(state.force().abs() <= 0.15001);
        }
    }

    #[test]
    fn it_is_odd(path in prop::collection::vec(-20.0f64..20.0, 100)) {
        let model = build::<f32>(DAMPING);
        let (mut forth, mut back) = (Bristle::default(), Bristle::default());
        for velocity in path {
            let (f, b) = (step(&model, &mut forth, velocity), step(&model, &mut back, -velocity));
            prop_assert_eq!(f, -b);
        }
    }

    /// The bristles store no more than they are given, at any velocity: at most the last step's share is
    /// counted differently by a sum over steps.
    #[test]
    fn the_bristles_are_passive(path in prop::collection::vec(-5.0f64..5.0, 1..60)) {
        let model = build::<f64>(0.0);
        let mut state = Bristle::default();
        let mut work = 0.0;
        for velocity in path {
            for _ in 0..20 {
                let before = state.force();
                let force = step(&model, &mut state, velocity);
                work += 0.5 * (before + force) * velocity * PERIOD_S;
                let stored = 0.5 * force * force / STIFFNESS;
                prop_assert!(work - stored >= -1e-9, "{work} {stored}");
            }
        }
    }
}
