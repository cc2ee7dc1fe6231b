//! Frequency responses of the plant, the PID and the filters: what designs, proofs and the cancelling's table are computed with.

use num_complex::Complex64;

use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;

/// Something linear that has a response in continuous time.
pub trait LinearResponse {
    /// The response at `s = j omega`, rad/s.
    fn response(&self, omega_rad_s: f64) -> Complex64;
}

impl LinearResponse for PlantModel {
    /// mm/V. Infinite at zero frequency when the stiffness is zero.
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        delayed_gain(self, omega_rad_s) / denominator(self, omega_rad_s)
    }
}

impl LinearResponse for PidGains {
    /// V/mm. Infinite at zero frequency unless Ki is zero.
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega_rad_s);
        let derivative = s * self.kd_v_s_per_mm / (s * self.derivative_filter_s + 1.0);
        let proportional = derivative + self.kp_v_per_mm;
        if self.ki_v_per_mm_s == 0.0 {
            proportional
        } else {
            proportional + s.inv() * self.ki_v_per_mm_s
        }
    }
}

impl LinearResponse for FilterSettings {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        let (numerator, denominator) = filter_at(self, omega_rad_s);
        numerator / denominator
    }
}

/// `A exp(-s Td)` of a plant at `s = j omega`, mm/(V s^2).
pub(crate) fn delayed_gain(plant: &PlantModel, omega_rad_s: f64) -> Complex64 {
    let (sin, cos) = libm::sincos(-omega_rad_s * plant.delay_s);
    Complex64::new(cos, sin) * plant.gain_mm_per_v_s2
}

/// `s^2 + B s + C` of a plant at `s = j omega`, 1/s^2: finite at every frequency, unlike the response.
pub fn denominator(plant: &PlantModel, omega_rad_s: f64) -> Complex64 {
    Complex64::new(
        plant.stiffness_per_s2 - omega_rad_s * omega_rad_s,
        plant.damping_per_s * omega_rad_s,
    )
}

/// Numerator and denominator of a filter at `s = j ratio w`.
pub fn filter_polynomials(filter: &FilterSettings, ratio: f64) -> (Complex64, Complex64) {
    let (square, width) = (ratio * ratio, 2.0 * filter.damping * ratio);
    (
        Complex64::new(
            1.0 - filter.high_frequency_gain * square,
            filter.centre_gain * width,
        ),
        Complex64::new(1.0 - square, width),
    )
}

/// Numerator and denominator of a filter's continuous form at a frequency in rad/s.
pub(crate) fn filter_at(filter: &FilterSettings, omega_rad_s: f64) -> (Complex64, Complex64) {
    filter_polynomials(
        filter,
        omega_rad_s / (core::f64::consts::TAU * filter.frequency_hz),
    )
}

/// The response of a filter as it runs, at a frequency in rad/s below half the control rate.
pub fn sampled_filter_response(
    filter: &FilterSettings,
    omega_rad_s: f64,
    period_s: f64,
) -> Complex64 {
    let ratio = libm::tan(0.5 * omega_rad_s * period_s) / filter.warped(period_s);
    let (numerator, denominator) = filter_polynomials(filter, ratio);
    numerator / denominator
}

/// An upper bound of a filter's gain at any frequency.
pub(crate) fn largest_filter_gain(filter: &FilterSettings) -> f64 {
    let (d, h) = (filter.damping, filter.high_frequency_gain);
    let low_pass = if d * d >= 0.5 {
        1.0
    } else {
        1.0 / (2.0 * d * libm::sqrt(1.0 - d * d))
    };
    // F is a notch of gain h far from its frequency, and 1 - h of the low-pass.
    filter.centre_gain.max(h) + (1.0 - h) * low_pass
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: PlantModel = PlantModel {
        gain_mm_per_v_s2: 69390.0,
        damping_per_s: 144.8,
        stiffness_per_s2: 166.6,
        delay_s: 1.2e-3,
    };

    #[test]
    fn response_is_the_static_compliance_at_zero_frequency() {
        let response = PLANT.response(0.0);
        assert!((response.re - 69390.0 / 166.6).abs() < 1e-9);
        assert_eq!(response.im, 0.0);
    }

    #[test]
    fn delay_turns_the_phase_and_leaves_the_magnitude() {
        let prompt = PlantModel {
            delay_s: 0.0,
            ..PLANT
        };
        let omega = 400.0;
        let ratio = PLANT.response(omega) / prompt.response(omega);
        assert!((ratio.norm_sqr() - 1.0).abs() < 1e-12);
        assert!((libm::atan2(ratio.im, ratio.re) + omega * 1.2e-3).abs() < 1e-12);
    }

    #[test]
    fn response_is_inertia_far_above_the_corners() {
        let prompt = PlantModel {
            delay_s: 0.0,
            ..PLANT
        };
        let omega = 1e6;
        let inertia = 69390.0 / (omega * omega);
        assert!((prompt.response(omega).re / -inertia - 1.0).abs() < 1e-6);
    }
}
