//! The GMS model's branches: sticking, slipping, reversal; its bounds and its losses.

use proptest::prelude::*;
use quadrant_law::friction::gms::{Gms, GmsElement, GmsState};
use quadrant_law::friction::stribeck::{Sliding, SlidingTable, StribeckCurve};
use quadrant_law::friction::{Direction, PerDirection};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};

use quadrant_test_support::{any_f32, repeatable};

const PERIOD_S: f64 = 1e-4;
const ATTRACTION_V_S: f64 = 5.0;
const CURVES: PerDirection<StribeckCurve> = PerDirection {
    positive: StribeckCurve {
        coulomb_v: 0.12,
        breakaway_v: 0.15,
        stribeck_velocity_mm_s: 1.0,
        exponent: 1.0,
    },
    negative: StribeckCurve {
        coulomb_v: 0.10,
        breakaway_v: 0.17,
        stribeck_velocity_mm_s: 2.0,
        exponent: 2.0,
    },
};

/// One to ten elements whose weights sum to one.
pub(crate) fn elements() -> impl Strategy<Value = Vec<GmsElement>> {
    prop::collection::vec((0.1f64..100.0, 0.05f64..1.0), 1..=10).prop_map(|raw| {
        let sum: f64 = raw.iter().map(|(_, weight)| weight).sum();
        raw.iter()
            .map(|&(stiffness_v_per_mm, weight)| GmsElement {
                stiffness_v_per_mm,
                weight: weight / sum,
            })
            .collect()
    })
}

fn single() -> Vec<GmsElement> {
    vec![GmsElement {
        stiffness_v_per_mm: 10.0,
        weight: 1.0,
    }]
}

fn surface<S: Scalar>() -> SlidingTable<S> {
    SlidingTable::build(&CURVES, ATTRACTION_V_S, PERIOD_S)
}

/// The surface under a displacement in one period.
fn under<S: Scalar>(table: &SlidingTable<S>, displacement_mm: f64) -> Sliding<S> {
    let speed = S::quantise(displacement_mm.abs() / PERIOD_S, Quantity::Velocity);
    let direction = if displacement_mm < 0.0 {
        Direction::Negative
    } else {
        Direction::Positive
    };
    table.at(speed, direction)
}

/// Checks that no element ever exceeds its share of the highest level.
fn check_bound<S: Scalar>(
    elements: &[GmsElement],
    path: &[f64],
    rounding_v: f64,
) -> Result<(), TestCaseError> {
    let gms = Gms::<S, 10>::build(elements);
    let table = surface::<S>();
    let mut state = GmsState::default();
    for &step in path {
        let displacement = S::quantise(step, Quantity::Length);
        let total = gms.step(&mut state, displacement, under(&table, step));
        let highest = CURVES.negative.breakaway_v;
        prop_assert!(total.to_f64(Quantity::Voltage).abs() <= highest + 10.0 * rounding_v);
        for (force, element) in gms.forces(&state).iter().zip(elements) {
            let force = force.to_f64(Quantity::Voltage).abs();
            prop_assert!(force <= element.weight * highest + rounding_v, "{force}");
        }
    }
    Ok(())
}

/// The model as it is defined, an element at a time.
struct EachByItself {
    elements: Vec<GmsElement>,
    forces: Vec<f64>,
    slips: Vec<bool>,
    forward: bool,
}

impl EachByItself {
    fn new(elements: &[GmsElement]) -> Self {
        Self {
            elements: elements.to_vec(),
            forces: vec![0.0; elements.len()],
            slips: vec![false; elements.len()],
            forward: true,
        }
    }

