//! The PID: bounds, filter, and its start.

use proptest::prelude::*;
use quadrant_law::control::npid::{NonlinearGain, NonlinearGainTable};
use quadrant_law::control::pid::{Pid, PidGains};
use quadrant_law::control::terms::FeedbackState;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::presets::x_axis;

use quadrant_test_support::{any_f32, repeatable};

const PERIOD_S: f64 = 1e-4;

fn x_gains() -> PidGains {
    x_axis().feedback.pid
}

/// Every set of gains that validation accepts at 10 kHz.
fn gains() -> impl Strategy<Value = PidGains> {
    (0.0f64..=1e4, 0.0f64..=1e6, 0.0f64..=1e2, 0.5e-4f64..=1.0).prop_map(|(kp, ki, kd, filter)| {
        PidGains {
            kp_v_per_mm: kp,
            ki_v_per_mm_s: ki,
            kd_v_s_per_mm: kd,
            derivative_filter_s: filter,
        }
    })
}

proptest! {
    #![proptest_config(repeatable(400))]

    #[test]
    fn output_is_finite_and_within_its_bounds_for_any_error(
        gains in gains(),
        errors in prop::collection::vec(any_f32(), 40),
        base in -10.0f32..10.0,
        nonlinear in any::<bool>(),
    ) {
        // What is cut is a difference from the base, rounded.
        let limit = 10.0f32;
        let most = limit.next_up();
        let pid = Pid::<f32>::build(&gains, 10.0, PERIOD_S);
        let shape = NonlinearGainTable::<f32>::build(&NonlinearGain {
            rate_per_mm: 15.0,
            range_mm: 0.1,
        });
        let mut state = FeedbackState::default();
        for error in errors {
            let error = if nonlinear { shape.scaled_error(error) } else { error };
            let terms = pid.step(&mut state, error, base, limit);
            prop_assert!((terms.output + base).abs() <= most, "{terms:?}");
            prop_assert!(terms.proportional.is_finite() && terms.derivative.is_finite());
            prop_assert!(terms.integral.abs() <= 10.0, "{terms:?}");
        }
        // The memory has no trace of what was not a number: the loop works on.
        let terms = pid.step(&mut state, 1e-3, base, limit);
        prop_assert!(terms.derivative.is_finite() && terms.integral.abs() <= 10.0);
    }

    #[test]
    fn fixed_point_output_stays_within_its_bounds_for_any_error(
        gains in gains(),
        errors in prop::collection::vec(any::<i32>(), 40),
    ) {
        let pid = Pid::<Fixed>::build(&gains, 10.0, PERIOD_S);
        let high = Fixed::quantise(10.0, Quantity::Voltage);
        let mut state = FeedbackState::default();
        for error in errors {
            let terms = pid.step(&mut state, Fixed(error), Fixed::ZERO, high);
            prop_assert!(terms.output >= -high && terms.output <= high, "{terms:?}");
            prop_assert!(terms.integral >= -high && terms.integral <= high, "{terms:?}");
        }
    }
}

#[test]
fn an_error_that_is_not_a_number_counts_as_none() {
    let pid = Pid::<f32>::build(&x_gains(), 2.0, PERIOD_S);
    let mut state = FeedbackState::default();
    let terms = pid.step(&mut state, f32::NAN, 0.0, 10.0);
    assert_eq!(terms.output, 0.0);
    assert_eq!(state, FeedbackState::default());
}

#[test]
fn proportional_and_integral_terms_are_their_definitions() {
    let gains = PidGains {
        kd_v_s_per_mm: 0.0,
        ki_v_per_mm_s: 50.0,
        ..x_gains()
    };
    let pid = Pid::<f64>::build(&gains, 2.0, PERIOD_S);
    let mut state = FeedbackState::default();
    for tick in 1..=1000 {
        let terms = pid.step(&mut state, 0.1, 0.0, 10.0);
        assert!((terms.proportional - 0.1 * gains.kp_v_per_mm).abs() < 1e-15);
        let integral = 0.1 * gains.ki_v_per_mm_s * PERIOD_S * f64::from(tick);
        assert!((terms.integral - integral).abs() < 1e-12);
        assert_eq!(
            terms.output,
            terms.proportional + terms.derivative + terms.integral
        );
        assert!(!terms.saturated);
    }
}

#[test]
fn derivative_step_response_is_the_bilinear_one() {
    let gains = x_gains();
    let pid = Pid::<f64>::build(&gains, 2.0, PERIOD_S);
    let mut state = FeedbackState::default();
    // s = 2/T (z-1)/(z+1) in Kd s / (1 + tau s).
    let (tau, kd) = (gains.derivative_filter_s, gains.kd_v_s_per_mm);
    let pole = (2.0 * tau - PERIOD_S) / (2.0 * tau + PERIOD_S);
    let mut expected = 2.0 * kd / (2.0 * tau + PERIOD_S) * 0.01;
    for _ in 0..20 {
        let terms = pid.step(&mut state, 0.01, 0.0, 10.0);
        assert!((terms.derivative - expected).abs() < 1e-12);
        expected *= pole;
    }
}

