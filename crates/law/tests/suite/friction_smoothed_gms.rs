//! The smoothed GMS: smooth, bounded, and GMS in the limit.

use proptest::prelude::*;
use quadrant_law::friction::gms::{Gms, GmsElement, GmsState};
use quadrant_law::friction::smoothed_gms::{SmoothedGms, SmoothedGmsParameters};
use quadrant_law::friction::stribeck::{Sliding, SlidingTable};
use quadrant_law::friction::{Direction, PerDirection};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::presets::x_axis;

use crate::friction_gms::elements;
use quadrant_test_support::{any_f32, repeatable};

const PERIOD_S: f64 = 1e-4;
const LEVEL_V: f64 = 0.15;

fn build<S: Scalar>(elements: &[GmsElement], width: f64) -> SmoothedGms<S, 10> {
    SmoothedGms::build(elements, &SmoothedGmsParameters { width }, LEVEL_V)
}

/// A surface of constant level; without attraction only the displacement counts.
fn constant<S: Scalar>(attraction_v_s: f64) -> Sliding<S> {
    Sliding::constant(LEVEL_V, attraction_v_s, PERIOD_S)
}

fn x_elements() -> Vec<GmsElement> {
    x_axis().friction.gms.elements.to_vec()
}

/// A sine of 20 um that takes `steps` steps for each of two cycles.
fn sine(steps: u32) -> impl Iterator<Item = f64> {
    let place = move |step: u32| {
        let phase = std::f64::consts::TAU * f64::from(step) / f64::from(steps);
        0.02 * phase.sin()
    };
    (1..=2 * steps).map(move |step| place(step) - place(step - 1))
}

#[test]
fn a_vanishing_width_is_gms() {
    let elements = x_elements();
    let gms = Gms::<f64, 10>::build(&elements);
    let mut last = f64::MAX;
    for width in [0.3, 0.1, 0.03, 0.01, 0.003, 0.001] {
        let smooth = build::<f64>(&elements, width);
        let (mut sharp, mut soft) = (GmsState::default(), GmsState::default());
        let worst = sine(20_000)
            .map(|step| {
                let exact = gms.step(&mut sharp, step, constant(5.0));
                (smooth.step(&mut soft, step, constant(5.0)) - exact).abs()
            })
            .fold(0.0, f64::max);
        println!(
            "width {width}: {:.4} % of the level off GMS",
            100.0 * worst / LEVEL_V
        );
        assert!(worst < 0.5 * width * LEVEL_V, "{width}: {worst}");
        assert!(worst < last);
        last = worst;
    }
}

#[test]
fn the_slope_of_the_force_does_not_jump() {
    let elements = x_elements();
    let steepest = elements
        .iter()
        .map(|e| e.stiffness_v_per_mm)
        .fold(0.0, f64::max);
    // The largest change of slope within two steps of a nanometre, V/mm.
    let jump = |mut force: Box<dyn FnMut(f64) -> f64>| {
        let forces: Vec<f64> = (0..40_000).map(|_| force(1e-6)).collect();
        let slopes: Vec<f64> = forces.windows(2).map(|w| (w[1] - w[0]) / 1e-6).collect();
        let changes = slopes.windows(3).map(|w| (w[2] - w[0]).abs());
        changes.fold(0.0, f64::max)
    };
    let gms = Gms::<f64, 10>::build(&elements);
    let mut state = GmsState::default();
    let sharp = jump(Box::new(move |step| {
        gms.step(&mut state, step, constant(0.0))
    }));
    let smooth = build::<f64>(&elements, 0.25);
    let mut state = GmsState::default();
    let soft = jump(Box::new(move |step| {
        smooth.step(&mut state, step, constant(0.0))
    }));
    assert!(sharp > 0.9 * steepest, "GMS jumps: {sharp} of {steepest}");
    assert!(soft < 5e-3 * steepest, "S-GMS does not: {soft}");
}