    fn step(&mut self, displacement: f64, sliding: Sliding<f64>) -> f64 {
        let forward = displacement > 0.0;
        if displacement != 0.0 && forward != self.forward {
            self.slips.fill(false);
            self.forward = forward;
        }
        if displacement != 0.0 {
            let sign = displacement.signum();
            for (index, element) in self.elements.iter().enumerate() {
                let share = element.weight * sliding.level;
                let carried = sign * self.forces[index];
                let sprung = carried + element.stiffness_v_per_mm * displacement.abs();
                self.slips[index] |= carried > share;
                self.forces[index] = sign
                    * if self.slips[index] {
                        share + (carried - share) * sliding.decay
                    } else {
                        self.slips[index] = sprung >= share;
                        sprung.min(share)
                    };
            }
        }
        self.forces.iter().sum()
    }
}

/// Runs of some ticks at a velocity, mm/s, either way.
fn runs() -> impl Strategy<Value = Vec<(f64, bool, usize)>> {
    prop::collection::vec((-2.0f64..2.0, any::<bool>(), 1usize..400), 1..12)
}

/// The largest difference, V, between the model and its definition along runs on curves that fall and that rise.
fn from_definition<S: Scalar>(elements: &[GmsElement], runs: &[(f64, bool, usize)]) -> f64 {
    let rising = CURVES.map(|curve| StribeckCurve {
        coulomb_v: curve.breakaway_v,
        breakaway_v: curve.coulomb_v,
        ..*curve
    });
    let mut worst = 0.0f64;
    for curves in [CURVES, rising] {
        let gms = Gms::<S, 10>::build(elements);
        let table = SlidingTable::<S>::build(&curves, ATTRACTION_V_S, PERIOD_S);
        let exact = SlidingTable::<f64>::build(&curves, ATTRACTION_V_S, PERIOD_S);
        let (mut state, mut each) = (GmsState::default(), EachByItself::new(elements));
        for &(log, forward, ticks) in runs {
            let step = 10f64.powf(log) * PERIOD_S * if forward { 1.0 } else { -1.0 };
            for _ in 0..ticks {
                let displacement = S::quantise(step, Quantity::Length);
                let together = gms.step(&mut state, displacement, under(&table, step));
                let apart = each.step(displacement.to_f64(Quantity::Length), under(&exact, step));
                worst = worst.max((together.to_f64(Quantity::Voltage) - apart).abs());
            }
            let pairs = gms.forces(&state).into_iter().zip(&each.forces);
            worst = pairs.fold(worst, |worst, (force, each)| {
                worst.max((force.to_f64(Quantity::Voltage) - each).abs())
            });
        }
    }
    worst
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn elements_that_slip_together_do_as_each_by_itself(elements in elements(), runs in runs()) {
        let worst = from_definition::<f64>(&elements, &runs);
        prop_assert!(worst < 1e-13, "{worst}");
        let worst = from_definition::<f32>(&elements, &runs);
        prop_assert!(worst < 3e-6, "f32: {worst}");
        let worst = from_definition::<Fixed>(&elements, &runs);
        prop_assert!(worst < 1e-5, "fixed point: {worst}");
    }

    #[test]
    fn each_element_stays_within_its_share(
        elements in elements(),
        path in prop::collection::vec((-6.0f64..0.0, any::<bool>()), 100),
    ) {
        let path: Vec<f64> = path
            .iter()
            .map(|&(log, forward)| 10f64.powf(log) * if forward { 1.0 } else { -1.0 })
            .collect();
        check_bound::<f64>(&elements, &path, 1e-15)?;
        check_bound::<f32>(&elements, &path, 1e-7)?;
        check_bound::<Fixed>(&elements, &path, 3e-8)?;
    }

    #[test]
    fn any_input_leaves_bounded_memory(
        elements in elements(),
        path in prop::collection::vec((any_f32(), any_f32()), 50),
    ) {
        let gms = Gms::<f32, 10>::build(&elements);
        let table = surface::<f32>();
        let mut state = GmsState::default();
        for (displacement, speed) in path {
            let sliding = table.at(speed.magnitude(), Direction::Positive);
            let force = gms.step(&mut state, displacement, sliding);
            prop_assert!(force.abs() <= 0.151, "{force}");
            prop_assert!(gms.forces(&state).iter().all(|force| force.is_finite()));
        }
    }

    /// On a surface of constant level, with any shape of the cycle from any start.
    #[test]
    fn a_closed_cycle_takes_work(
        elements in elements(),
        steps in prop::collection::vec(-0.05f64..0.05, 1..60),
    ) {
        let gms = Gms::<f64, 10>::build(&elements);
        let sliding = Sliding::constant(0.15, ATTRACTION_V_S, PERIOD_S);
        let mut state = GmsState::default();
        let back = -steps.iter().sum::<f64>();
        let mut works = [0.0; 3];
        for work in &mut works {
            let mut last: f64 = gms.forces(&state).iter().sum();
            for &step in steps.iter().chain([&back]) {
                let force = gms.step(&mut state, step, sliding);
                *work += 0.5 * (last + force) * step;
                last = force;
            }
        }
        // From slack springs, and once settled.
        prop_assert!(works[0] >= -1e-15, "{works:?}");
        prop_assert!(works[2] >= -1e-15, "{works:?}");
    }

    /// While slipping at constant velocity, one step of 2h is two of h.
    #[test]
    fn slipping_does_not_depend_on_the_step(level in 0.05f64..0.3, attraction in 0.1f64..500.0) {
        let elements = single();
        let gms = Gms::<f64, 1>::build(&elements);
        let before = Sliding::constant(0.15, attraction, PERIOD_S);
        let fine = Sliding::constant(level, attraction, PERIOD_S);
        let coarse = Sliding::constant(level, attraction, 2.0 * PERIOD_S);
        let (mut one, mut two) = (GmsState::default(), GmsState::default());
        gms.step(&mut one, 1.0, before);
        gms.step(&mut two, 1.0, before);
        for _ in 0..20 {
            let coarse = gms.step(&mut one, 2e-3, coarse);
            gms.step(&mut two, 1e-3, fine);
            let fine = gms.step(&mut two, 1e-3, fine);
            prop_assert!((coarse - fine).abs() < 1e-14, "{coarse} {fine}");
        }
    }
}

