//! References in memory: the same words as the plan of settings that they are samples of.

use quadrant_law::admission::Refusal;
use quadrant_law::axes::AxisName;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_settings::{Job, PlanSettings, StageSettings};
use quadrant_sim::given_run::{GivenReference, GivenRun, GivenTrace};
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::plant::{SimulatedStage, StageParameters};
use quadrant_sim::run::{RunError, run};

const TICKS: usize = 20_000;

fn sine(amplitude_mm: f64) -> MotionSettings {
    MotionSettings::Harmonic(HarmonicSettings::with_velocity(
        amplitude_mm,
        20.0,
        0.25,
        0.2,
    ))
}

fn finished(mut run: GivenRun) -> Vec<GivenTrace> {
    while !run.advance(777).unwrap() {}
    assert_eq!(run.done(), run.rows());
    run.into_traces()
}

#[test]
fn samples_of_a_plan_run_as_the_plan_does() {
    let settings = StageSettings::simulated();
    let motions = [sine(5.0), sine(4.0), sine(3.0)];
    let job = Job {
        stage: settings.clone(),
        plan: PlanSettings { motions },
    };
    let truth = StageParameters::real();
    let resolutions = settings
        .axes
        .each_ref()
        .map(|axis| axis.encoder.resolution_mm);
    let mut machine = LawMachine::<f32, FIRMWARE_ELEMENTS>::new(&job).unwrap();
    let mut plant = SimulatedStage::new(&truth, settings.rate_hz, 3);
    let planned = run(&mut machine, &mut plant, resolutions, 2 * TICKS).unwrap();
    let references = [0, 1, 2].map(|index| {
        GivenReference::of_motion(&motions[index], settings.motion_scale(index), TICKS)
    });
    let found = finished(GivenRun::of_stage(&settings, &truth, references, 3).unwrap());
    for (planned, found) in planned.iter().zip(&found) {
        // The plan's trace begins with the look-ahead.
        let after: Vec<f32> = planned.output_v[13..].iter().map(|v| *v as f32).collect();
        let count = after.len().min(found.output_v.len());
        assert!(count > 5000, "{count}");
        assert_eq!(after[..count], found.output_v[..count]);
        assert!(found.output_v.iter().any(|volts| volts.abs() > 0.1));
    }
}

#[test]
fn an_axis_alone_does_what_it_does_on_the_stage() {
    let settings = StageSettings::simulated();
    let truth = StageParameters::real();
    let references = [0, 1, 2]
        .map(|index| GivenReference::of_motion(&sine(5.0), settings.motion_scale(index), TICKS));
    let together = finished(GivenRun::of_stage(&settings, &truth, references.clone(), 5).unwrap());
    // z has the longest preview, so it waits for none of the others.
    let [.., of_z] = references;
    let alone = finished(GivenRun::of_axis(&settings, &truth, AxisName::Z, of_z, 5).unwrap());
    assert_eq!(alone[0].word, together[2].word);
    assert_eq!(alone[0].position_mm, together[2].position_mm);
}

#[test]
fn a_row_is_the_tick_in_which_the_feedback_works_on_that_sample() {
    let settings = StageSettings::simulated();
    let scale = settings.motion_scale(0);
    let positions: Vec<f64> = (0..TICKS)
        .map(|tick| 4.0 - 2.0 * (std::f64::consts::TAU * tick as f64 / TICKS as f64).cos())
        .collect();
    let reference = GivenReference::through(&positions, scale);
    let truth = StageParameters::real();
    let run = GivenRun::of_axis(&settings, &truth, AxisName::X, reference, 1).unwrap();
    let [trace] = finished(run).try_into().unwrap();
    for (tick, (given, found)) in positions.iter().zip(&trace.reference_mm).enumerate() {
        // Within the rounding of a position.
        assert!((given - positions[0] - found).abs() < 1e-8, "{tick}");
    }
    for (reference, position) in trace.reference_mm.iter().zip(&trace.position_mm) {
        assert!((reference - position).abs() < 0.02);
    }
}

#[test]
fn axes_that_nobody_has_commissioned_do_not_start() {
    let reference = GivenReference::through(&[0.0; 10], StageSettings::default().motion_scale(0));
    let truth = StageParameters::real();
    let mut run =
        GivenRun::of_axis(&StageSettings::default(), &truth, AxisName::X, reference, 1).unwrap();
    let error = run.advance(10_000).unwrap_err();
    assert!(
        matches!(error, RunError::Refused(Refusal::NotCommissioned)),
        "{error}"
    );
}

#[test]
fn a_run_that_the_law_refuses_ends_at_once_with_the_axis_and_the_reason() {
    let mut settings = StageSettings::simulated();
    settings.axes[1].commissioned = false;
    let mut plan = PlanSettings::default();
    plan.motions[0] = sine(1.0);
    let mut other = StageSettings::simulated();
    other.axes[0] = StageSettings::default().axes[0].clone();
    for (stage, reason) in [
        (settings, Refusal::LawNotCommissioned(AxisName::Y)),
        (other, Refusal::NoLaw(AxisName::X)),
    ] {
        let job = Job { stage, plan };
        let mut machine = LawMachine::<f32, FIRMWARE_ELEMENTS>::new(&job).unwrap();
        let mut plant = SimulatedStage::new(&StageParameters::ideal(), 1e4, 1);
        let error = run(&mut machine, &mut plant, [5e-4; 3], TICKS).unwrap_err();
        assert!(
            matches!(error, RunError::Refused(refusal) if refusal == reason),
            "{error}"
        );
        assert!(machine.state().tick() < 400);
    }
}
