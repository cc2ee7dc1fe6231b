//! The linear model of one axis, from amplifier voltage to position: what controllers are designed on.
//!
//! `Y(s)/U(s) = A exp(-s Td) / (s^2 + B s + C)`, the form an FRF measurement at working amplitude is fitted with
//! (thesis, Table 3.1). Friction is inside B and C here; a simulated stage with explicit friction needs other values.

/// The largest product of control period and pre-sliding resonance, rad, from 4 kHz up.
const RESOLVED_RESONANCE: f64 = 0.5;

/// The same at lower rates, where a resonance is no faster than [`USUAL_RESONANCE`]: half of what a sampled loop could show.
const SLOW_RESOLVED_RESONANCE: f64 = 1.5;

/// A pre-sliding resonance that is allowed at every rate which could show it, rad/s. The friction model follows the reference, and is exact
/// at any stiffness: at 1 kHz half a radian would take most of what its feedforward gives (`cargo xtask linuxcnc --check`).
const USUAL_RESONANCE: f64 = 2000.0;

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
    /// The stiffest pre-sliding spring, V/mm, that a control period, s, resolves: it swings the mass by half a radian in it, or, at less
    /// than 4 kHz, by up to 1.5.
    pub fn stiffest_v_per_mm(&self, period_s: f64) -> f64 {
        let slow = (SLOW_RESOLVED_RESONANCE / period_s).min(USUAL_RESONANCE);
        let resonance = (RESOLVED_RESONANCE / period_s).max(slow);
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
    #[test]
    fn a_resonance_of_half_a_radian_a_period_is_resolved_and_of_more_at_low_rates() {
        // Times A: the square of the resonance, rad/s.
        for (rate_hz, resonance) in [(1e3, 1500.0), (2e3, 2000.0), (4e3, 2000.0), (10e3, 5000.0)] {
            let stiffest = PLANT.stiffest_v_per_mm(1.0 / rate_hz) * PLANT.gain_mm_per_v_s2;
            assert!(
                (stiffest / (resonance * resonance) - 1.0_f64).abs() < 1e-12,
                "{rate_hz}"
            );
        }
    }
}