#[test]
fn one_element_fades_exponentially_within_the_width() {
    let single = [GmsElement {
        stiffness_v_per_mm: 10.0,
        weight: 1.0,
    }];
    let model = build::<f64>(&single, 0.2);
    let mut state = GmsState::default();
    let (sliding, width) = (constant(0.0), 0.2 * LEVEL_V);
    for step in 1..2000 {
        let force = model.step(&mut state, 1e-5, sliding);
        let free = 10.0 * 1e-5 * f64::from(step);
        let knee = LEVEL_V - width;
        let exact = if free < knee {
            free
        } else {
            LEVEL_V - width * (-(free - knee) / width).exp()
        };
        assert!((force - exact).abs() < 1e-6, "{force} {exact}");
    }
}

#[test]
fn sliding_follows_a_falling_level_at_the_rate_that_c_sets() {
    let single = [GmsElement {
        stiffness_v_per_mm: 10.0,
        weight: 1.0,
    }];
    let model = build::<f64>(&single, 0.2);
    let mut state = GmsState::default();
    model.step(&mut state, 10.0, constant(5.0));
    let lower = Sliding::constant(0.12, 5.0, PERIOD_S);
    let start = model.forces(&state)[0];
    for tick in 1..2000 {
        let force = model.step(&mut state, 1e-3, lower);
        let exact = 0.12 + (start - 0.12) * (-5.0 * PERIOD_S * f64::from(tick) / 0.12).exp();
        assert!((force - exact).abs() < 1e-12, "{force} {exact}");
    }
}

/// Forces along x's default elements on its Stribeck curve, a sine of 10 mm/s at 1 Hz, V.
fn forces<S: Scalar>() -> Vec<f64> {
    let friction = x_axis().friction;
    let curves = friction.sliding.map(|model| model.curve);
    let table = SlidingTable::<S>::build(&curves, friction.gms.attraction_v_s, PERIOD_S);
    let model = build::<S>(&friction.gms.elements, 0.25);
    let mut state = GmsState::default();
    (0..20_000)
        .map(|tick| {
            let velocity = 10.0 * (std::f64::consts::TAU * PERIOD_S * f64::from(tick)).cos();
            let direction = if velocity < 0.0 {
                Direction::Negative
            } else {
                Direction::Positive
            };
            let sliding = table.at(S::quantise(velocity.abs(), Quantity::Velocity), direction);
            let displacement = S::quantise(velocity * PERIOD_S, Quantity::Length);
            let force = model.step(&mut state, displacement, sliding);
            force.to_f64(Quantity::Voltage)
        })
        .collect()
}

#[test]
fn every_number_type_gives_the_same_force() {
    let exact = forces::<f64>();
    let off = |other: Vec<f64>| {
        let differences = exact.iter().zip(other).map(|(a, b)| (a - b).abs());
        1e6 * differences.fold(0.0, f64::max)
    };
    let (single, fixed) = (off(forces::<f32>()), off(forces::<Fixed>()));
    println!("S-GMS, uV off f64: f32 {single:.3}, fixed {fixed:.3}");
    // In slow motion an element stops where its step rounds to nothing.
    assert!(single < 2.0 && fixed < 15.0, "{single} {fixed}");
}

