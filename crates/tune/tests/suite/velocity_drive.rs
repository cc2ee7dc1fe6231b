//! Axes behind an amplifier in velocity mode.

use std::path::Path;

use quadrant_law::units::DacCode;
use quadrant_settings::StageSettings;
use quadrant_sim::plant::{SimulatedAxis, StageParameters, VelocityDrive};
use quadrant_sim::stage_file::StageFile;
use quadrant_tune::commission::{CommissionError, CommissionSettings, commission};
use quadrant_tune::test_axis::{SimulatedTestAxis, TestAxis};
use rayon::prelude::*;

/// The simulated stage's x axis behind a drive of a lag and a velocity for a volt, at a rate.
fn behind(lag_s: f64, velocity_mm_s_per_v: f64, rate_hz: f64) -> SimulatedTestAxis {
    let mut x = StageParameters::real().axes[0].clone();
    let drive = VelocityDrive::with_lag(
        lag_s,
        velocity_mm_s_per_v,
        x.full_scale_v,
        x.gain_mm_per_v_s2,
    );
    x.velocity_drive = Some(drive);
    let mut stage = StageSettings::simulated();
    stage.rate_hz = rate_hz;
    for axis in &mut stage.axes {
        axis.feedback.pid.derivative_filter_s = 1.0 / rate_hz;
    }
    SimulatedTestAxis::under(&stage, 0, x, 1).with_travel_mm(100.0)
}

#[test]
fn an_amplifier_in_velocity_mode_is_recognised_before_friction_is_measured() {
    let mut cases = Vec::new();
    for rate_hz in [1e3, 4e3] {
        for lag_s in [1e-3, 2e-3, 5e-3] {
            for velocity_mm_s_per_v in [10.0, 25.0, 60.0] {
                cases.push((lag_s, velocity_mm_s_per_v, rate_hz));
            }
        }
    }
    cases.into_par_iter().for_each(|case| {
        let (lag_s, velocity_mm_s_per_v, rate_hz) = case;
        let mut axis = behind(lag_s, velocity_mm_s_per_v, rate_hz);
        let base = axis.settings().clone();
        let mut last = "";
        let mut watch = |step: &'static str, _: f64| last = step;
        let found = commission(&mut axis, &base, &CommissionSettings::default(), &mut watch);
        let Err(CommissionError::VelocityMode {
            velocity_mm_s_per_v: found,
            lag_ms,
        }) = found
        else {
            panic!("{case:?}: {:?}", found.map(|found| found.notes()));
        };
        let ratio = found / velocity_mm_s_per_v;
        assert!((ratio - 1.0).abs() < 0.02, "{case:?}: {found}");
        let ratio = 1e-3 * lag_ms / lag_s;
        assert!((0.6..1.4).contains(&ratio), "{case:?}: {lag_ms}");
        assert_eq!(last, "frequency response", "{case:?}");
    });
}

#[test]
fn an_amplifier_in_velocity_mode_is_recognised_of_a_fine_encoder_and_of_a_heavy_slide() {
    let fine = "[x]\ndrive_lag_ms = 2\nresolution_um = 0.1\n";
    let heavy = format!("{fine}mass_kg = 40\nforce_n_per_v = 400\ncoulomb_n = 90\n");
    for text in [fine, &heavy] {
        let file = StageFile::parse(text, Path::new("mine.toml")).expect("a stage");
        let mut stage = StageSettings::simulated();
        stage.axes[0].encoder.resolution_mm = 1e-4;
        let mut axis = SimulatedTestAxis::under(&stage, 0, file.truth.axes[0].clone(), 1);
        let base = axis.settings().clone();
        let (request, mut watch) = (CommissionSettings::default(), |_: &'static str, _: f64| {});
        let found = commission(&mut axis, &base, &request, &mut watch);
        let Err(CommissionError::VelocityMode {
            velocity_mm_s_per_v,
            lag_ms,
        }) = found
        else {
            panic!("{text}: {:?}", found.map(|found| found.notes()));
        };
        let ratio = velocity_mm_s_per_v / 25.0;
        assert!((ratio - 1.0).abs() < 0.02, "{text}: {velocity_mm_s_per_v}");
        // Dead time, and what friction takes until the drive's integral has it, are in what open loop shows.
        assert!((1.0..20.0).contains(&lag_ms), "{text}: {lag_ms}");
    }
}

#[test]
fn a_drive_in_velocity_mode_follows_its_command_by_its_lag_and_takes_friction_up() {
    let (lag_s, rate_hz, velocity_mm_s) = (2e-3, 1e4, 50.0);
    let mut x = StageParameters::ideal().axes[0].clone();
    x.delay_s = 0.0;
    let drive = VelocityDrive::with_lag(lag_s, 25.0, x.full_scale_v, x.gain_mm_per_v_s2);
    x.velocity_drive = Some(drive);
    let mut axis = SimulatedAxis::new(x.clone(), rate_hz, 1);
    let code = DacCode::from_volts(velocity_mm_s / 25.0, x.full_scale_v);
    let mut velocities = Vec::new();
    for _ in 0..2000 {
        axis.step(code, true);
        velocities.push(axis.velocity_mm_s());
    }
    // In a lag the proportional part alone brings 1 - 1/e of the velocity, less what friction takes of it.
    let at = |time_s: f64| velocities[(time_s * rate_hz) as usize] / velocity_mm_s;
    assert!((0.35..0.75).contains(&at(lag_s)), "{}", at(lag_s));
    // Friction and damping of some 0.2 V would take 14 mm/s of a drive without an integral.
    assert!((at(0.15) - 1.0).abs() < 0.002, "{}", at(0.15));
    for _ in 0..2000 {
        axis.step(code, false);
    }
    assert!(axis.velocity_mm_s().abs() < 0.01, "a disabled drive coasts");
}
