//! Promises of every feedback law, whichever it is.

use proptest::prelude::*;
use quadrant_law::control::feedback::{Feedback, LawKind};
use quadrant_law::control::terms::FeedbackInput;
use quadrant_law::control::terms::FeedbackState;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::presets::x_axis;

use quadrant_test_support::{any_f32, repeatable};

const PERIOD_S: f64 = 1e-4;

fn law<S: Scalar>(kind: LawKind) -> Feedback<S> {
    let mut settings = x_axis().feedback;
    settings.law = kind;
    settings.build(PERIOD_S)
}

fn laws() -> impl Strategy<Value = LawKind> {
    prop::sample::select(LawKind::ALL.to_vec())
}

fn input<S: Scalar>(error_mm: f64, velocity_mm_s: f64) -> FeedbackInput<S> {
    FeedbackInput {
        error: S::quantise(error_mm, Quantity::Length),
        velocity: S::quantise(velocity_mm_s, Quantity::Velocity),
    }
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn output_is_finite_and_within_its_bounds_for_any_input(
        kind in laws(),
        inputs in prop::collection::vec((any_f32(), any_f32()), 40),
        base in -10.0f32..10.0,
    ) {
        // What is cut is a difference from the base, rounded.
        let limit = 10.0f32;
        let most = limit.next_up();
        let law = law::<f32>(kind);
        let mut state = FeedbackState::default();
        for (error, velocity) in inputs {
            // The reference is the law's own and always a number.
            let velocity = if velocity.is_finite() { velocity.clamp(-2e3, 2e3) } else { 0.0 };
            let terms = law.step(&mut state, FeedbackInput { error, velocity }, base, limit);
            prop_assert!((terms.output + base).abs() <= most, "{terms:?}");
            prop_assert!(terms.proportional.is_finite() && terms.derivative.is_finite());
            prop_assert!(terms.integral.abs() <= 2.0, "{terms:?}");
        }
        // The memory has no trace of what was not a number: the loop works on.
        let terms = law.step(&mut state, input(1e-3, 0.0), base, limit);
        prop_assert!(terms.derivative.is_finite() && terms.integral.abs() <= 2.0);
    }

    #[test]
    fn fixed_point_output_stays_within_its_bounds_for_any_input(
        kind in laws(),
        inputs in prop::collection::vec((any::<i32>(), any::<i32>()), 40),
    ) {
        let law = law::<Fixed>(kind);
        let high = Fixed::quantise(10.0, Quantity::Voltage);
        let mut state = FeedbackState::default();
        for (error, velocity) in inputs {
            let input = FeedbackInput { error: Fixed(error), velocity: Fixed(velocity) };
            let terms = law.step(&mut state, input, Fixed::ZERO, high);
            prop_assert!(terms.output >= -high && terms.output <= high, "{terms:?}");
        }
    }

    #[test]
    fn both_senses_of_motion_are_alike(
        kind in laws(),
        inputs in prop::collection::vec((-0.2f64..0.2, -20.0f64..20.0), 60),
    ) {
        let law = law::<f64>(kind);
        let (mut here, mut there) = (FeedbackState::default(), FeedbackState::default());
        for (error, velocity) in inputs {
            let one = law.step(&mut here, input(error, velocity), 0.0, 10.0).output;
            let other = law.step(&mut there, input(-error, -velocity), 0.0, 10.0).output;
            prop_assert_eq!(one, -other);
        }
    }

    #[test]
    fn number_types_agree(
        kind in laws(),
        errors in prop::collection::vec(-0.02f64..0.02, 60),
        velocity in -20.0f64..20.0,
    ) {
        let (exact, single, fixed) = (law::<f64>(kind), law::<f32>(kind), law::<Fixed>(kind));
        let mut states = (FeedbackState::default(), FeedbackState::default(), FeedbackState::default());
        let ten = Fixed::quantise(10.0, Quantity::Voltage);
        for error in errors {
            let exact = exact.step(&mut states.0, input(error, velocity), 0.0, 10.0).output;
            let single = single.step(&mut states.1, input(error, velocity), 0.0, 10.0).output;
            let fixed = fixed.step(&mut states.2, input(error, velocity), Fixed::ZERO, ten).output;
            // The derivative alone multiplies an error's rounding by 54 V/mm.
            prop_assert!((f64::from(single) - exact).abs() < 2e-6, "{single} {exact}");
            let fixed = fixed.to_f64(Quantity::Voltage);
            prop_assert!((fixed - exact).abs() < 2e-5, "{fixed} {exact}");
        }
    }
}

#[test]
fn an_error_that_is_not_a_number_counts_as_none() {
    for kind in LawKind::ALL {
        let mut state = FeedbackState::default();
        let nothing = FeedbackInput {
            error: f32::NAN,
            velocity: 0.0,
        };
        let terms = law::<f32>(kind).step(&mut state, nothing, 0.0, 10.0);
        assert_eq!(terms.output, 0.0, "{kind:?}");
        assert_eq!(state, FeedbackState::default(), "{kind:?}");
    }
}

#[test]
fn the_default_laws_are_one_pid_at_small_errors() {
    let settings = x_axis().feedback;
    for kind in LawKind::ALL {
        let of = quadrant_settings::FeedbackSettings {
            law: kind,
            ..settings.clone()
        };
        for gains in of.linear_gains() {
            let near = |found: f64, expected: f64| (found - expected).abs() < 1e-9 * expected.abs();
            assert!(
                near(gains.kp_v_per_mm, settings.pid.kp_v_per_mm),
                "{kind:?}"
            );
            assert!(
                near(gains.kd_v_s_per_mm, settings.pid.kd_v_s_per_mm),
                "{kind:?}"
            );
            let integrates = kind != LawKind::Pd;
            assert_eq!(gains.ki_v_per_mm_s > 0.0, integrates, "{kind:?}");
        }
    }
}
