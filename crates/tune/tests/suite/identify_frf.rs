//! Frequency responses of the simulated stage, judged against its truth.

use std::f64::consts::TAU;

use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::AxisSettings;
use quadrant_settings::response::LinearResponse;
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::commission::bootstrap::bootstrap_settings;
use quadrant_tune::identify::excitation::Waveform;
use quadrant_tune::identify::frf::{
    FrfError, FrfMeasurement, FrfSettings, SavedError, SavedSettings, measure, response_of,
};
use quadrant_tune::identify::response::FrequencyResponse;
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{
    AxisInfo, Experiment, ExperimentError, MachineError, SimulatedTestAxis, TestAxis,
};

/// The sliding axis: the viscous friction is part of its damping, and there is no spring.
fn sliding(truth: &AxisParameters) -> PlantModel {
    let viscous = truth.friction.positive.viscous_v_s_per_mm;
    PlantModel {
        gain_mm_per_v_s2: truth.gain_mm_per_v_s2,
        damping_per_s: truth.damping_per_s + truth.gain_mm_per_v_s2 * viscous,
        stiffness_per_s2: 0.0,
        delay_s: truth.delay_s,
    }
}

fn x_truth() -> AxisParameters {
    StageParameters::real().axes[0].clone()
}

/// The x axis under the slow first controller.
fn slow_rig(truth: &AxisParameters, seed: u64) -> SimulatedTestAxis {
    let mut test_axis = SimulatedTestAxis::new(0, truth.clone(), seed);
    let settings = bootstrap_settings(test_axis.settings(), truth.gain_mm_per_v_s2, 1e4);
    test_axis.apply(&settings).unwrap();
    test_axis
}

/// The default measurement with an excitation that leaves every pass sliding, for all phases.
fn gentle() -> FrfSettings {
    let mut settings = FrfSettings::default();
    settings.excitation.rms_v = 0.08;
    settings.periods = 20;
    settings
}

fn measured(test_axis: &mut SimulatedTestAxis, settings: &FrfSettings) -> FrfMeasurement {
    measure(test_axis, settings, &mut |_| {}).unwrap()
}

/// Largest distance from the model over the lines with a coherence above 0.95, dB and deg, and how many lines these are.
fn worst(response: &FrequencyResponse, plant: &PlantModel) -> (f64, f64, usize) {
    response
        .points
        .iter()
        .filter(|point| point.coherence > 0.95)
        .fold((0.0, 0.0, 0), |(gain, phase, lines), point| {
            let ratio = point.response / plant.response(TAU * point.frequency_hz);
            (
                f64::max(gain, (20.0 * ratio.norm().log10()).abs()),
                f64::max(phase, ratio.arg().to_degrees().abs()),
                lines + 1,
            )
        })
}

fn assert_true(response: &FrequencyResponse, plant: &PlantModel, least_lines: usize) {
    let (gain_db, phase_deg, lines) = worst(response, plant);
    assert!(
        gain_db < 0.3 && phase_deg < 2.0 && lines >= least_lines,
        "{gain_db} dB, {phase_deg} deg over {lines} lines"
    );
}

#[test]
fn every_waveform_shows_the_sliding_axis() {
    let truth = x_truth();
    for (waveform, band_hz) in [
        (Waveform::Multisine, (4.0, 400.0)),
        (Waveform::Random, (8.0, 300.0)),
        (Waveform::Sweep, (8.0, 300.0)),
    ] {
        let mut settings = gentle();
        settings.excitation.waveform = waveform;
        settings.excitation.band_hz = band_hz;
        if waveform != Waveform::Multisine {
            // The power is spread over all lines, so that each takes longer to show.
            settings.excitation.rms_v = 0.035;
            settings.periods = 320;
        }
        let found = measured(&mut slow_rig(&truth, 1), &settings);
        assert_true(&found.estimate.response, &sliding(&truth), 40);
    }
}

#[test]
fn every_axis_shows_its_response() {
    for (seed, truth) in (1..).zip(&StageParameters::real().axes) {
        let found = measured(&mut slow_rig(truth, seed), &gentle());
        let lines = found.estimate.response.points.len();
        assert_true(&found.estimate.response, &sliding(truth), lines - 4);
    }
}

#[test]
fn a_stiff_loop_leaves_no_wrong_line_with_a_high_coherence() {
    let truth = x_truth();
    for seed in 1..=5 {
        // The axis' own controller: below its crossover the voltage hardly shows the injection.
        let mut test_axis = SimulatedTestAxis::new(0, truth.clone(), seed);
        let mut settings = gentle();
        settings.excitation.rms_v = 0.05;
        settings.excitation.seed = 1000 * seed;
        settings.periods = 40;
        let found = measured(&mut test_axis, &settings);
        assert_true(&found.estimate.response, &sliding(&truth), 30);
    }
}

