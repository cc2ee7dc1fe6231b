//! Tests of the Popov bound. Its confirmation by running the loop is in `quadrant-sim`, beside the margins.

use proptest::prelude::*;

use super::*;

const X_PLANT: PlantModel = PlantModel {
    gain_mm_per_v_s2: 69390.0,
    damping_per_s: 144.8,
    stiffness_per_s2: 166.6,
    delay_s: 1.2e-3,
};

const X_GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.118,
    ki_v_per_mm_s: 0.74,
    kd_v_s_per_mm: 0.005537,
    derivative_filter_s: 52e-6,
};

fn scaled(factor: f64) -> PidGains {
    PidGains {
        kp_v_per_mm: factor * X_GAINS.kp_v_per_mm,
        ki_v_per_mm_s: factor * X_GAINS.ki_v_per_mm_s,
        kd_v_s_per_mm: factor * X_GAINS.kd_v_s_per_mm,
        ..X_GAINS
    }
}

#[test]
fn x_axis_bears_a_gain_of_about_three() {
    let continuous = sector_bound(&X_PLANT, &X_GAINS, 0.0);
    assert!((continuous - 3.127).abs() < 1e-3, "{continuous}");
    let at_10_khz = sector_bound(&X_PLANT, &X_GAINS, 1e-4);
    assert!((at_10_khz - 3.002).abs() < 1e-3, "{at_10_khz}");
}

#[test]
fn an_integrating_loop_with_delay_agrees_with_the_closed_form() {
    // An integrator-like loop, L = g exp(-s Td) / s, has its gain margin at pi / (2 Td), and Popov proves all of it.
    let (gain, delay_s) = (100.0, 2e-3);
    let damping = 1e6;
    let plant = PlantModel {
        gain_mm_per_v_s2: gain * damping,
        damping_per_s: damping,
        stiffness_per_s2: 0.0,
        delay_s,
    };
    let gains = PidGains {
        kp_v_per_mm: 1.0,
        ki_v_per_mm_s: 0.0,
        kd_v_s_per_mm: 0.0,
        derivative_filter_s: 0.0,
    };
    let expected = FRAC_PI_2 / (gain * delay_s);
    let bound = sector_bound(&plant, &gains, 0.0);
    assert!((bound / expected - 1.0).abs() < 2e-3, "{bound}, {expected}");
}

#[test]
fn an_unstable_linear_loop_bears_no_nonlinear_gain() {
    assert_eq!(sector_bound(&X_PLANT, &scaled(3.2), 0.0), 1.0);
    assert_eq!(sector_bound(&X_PLANT, &scaled(30.0), 0.0), 1.0);
    let impatient = PidGains {
        ki_v_per_mm_s: 700.0,
        ..X_GAINS
    };
    assert_eq!(sector_bound(&X_PLANT, &impatient, 0.0), 1.0);
    let undamped = PlantModel {
        damping_per_s: 0.0,
        stiffness_per_s2: 0.0,
        ..X_PLANT
    };
    let proportional = PidGains {
        kd_v_s_per_mm: 0.0,
        ..X_GAINS
    };
    assert_eq!(sector_bound(&undamped, &proportional, 0.0), 1.0);
}

#[test]
fn poles_on_the_imaginary_axis_are_no_obstacle() {
    let free = PlantModel {
        damping_per_s: 0.0,
        stiffness_per_s2: 0.0,
        ..X_PLANT
    };
    let bound = sector_bound(&free, &X_GAINS, 0.0);
    assert!(bound > 2.0 && bound < 4.0, "{bound}");
}

#[test]
fn a_parameter_outside_its_range_bears_no_nonlinear_gain() {
    for broken in [f64::NAN, f64::INFINITY, -1.0] {
        let plant = PlantModel {
            damping_per_s: broken,
            ..X_PLANT
        };
        assert_eq!(sector_bound(&plant, &X_GAINS, 1e-4), 1.0);
        let gains = PidGains {
            ki_v_per_mm_s: broken,
            ..X_GAINS
        };
        assert_eq!(sector_bound(&X_PLANT, &gains, 1e-4), 1.0);
        assert_eq!(sector_bound(&X_PLANT, &X_GAINS, broken), 1.0);
    }
}

proptest! {
    #[test]
    fn any_parameters_give_a_bound_between_one_and_a_million(
        plant in any::<[f64; 4]>(),
        gains in any::<[f64; 4]>(),
        sample_time_s in any::<f64>(),
    ) {
        let plant = PlantModel {
            gain_mm_per_v_s2: plant[0].abs(),
            damping_per_s: plant[1].abs(),
            stiffness_per_s2: plant[2].abs(),
            delay_s: plant[3].abs(),
        };
        let gains = PidGains {
            kp_v_per_mm: gains[0].abs(),
            ki_v_per_mm_s: gains[1].abs(),
            kd_v_s_per_mm: gains[2].abs(),
            derivative_filter_s: gains[3].abs(),
        };
        let bound = sector_bound(&plant, &gains, sample_time_s);
        prop_assert!((1.0..=1e6).contains(&bound), "{bound}");
    }

    #[test]
    fn gain_spent_on_the_pid_is_missing_in_the_sector(factor in 1.0..2.9_f64) {
        let whole = sector_bound(&X_PLANT, &X_GAINS, 0.0);
        let rest = sector_bound(&X_PLANT, &scaled(factor), 0.0);
        // Two per cent where less than a decibel is left, a fifth of one elsewhere, and never on the wide side.
        let tolerance = if rest < 1.13 { 2e-2 } else { 2e-3 };
        let error = factor * rest / whole - 1.0;
        prop_assert!(error < 1e-9 && error > -tolerance, "{rest}, {whole}");
    }

    #[test]
    fn a_longer_sample_time_never_widens_the_sector(
        shorter in 0.0..1e-3_f64,
        more in 1e-6..1e-3_f64,
    ) {
        let wide = sector_bound(&X_PLANT, &X_GAINS, shorter);
        let narrow = sector_bound(&X_PLANT, &X_GAINS, shorter + more);
        prop_assert!(narrow <= wide * (1.0 + 1e-6), "{narrow}, {wide}");
    }
}
