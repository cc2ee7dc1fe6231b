//! The nonlinear gain: what is proven of it, what is not, and what a search finds in between.

use std::f64::consts::TAU;

use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::popov::sector_proof;
use quadrant_settings::presets::{X_GAINS, X_PLANT};
use quadrant_sim::loop_shape::{ContinuousLoop, OpenLoop, SampledLoop};
use quadrant_tune::design::npid::{NonlinearRule, Range, choose_nonlinear, gain_within_peak};
use quadrant_tune::design::robustness::{Robustness, RobustnessError, Uncertainty, robustness};
use quadrant_tune::design::time_varying::{Switching, VaryingLoop};
use quadrant_tune::design::{Form, Process};

const PERIOD_S: f64 = 1e-4;
const CROSSOVER_HZ: f64 = 64.9;
const X_LOOP: VaryingLoop<'_> = VaryingLoop {
    plant: X_PLANT,
    gains: X_GAINS,
    filters: &[],
    sample_time_s: PERIOD_S,
};

#[test]
fn the_popov_line_leaves_the_whole_plot_on_its_right() {
    let proof = sector_proof(&X_PLANT, &X_GAINS, 0.0);
    let open_loop = ContinuousLoop {
        plant: X_PLANT,
        gains: X_GAINS,
    };
    let foot = -1.0 / (proof.popov - 1.0);
    let mut nearest = f64::INFINITY;
    for index in 0..20_000 {
        let omega = TAU * 10.0_f64.powf(f64::from(index) / 20_000.0 * 4.0 - 1.0);
        let l = open_loop.response(omega);
        let h = l / (l + 1.0);
        nearest = nearest.min(h.re - proof.slope_s * omega * h.im - foot);
    }
    assert!((-1e-4..1e-2).contains(&nearest), "{nearest}");
}

#[test]
fn no_switching_gain_inside_the_circle_bound_destabilises() {
    let proof = sector_proof(&X_PLANT, &X_GAINS, PERIOD_S);
    for switching in VaryingLoop::family(CROSSOVER_HZ) {
        let growth = X_LOOP.growth(0.99 * proof.circle, switching);
        assert!(growth < 1.0, "{switching:?}: {growth}");
    }
}

#[test]
fn the_smallest_destabilising_gain_lies_between_the_two_bounds_and_close_to_popovs() {
    let proof = sector_proof(&X_PLANT, &X_GAINS, PERIOD_S);
    assert!(proof.circle < 0.95 * proof.popov, "{proof:?}");
    let constant = X_LOOP.smallest_unstable(1.0, Switching::Constant).unwrap();
    assert!((constant / proof.popov - 1.0).abs() < 2e-3, "{constant}");
    // A gain that may look at the error's rate as well, which Popov does not cover, needs a little less.
    let worst = X_LOOP.worst(1.0, CROSSOVER_HZ).unwrap();
    assert!(
        worst.gain > proof.circle && worst.gain < 0.99 * proof.popov,
        "{worst:?} against {proof:?}"
    );
    assert!(worst.gain > 0.93 * proof.popov, "{worst:?}");
}

#[test]
fn the_largest_gain_leaves_the_sensitivity_within_its_peak_and_hardly_more_exceeds_it() {
    let form = Form::Sampled {
        sample_time_s: PERIOD_S,
        computation_delay_s: 0.0,
    };
    let process = Process::Model(X_PLANT);
    for peak in [2.0, 2.5, 3.5] {
        let largest = gain_within_peak(&process, &X_GAINS, form, peak, 10.0);
        // |S| read off the frequency response, by a sweep of its own.
        let loudest = |gain: f64| {
            let open_loop = SampledLoop::new(&X_PLANT, &X_GAINS, PERIOD_S, 0.0);
            (0..20_000)
                .map(|i| 10.0_f64.powf(f64::from(i) * 1e-4 + 1.0) * TAU)
                .map(|omega| (open_loop.response(omega) * gain + 1.0).norm().recip())
                .fold(0.0, f64::max)
        };
        assert!(
            loudest(largest) < 1.001 * peak,
            "{peak}: {}",
            loudest(largest)
        );
        assert!(
            loudest(1.01 * largest) > peak,
            "{peak}: {}",
            loudest(1.01 * largest)
        );
    }
    assert_eq!(gain_within_peak(&process, &X_GAINS, form, 1.01, 10.0), 1.0);
    assert_eq!(gain_within_peak(&process, &X_GAINS, form, 1e9, 1.1), 1.1);
}

#[test]
fn the_gain_takes_its_share_of_the_bound_over_the_range_that_friction_causes() {
    let rule = NonlinearRule {
        sector_share: 0.75,
        largest: 5.0,
        range: Range::Breakaway(0.15),
    };
    let chosen = choose_nonlinear(&X_GAINS, 3.0, &rule).unwrap();
    assert!((chosen.largest() - 2.25).abs() < 1e-12);
    assert!((chosen.range_mm - 0.15 / 1.118).abs() < 1e-12);
    assert_eq!(choose_nonlinear(&X_GAINS, 1.2, &rule), None);
}

fn with(deviations: [f64; 4]) -> Robustness {
    let uncertainty = Uncertainty::independent(deviations);
    robustness(&X_PLANT, &X_GAINS, &[], PERIOD_S, &uncertainty, 200, 1).unwrap()
}

#[test]
fn a_certain_model_has_one_bound_and_an_uncertain_one_a_spread_around_it() {
    let proof = sector_proof(&X_PLANT, &X_GAINS, PERIOD_S);
    let certain = with([0.0; 4]);
    assert!(certain.bounds.iter().all(|&bound| bound == proof.popov));
    let uncertain = with([0.05, 0.1, 0.3, 0.05]);
    assert!(uncertain.quantile(0.05) < 0.95 * proof.popov);
    assert!((uncertain.quantile(0.5) / proof.popov - 1.0).abs() < 0.03);
    assert!(uncertain.share_below(proof.popov) > 0.3);
    assert_eq!(uncertain.share_below(1.0), 0.0);
}

#[test]
fn the_bound_falls_in_proportion_as_the_axis_answers_more() {
    let proof = sector_proof(&X_PLANT, &X_GAINS, PERIOD_S);
    let lively = PlantModel {
        gain_mm_per_v_s2: 1.1 * X_PLANT.gain_mm_per_v_s2,
        ..X_PLANT
    };
    let bound = sector_proof(&lively, &X_GAINS, PERIOD_S).popov;
    assert!((bound * 1.1 / proof.popov - 1.0).abs() < 2e-3, "{bound}");
}

#[test]
fn impossible_correlations_and_no_draws_are_refused() {
    let mut uncertainty = Uncertainty::independent([0.1; 4]);
    uncertainty.correlation[(0, 1)] = 2.0;
    uncertainty.correlation[(1, 0)] = 2.0;
    let run = |uncertainty: &Uncertainty, draws: usize| {
        robustness(&X_PLANT, &X_GAINS, &[], PERIOD_S, uncertainty, draws, 1)
    };
    assert_eq!(run(&uncertainty, 10), Err(RobustnessError::Correlation));
    let independent = Uncertainty::independent([0.1; 4]);
    assert_eq!(run(&independent, 0), Err(RobustnessError::NoDraws));
}