#[test]
fn slipping_follows_the_exact_exponential() {
    let gms = Gms::<f64, 1>::build(&single());
    let mut state = GmsState::default();
    gms.step(&mut state, 1.0, Sliding::constant(0.15, 5.0, PERIOD_S));
    let lower = Sliding::constant(0.12, 5.0, PERIOD_S);
    for tick in 1..2000 {
        let force = gms.step(&mut state, 1e-3, lower);
        let exact = 0.12 + 0.03 * (-5.0 * PERIOD_S * f64::from(tick) / 0.12).exp();
        assert!((force - exact).abs() < 1e-13, "{force} {exact}");
    }
}

#[test]
fn sinusoidal_cycles_on_the_stribeck_curve_take_work() {
    let elements = quadrant_settings::presets::x_axis().friction.gms.elements;
    let table = surface::<f64>();
    for amplitude_mm in [0.001, 0.003, 0.01, 0.03, 0.1, 1.0, 10.0] {
        for frequency_hz in [0.1, 1.0, 10.0] {
            let gms = Gms::<f64, 10>::build(&elements);
            let mut state = GmsState::default();
            let ticks = (1.0 / (frequency_hz * PERIOD_S)).round() as u32;
            let place = |tick: u32| {
                amplitude_mm * (std::f64::consts::TAU * f64::from(tick) / f64::from(ticks)).sin()
            };
            let (mut work, mut last) = (0.0, 0.0);
            for tick in 1..=3 * ticks {
                let step = place(tick) - place(tick - 1);
                let force = gms.step(&mut state, step, under(&table, step));
                if tick > 2 * ticks {
                    work += 0.5 * (last + force) * step;
                }
                last = force;
            }
            // The smallest cycles are elastic: no work but rounding.
            let least = if amplitude_mm < 0.002 { -1e-18 } else { 1e-9 };
            assert!(work > least, "{amplitude_mm} mm {frequency_hz} Hz: {work}");
        }
    }
}

