//! The robustness experiment measures what it says.

use std::sync::Arc;

use quadrant_law::safety::FaultCode;
use quadrant_pages::compare::sine::run_configuration;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_settings::StageSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::{Force, Load};
use quadrant_sim::plant::{NEWTONS_PER_VOLT, StageParameters};
use quadrant_studies::robustness::compliance::{
    FREQUENCIES_HZ, frictionless, linear_compliance, pid_alone, simulated_compliance,
};
use quadrant_studies::robustness::{
    RobustnessOutcome, RobustnessRequest, Task, baseline, find, run_robustness, scenarios,
    usual_competitors,
};
use quadrant_tune::record::ForceRecord;

fn stage() -> StageSettings {
    identified_settings().unwrap().stage
}

/// The scenarios of these names on x, under the usual laws.
fn request(names: &[&str], seed: u64, seeds: u64) -> RobustnessRequest {
    let mut scenarios = scenarios(0, None);
    scenarios.retain(|scenario| names.contains(&scenario.name.as_str()));
    assert_eq!(scenarios.len(), names.len());
    RobustnessRequest {
        competitors: usual_competitors(&stage()),
        axis: 0,
        scenarios,
        seed,
        seeds,
    }
}

fn run(request: &RobustnessRequest) -> Vec<RobustnessOutcome> {
    run_robustness(request, &|| {}).unwrap()
}

fn largest_um(outcomes: &[RobustnessOutcome], scenario: &str, competitor: &str) -> f64 {
    let outcome = find(outcomes, scenario, competitor).unwrap();
    1e3 * outcome.statistic(|score| score.largest_mm).unwrap().mean
}

#[test]
fn the_nominal_sine_is_the_comparison_s_run_to_the_last_bit() {
    // The comparison's second axis, at 10 mm/s, has the noise of three times its seed and one.
    let outcomes = run(&request(&["nominal"], 4, 1));
    let setup = RunConfiguration::identified(stage());
    for configuration in [Configuration::all()[0], Configuration::all()[7]] {
        let compared = run_configuration::<f32>(configuration, &setup, 1).unwrap();
        let own = find(&outcomes, "nominal", &configuration.name()).unwrap();
        assert_eq!(own.runs[0], Ok(compared[1].score));
    }
}

#[test]
fn the_same_seeds_give_the_same_scores_and_others_others() {
    let scores = |seed| -> Vec<_> {
        run(&request(&["hold", "hold, cutting"], seed, 2))
            .into_iter()
            .map(|outcome| {
                outcome
                    .runs
                    .iter()
                    .map(|run| run.map(|it| it.rms_mm))
                    .collect::<Vec<_>>()
            })
            .collect()
    };
    assert_eq!(scores(1), scores(1));
    assert_ne!(scores(1), scores(5));
}

#[test]
fn changes_are_counted_from_the_same_law_on_the_same_task() {
    let outcomes = run(&request(&["hold", "hold, cutting", "slow feed"], 1, 1));
    for outcome in &outcomes {
        let from = baseline(&outcomes, outcome).unwrap();
        assert_eq!(
            (from.task, &from.competitor),
            (outcome.task, &outcome.competitor)
        );
        assert!(["hold", "slow feed"].contains(&from.scenario.as_str()));
    }
    for law in ["PID", "N-PID + static + GMS"] {
        let still = largest_um(&outcomes, "hold", law);
        assert!(largest_um(&outcomes, "hold, cutting", law) > 3.0 * still);
    }
}

#[test]
fn learning_takes_back_what_a_change_of_friction_and_a_cut_cost() {
    let names = ["nominal", "friction +50 %", "friction x 0.5", "cutting"];
    let outcomes = run(&request(&names, 1, 1));
    let of = |scenario: &str, law: &str| largest_um(&outcomes, scenario, law);
    for law in ["PID", "N-PID"] {
        let (fixed, learning) = (
            format!("{law} + static + GMS"),
            format!("{law} + static + GMS, learning"),
        );
        assert!(of("nominal", &learning) < of("nominal", &fixed) + 1.5);
        for scenario in ["friction +50 %", "friction x 0.5"] {
            assert!(of(scenario, &learning) < 9.0, "{scenario}");
            assert!(of(scenario, &fixed) > 50.0, "{scenario}");
        }
        // Fixed feedforward doubles the error of the law alone; learning halves it.
        assert!(of("cutting", &fixed) > 1.5 * of("cutting", law));
        assert!(of("cutting", &learning) < 0.75 * of("cutting", law));
    }
}

