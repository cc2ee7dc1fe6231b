//! Dahl's model: its closed form, its bounds, its losses.

use proptest::prelude::*;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::bristle::Bristle;
use quadrant_law::friction::dahl::{Dahl, DahlParameters};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};

use quadrant_test_support::{any_f32, repeatable};

const LEVEL_V: f64 = 0.12;

fn parameters(exponent: f64) -> DahlParameters {
    DahlParameters {
        stiffness_v_per_mm: 15.0,
        exponent,
    }
}

fn build<S: Scalar>(exponent: f64) -> Dahl<S> {
    Dahl::build(&parameters(exponent), PerDirection::both(LEVEL_V))
}

/// The forces along a path of displacements.
fn along<S: Scalar>(model: &Dahl<S>, path: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut state = Bristle::default();
    path.into_iter()
        .map(|step| {
            let force = model.step(&mut state, S::quantise(step, Quantity::Length));
            force.to_f64(Quantity::Voltage)
        })
        .collect()
}

/// dF/dx, with very small steps of the fourth-order Runge-Kutta method.
fn integrated(exponent: f64, from_v: f64, displacement_mm: f64) -> f64 {
    const STEPS: u32 = 20_000;
    let h = displacement_mm / f64::from(STEPS);
    let sense = displacement_mm.signum();
    let slope = |force: f64| {
        let w = 1.0 - force / LEVEL_V * sense;
        15.0 * w.abs().powf(exponent) * w.signum()
    };
    let mut force = from_v;
    for _ in 0..STEPS {
        let a = slope(force);
        let b = slope(force + 0.5 * h * a);
        let c = slope(force + 0.5 * h * b);
        let d = slope(force + h * c);
        force += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    force
}

#[test]
fn the_closed_form_solves_the_equation() {
    for exponent in [1.0, 1.001, 1.5, 2.0, 3.0] {
        let model = parameters(exponent);
        for from in [-0.119, -0.05, 0.0, 0.08, 0.119] {
            for displacement in [-0.03, -0.001, 0.002, 0.02] {
                let closed = model.force_after_v(from, displacement, LEVEL_V);
                let exact = integrated(exponent, from, displacement);
                assert!(
                    (closed - exact).abs() < 1e-9,
                    "{exponent} {from} {displacement}: {closed} {exact}"
                );
            }
        }
    }
}

#[test]
fn an_exponent_of_one_is_the_exact_exponential() {
    let forces = along(&build::<f64>(1.0), std::iter::repeat_n(1e-4, 500));
    for (index, force) in forces.iter().enumerate() {
        let travelled = 1e-4 * (index + 1) as f64;
        let exact = LEVEL_V * (1.0 - (-15.0 * travelled / LEVEL_V).exp());
        assert!((force - exact).abs() < 1e-5 * LEVEL_V, "{force} {exact}");
    }
    let model = parameters(1.0);
    for z in [1e-9, 1e-3, 1.0, 10.0] {
        assert_eq!(model.covered(z), -(-z).exp_m1());
    }
}

/// Tables in `S` against the closed form in `f64`, largest difference, V.
fn deviation<S: Scalar>(exponent: f64) -> f64 {
    let model = build::<S>(exponent);
    let closed = parameters(exponent);
    let mut state = Bristle::default();
    let mut exact = 0.0;
    let mut worst: f64 = 0.0;
    let mut last = 0;
    for tick in 1..100_000 {
        // A sine of 0.1 mm in whole steps of the fixed-point length; 1 Hz at 10 kHz.
        let place = 0.1 * (std::f64::consts::TAU * 1e-4 * f64::from(tick)).sin();
        let units = (place * 2f64.powi(26)).round() as i64;
        let step = (units - last) as f64 / 2f64.powi(26);
        last = units;
        let force = model.step(&mut state, S::quantise(step, Quantity::Length));
        if step != 0.0 {
            exact = closed.force_after_v(exact, step, LEVEL_V);
        }
        worst = worst.max((force.to_f64(Quantity::Voltage) - exact).abs());
    }
    worst
}

#[test]
fn tables_follow_the_closed_form_in_every_number_type() {
    for exponent in [1.0, 1.5, 2.0, 3.0] {
        let [double, single, fixed] = [
            deviation::<f64>(exponent),
            deviation::<f32>(exponent),
            deviation::<Fixed>(exponent),
        ]
        .map(|volts| 1e6 * volts);
        println!(
            "Dahl, delta {exponent}, uV off: f64 {double:.2}, f32 {single:.2}, fixed {fixed:.2}"
        );
        // 0.1 % of the level.
        assert!(double < 120.0 && single < 120.0 && fixed < 120.0);
        assert!((fixed - double).abs() < 10.0 && (single - double).abs() < 10.0);
    }
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn the_force_stays_within_the_level(
        exponent in 1.0f64..=3.0,
        path in prop::collection::vec((any_f32(), any::<bool>()), 100),
    ) {
        let model = build::<f32>(exponent);
        let mut state = Bristle::default();
        for (displacement, small) in path {
            let step = if small { displacement * 1e-3 } else { displacement };
            let force = model.step(&mut state, step);
            prop_assert!(force.abs() <= LEVEL_V as f32 * (1.0 + 1e-6), "{force}");
            prop_assert!(state.force().is_finite());
        }
    }

    #[test]
    fn it_is_odd(exponent in 1.0f64..=3.0, path in prop::collection::vec(-0.02f64..0.02, 100)) {
        let model = build::<f32>(exponent);
        let forth = along(&model, path.iter().copied());
        let back = along(&model, path.iter().map(|step| -step));
        prop_assert!(forth.iter().zip(&back).all(|(f, b)| *f == -b));
    }

    /// Moving in two steps is moving in one.
    #[test]
    fn it_does_not_depend_on_the_rate(
        exponent in 1.0f64..=3.0,
        path in prop::collection::vec((-0.02f64..0.02, 2usize..40), 60),
    ) {
        let model = build::<f64>(exponent);
        let whole = along(&model, path.iter().map(|(step, _)| *step));
        let (mut state, mut last) = (Bristle::default(), 0.0);
        for ((step, pieces), whole) in path.iter().zip(whole) {
            for _ in 0..*pieces {
                last = model.step(&mut state, step / *pieces as f64);
            }
            prop_assert!((last - whole).abs() < 2e-3 * LEVEL_V, "{last} {whole}");
        }
    }

    #[test]
    fn a_closed_cycle_takes_work(
        exponent in 1.0f64..=3.0,
        steps in prop::collection::vec(-0.02f64..0.02, 1..40),
    ) {
        const PIECES: usize = 50;
        let model = build::<f64>(exponent);
        let mut state = Bristle::default();
        let back = -steps.iter().sum::<f64>();
        let mut works = [0.0; 3];
        for work in &mut works {
            let mut last = state.force();
            for &step in steps.iter().chain([&back]) {
                for _ in 0..PIECES {
                    let force = model.step(&mut state, step / PIECES as f64);
                    *work += 0.5 * (last + force) * step / PIECES as f64;
                    last = force;
                }
            }
        }
        prop_assert!(works[0] >= -1e-12 && works[2] >= -1e-12, "{works:?}");
    }
}

#[test]
fn each_direction_slides_at_its_own_level() {
    let levels = PerDirection {
        positive: 0.12,
        negative: 0.10,
    };
    let model = Dahl::<f64>::build(&parameters(1.5), levels);
    let forces = along(&model, std::iter::repeat_n(1e-3, 1000));
    assert!((forces[999] - 0.12).abs() < 1e-4, "{}", forces[999]);
    let path = std::iter::repeat_n(1e-3, 1000).chain(std::iter::repeat_n(-1e-3, 1000));
    let forces = along(&model, path);
    assert!((forces[1999] + 0.10).abs() < 1e-4, "{}", forces[1999]);
}