#[test]
fn derivative_has_the_analytic_gain_and_phase_at_frequencies() {
    use std::f64::consts::TAU;
    let gains = x_gains();
    let pid = Pid::<f64>::build(&gains, 2.0, PERIOD_S);
    // Frequencies with a whole number of cycles in 10 000 ticks.
    for frequency_hz in [1.0, 65.0, 500.0, 2000.0] {
        let angle = |tick: i32| TAU * frequency_hz * f64::from(tick) * PERIOD_S;
        let mut state = FeedbackState::default();
        let (mut re, mut im) = (0.0, 0.0);
        for tick in -1000..10_000 {
            let terms = pid.step(&mut state, 1e-3 * angle(tick).sin(), 0.0, 10.0);
            if tick >= 0 {
                re += terms.derivative * angle(tick).sin() * 2e-4 / 1e-3;
                im += terms.derivative * angle(tick).cos() * 2e-4 / 1e-3;
            }
        }
        // Kd j W / (1 + j W tau) at the frequency that the bilinear rule maps to.
        let warped = 2.0 / PERIOD_S * (TAU * frequency_hz * PERIOD_S / 2.0).tan();
        let (w, wt) = (warped, warped * gains.derivative_filter_s);
        let kd = gains.kd_v_s_per_mm;
        let (exact_re, exact_im) = (kd * w * wt / (1.0 + wt * wt), kd * w / (1.0 + wt * wt));
        let size = exact_re.hypot(exact_im);
        let error = (re - exact_re).hypot(im - exact_im) / size;
        assert!(error < 1e-6, "{frequency_hz} Hz: {error:e}");
    }
}

#[test]
fn reset_gives_no_derivative_kick() {
    let pid = Pid::<f32>::build(&x_gains(), 2.0, PERIOD_S);
    let mut state = FeedbackState::default();
    pid.step(&mut state, 3.0, 0.0, 10.0);
    pid.reset(&mut state, 0.5);
    let terms = pid.step(&mut state, 0.5, 0.0, 10.0);
    assert_eq!(terms.derivative, 0.0);
    assert!((terms.output - 0.5 * 1.118).abs() < 1e-3);
}

#[test]
fn integral_stops_at_its_limit_and_leaves_it_at_once() {
    let gains = PidGains {
        ki_v_per_mm_s: 100.0,
        kd_v_s_per_mm: 0.0,
        ..x_gains()
    };
    for sign in [1.0, -1.0] {
        let pid = Pid::<f64>::build(&gains, 0.5, PERIOD_S);
        let mut state = FeedbackState::default();
        for _ in 0..10_000 {
            pid.step(&mut state, sign * 0.1, 0.0, 10.0);
        }
        let held = pid.step(&mut state, sign * 0.1, 0.0, 10.0);
        assert_eq!(held.integral, sign * 0.5);
        let back = pid.step(&mut state, -sign * 0.1, 0.0, 10.0);
        assert!((back.integral - sign * (0.5 - 0.1 * 100.0 * PERIOD_S)).abs() < 1e-12);
    }
}

#[test]
fn integral_takes_nothing_that_pushes_a_cut_output_further_out() {
    let gains = PidGains {
        ki_v_per_mm_s: 100.0,
        kd_v_s_per_mm: 0.0,
        ..x_gains()
    };
    for sign in [1.0, -1.0] {
        let pid = Pid::<f64>::build(&gains, 5.0, PERIOD_S);
        let mut state = FeedbackState::default();
        for _ in 0..10_000 {
            let terms = pid.step(&mut state, sign * 5.0, 0.0, 3.0);
            assert!(terms.saturated);
            assert_eq!(terms.output, sign * 3.0);
            assert_eq!(terms.integral, 0.0);
        }
        // An error of the other sign is taken although the output is still cut.
        let terms = pid.step(&mut state, -sign * 5.0, 0.0, 3.0);
        assert!(terms.saturated);
        let again = pid.step(&mut state, -sign * 0.1, 0.0, 3.0);
        assert!(!again.saturated);
        assert!((again.integral + sign * 0.1 * 100.0 * PERIOD_S).abs() < 1e-12);
    }
}

#[test]
fn a_fixed_point_integral_collects_terms_below_its_step() {
    let gains = PidGains {
        kp_v_per_mm: 0.0,
        ki_v_per_mm_s: 1.5,
        kd_v_s_per_mm: 0.0,
        ..x_gains()
    };
    // One step of error, 15 pm, adds 2e-15 V a tick: 1e-7 of the voltage's step.
    let pid = Pid::<Fixed>::build(&gains, 2.0, PERIOD_S);
    let mut state = FeedbackState::default();
    let high = Fixed::quantise(10.0, Quantity::Voltage);
    let mut terms = pid.step(&mut state, Fixed(1), Fixed::ZERO, high);
    assert_eq!(terms.integral, Fixed(0));
    for _ in 0..10_000 {
        terms = pid.step(&mut state, Fixed(1000), Fixed::ZERO, high);
    }
    let exact = 10_001.0 * 1000.0 * 1.5e-4;
    assert!(
        (f64::from(terms.integral.0) - exact).abs() < 1.0,
        "{terms:?}"
    );
}