#[test]
fn a_stage_that_switches_itself_off_is_a_result() {
    let mut request = request(&["hold"], 1, 2);
    request.scenarios[0].load = Load::Sine {
        amplitude_v: 8.0,
        frequency_hz: 2.0,
    };
    for outcome in run(&request) {
        assert_eq!(outcome.faults().len(), 2);
        // No load is as large, says the plant, if the error has not grown to its limit before.
        let codes = [FaultCode::FollowingError, FaultCode::EncoderImplausible];
        assert!(outcome.faults().iter().all(|it| codes.contains(&it.code)));
        assert_eq!(outcome.statistic(|score| score.largest_mm), None);
    }
}

#[test]
fn compensation_that_was_identified_before_friction_grew_still_helps() {
    let outcomes = run(&request(&["nominal", "friction +50 %"], 1, 1));
    let pid = largest_um(&outcomes, "friction +50 %", "PID");
    let full = largest_um(&outcomes, "friction +50 %", "N-PID + static + GMS");
    assert!(full < 0.5 * pid, "{full} um, PID {pid} um");
    assert!(full > 3.0 * largest_um(&outcomes, "nominal", "N-PID + static + GMS"));
}

/// The scenario "cutting" with a force in place of its own, N, repeated every 20 ms.
fn under(force_n: Vec<f64>) -> Vec<RobustnessOutcome> {
    let mut request = request(&["nominal", "cutting"], 1, 1);
    request.scenarios[1].load = Load::Recorded {
        force: Arc::new(Force {
            sample_time_s: 0.020 / force_n.len() as f64,
            force_n,
        }),
        newtons_per_volt: NEWTONS_PER_VOLT,
    };
    run(&request)
}

#[test]
fn a_cut_s_vibration_and_not_its_mean_spoils_the_compensation() {
    const FULL: &str = "N-PID + static + GMS";
    let cut = Milling::slot();
    let mean = cut.mean_force_n(Component::Normal);
    let steady = under(vec![mean; 200]);
    let nominal = largest_um(&steady, "nominal", FULL);
    assert!(largest_um(&steady, "cutting", FULL) < 1.5 * nominal);
    let vibration = (0..200)
        .map(|k| cut.force_n(Component::Normal, f64::from(k) * 1e-4) - mean)
        .collect();
    let shaken = under(vibration);
    // It makes the axis break away: there is less of it at a reversal than the compensation puts in.
    let pid = largest_um(&shaken, "cutting", "PID");
    assert!(pid < 0.6 * largest_um(&shaken, "nominal", "PID"));
    assert!(largest_um(&shaken, "cutting", FULL) > 1.5 * pid);
}

#[test]
fn without_friction_the_compliance_is_that_of_the_linear_loop() {
    let alone = pid_alone(&stage());
    let own = &alone.axes[0];
    let truth = StageParameters::real().axes[0].clone();
    let simulated = simulated_compliance("PID", &alone, &frictionless(&truth), 1).unwrap();
    for (hz, simulated) in FREQUENCIES_HZ.into_iter().zip(simulated.mm_per_v) {
        let linear = linear_compliance(&own.plant.unwrap(), own, 1e4, hz).norm();
        let apart = simulated.unwrap() / linear - 1.0;
        // Above, what is left of the amplitude is a few counts.
        let allowed = if hz < 150.0 { 0.02 } else { 0.06 };
        assert!(apart.abs() < allowed, "{hz} Hz: {:.2} %", 100.0 * apart);
    }
}

#[test]
fn every_scenario_has_a_name_of_its_own_and_something_different() {
    let all = scenarios(1, None);
    for (index, scenario) in all.iter().enumerate() {
        assert!(all[..index].iter().all(|it| it.name != scenario.name));
        let differs = scenario.truth != all[0].truth
            || scenario.load != Load::None
            || scenario.task != Task::Sine;
        assert_eq!(differs, index > 0, "{}", scenario.name);
    }
}

#[test]
fn the_committed_force_is_the_generated_one() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host-sim/data/synthetic-cutting-force.csv"
    );
    let [across, along, none] = ForceRecord::read_csv(path.as_ref()).unwrap().axes;
    assert_eq!(none, None);
    let cut = Milling::slot();
    for (force, component) in [(across, Component::Normal), (along, Component::Feed)] {
        let force = force.unwrap();
        assert_eq!(force.force_n.len(), 1000);
        for k in 0..1000 {
            let time_s = f64::from(k) * 2e-4;
            assert!((force.at_n(time_s) - cut.force_n(component, time_s)).abs() < 1e-9);
        }
    }
}