/// Checks that no element ever exceeds its share of the level.
fn check_bound<S: Scalar>(
    elements: &[GmsElement],
    width: f64,
    path: &[f64],
    rounding_v: f64,
) -> Result<(), TestCaseError> {
    let model = build::<S>(elements, width);
    let mut state = GmsState::default();
    for &step in path {
        model.step(
            &mut state,
            S::quantise(step, Quantity::Length),
            constant(5.0),
        );
        for (force, element) in model.forces(&state).iter().zip(elements) {
            let force = force.to_f64(Quantity::Voltage).abs();
            prop_assert!(force <= element.weight * LEVEL_V + rounding_v, "{force}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn each_element_stays_within_its_share(
        elements in elements(),
        width in 0.001f64..=1.0,
        path in prop::collection::vec((-6.0f64..0.0, any::<bool>()), 100),
    ) {
        let path: Vec<f64> = path
            .iter()
            .map(|&(log, forward)| 10f64.powf(log) * if forward { 1.0 } else { -1.0 })
            .collect();
        check_bound::<f64>(&elements, width, &path, 1e-15)?;
        check_bound::<f32>(&elements, width, &path, 1e-7)?;
        check_bound::<Fixed>(&elements, width, &path, 5e-8)?;
    }

    #[test]
    fn any_input_leaves_bounded_memory(
        elements in elements(),
        path in prop::collection::vec((any_f32(), any_f32()), 50),
    ) {
        let model = build::<f32>(&elements, 0.25);
        let curve = x_axis().friction.sliding.positive.curve;
        let table = SlidingTable::<f32>::build(&PerDirection::both(curve), 5.0, PERIOD_S);
        let mut state = GmsState::default();
        for (displacement, speed) in path {
            let sliding = table.at(speed.magnitude(), Direction::Positive);
            let force = model.step(&mut state, displacement, sliding);
            prop_assert!(force.abs() <= 0.151, "{force}");
            prop_assert!(model.forces(&state).iter().all(|force| force.is_finite()));
        }
    }

    #[test]
    fn it_is_odd(elements in elements(), path in prop::collection::vec(-0.02f64..0.02, 100)) {
        let model = build::<f32>(&elements, 0.25);
        let (mut forth, mut back) = (GmsState::default(), GmsState::default());
        for step in path {
            let f = model.step(&mut forth, step as f32, constant(5.0));
            prop_assert_eq!(f, -model.step(&mut back, -step as f32, constant(5.0)));
        }
    }

    /// Without attraction, which is a matter of time, moving in many steps is moving in one.
    #[test]
    fn it_does_not_depend_on_the_rate(
        elements in elements(),
        width in 0.05f64..=1.0,
        path in prop::collection::vec((-0.02f64..0.02, 2usize..40), 60),
    ) {
        let model = build::<f64>(&elements, width);
        let (mut whole, mut pieced) = (GmsState::default(), GmsState::default());
        for (step, pieces) in path {
            let one = model.step(&mut whole, step, constant(0.0));
            let mut many = 0.0;
            for _ in 0..pieces {
                many = model.step(&mut pieced, step / pieces as f64, constant(0.0));
            }
            // The exponential is 0.005 off at most, of the width.
            prop_assert!((one - many).abs() < 0.01 * width * LEVEL_V, "{one} {many}");
        }
    }

    /// So that no element gives back more than it took, in slow motion either.
    #[test]
    fn no_element_rises_faster_than_its_spring(
        elements in elements(),
        width in 0.001f64..=1.0,
        path in prop::collection::vec((-8.0f64..-1.0, any::<bool>()), 200),
    ) {
        let model = build::<f64>(&elements, width);
        let mut state = GmsState::default();
        for (log, forward) in path {
            let step = 10f64.powf(log) * if forward { 1.0 } else { -1.0 };
            let before = model.forces(&state);
            model.step(&mut state, step, constant(50.0));
            for ((after, before), element) in model.forces(&state).iter().zip(before).zip(&elements) {
                let rise = (after - before) * step.signum();
                let push = element.stiffness_v_per_mm * step.abs();
                prop_assert!(rise <= push * (1.0 + 1e-9) + 1e-15, "{rise} {push}");
            }
        }
    }

    #[test]
    fn a_closed_cycle_takes_work(
        elements in elements(),
        width in 0.01f64..=1.0,
        steps in prop::collection::vec(-0.05f64..0.05, 1..40),
    ) {
        const PIECES: usize = 50;
        let model = build::<f64>(&elements, width);
        let mut state = GmsState::default();
        let back = -steps.iter().sum::<f64>();
        let mut works = [0.0; 3];
        for work in &mut works {
            let mut last: f64 = model.forces(&state).iter().sum();
            for &step in steps.iter().chain([&back]) {
                for _ in 0..PIECES {
                    let force = model.step(&mut state, step / PIECES as f64, constant(5.0));
                    *work += 0.5 * (last + force) * step / PIECES as f64;
                    last = force;
                }
            }
        }
        prop_assert!(works[0] >= -1e-12 && works[2] >= -1e-12, "{works:?}");
    }
}
