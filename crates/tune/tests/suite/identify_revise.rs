//! The linear model revised for explicit friction, on the simulated x axis at rest.

use quadrant_settings::AxisSettings;
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::plant::StageParameters;
use quadrant_tune::identify::at_rest::AtRest;
use quadrant_tune::identify::excitation::{Excitation, Waveform};
use quadrant_tune::identify::response::FrequencyResponse;
use quadrant_tune::identify::revise::{ExplicitFriction, ReviseError};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::SimulatedTestAxis;

fn excited(rms_v: f64) -> (AtRest, AxisSettings) {
    let settings = identified_settings().unwrap().stage.axes[0].clone();
    let mut test_axis = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let excitation = Excitation {
        waveform: Waveform::Multisine,
        rms_v,
        band_hz: (4.0, 400.0),
        rise_hz: 0.0,
        period_s: 0.5,
        seed: 1,
    };
    let measured = AtRest::measure(&mut test_axis, &settings, excitation, 6, &mut |_| {}).unwrap();
    (measured, settings)
}

/// Mean gain between two frequencies, dB.
fn gain_db(response: &FrequencyResponse, low_hz: f64, high_hz: f64) -> f64 {
    let gains: Vec<f64> = response
        .points
        .iter()
        .filter(|point| (low_hz..high_hz).contains(&point.frequency_hz))
        .map(|point| 20.0 * point.response.norm().log10())
        .collect();
    gains.iter().sum::<f64>() / gains.len() as f64
}

#[test]
fn with_both_frictions_the_revised_model_shows_the_measured_response() {
    let (measured, settings) = excited(0.4);
    let original = settings.plant.unwrap();
    let revisions = measured.revise(&original).unwrap();
    let [fixed, gms, both] = &revisions[..] else {
        panic!("{} revisions", revisions.len());
    };
    assert_eq!(
        [fixed, gms, both].map(|revision| revision.friction),
        ExplicitFriction::ALL
    );
    let truth = &StageParameters::real().axes[0];
    let gain = both.plant.gain_mm_per_v_s2 / truth.gain_mm_per_v_s2;
    assert!((gain - 1.0).abs() < 0.01, "{gain}");
    // The friction carries the whole viscous damping.
    assert!(both.plant.damping_per_s < 5.0, "{:?}", both.plant);
    assert!(both.misfit.1.gain_db < 0.1 && both.misfit.1.phase_deg < 1.0);
    // Neither half of the friction alone shows what was measured.
    for half in [fixed, gms] {
        assert!(
            half.misfit.1.gain_db > 3.0 * both.misfit.1.gain_db,
            "{:?}",
            half.misfit
        );
    }
    for revision in &revisions {
        assert!(revision.misfit.1.gain_db <= revision.misfit.0.gain_db);
    }
}

#[test]
fn the_response_depends_on_the_amplitude_as_the_model_with_friction_predicts() {
    let mut levels = Vec::new();
    for rms_v in [0.2, 0.6] {
        let (measured, settings) = excited(rms_v);
        let mut sliding = settings.plant.unwrap();
        // Of the damping, the friction model has its share: all of it.
        sliding.damping_per_s = 0.0;
        let response = measured.response().unwrap();
        let predicted = measured.predict(&sliding, ExplicitFriction::Both).unwrap();
        let level = gain_db(&response, 10.0, 60.0);
        assert!((level - gain_db(&predicted, 10.0, 60.0)).abs() < 1.0);
        levels.push(level);
    }
    assert!(levels[1] - levels[0] > 3.0, "{levels:?}");
}

#[test]
fn a_saved_recording_shows_the_same_response_and_one_at_another_rate_is_refused() {
    let (measured, settings) = excited(0.4);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("at-rest.csv");
    measured.recording.write_csv(&path).unwrap();
    let read = Recording::read_csv(&path).unwrap();
    let saved = AtRest::saved(read.clone(), &settings, 1e4, measured.excitation).unwrap();
    let (fresh, again) = (measured.response().unwrap(), saved.response().unwrap());
    assert_eq!(fresh.points.len(), again.points.len());
    for (a, b) in fresh.points.iter().zip(&again.points) {
        assert!((a.response / b.response - 1.0).norm() < 1e-6);
    }
    let error = AtRest::saved(read, &settings, 5e3, measured.excitation).unwrap_err();
    assert!(matches!(error, ReviseError::Rate { .. }), "{error}");
}
