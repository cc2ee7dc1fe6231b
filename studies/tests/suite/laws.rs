//! The laws' comparison: equal robustness, knobs that were really tried, and the same again.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::StageParameters;
use quadrant_studies::laws::comparison::compare_laws;
use quadrant_studies::laws::tuning::{COMPLEMENTARY_PEAK, SENSITIVITY_PEAK, TunedLaw, tune_all};
use quadrant_studies::wrong_model::{Competitor, Wrong, feedback, with_wrong_model};
use quadrant_tune::design::{Form, Process};
use quadrant_tune::identify::characteristic::{CharacteristicSettings, measure};
use quadrant_tune::test_axis::SimulatedTestAxis;

fn tuned() -> (quadrant_settings::AxisSettings, Vec<TunedLaw>) {
    let settings = identified_settings().unwrap().stage.axes[0].clone();
    let mut rig = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let characteristic =
        measure(&mut rig, &CharacteristicSettings::default(), &mut |_| {}).unwrap();
    let laws = tune_all(&settings, &characteristic, 1e4, 1, &|_| {}).unwrap();
    (settings, laws)
}

/// One tuning serves all that there is to see of it: it takes seconds.
#[test]
fn every_law_is_tuned_at_equal_robustness_and_runs() {
    let (settings, laws) = tuned();
    assert_eq!(
        laws.iter().map(|tuned| tuned.law).collect::<Vec<_>>(),
        LawKind::ALL
    );
    let process = Process::Model(settings.plant.unwrap());
    let form = Form::Sampled {
        sample_time_s: 1e-4,
        computation_delay_s: 0.0,
    };
    for tuned in &laws {
        for gains in tuned.feedback.linear_gains() {
            let margins = process.margins(&gains, form).unwrap();
            let used = (margins.sensitivity_peak / SENSITIVITY_PEAK)
                .max(margins.complementary_peak / COMPLEMENTARY_PEAK);
            // Kept, and used up but for the two digits that Ki is rounded down to.
            assert!(used <= 1.0 + 1e-6 && used > 0.95, "{:?}: {used}", tuned.law);
        }
        // A loop whose slope is beyond its gain margin hunts about lasting errors.
        if tuned.law == LawKind::NPid {
            let margins = process.margins(&tuned.feedback.pid, form).unwrap();
            let bearable = 10.0_f64.powf(margins.gain_margin_db / 20.0);
            let slope = tuned.feedback.nonlinear.unwrap().largest_slope();
            assert!(1.5 < slope && slope < bearable, "{slope} of {bearable}");
        }
        // The best of what was tried is what stayed.
        let cost = |value: f64| {
            let of = tuned.tried.iter().filter(|(tried, _)| *tried == value);
            of.map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min)
        };
        assert!(
            tuned
                .tried
                .iter()
                .all(|(_, other)| cost(tuned.value) <= *other)
        );
        assert!(tuned.tried.len() > 1 || tuned.law == LawKind::Pd);
    }

    // The cautious N-PID is the tuned PID where its gain is largest.
    let cautious = feedback(&laws, Competitor::CautiousNPid).unwrap();
    let pid = feedback(&laws, Competitor::Pid).unwrap();
    let largest = cautious.nonlinear.unwrap().largest();
    assert!((cautious.pid.kp_v_per_mm * largest / pid.pid.kp_v_per_mm - 1.0).abs() < 1e-9);

    let truth = &StageParameters::real().axes[0];
    let two: Vec<TunedLaw> = laws
        .into_iter()
        .filter(|t| matches!(t.law, LawKind::Pid | LawKind::Cascade))
        .collect();
    let kinds = [FeedforwardKind::None, FeedforwardKind::Combined];
    let run = || compare_laws(&two, &kinds, (&settings, truth), 1e4, 1..2, &|| {}).unwrap();
    let outcomes = run();
    assert_eq!(outcomes.len(), 4);
    for pair in outcomes.chunks(2) {
        let rms = |index: usize| pair[index].statistic(|o| o.score.rms_mm).mean;
        assert!(
            rms(1) < 0.3 * rms(0),
            "feedforward pays: {} {}",
            rms(0),
            rms(1)
        );
    }
    let again = run();
    for (one, other) in outcomes.iter().zip(&again) {
        assert_eq!(one.outcomes, other.outcomes);
    }
}

#[test]
fn a_model_that_is_not_wrong_is_the_identified_one() {
    let settings = identified_settings().unwrap().stage.axes[0].clone();
    let right = with_wrong_model(
        &settings,
        Wrong::Everything {
            share: 0.0,
            draw: 0,
        },
        1,
    );
    // Weights are normalised: equal up to rounding.
    for (one, other) in right
        .friction
        .gms
        .elements
        .iter()
        .zip(&settings.friction.gms.elements)
    {
        assert!((one.weight - other.weight).abs() < 1e-12);
        assert_eq!(one.stiffness_v_per_mm, other.stiffness_v_per_mm);
    }
    assert_eq!(right.friction.sliding, settings.friction.sliding);
    let wrong = with_wrong_model(
        &settings,
        Wrong::Everything {
            share: 0.5,
            draw: 3,
        },
        1,
    );
    assert_ne!(wrong.friction, settings.friction);
    let twice = with_wrong_model(
        &settings,
        Wrong::Everything {
            share: 0.5,
            draw: 3,
        },
        1,
    );
    assert_eq!(wrong, twice);
}
