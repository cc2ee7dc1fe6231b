//! The experiments on the simulated stage: what they must show, apart from exact figures.

use quadrant_law::command::Command;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_law::supervisor::Event;
use quadrant_pages::circle::run_circles;
use quadrant_pages::compare::sine::run_configuration;
use quadrant_pages::experiment::configuration::Configuration;
use quadrant_pages::experiment::run_configuration::RunConfiguration;
use quadrant_pages::replay::recorded::{RecordedAxis, replay};
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, StageSettings};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::law_machine::{LawMachine, Operator, TickInput};
use quadrant_sim::plant::{SimulatedStage, StageParameters};
use quadrant_tune::record::Record;
use quadrant_tune::test_axis::{SimulatedTestAxis, TestAxis, approach};

#[test]
fn combined_feedforward_removes_most_of_the_error_and_the_glitch_also_with_an_identified_model() {
    for setup in RunConfiguration::both(&identified_settings().unwrap().stage) {
        let pid = run_configuration::<f32>(Configuration::PID, &setup, 1).unwrap();
        let best = run_configuration::<f32>(Configuration::BEST, &setup, 1).unwrap();
        for (pid, best) in pid.iter().zip(&best) {
            assert!(best.score.largest_mm < 0.12 * pid.score.largest_mm);
            assert!(best.score.glitch_mm < 0.2 * pid.score.glitch_mm);
            assert!(best.score.rms_mm < 0.1 * pid.score.rms_mm);
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_outcome() {
    let [_, setup] = RunConfiguration::both(&identified_settings().unwrap().stage);
    let run = |seed| {
        run_configuration::<f32>(Configuration::BEST, &setup, seed)
            .unwrap()
            .map(|o| o.last_cycle.error_mm)
    };
    assert_eq!(run(7), run(7));
    assert_ne!(run(7), run(8));
}

#[test]
fn combined_feedforward_makes_the_circle_rounder() {
    let [_, setup] = RunConfiguration::both(&identified_settings().unwrap().stage);
    let circles = run_circles(&Configuration::EXTREMES, &setup, 1).unwrap();
    assert!(circles[1].circular_deviation_mm < 0.2 * circles[0].circular_deviation_mm);
    assert!(circles[1].reversal_spike_mm < 0.3 * circles[0].reversal_spike_mm);
}

#[test]
fn an_experiment_on_an_axis_that_nobody_commissioned_ends_with_the_reason() {
    let truth = StageParameters::real().axes[0].clone();
    let mut test_axis = SimulatedTestAxis::new(0, truth, 1);
    let mut settings = test_axis.settings().clone();
    settings.commissioned = false;
    test_axis.apply(&settings).unwrap();
    let target_mm = 1.0;
    let error = approach(&mut test_axis, target_mm).unwrap_err();
    assert!(error.to_string().contains("not commissioned"), "{error}");
}

#[test]
fn a_blocked_axis_is_switched_off_and_the_log_says_why() {
    let sine = MotionSettings::Harmonic(HarmonicSettings::with_velocity(30.0, 15.0, 1.0, 0.5));
    let job = Job {
        stage: StageSettings::simulated(),
        plan: PlanSettings {
            motions: [sine, MotionSettings::Hold, MotionSettings::Hold],
        },
    };
    let mut machine = LawMachine::<f32, 4>::new(&job).unwrap();
    let mut plant = SimulatedStage::new(&StageParameters::real(), job.stage.rate_hz, 1);
    let mut operator = Operator::runs_the_plan();
    for tick in 0..20_000 {
        // The encoder of x stands still, as if the axis were clamped.
        let mut counts = plant.read_counters();
        counts[0] = 0;
        let input = TickInput::of_counts(counts, operator.request(tick));
        let outputs = machine.tick(&input);
        plant.step(&outputs);
        if let SafetyState::Faulted(fault) = machine.state().safety() {
            assert!(!outputs.enabled);
            assert_eq!(outputs.codes.map(|code| code.0), [0; 3]);
            assert_eq!(fault.code, FaultCode::EncoderImplausible);
            break;
        }
    }
    for _ in 0..20 {
        machine.tick(&TickInput::of_counts([0; 3], Some(Command::Run)));
    }
    let events: Vec<_> = machine.events().iter().map(|(_, event)| *event).collect();
    assert!(matches!(
        events[..],
        [
            Event::Enabled,
            Event::MotionStarted,
            Event::Faulted(_),
            Event::Refused(Command::Run, _),
            ..
        ]
    ));
}

#[test]
fn our_controllers_follow_the_recorded_emps_reference() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/data/emps/emps.csv"
    );
    if !std::path::Path::new(file).exists() {
        println!("SKIPPED: the EMPS record is not beside the repository ({file})");
        return;
    }
    let axis = RecordedAxis::Emps;
    let record = Record::read(file.as_ref(), &axis.limits()).unwrap();
    let outcomes = replay(
        &record,
        axis,
        &RunConfiguration::exact(StageSettings::simulated()),
        1,
        &|| {},
    )
    .unwrap();
    let rms = |configuration| {
        let found = outcomes
            .iter()
            .find(|outcome| outcome.configuration == configuration);
        found.unwrap().rms_mm
    };
    // The recorded machine's own error, computed from the file alone, is 0.58 mm.
    assert!((rms(None) - 0.58).abs() < 0.01);
    assert!(rms(Some(Configuration::BEST)) < 0.1 * rms(Some(Configuration::PID)));
    assert!(rms(Some(Configuration::PID)) < rms(None));
}
