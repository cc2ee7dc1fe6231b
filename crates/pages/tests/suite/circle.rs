//! The circle test on the simulated stage.

use quadrant_law::reference::Plane;
use quadrant_pages::circle::page::circle_tables;
use quadrant_pages::circle::{CircleRefusal, CircleRequest, CircleResult, run_circle_tests};
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_sim::identified_stage::identified_settings;

fn request(configurations: &[Configuration]) -> CircleRequest {
    CircleRequest {
        planes: vec![Plane::Xy],
        radii_mm: vec![10.0],
        feeds_mm_min: vec![1000.0],
        configurations: configurations.to_vec(),
        seeds: vec![1],
    }
}

fn results(request: &CircleRequest) -> Vec<CircleResult> {
    let setup = RunConfiguration::identified(identified_settings().unwrap().stage);
    run_circle_tests(request, &setup, &|| {})
}

#[test]
fn compensation_makes_the_circle_rounder_in_both_senses() {
    let results = results(&request(&Configuration::EXTREMES));
    let [pid, best] = [0, 1].map(|index| results[index].outcome.as_ref().unwrap());
    for (pid, best) in pid.turns().iter().zip(best.turns()) {
        assert!(best.1.circular_deviation_mm < 0.3 * pid.1.circular_deviation_mm);
        assert!(best.1.spikes.mean_height_mm() < 0.3 * pid.1.spikes.mean_height_mm());
    }
    assert!(best.both.circular_deviation_mm < 0.3 * pid.both.circular_deviation_mm);
}

#[test]
fn what_is_reported_of_a_circle_hangs_together() {
    let results = results(&request(&[Configuration::PID]));
    let test = results[0].outcome.as_ref().unwrap();
    for (_, turn) in test.turns() {
        // The least-squares centre can only narrow the range; both senses can only widen it.
        let about_nominal = turn.radial_max_mm - turn.radial_min_mm;
        assert!(turn.circular_deviation_mm <= about_nominal + 1e-4);
        assert!(turn.circular_deviation_mm <= test.both.circular_deviation_mm + 1e-4);
        assert!(turn.spikes.largest_mm() <= about_nominal);
        let drawn = turn.path.iter().map(|&(_, deviation)| deviation);
        assert_eq!(drawn.fold(f64::MIN, f64::max), turn.radial_max_mm);
        // Friction holds an axis at its reversal: PID alone is thrown outwards at all four.
        assert!(
            turn.spikes.0.iter().all(|&spike| spike > 0.0),
            "{:?}",
            turn.spikes
        );
    }
}

#[test]
fn a_circle_beyond_the_limits_is_reported_with_its_reason_beside_the_others() {
    let request = CircleRequest {
        radii_mm: vec![1.0, 10.0],
        feeds_mm_min: vec![4000.0, 0.001],
        ..request(&[Configuration::BEST])
    };
    let results = results(&request);
    // v^2 / r = 4444 mm/s^2 at 1 mm, of 2000 allowed; 444 at 10 mm.
    let refusal = results[0].outcome.as_ref().unwrap_err().to_string();
    assert!(
        refusal.contains("acceleration") && refusal.contains("2000"),
        "{refusal}"
    );
    assert!(matches!(
        results[1].outcome,
        Err(CircleRefusal::TooSlow { .. })
    ));
    assert!(results[2].outcome.is_ok());
    let tables = circle_tables(&results);
    let refused = tables.last().unwrap();
    assert_eq!(
        (refused.id.as_str(), refused.rows.len()),
        ("circle-refusals", 3)
    );
}

#[test]
fn the_same_request_gives_the_same_results_and_seeds_differ() {
    let request = CircleRequest {
        seeds: vec![1, 2],
        ..request(&[Configuration::BEST])
    };
    let deviations = |results: Vec<CircleResult>| {
        results
            .into_iter()
            .map(|result| result.outcome.unwrap().both)
            .collect::<Vec<_>>()
    };
    let [one, other] = [0, 1].map(|_| deviations(results(&request)));
    assert_eq!(one, other);
    assert_ne!(one[0], one[1]);
}
