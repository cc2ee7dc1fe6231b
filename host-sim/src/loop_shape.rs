//! The open loop of an axis: plant times controller, seen by its frequency response.

use std::f64::consts::PI;

use num_complex::Complex64;
use quadrant_law::control::{pid::PidGains, plant_model::PlantModel};
use quadrant_settings::response::LinearResponse;

use crate::held_plant::HeldPlant;

/// An open loop without poles in the right half plane (outside the unit circle, when sampled).
pub trait OpenLoop {
    /// The response at a frequency in rad/s: dimensionless, from error to position.
    fn response(&self, omega_rad_s: f64) -> Complex64;

    /// The lowest and the highest frequency worth looking at, rad/s; the first is above zero.
    fn band_rad_s(&self) -> (f64, f64);
}

/// Of the order of the crossover frequency, rad/s.
fn crossover_scale(plant: &PlantModel, gains: &PidGains) -> f64 {
    let proportional = plant.gain_mm_per_v_s2 * gains.kp_v_per_mm;
    let derivative = plant.gain_mm_per_v_s2 * gains.kd_v_s_per_mm;
    (plant.stiffness_per_s2 + proportional)
        .sqrt()
        .max(derivative)
}

/// Plant and PID in continuous time: the form the thesis' margins are printed for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContinuousLoop {
    pub plant: PlantModel,
    pub gains: PidGains,
}

impl OpenLoop for ContinuousLoop {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.plant.response(omega_rad_s) * self.gains.response(omega_rad_s)
    }

    fn band_rad_s(&self) -> (f64, f64) {
        let scale = crossover_scale(&self.plant, &self.gains);
        (1e-4 * scale, 1e2 * scale)
    }
}

/// Plant and PID as they run: the plant driven through a zero-order hold, exactly, with any delay, whole periods or
/// not; the controller by its difference equations
///
/// - integral: `I[k] = I[k-1] + Ki Ts e[k]`,
/// - derivative, by Tustin's rule: `d[k] = a d[k-1] + b (e[k] - e[k-1])`, with `a = (2 tau - Ts) / (2 tau + Ts)` and
///   `b = 2 Kd / (2 tau + Ts)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledLoop {
    plant: HeldPlant,
    gains: PidGains,
    sample_time_s: f64,
    lowest_rad_s: f64,
}

impl SampledLoop {
    /// The loop at a control period of `sample_time_s` s, the output written `computation_delay_s` s after the position
    /// was read. The derivative filter must not be zero: Tustin's rule makes an oscillator of that.
    pub fn new(
        plant: &PlantModel,
        gains: &PidGains,
        sample_time_s: f64,
        computation_delay_s: f64,
    ) -> Self {
        Self {
            plant: HeldPlant::new(plant, sample_time_s, computation_delay_s),
            gains: *gains,
            sample_time_s,
            lowest_rad_s: 1e-4 * crossover_scale(plant, gains),
        }
    }
}

/// The controller's difference equations at a point of the z plane, V/mm. The derivative filter must not be zero.
pub fn controller_response(gains: &PidGains, period: f64, z: Complex64) -> Complex64 {
    let filter = 2.0 * gains.derivative_filter_s;
    let a = (filter - period) / (filter + period);
    let b = 2.0 * gains.kd_v_s_per_mm / (filter + period);
    let derivative = (z - 1.0) / (z - a) * b;
    let integral = z / (z - 1.0) * (gains.ki_v_per_mm_s * period);
    derivative + integral + gains.kp_v_per_mm
}

impl OpenLoop for SampledLoop {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        let z = Complex64::cis(omega_rad_s * self.sample_time_s);
        self.plant.response(z) * controller_response(&self.gains, self.sample_time_s, z)
    }

    fn band_rad_s(&self) -> (f64, f64) {
        // Just below half the sampling frequency, where every response is real.
        (self.lowest_rad_s, 0.999 * PI / self.sample_time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{X_GAINS, X_PLANT};

    #[test]
    fn sampled_form_approaches_the_continuous_one_at_a_high_rate() {
        let gains = PidGains {
            ki_v_per_mm_s: 3.0,
            ..X_GAINS
        };
        let continuous = ContinuousLoop {
            plant: X_PLANT,
            gains,
        };
        let sampled = SampledLoop::new(&X_PLANT, &gains, 1e-7, 0.0);
        for omega in [1.0, 40.0, 400.0, 1200.0, 4000.0] {
            let ratio = sampled.response(omega) / continuous.response(omega);
            assert!((ratio - 1.0).norm() < 5e-4, "{omega} rad/s: {ratio}");
        }
    }

    #[test]
    fn sampling_costs_half_a_period_of_delay_at_low_frequency() {
        let period = 1e-4;
        let late = PlantModel {
            delay_s: X_PLANT.delay_s + period / 2.0,
            ..X_PLANT
        };
        let continuous = ContinuousLoop {
            plant: late,
            gains: X_GAINS,
        };
        let sampled = SampledLoop::new(&X_PLANT, &X_GAINS, period, 0.0);
        for omega in [10.0, 400.0, 1200.0] {
            let ratio = sampled.response(omega) / continuous.response(omega);
            assert!((ratio - 1.0).norm() < 0.01, "{omega} rad/s: {ratio}");
        }
    }

    #[test]
    fn a_delay_in_fractions_of_a_period_interpolates_between_whole_ones() {
        let at = |delay_s: f64| {
            let plant = PlantModel { delay_s, ..X_PLANT };
            SampledLoop::new(&plant, &X_GAINS, 1e-4, 0.0).response(400.0)
        };
        let turn = (at(1.26e-3) / at(1.2e-3)).arg();
        assert!((turn + 400.0 * 0.06e-3).abs() < 1e-4, "{turn}");
        let continuous_in_delay = (at(1.3e-3 - 1e-9) / at(1.3e-3)).arg();
        assert!(continuous_in_delay.abs() < 1e-6);
    }

    #[test]
    fn computing_time_counts_as_delay() {
        let later = PlantModel {
            delay_s: X_PLANT.delay_s + 3e-5,
            ..X_PLANT
        };
        let a = SampledLoop::new(&X_PLANT, &X_GAINS, 1e-4, 3e-5).response(700.0);
        let b = SampledLoop::new(&later, &X_GAINS, 1e-4, 0.0).response(700.0);
        assert!((a - b).norm() < 1e-12);
    }
}
