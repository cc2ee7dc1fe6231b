//! The robustness experiment measures what it says.

use std::sync::Arc;

use quadrant_law::safety::FaultCode;
use quadrant_pages::compare::sine::run_configuration;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_settings::StageSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::NEWTONS_PER_VOLT;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::{Force, Load};
use quadrant_studies::robustness::{
    Outcome, Request, Task, baseline, find, run as run_scenarios, scenarios, usual_competitors,
};
use quadrant_tune::record::ForceRecord;

use crate::command::{fail, succeed};

fn stage() -> StageSettings {
    identified_settings().unwrap().stage
}

/// The scenarios of these names on x, under the usual laws.
fn request(names: &[&str], seed: u64, seeds: u64) -> Request {
    let mut scenarios = scenarios(0, None);
    scenarios.retain(|scenario| names.contains(&scenario.name.as_str()));
    assert_eq!(scenarios.len(), names.len());
    Request {
        competitors: usual_competitors(&stage()),
        axis: 0,
        scenarios,
        seed,
        seeds,
    }
}

fn run(request: &Request) -> Vec<Outcome> {
    run_scenarios(request, &|_| {}).unwrap()
}

fn largest_um(outcomes: &[Outcome], scenario: &str, competitor: &str) -> f64 {
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
fn under(force_n: Vec<f64>) -> Vec<Outcome> {
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

#[test]
fn chosen_scenarios_leave_tables_and_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let force = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../host-sim/data/synthetic-cutting-force.csv"
    );
    let arguments = ["robustness", "--seeds", "1", "--force", force];
    let chosen = ["--only", "hold, recorded", "--out", "a"];
    let said = succeed(folder.path(), &[&arguments[..], &chosen].concat());
    assert!(said.contains("Simulated, not measured"), "{said}");
    let file = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    assert!(
        file("a/robustness.csv")
            .contains("\"hold, recorded force\",the file's force all along,hold,PID,")
    );
    assert!(file("a/robustness.html").contains("hold, recorded force"));
    let refused = fail(folder.path(), &[&arguments[..], &["--axis", "z"]].concat());
    assert!(refused.contains("force_z_n"), "{refused}");
}

#[test]
fn what_cannot_be_is_refused_with_what_could() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..20)
        .map(|k| format!("{},{}\n", f64::from(k) * 1e-3, 2e5))
        .collect();
    for (name, text) in [
        ("f.csv", "t_s,force_n\n0,1\n".to_owned()),
        ("g.csv", format!("t_s,force_x_n\n{rows}")),
    ] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    for (arguments, words) in [
        (["--only", "earthquake"], "light cutting"),
        (["--seeds", "0"], "1..=100"),
        (["--force", "missing.csv"], "missing.csv"),
        (["--force", "f.csv"], "force_x_n"),
        (["--force", "g.csv"], "newtons"),
    ] {
        let said = fail(folder.path(), &[&["robustness"], &arguments[..]].concat());
        assert!(said.contains(words), "{said}");
    }
}
