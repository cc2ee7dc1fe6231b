//! The best PID, compared with what an optimiser of another kind (CMA-ES) finds on plants that are drawn.

use cmaes::{CMAESOptions, DVector};
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_tune::design::{COMPLEMENTARY_PEAK, Peaks, SENSITIVITY_PEAK, best_pid_within};
use quadrant_tune::design::{Form, Process, best_pid, load_step_error};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Evaluations in each run of the other search.
const EVALUATIONS: usize = 700;
/// Runs of the other search.
const RUNS: u64 = 3;
/// Share by which the other may find less error.
const WORSE: f64 = 0.01;

/// A plant, a control rate and a filter of the derivative: from light and quick to heavy, damped, sprung and late.
fn drawn(seed: u64) -> (PlantModel, Form, f64) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut decades = |low: f64, high: f64| low * (high / low).powf(random.random::<f64>());
    let sample_time_s = decades(5e-5, 1e-3);
    let plant = PlantModel {
        gain_mm_per_v_s2: decades(3e3, 1e6),
        damping_per_s: decades(0.1, 1e3),
        stiffness_per_s2: decades(1e-3, 1e4),
        delay_s: decades(sample_time_s, 5e-3f64.max(2.0 * sample_time_s)),
    };
    let form = Form::Sampled {
        sample_time_s,
        computation_delay_s: 0.0,
    };
    (plant, form, decades(0.5, 3.0) * sample_time_s)
}

/// The error after a step of the load that the other optimiser leaves, by exact margins; none if it finds no loop.
fn least_error_by_another(plant: &PlantModel, form: Form, filter_s: f64, seed: u64) -> Option<f64> {
    let process = Process::Model(*plant);
    let gains = |logarithms: &DVector<f64>| PidGains {
        kp_v_per_mm: logarithms[0].exp(),
        ki_v_per_mm_s: logarithms[1].exp(),
        kd_v_s_per_mm: logarithms[2].exp(),
        derivative_filter_s: filter_s,
    };
    let cost = |logarithms: &DVector<f64>| {
        let gains = gains(logarithms);
        let Ok(margins) = process.margins(&gains, form) else {
            return 1e3;
        };
        let excess = (margins.sensitivity_peak / SENSITIVITY_PEAK)
            .max(margins.complementary_peak / COMPLEMENTARY_PEAK);
        load_step_error(&process, &gains, form).ln() + 100.0 * (excess - 1.0).max(0.0)
    };
    // A crossover well below the delay's.
    let omega = 0.3 / plant.delay_s;
    let kd = omega / plant.gain_mm_per_v_s2;
    let start = [kd * omega / 3.0, kd * omega * omega / 30.0, kd].map(f64::ln);
    let best = (0..RUNS)
        .filter_map(|run| {
            let state = CMAESOptions::new(start.to_vec(), 0.7)
                .seed(RUNS * seed + run)
                .population_size(12)
                .max_function_evals(EVALUATIONS)
                .build(cost);
            Some(state.ok()?.run().overall_best?.value)
        })
        .min_by(f64::total_cmp)?;
    (best < 500.0).then(|| best.exp())
}

/// `QUADRANT_PLANTS=200 cargo test -p quadrant-tune --test suite best_pid -- --nocapture`: as many as one likes.
#[test]
fn no_other_optimiser_finds_a_pid_that_leaves_less_error_within_the_bounds() {
    let count = std::env::var("QUADRANT_PLANTS").map_or(10, |count| {
        count.parse().expect("QUADRANT_PLANTS: a number")
    });
    let mut ratios: Vec<(f64, u64)> = (1..=count)
        .into_par_iter()
        .map(|seed| {
            let (plant, form, filter_s) = drawn(seed);
            let process = Process::Model(plant);
            let other = least_error_by_another(&plant, form, filter_s, seed);
            let own = best_pid(&process, form, filter_s).ok().map(|design| {
                assert!(design.margins.sensitivity_peak <= SENSITIVITY_PEAK);
                assert!(design.margins.complementary_peak <= COMPLEMENTARY_PEAK);
                load_step_error(&process, &design.gains, form)
            });
            match (own, other) {
                (Some(own), Some(other)) => (own / other, seed),
                (None, Some(_)) => (f64::INFINITY, seed),
                (_, None) => (0.0, seed),
            }
        })
        .collect();
    ratios.sort_by(|a, b| b.0.total_cmp(&a.0));
    let shown = &ratios[..ratios.len().min(10)];
    println!("error over the other's, and the seed of the plant: {shown:.4?}");
    let alone = ratios.iter().filter(|(ratio, _)| *ratio == 0.0).count();
    println!(
        "the other finds no loop on {alone}; half are below {:.4}",
        ratios[ratios.len() / 2].0
    );
    assert!(ratios[0].0 < 1.0 + WORSE, "{shown:?}");
    assert!(alone < ratios.len() / 4, "{alone}");
}

#[test]
fn other_bounds_are_kept_and_used() {
    let (plant, form, filter_s) = drawn(3);
    let process = Process::Model(plant);
    let design = |sensitivity, complementary| {
        let peaks = Peaks {
            sensitivity,
            complementary,
        };
        let found = best_pid_within(&process, form, filter_s, peaks).unwrap();
        assert!(found.margins.sensitivity_peak <= sensitivity);
        assert!(found.margins.complementary_peak <= complementary);
        assert!(
            found.margins.sensitivity_peak > 0.98 * sensitivity
                || found.margins.complementary_peak > 0.98 * complementary
        );
        load_step_error(&process, &found.gains, form)
    };
    assert!(design(2.0, 1.8) < design(1.7, 1.5) && design(1.7, 1.5) < design(1.4, 1.3));
}
