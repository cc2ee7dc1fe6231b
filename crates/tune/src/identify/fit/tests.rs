use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

const LEVEL: Parameter = Parameter {
    name: "level",
    start: 1.0,
    bounds: (0.0, 100.0),
};
const RATE: Parameter = Parameter {
    name: "rate",
    start: 1.0,
    bounds: (0.0, 50.0),
};

/// Samples of `3 exp(-2 t)` with noise.
fn decay(noise: f64, seed: u64) -> Vec<(f64, f64)> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    (0..60)
        .map(|k| {
            let t = 0.03 * f64::from(k);
            let normal: f64 = StandardNormal.sample(&mut random);
            (t, 3.0 * (-2.0 * t).exp() + noise * normal)
        })
        .collect()
}

fn residuals(data: &[(f64, f64)]) -> impl Fn(&[f64]) -> Vec<f64> {
    |p| {
        data.iter()
            .map(|(t, y)| p[0] * (-p[1] * t).exp() - y)
            .collect()
    }
}

#[test]
fn exact_data_give_the_exact_parameters() {
    let data = decay(0.0, 1);
    let fit = fit(&[LEVEL, RATE], Loss::Squares, residuals(&data)).unwrap();
    assert!((fit.values[0] - 3.0).abs() < 1e-6);
    assert!((fit.values[1] - 2.0).abs() < 1e-6);
    assert!(!fit.at_bound.contains(&true));
}

#[test]
fn a_parameter_without_influence_leaves_the_others_their_standard_errors() {
    let data = decay(0.01, 1);
    let alone = fit(&[LEVEL, RATE], Loss::Squares, residuals(&data)).unwrap();
    let idle = Parameter {
        name: "idle",
        ..RATE
    };
    let with = fit(&[LEVEL, RATE, idle], Loss::Squares, residuals(&data)).unwrap();
    assert!(with.standard_errors[2].is_infinite());
    for index in 0..2 {
        let ratio = with.standard_errors[index] / alone.standard_errors[index];
        // One more parameter counts.
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    }
}

#[test]
fn the_truth_lies_within_two_standard_errors_as_often_as_it_should() {
    let inside = (0..200)
        .filter(|&seed| {
            let data = decay(0.05, seed);
            let fit = fit(&[LEVEL, RATE], Loss::Squares, residuals(&data)).unwrap();
            (fit.values[1] - 2.0).abs() < 2.0 * fit.standard_errors[1]
        })
        .count();
    // 95.4 % of 200, give or take three standard deviations.
    assert!((182..=199).contains(&inside), "{inside} of 200");
}

#[test]
fn outliers_hardly_move_the_robust_fit() {
    let mut data = decay(0.01, 1);
    for index in [5, 17, 33, 48] {
        data[index].1 += 4.0;
    }
    let plain = fit(&[LEVEL, RATE], Loss::Squares, residuals(&data)).unwrap();
    let robust = fit(&[LEVEL, RATE], Loss::Huber, residuals(&data)).unwrap();
    assert!((plain.values[1] - 2.0).abs() > 0.3);
    assert!((robust.values[1] - 2.0).abs() < 0.03);
}

#[test]
fn a_bound_holds_and_is_reported() {
    let data = decay(0.01, 1);
    let slow = Parameter {
        bounds: (0.0, 1.5),
        ..RATE
    };
    let fit = fit(&[LEVEL, slow], Loss::Squares, residuals(&data)).unwrap();
    assert!(fit.values[1] <= 1.5);
    assert_eq!(fit.at_bound, [false, true]);
}

#[test]
fn parameters_that_the_data_hardly_distinguish_are_seen_to_be_correlated() {
    let data = decay(0.01, 1);
    let slope = Parameter {
        name: "slope",
        start: 0.5,
        bounds: (-10.0, 10.0),
    };
    // A line far from the origin: a higher level is as good as a steeper slope.
    let line = fit(&[LEVEL, slope], Loss::Squares, |p| {
        data.iter()
            .map(|(t, noise)| p[0] + p[1] * (t + 20.0) - noise)
            .collect()
    })
    .unwrap();
    assert!(line.correlation[(0, 1)] < -0.99);
    let covariance = line.covariance(0, 1);
    assert!(covariance < 0.0 && covariance.is_finite());
}

#[test]
fn what_the_data_do_not_distinguish_has_no_small_standard_error() {
    let data = decay(0.01, 1);
    let other = Parameter {
        name: "other",
        ..LEVEL
    };
    for exponent in 4..14 {
        let apart = 0.1_f64.powi(exponent);
        let fit = fit_nearest(&[LEVEL, other], Loss::Squares, |p| {
            data.iter()
                .map(|(t, y)| p[0] * (-2.0 * t).exp() + p[1] * (-(2.0 + apart) * t).exp() - y)
                .collect()
        })
        .unwrap();
        for error in fit.standard_errors {
            assert!(error > 10.0, "{error} with rates {apart} apart");
        }
    }
}

#[test]
fn too_few_data_and_bad_starts_are_refused() {
    let few = fit(&[LEVEL, RATE], Loss::Squares, |_| vec![0.0; 2]);
    assert!(matches!(few, Err(FitError::TooFewData { .. })));
    let outside = Parameter {
        start: -1.0,
        ..RATE
    };
    let bad = fit(&[LEVEL, outside], Loss::Squares, |_| vec![0.0; 9]);
    assert_eq!(bad, Err(FitError::BadStart { parameter: "rate" }));
    let not_a_number = fit(&[LEVEL, RATE], Loss::Squares, |_| vec![f64::NAN; 9]);
    assert_eq!(not_a_number, Err(FitError::NotFinite));
}
