//! Parameters of the simulated axes. Every number here is chosen, none measured.

use std::f64::consts::TAU;

use heapless::Vec;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::friction::PerDirection;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::gms::{GmsElement, GmsParameters, MAX_ELEMENTS};
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_settings::presets::{X_PLANT, Y_PLANT, Z_PLANT};

use super::{Drive, VelocityDrive};

/// GMS elements of the simulated axes' friction.
pub const PLANT_ELEMENTS: usize = 10;

/// Velocity for a volt of the simulated stage's amplifiers in velocity mode, mm/(V s).
pub const DRIVE_MM_S_PER_V: f64 = 25.0;

/// Friction model of a simulated axis. The levels are those of its static friction, the elements those of its GMS
/// parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FrictionParameters {
    #[default]
    Gms,
    Smoothed(SmoothedGmsParameters),
    /// LuGre; its viscous friction is the static model's.
    Lugre(LugreParameters),
    /// Dahl's model, at the Coulomb level.
    Dahl(DahlParameters),
}

/// One simulated axis: `x'' = A (u(t - Td) - F) - B x' - C x`, friction `F` explicit.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisParameters {
    /// A, mm/(V s^2).
    pub gain_mm_per_v_s2: f64,
    /// B without the viscous friction that `friction` carries, 1/s.
    pub damping_per_s: f64,
    /// C, 1/s^2: zero for a stage, which has no spring to ground.
    pub stiffness_per_s2: f64,
    /// Td, s.
    pub delay_s: f64,
    /// Stribeck curve and viscous friction, each way.
    pub friction: PerDirection<StaticFriction>,
    /// Pre-sliding friction, and the rate at which sliding friction follows the Stribeck curve.
    pub gms: GmsParameters,
    /// The model that it follows.
    pub model: FrictionParameters,
    /// Length of an encoder count, mm.
    pub resolution_mm: f64,
    /// Voltage of the converter's largest code, V; the amplifier saturates there.
    pub full_scale_v: f64,
    /// Imperfections of a real axis that its model leaves out.
    pub imperfections: Imperfections,
    /// Drive train between motor and table.
    pub drive: Drive,
    /// The amplifier's own velocity loop; `None` in torque mode, where a voltage is a force.
    pub velocity_drive: Option<VelocityDrive>,
}

/// Imperfections of a real axis that its model leaves out; all zero for an ideal one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Imperfections {
    /// Constant force along the axis, V at the amplifier's input: the weight of what hangs, less its counterweight; negative towards
    /// smaller positions.
    pub gravity_v: f64,
    /// Standard deviation of the encoder's noise, mm, before it is quantised.
    pub encoder_noise_mm: f64,
    /// Offset of converter and amplifier, V.
    pub offset_v: f64,
    /// Amplitude of a force that repeats with every turn of the screw, V.
    pub ripple_v: f64,
    /// Lead of the screw, mm.
    pub lead_mm: f64,
    /// Relative error of the amplifier's gain, above -1.
    pub amplifier_gain_error: f64,
    /// Amplitude of the error that the encoder's interpolation repeats in every period of its grating, mm.
    pub interpolation_mm: f64,
    /// Period of the grating, mm; above zero where the amplitude is.
    pub grating_mm: f64,
    /// Amplitude, relative, with which friction changes along the travel, 0 to below 1.
    pub friction_variation: f64,
    /// Length over which that repeats, mm; above zero where the amplitude is.
    pub friction_period_mm: f64,
    /// Position at which it is that of the mean and grows, mm.
    pub friction_from_mm: f64,
}

impl Imperfections {
    /// Returns the error that the encoder's interpolation adds to a position, mm.
    pub fn interpolation_error_mm(&self, position_mm: f64) -> f64 {
        if self.interpolation_mm > 0.0 {
            self.interpolation_mm * (TAU * position_mm / self.grating_mm).sin()
        } else {
            0.0
        }
    }

    /// Friction at a position over its mean.
    pub fn friction_factor(&self, position_mm: f64) -> f64 {
        if self.friction_variation > 0.0 {
            let periods = (position_mm - self.friction_from_mm) / self.friction_period_mm;
            1.0 + self.friction_variation * (TAU * periods).sin()
        } else {
            1.0
        }
    }
}

/// The three axes of the simulated stage.
#[derive(Clone, Debug, PartialEq)]
pub struct StageParameters {
    /// x, y, z.
    pub axes: [AxisParameters; 3],
}