#[test]
fn slipping_ends_only_at_a_reversal() {
    let gms = Gms::<f64, 1>::build(&single());
    let mut state = GmsState::default();
    gms.step(&mut state, 1.0, Sliding::constant(0.10, 5.0, PERIOD_S));
    // The surface rises faster than the element follows: a sticking element would load its spring by 0.01 V a step.
    let higher = Sliding::constant(0.20, 5.0, PERIOD_S);
    let force = gms.step(&mut state, 1e-3, higher);
    assert!(force - 0.10 < 0.0005, "slips on: {force}");
    // Standing still changes nothing, and does not end slipping.
    assert_eq!(gms.step(&mut state, 0.0, higher), force);
    let slipped = gms.step(&mut state, 1e-3, higher);
    assert!(slipped - force < 0.0005, "still slips: {slipped}");
    // A reversal does: from then on the spring carries.
    let back = gms.step(&mut state, -1e-3, higher);
    assert!((back - (slipped - 0.01)).abs() < 1e-15, "sticks: {back}");
    let forth = gms.step(&mut state, 1e-3, higher);
    assert!((forth - slipped).abs() < 1e-15, "sticks: {forth}");
}

#[test]
fn a_surface_that_falls_below_a_stuck_element_takes_its_force_down_no_faster_than_slip_does() {
    let gms = Gms::<f64, 1>::build(&single());
    let mut state = GmsState::default();
    let high = Sliding::constant(0.20, 5.0, PERIOD_S);
    let low = Sliding::constant(0.05, 5.0, PERIOD_S);
    gms.step(&mut state, 1.0, high);
    // It slides, stops, is shaken to and fro by a hundredth of a micrometre, and goes on slowly.
    let mut last = gms.step(&mut state, -1e-5, low);
    for _ in 0..100 {
        let force = gms.step(&mut state, 1e-5, low);
        let exact = 0.05 + (last - 0.05) * (-5.0 * PERIOD_S / 0.05f64).exp();
        assert!((force - exact).abs() < 1e-12, "{last} {force} {exact}");
        last = force;
    }
}

#[test]
fn entry_to_slip_is_clipped_to_the_share() {
    let gms = Gms::<f64, 1>::build(&single());
    let mut state = GmsState::default();
    let sliding = Sliding::constant(0.15, 5.0, PERIOD_S);
    assert!((gms.step(&mut state, 0.0149, sliding) - 0.149).abs() < 1e-15);
    assert_eq!(gms.step(&mut state, 0.01, sliding), 0.15);
}

#[test]
fn each_direction_slides_at_its_own_level() {
    let elements = quadrant_settings::presets::x_axis().friction.gms.elements;
    let gms = Gms::<f64, 10>::build(&elements);
    let table = surface::<f64>();
    let mut state = GmsState::default();
    let mut settle = |step: f64| {
        let mut force = 0.0;
        for _ in 0..20_000 {
            force = gms.step(&mut state, step, under(&table, step));
        }
        force
    };
    let (forth, back) = (settle(2e-3), settle(-2e-3));
    assert!(
        (forth - CURVES.positive.level_v(20.0)).abs() < 1e-3 * 0.15,
        "{forth}"
    );
    assert!(
        (back + CURVES.negative.level_v(20.0)).abs() < 1e-3 * 0.17,
        "{back}"
    );
}

#[test]
fn unused_room_for_elements_does_not_act() {
    let elements = quadrant_settings::presets::x_axis().friction.gms.elements;
    let sliding = Sliding::constant(0.15, 5.0, PERIOD_S);
    let (four, ten) = (
        Gms::<f32, 4>::build(&elements),
        Gms::<f32, 10>::build(&elements),
    );
    let (mut in_four, mut in_ten) = (GmsState::default(), GmsState::default());
    for tick in 0..5000 {
        let step = 1e-3 * (tick as f32 * 0.01).sin();
        let tight = four.step(&mut in_four, step, sliding);
        assert_eq!(tight, ten.step(&mut in_ten, step, sliding));
    }
}
