//! The GMS model's hysteresis: virgin curve, doubled reversal curves, return points, and no drift.

use proptest::prelude::*;
use quadrant_law::friction::gms::{Gms, GmsElement, GmsParameters, GmsState};
use quadrant_law::friction::stribeck::Sliding;

use crate::friction_gms::elements;
use quadrant_test_support::repeatable;

const LEVEL_V: f64 = 0.15;

fn sliding() -> Sliding<f64> {
    Sliding::constant(LEVEL_V, 5.0, 1e-4)
}

fn parameters(elements: &[GmsElement]) -> GmsParameters {
    GmsParameters {
        elements: elements.iter().copied().collect(),
        attraction_v_s: 5.0,
    }
}

/// The model as a person would handle it: moved to places, read at places.
struct Block<const N: usize> {
    gms: Gms<f64, N>,
    state: GmsState<f64, N>,
    place_mm: f64,
    steps: u32,
}

impl<const N: usize> Block<N> {
    fn new(elements: &[GmsElement], steps: u32) -> Self {
        Self {
            gms: Gms::build(elements),
            state: GmsState::default(),
            place_mm: 0.0,
            steps,
        }
    }

    fn move_to(&mut self, place_mm: f64) -> f64 {
        let step = (place_mm - self.place_mm) / f64::from(self.steps);
        self.place_mm = place_mm;
        let mut force = 0.0;
        for _ in 0..self.steps {
            force = self.gms.step(&mut self.state, step, sliding());
        }
        force
    }
}

/// The first elements alone, with the whole of the load.
fn first(elements: &[GmsElement], count: usize) -> Vec<GmsElement> {
    let kept = &elements[..count.min(elements.len())];
    let sum: f64 = kept.iter().map(|element| element.weight).sum();
    let share = |element: &GmsElement| GmsElement {
        weight: element.weight / sum,
        ..*element
    };
    kept.iter().map(share).collect()
}

