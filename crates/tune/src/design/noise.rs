//! Voltage that the noise of the encoder makes in a loop.

use std::f64::consts::PI;

use num_complex::Complex64;
use quadrant_law::control::pid::PidGains;
use quadrant_sim::loop_shape::OpenLoop;

use super::form::Form;
use super::process::Process;

/// Frequencies of the sum, even up to the highest.
const FREQUENCIES: usize = 500;
/// Highest frequency in continuous time, Hz: the noise is white in readings at about that rate.
const CONTINUOUS_HZ: f64 = 5000.0;

/// RMS voltage at the amplifier, V, that readings with white noise of `noise_mm` make in the closed loop, through PID and filters.
pub fn noise_voltage_v(process: &Process, gains: &PidGains, form: Form, noise_mm: f64) -> f64 {
    let open_loop = process.open_loop(gains, form);
    let highest = match form {
        Form::Continuous => 2.0 * PI * CONTINUOUS_HZ,
        Form::Sampled { sample_time_s, .. } => PI / sample_time_s,
    };
    let sum: f64 = (0..FREQUENCIES)
        .map(|index| {
            let omega = highest * (index as f64 + 0.5) / FREQUENCIES as f64;
            let sensitivity = (Complex64::new(1.0, 0.0) + open_loop.response(omega)).inv();
            (process.controller(gains, form, omega) * sensitivity).norm_sqr()
        })
        .sum();
    noise_mm * (sum / FREQUENCIES as f64).sqrt()
}