#[test]
fn under_feedback_h1_is_biased_and_the_instrument_is_not() {
    // Encoder noise of three counts and a weak excitation: the loop carries the noise into the voltage.
    let mut truth = x_truth();
    truth.imperfections.encoder_noise_mm = 1.5e-3;
    let mut test_axis = SimulatedTestAxis::new(0, truth.clone(), 1);
    let mut settings = gentle();
    settings.excitation.rms_v = 0.0015;
    settings.excitation.band_hz = (80.0, 300.0);
    settings.excitation.rise_hz = 0.0;
    settings.periods = 800;
    let found = measured(&mut test_axis, &settings);
    let mean_ratio = |response: &FrequencyResponse| {
        let points = &response.points;
        let sum: num_complex::Complex64 = points
            .iter()
            .map(|p| p.response / sliding(&truth).response(TAU * p.frequency_hz))
            .sum();
        sum / points.len() as f64
    };
    let instrument = mean_ratio(&found.estimate.response);
    let plain = mean_ratio(&found.plain.response);
    assert!((instrument - 1.0).norm() < 0.05, "instrument: {instrument}");
    assert!((plain - 1.0).norm() > 0.15, "H1: {plain}");
}

#[test]
fn the_stated_deviation_is_the_distance_from_the_truth() {
    let truth = x_truth();
    let mut squares = Vec::new();
    for seed in 1..=4 {
        let mut settings = gentle();
        settings.excitation.seed = 1000 * seed;
        let found = measured(&mut slow_rig(&truth, 100 + seed), &settings);
        squares.extend(found.estimate.response.points.iter().map(|point| {
            let ratio = point.response / sliding(&truth).response(TAU * point.frequency_hz) - 1.0;
            ratio.norm_sqr() / (2.0 * point.relative_deviation.powi(2))
        }));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    assert!((0.7..1.5).contains(&mean), "{mean} over {}", squares.len());
}

#[test]
fn passes_do_not_repeat_one_realisation() {
    let mut settings = gentle();
    settings.excitation.waveform = Waveform::Random;
    settings.excitation.rms_v = 0.05;
    let found = measured(&mut slow_rig(&x_truth(), 1), &settings);
    let [first, second, ..] = &found.recordings[..] else {
        panic!("{} passes", found.recordings.len());
    };
    let differ = first.injection_v.iter().zip(&second.injection_v);
    assert!(differ.filter(|(a, b)| a != b).count() > 10_000);
}

#[test]
fn an_open_loop_shows_a_response_that_friction_bends() {
    let truth = x_truth();
    let mut settings = FrfSettings {
        open_loop: true,
        bias_velocity_mm_s: 0.0,
        ..gentle()
    };
    settings.excitation.waveform = Waveform::Random;
    settings.excitation.rms_v = 0.3;
    settings.excitation.rise_hz = 0.0;
    let found = measured(&mut slow_rig(&truth, 1), &settings);
    let against = |low: f64, high: f64| {
        let points = &found.estimate.response.points;
        let gains: Vec<f64> = points
            .iter()
            .filter(|p| (low..high).contains(&p.frequency_hz))
            .map(|p| {
                let ratio = p.response / sliding(&truth).response(TAU * p.frequency_hz);
                20.0 * ratio.norm().log10()
            })
            .collect();
        gains.iter().sum::<f64>() / gains.len() as f64
    };
    // At high frequency the mass alone counts; at low frequency friction holds the axis back.
    assert!(against(250.0, 400.0).abs() < 1.0);
    assert!(against(4.0, 20.0) < -4.0);
}

#[test]
fn an_excitation_that_stops_the_axis_is_refused() {
    let mut settings = gentle();
    settings.excitation.rms_v = 0.6;
    let error = measure(&mut slow_rig(&x_truth(), 1), &settings, &mut |_| {}).unwrap_err();
    assert!(matches!(error, FrfError::NotSliding { .. }), "{error}");
}

#[test]
fn the_noise_of_a_coarse_encoder_is_no_standstill() {
    let mut truth = x_truth();
    truth.resolution_mm = 2e-3;
    truth.imperfections.encoder_noise_mm = 2e-3;
    let mut axis = SimulatedTestAxis::new(0, truth.clone(), 1);
    let mut settings = bootstrap_settings(axis.settings(), truth.gain_mm_per_v_s2, 1e4);
    settings.encoder.resolution_mm = truth.resolution_mm;
    axis.apply(&settings).unwrap();
    let mut slow = gentle();
    slow.bias_velocity_mm_s = 7.0;
    slow.excitation.rms_v = 0.01;
    measured(&mut axis, &slow);
}

/// A short measurement, its recordings written and read back.
fn saved(settings: &FrfSettings) -> (FrfMeasurement, Vec<Recording>) {
    let found = measured(&mut slow_rig(&x_truth(), 1), settings);
    let folder = tempfile::tempdir().unwrap();
    let read = found
        .recordings
        .iter()
        .enumerate()
        .map(|(index, recording)| {
            let path = folder.path().join(format!("{index}.csv"));
            recording.write_csv(&path).unwrap();
            Recording::read_csv(&path).unwrap()
        })
        .collect();
    (found, read)
}

const SAVED: SavedSettings = SavedSettings {
    period_s: 0.5,
    band_hz: (4.0, 400.0),
    settling_s: 0.7,
};

#[test]
fn saved_recordings_show_the_sliding_axis_too() {
    let (found, read) = saved(&FrfSettings {
        periods: 16,
        ..gentle()
    });
    let recorded = response_of(read, &SAVED).unwrap();
    assert!(recorded.closed_loop);
    let lines = found.estimate.response.points.len();
    assert_eq!(recorded.estimate.response.points.len(), lines);
    assert_true(&recorded.estimate.response, &sliding(&x_truth()), lines - 4);
}

#[test]
fn a_saved_open_loop_is_recognised() {
    let mut settings = FrfSettings {
        open_loop: true,
        bias_velocity_mm_s: 0.0,
        periods: 8,
        ..gentle()
    };
    settings.excitation.rms_v = 0.3;
    let (found, read) = saved(&settings);
    let recorded = response_of(read, &SAVED).unwrap();
    assert!(!recorded.closed_loop);
    let pairs = recorded.estimate.response.points.iter();
    for (a, b) in pairs.zip(&found.estimate.response.points) {
        assert!((a.response / b.response - 1.0).norm() < 0.05);
    }
}

#[test]
fn recordings_without_excitation_or_too_short_are_refused() {
    let (_, read) = saved(&FrfSettings {
        periods: 4,
        ..gentle()
    });
    let mut silent = read.clone();
    for recording in &mut silent {
        recording.injection_v.fill(0.0);
    }
    let error = response_of(silent, &SAVED).unwrap_err();
    assert!(matches!(error, SavedError::NoExcitation { .. }), "{error}");
    let cut = vec![read[0].slice(0..15_000)];
    let error = response_of(cut, &SAVED).unwrap_err();
    assert!(
        matches!(error, SavedError::TooShort { blocks: 0, .. }),
        "{error}"
    );
}

#[test]
fn the_number_of_threads_changes_no_bit_of_a_saved_response() {
    let mut settings = FrfSettings {
        open_loop: true,
        bias_velocity_mm_s: 0.0,
        periods: 60,
        ..gentle()
    };
    settings.excitation.waveform = Waveform::Random;
    settings.excitation.rms_v = 0.3;
    let found = measured(&mut slow_rig(&x_truth(), 1), &settings);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.csv");
    found.recordings[0].write_csv(&path).unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let read = Recording::read_csv(&path).unwrap();
            let measured = response_of(vec![read], &SAVED).unwrap();
            (measured.recordings, measured.estimate, measured.plain)
        })
    };
    let alone = with(1);
    for threads in [2, 3, 8] {
        assert_eq!(with(threads), alone, "{threads} threads");
    }
}

/// An axis that records every tenth control period.
struct Coarse(SimulatedTestAxis);

impl TestAxis for Coarse {
    fn info(&self) -> AxisInfo {
        self.0.info()
    }

    fn settings(&self) -> &AxisSettings {
        self.0.settings()
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        self.0.apply(settings)
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.0.switch_off()
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        let mut every_tenth = experiment.clone();
        every_tenth.decimation = 10;
        self.0.perform(&every_tenth, progress)
    }
}

#[test]
fn a_band_beyond_half_the_recorded_rate_is_refused() {
    let mut test_axis = Coarse(slow_rig(&x_truth(), 1));
    let mut settings = FrfSettings {
        open_loop: true,
        bias_velocity_mm_s: 0.0,
        periods: 4,
        ..gentle()
    };
    settings.excitation.rms_v = 0.3;
    settings.excitation.band_hz = (4.0, 499.0);
    assert!(measure(&mut test_axis, &settings, &mut |_| {}).is_ok());
    settings.excitation.band_hz = (4.0, 500.0);
    let error = measure(&mut test_axis, &settings, &mut |_| {}).unwrap_err();
    assert!(error.to_string().contains("half the rate"), "{error}");
}
