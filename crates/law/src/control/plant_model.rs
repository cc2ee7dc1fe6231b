//! The linear model of one axis, from amplifier voltage to position: what controllers are designed on.
//!
//! `Y(s)/U(s) = A exp(-s Td) / (s^2 + B s + C)`, the form an FRF measurement at working amplitude is fitted with
//! (thesis, Table 3.1). Friction is inside B and C here; a simulated stage with explicit friction needs other values.

use num_complex::Complex64;

/// The largest product of control period and pre-sliding resonance, rad.
const RESOLVED_RESONANCE: f64 = 0.5;

/// Second order plus delay. Settings time and host only: double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "settings", derive(miniconf::TreeSchema, miniconf::TreeAny))]
pub struct PlantModel {
    /// A, acceleration per volt at the amplifier input, mm/(V s^2). Above zero.
    pub gain_mm_per_v_s2: f64,
    /// B, damping over mass, 1/s. Zero or more.
    pub damping_per_s: f64,
    /// C, stiffness over mass, 1/s^2. Zero or more; zero is a stage without a spring to ground.
    pub stiffness_per_s2: f64,
    /// Td, the dead time of amplifier, drive and encoder, s. Zero or more. Neither the hold of a sampled controller nor
    /// its computing time is part of it.
    pub delay_s: f64,
}

impl PlantModel {
    /// The response at `s = j omega`, mm/V. Infinite at zero frequency when the stiffness is zero.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.delayed_gain(omega_rad_s) / self.denominator(omega_rad_s)
    }

    /// `A exp(-s Td)` at `s = j omega`, mm/(V s^2).
    pub(crate) fn delayed_gain(&self, omega_rad_s: f64) -> Complex64 {
        let (sin, cos) = libm::sincos(-omega_rad_s * self.delay_s);
        Complex64::new(cos, sin) * self.gain_mm_per_v_s2
    }

    /// `s^2 + B s + C` at `s = j omega`, 1/s^2: finite at every frequency, unlike the response.
    pub fn denominator(&self, omega_rad_s: f64) -> Complex64 {
        Complex64::new(
            self.stiffness_per_s2 - omega_rad_s * omega_rad_s,
            self.damping_per_s * omega_rad_s,
        )
    }

    /// The stiffest pre-sliding spring, V/mm, that a control period, s, resolves: it swings the mass by half a radian in it.
    pub fn stiffest_v_per_mm(&self, period_s: f64) -> f64 {
        let resonance = RESOLVED_RESONANCE / period_s;
        resonance * resonance / self.gain_mm_per_v_s2
    }

    /// True if every parameter is finite and within the range its field states.
    pub fn is_valid(&self) -> bool {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let not_negative = |x: f64| x.is_finite() && x >= 0.0;
        positive(self.gain_mm_per_v_s2)
            && not_negative(self.damping_per_s)
            && not_negative(self.stiffness_per_s2)
            && not_negative(self.delay_s)
    }
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

    #[test]
    fn a_parameter_outside_its_range_is_noticed() {
        assert!(PLANT.is_valid());
        assert!(
            PlantModel {
                stiffness_per_s2: 0.0,
                ..PLANT
            }
            .is_valid()
        );
        assert!(
            !PlantModel {
                gain_mm_per_v_s2: 0.0,
                ..PLANT
            }
            .is_valid()
        );
        assert!(
            !PlantModel {
                damping_per_s: -1.0,
                ..PLANT
            }
            .is_valid()
        );
        assert!(
            !PlantModel {
                stiffness_per_s2: f64::NAN,
                ..PLANT
            }
            .is_valid()
        );
        assert!(
            !PlantModel {
                delay_s: f64::INFINITY,
                ..PLANT
            }
            .is_valid()
        );
    }
}
