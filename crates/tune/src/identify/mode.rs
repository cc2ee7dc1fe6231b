//! A structural mode of an axis: the resonance of a drive train between motor and table, and how it shows at the encoder.

use std::f64::consts::TAU;

use num_complex::Complex64;
use quadrant_law::control::plant_model::PlantModel;

/// Least damping ratio of an anti-resonance at which the spring's own damper transmits force: it is no dip then.
pub const MIN_TRANSMITTING_DAMPING: f64 = 0.5;

/// A resonance, with the anti-resonance below it where the encoder is on the motor: the factor
/// `(s^2 + 2 d_a w_a s + w_a^2) / (s^2 + 2 d w s + w^2) (w / w_a)^2` on the response of the rigid axis, or
/// `w^2 / (s^2 + 2 d w s + w^2)` without one. Where the encoder is on the table, an anti-resonance above the mode with a damping
/// ratio from [`MIN_TRANSMITTING_DAMPING`] on is the spring's own damper, through which force reaches the table above the resonance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// w / (2 pi), Hz.
    pub frequency_hz: f64,
    /// d, damping ratio.
    pub damping: f64,
    /// Frequency, Hz, and damping ratio of the anti-resonance.
    pub anti: Option<(f64, f64)>,
}

impl Mode {
    /// The factor at a frequency in rad/s; one at rest.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        let second_order = |frequency_hz: f64, damping: f64| {
            let ratio = omega_rad_s / (TAU * frequency_hz);
            Complex64::new(1.0 - ratio * ratio, 2.0 * damping * ratio)
        };
        let above = self
            .anti
            .map_or(Complex64::new(1.0, 0.0), |(frequency_hz, damping)| {
                second_order(frequency_hz, damping)
            });
        above / second_order(self.frequency_hz, self.damping)
    }

    /// True if the encoder is on the motor's side of the spring.
    pub fn is_at_motor(&self) -> bool {
        self.anti
            .is_some_and(|(_, damping)| damping < MIN_TRANSMITTING_DAMPING)
    }

    /// The axis that the encoder on the motor sees while friction holds the table: the motor's own mass on the spring, which is damped by
    /// the spring's damper. None of an encoder on the table, which sees nothing then.
    pub fn held(&self, sliding: &PlantModel) -> Option<PlantModel> {
        let (anti_hz, _) = self.anti.filter(|_| self.is_at_motor())?;
        let (mode, anti) = (TAU * self.frequency_hz, TAU * anti_hz);
        // The motor's share of the mass.
        let share = (anti / mode).powi(2);
        (share < 1.0).then(|| PlantModel {
            gain_mm_per_v_s2: sliding.gain_mm_per_v_s2 / share,
            damping_per_s: 2.0 * self.damping * mode * (1.0 - share),
            stiffness_per_s2: mode * mode - anti * anti,
            delay_s: sliding.delay_s,
        })
    }

    /// The mode at other frequencies by a factor, as when a mass on the axis has changed.
    #[must_use]
    pub fn shifted(&self, factor: f64) -> Self {
        Self {
            frequency_hz: factor * self.frequency_hz,
            anti: self.anti.map(|(hz, damping)| (factor * hz, damping)),
            ..*self
        }
    }
}

/// The factor of all modes at a frequency in rad/s.
pub fn response_of(modes: &[Mode], omega_rad_s: f64) -> Complex64 {
    modes
        .iter()
        .map(|mode| mode.response(omega_rad_s))
        .product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_is_one_at_rest_and_peaks_at_its_frequency() {
        let mode = Mode {
            frequency_hz: 100.0,
            damping: 0.01,
            anti: None,
        };
        assert_eq!(mode.response(0.0), Complex64::new(1.0, 0.0));
        assert!((mode.response(TAU * 100.0).norm() - 50.0).abs() < 1e-9);
    }

    #[test]
    fn a_held_table_leaves_the_motor_on_the_spring() {
        // 1 kg and 3 kg on a spring of 1e5 N/m with a damper of 20 N s/m; a volt is a newton, lengths are m.
        let (motor, table, spring, damper) = (1.0_f64, 3.0, 1e5, 20.0);
        let both = 1.0 / motor + 1.0 / table;
        let mode_rad_s = (spring * both).sqrt();
        let anti_rad_s = (spring / table).sqrt();
        let mode = Mode {
            frequency_hz: mode_rad_s / TAU,
            damping: 0.5 * damper * both / mode_rad_s,
            anti: Some((anti_rad_s / TAU, 0.5 * damper / table / anti_rad_s)),
        };
        let sliding = PlantModel {
            gain_mm_per_v_s2: 1.0 / (motor + table),
            damping_per_s: 0.0,
            stiffness_per_s2: 0.0,
            delay_s: 1e-3,
        };
        let held = mode.held(&sliding).unwrap();
        let near = |found: f64, expected: f64| (found / expected - 1.0).abs() < 1e-9;
        assert!(near(held.gain_mm_per_v_s2, 1.0 / motor), "{held:?}");
        assert!(near(held.stiffness_per_s2, spring / motor), "{held:?}");
        assert!(near(held.damping_per_s, damper / motor), "{held:?}");
        assert_eq!(held.delay_s, sliding.delay_s);
        assert_eq!(Mode { anti: None, ..mode }.held(&sliding), None);
    }

    #[test]
    fn an_anti_resonance_leaves_the_motors_own_mass_above() {
        // Equal halves: the anti-resonance lies at 1/sqrt(2) of the resonance, and the motor alone is half the mass.
        let anti = Some((100.0 / 2.0_f64.sqrt(), 0.01));
        let mode = Mode {
            frequency_hz: 100.0,
            damping: 0.01,
            anti,
        };
        assert!((mode.response(TAU * 1e5).norm() - 2.0).abs() < 1e-3);
        assert!(
            (mode.shifted(1.1).response(TAU * 110.0) - mode.response(TAU * 100.0)).norm() < 1e-9
        );
    }
}
