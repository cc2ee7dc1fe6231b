//! The linear model of one axis, from amplifier voltage to position: what controllers are designed on.
//!
//! `Y(s)/U(s) = A exp(-s Td) / (s^2 + B s + C)`, the form an FRF measurement at working amplitude is fitted with
//! (thesis, Table 3.1). Friction is inside B and C here; a simulated stage with explicit friction needs other values.

/// The largest product of control period and pre-sliding resonance, rad: half of what a sampled loop could show. The friction model follows
/// the reference, and is exact at any stiffness (`cargo xtask linuxcnc --check` at 1 kHz has 1.2).
const RESOLVED_RESONANCE: f64 = 1.5;

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
    /// The stiffest pre-sliding spring, V/mm, that a control period, s, resolves: it swings the mass by less than a quarter of a turn in it.
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