fn virgin_curve_and_doubling<const N: usize>(
    elements: &[GmsElement],
    turn_mm: f64,
    back_mm: f64,
    steps: u32,
) -> Result<(), TestCaseError> {
    let model = parameters(elements);
    let mut block = Block::<N>::new(elements, steps);
    let top = block.move_to(turn_mm);
    let virgin = model.virgin_curve_v(turn_mm, LEVEL_V);
    prop_assert!((top - virgin).abs() < 1e-12, "virgin: {top} {virgin}");
    // Masing: the way back is the virgin curve at twice the scale.
    let low = block.move_to(turn_mm - back_mm);
    let doubled = top - 2.0 * model.virgin_curve_v(0.5 * back_mm, LEVEL_V);
    if back_mm <= 2.0 * turn_mm {
        prop_assert!((low - doubled).abs() < 1e-12, "reversal: {low} {doubled}");
    } else {
        // Past the mirror image of the turn it is on the virgin curve of the other side.
        let other = model.virgin_curve_v(turn_mm - back_mm, LEVEL_V);
        prop_assert!((low - other).abs() < 1e-12, "far side: {low} {other}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn virgin_and_reversal_curves_obey_the_doubling_rule(
        elements in elements(),
        turn_mm in 1e-4f64..0.2,
        share in 0.0f64..3.0,
        steps in 1u32..40,
    ) {
        let back_mm = share * turn_mm;
        virgin_curve_and_doubling::<10>(&elements, turn_mm, back_mm, steps)?;
        virgin_curve_and_doubling::<4>(&first(&elements, 4), turn_mm, back_mm, steps)?;
        virgin_curve_and_doubling::<1>(&first(&elements, 1), turn_mm, back_mm, steps)?;
    }

    /// An inner loop, and one within it, leave no trace once they are closed.
    #[test]
    fn a_closed_inner_loop_is_forgotten(
        elements in elements(),
        outer in 0.01f64..0.1,
        inner in 0.1f64..0.9,
        innermost in 0.1f64..0.9,
        on in 0.0f64..0.2,
    ) {
        let mut plain = Block::<10>::new(&elements, 7);
        let mut looped = Block::<10>::new(&elements, 7);
        let low = outer * (1.0 - inner);
        let high = low + (outer - low) * innermost;
        for block in [&mut plain, &mut looped] {
            block.move_to(outer);
        }
        let before = looped.move_to(low);
        looped.move_to(high);
        looped.move_to(0.5 * (low + high));
        looped.move_to(high);
        let after = looped.move_to(low);
        prop_assert!((before - after).abs() < 1e-12, "{before} {after}");
        let place = low - on;
        let (one, two) = (plain.move_to(place), looped.move_to(place));
        prop_assert!((one - two).abs() < 1e-12, "{one} {two}");
    }
}

#[test]
fn ten_elements_give_ten_break_points() {
    let elements: Vec<GmsElement> = (1..=10)
        .map(|index| GmsElement {
            stiffness_v_per_mm: 0.1 * LEVEL_V / (0.001 * f64::from(index)),
            weight: 0.1,
        })
        .collect();
    let mut block = Block::<10>::new(&elements, 1);
    let mut slopes = vec![];
    let mut last = 0.0;
    for index in 0..=10 {
        let force = block.move_to(0.0005 + 0.001 * f64::from(index));
        let near = block.move_to(0.0005 + 0.001 * f64::from(index) + 1e-5);
        slopes.push(((near - force) / 1e-5).round());
        assert!(near >= last);
        last = near;
    }
    assert!(
        slopes.windows(2).all(|pair| pair[1] < pair[0]),
        "{slopes:?}"
    );
    assert!((last - LEVEL_V).abs() < 1e-12);
}

/// A mass on the x axis' friction under a constant voltage and a vibration, together below breakaway.
fn mean_place(bias_v: f64, vibration_v: f64, seconds: [f64; 2]) -> [f64; 2] {
    const STEP_S: f64 = 2e-5;
    const GAIN: f64 = 69_390.0;
    let elements = quadrant_settings::presets::x_axis().friction.gms.elements;
    let gms = Gms::<f64, 10>::build(&elements);
    let mut state = GmsState::default();
    let (mut velocity, mut place, mut friction) = (0.0, 0.0, 0.0);
    let mut time = 0.0;
    seconds.map(|until| {
        let (mut sum, mut count) = (0.0, 0);
        while time < until {
            let phase = std::f64::consts::TAU * 50.0 * time;
            // The bias comes on slowly, so that the vibration decides, not the step.
            let drive = bias_v * (time / 0.2f64).min(1.0) + vibration_v * phase.sin();
            velocity += STEP_S * (GAIN * (drive - friction) - 20.0 * velocity);
            let step = velocity * STEP_S;
            place += step;
            friction = gms.step(&mut state, step, sliding());
            time += STEP_S;
            // The mean over the last ten vibrations.
            if until - time < 0.2 {
                sum += place;
                count += 1;
            }
        }
        sum / f64::from(count)
    })
}

#[test]
fn vibration_below_breakaway_does_not_make_the_mass_drift() {
    for bias_v in [0.02, 0.05, 0.08, -0.08] {
        let [early, late] = mean_place(bias_v, 0.03, [2.0, 10.0]);
        let drift_nm = (late - early) * 1e6;
        println!(
            "bias {bias_v} V: at {:.3} um, drift {drift_nm:.4} nm in 8 s",
            early * 1e3
        );
        assert!(drift_nm.abs() < 1.0, "bias {bias_v} V: {drift_nm} nm");
        assert!(
            early.abs() > 1e-4,
            "the bias moved the mass within its pre-sliding range"
        );
    }
}

#[test]
fn a_bias_beyond_breakaway_does_move_the_mass() {
    let [early, late] = mean_place(0.16, 0.03, [1.0, 1.5]);
    assert!(late - early > 1.0, "{early} {late}");
}