/// The elements whose virgin curve is `Fs (1 - exp(-4 x / range))`, scaled to reach Fs at the end of the pre-sliding
/// range and cut into straight pieces at knots that are denser near zero:
/// `k_i = S_i - S_(i+1)`, `alpha_i = k_i x_i / Fs`.
pub fn virgin_curve_elements(
    breakaway_v: f64,
    range_mm: f64,
    count: usize,
) -> Vec<GmsElement, MAX_ELEMENTS> {
    let force =
        |x: f64| breakaway_v * (1.0 - (-4.0 * x / range_mm).exp()) / (1.0 - (-4.0f64).exp());
    let knot = |index: usize| range_mm * (index as f64 / count as f64).powi(2);
    let slope = |index: usize| {
        if index < count {
            (force(knot(index + 1)) - force(knot(index))) / (knot(index + 1) - knot(index))
        } else {
            0.0
        }
    };
    (1..=count)
        .map(|index| {
            let stiffness = slope(index - 1) - slope(index);
            GmsElement {
                stiffness_v_per_mm: stiffness,
                weight: stiffness * knot(index) / breakaway_v,
            }
        })
        .collect()
}

/// Friction of one sense of motion relative to the axis' mean.
fn directed(mean: &StaticFriction, factor: f64) -> StaticFriction {
    StaticFriction {
        curve: StribeckCurve {
            coulomb_v: mean.curve.coulomb_v * factor,
            breakaway_v: mean.curve.breakaway_v * factor,
            ..mean.curve
        },
        ..*mean
    }
}

/// Parameters in which the simulated axes differ.
struct Character {
    linear: PlantModel,
    mean: StaticFriction,
    asymmetry: f64,
    presliding_mm: f64,
    imperfections: Imperfections,
}

fn axis(character: &Character) -> AxisParameters {
    let Character { mean, .. } = character;
    AxisParameters {
        gain_mm_per_v_s2: character.linear.gain_mm_per_v_s2,
        // The viscous part of the linear model's damping is carried by friction.
        damping_per_s: character.linear.damping_per_s
            - character.linear.gain_mm_per_v_s2 * mean.viscous_v_s_per_mm,
        stiffness_per_s2: 0.0,
        delay_s: character.linear.delay_s,
        friction: PerDirection {
            positive: directed(mean, 1.0 + character.asymmetry),
            negative: directed(mean, 1.0 - character.asymmetry),
        },
        gms: GmsParameters {
            elements: virgin_curve_elements(
                mean.curve.breakaway_v,
                character.presliding_mm,
                PLANT_ELEMENTS,
            ),
            attraction_v_s: 5.0,
        },
        model: FrictionParameters::Gms,
        resolution_mm: 5e-4,
        full_scale_v: 10.0,
        imperfections: character.imperfections,
        drive: Drive::BallScrew,
        velocity_drive: None,
    }
}

impl StageParameters {
    /// The simulated stage with everything a real one has. x is the axis of `thesis.md`'s chosen parameters; y and z
    /// are plausible companions, chosen too.
    pub fn real() -> Self {
        let mean = |coulomb_v, breakaway_v, stribeck_velocity_mm_s| StaticFriction {
            curve: StribeckCurve {
                coulomb_v,
                breakaway_v,
                stribeck_velocity_mm_s,
                exponent: 1.0,
            },
            viscous_v_s_per_mm: 0.001,
        };
        let imperfections = |offset_v, ripple_v| Imperfections {
            encoder_noise_mm: 1.5e-4,
            offset_v,
            ripple_v,
            lead_mm: 10.0,
            ..Imperfections::default()
        };
        Self {
            axes: [
                axis(&Character {
                    linear: X_PLANT,
                    mean: mean(0.120, 0.150, 1.0),
                    asymmetry: 0.03,
                    presliding_mm: 0.030,
                    imperfections: imperfections(0.003, 0.002),
                }),
                axis(&Character {
                    linear: Y_PLANT,
                    mean: mean(0.140, 0.170, 1.2),
                    asymmetry: -0.02,
                    presliding_mm: 0.034,
                    imperfections: imperfections(-0.002, 0.003),
                }),
                axis(&Character {
                    linear: Z_PLANT,
                    mean: mean(0.160, 0.200, 0.9),
                    asymmetry: 0.04,
                    presliding_mm: 0.026,
                    imperfections: imperfections(0.004, 0.003),
                }),
            ],
        }
    }

    /// The same stage behind amplifiers in velocity mode: the velocity follows with a lag, s, and is [`DRIVE_MM_S_PER_V`] for a volt.
    #[must_use]
    pub fn in_velocity_mode(mut self, lag_s: f64) -> Self {
        for axis in &mut self.axes {
            axis.velocity_drive = Some(VelocityDrive::with_lag(
                lag_s,
                DRIVE_MM_S_PER_V,
                axis.full_scale_v,
                axis.gain_mm_per_v_s2,
            ));
        }
        self
    }

    /// The same stage without the imperfections that no model of the control law knows.
    pub fn ideal() -> Self {
        let mut stage = Self::real();
        for axis in &mut stage.axes {
            axis.imperfections = Imperfections::default();
        }
        stage
    }
}
