//! Random axes.

use std::fmt;

use quadrant_law::friction::PerDirection;
use quadrant_law::friction::dahl::DahlParameters;
use quadrant_law::friction::lugre::LugreParameters;
use quadrant_law::friction::smoothed_gms::SmoothedGmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_sim::plant::{
    AxisParameters, Backlash, Cogging, Drive, EncoderSide, FrictionParameters, PLANT_ELEMENTS,
    StageParameters, virgin_curve_elements,
};
use quadrant_tune::test_axis::Travel;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::subject::Subject;

/// An axis drawn from a seed.
#[derive(Clone, Debug)]
pub struct RandomAxis {
    pub seed: u64,
    pub parameters: AxisParameters,
    /// Travel either way, mm.
    pub travel_mm: f64,
    /// Moving mass over that of the simulated stage's x axis.
    mass: f64,
    friction: &'static str,
    /// Frequency of the resonance, Hz, and the encoder's side, where there is one.
    resonance: Option<(f64, EncoderSide)>,
    backlash_mm: f64,
    /// Relative change of friction when the axis is warm, and the time in which it warms, s.
    warming: (f64, f64),
}

/// Uniform on a logarithmic scale.
pub(super) fn log_uniform(random: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    low * (high / low).powf(random.random::<f64>())
}

impl RandomAxis {
    /// Mass x 0.3 to 3, delay 0.3 to 3 ms, five kinds of friction with asymmetry, a resonance of 30 to 500 Hz in half of
    /// the axes, encoders of 0.05 to 2 um with noise, backlash up to 10 um and cogging in some, ripple, friction that varies
    /// along the travel and as the axis warms, gravity in some, strokes of 10 to 500 mm.
    pub fn new(seed: u64) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mass = log_uniform(&mut random, 0.3, 3.0);
        let mut parameters = StageParameters::real().axes[0].clone().with_mass(mass);
        // The amplifier's gain acts as a mass does, and on friction, too.
        let amplifier = log_uniform(&mut random, 0.5, 2.0);
        parameters.gain_mm_per_v_s2 *= amplifier;
        parameters.delay_s = log_uniform(&mut random, 0.3e-3, 3e-3);
        parameters.resolution_mm = log_uniform(&mut random, 0.05e-3, 2e-3);
        parameters.imperfections.encoder_noise_mm =
            parameters.resolution_mm * random.random_range(0.1..1.0);
        parameters.imperfections.ripple_v *= random.random_range(0.0..3.0);
        parameters.imperfections.offset_v = random.random_range(-0.01..0.01);
        parameters.imperfections.friction_variation = random.random_range(0.0..0.15);
        parameters.imperfections.friction_period_mm = log_uniform(&mut random, 20.0, 500.0);

        let level_v = log_uniform(&mut random, 0.5, 2.0) * 0.12 / amplifier;
        let friction =
            ["GMS", "GMS, rising", "smoothed GMS", "LuGre", "Dahl"][random.random_range(0..5)];
        let breakaway_v = level_v
            * match friction {
                "GMS, rising" => random.random_range(0.5..0.9),
                "Dahl" => 1.0,
                _ => random.random_range(1.0..1.5),
            };
        let mean = StaticFriction {
            curve: StribeckCurve {
                coulomb_v: level_v,
                breakaway_v,
                stribeck_velocity_mm_s: log_uniform(&mut random, 0.5, 20.0),
                exponent: 1.0,
            },
            viscous_v_s_per_mm: log_uniform(&mut random, 0.3e-3, 3e-3) / amplifier,
        };
        let asymmetry = random.random_range(-0.2..0.2);
        let directed = |factor: f64| StaticFriction {
            curve: StribeckCurve {
                coulomb_v: factor * mean.curve.coulomb_v,
                breakaway_v: factor * mean.curve.breakaway_v,
                ..mean.curve
            },
            ..mean
        };
        parameters.friction = PerDirection {
            positive: directed(1.0 + asymmetry),
            negative: directed(1.0 - asymmetry),
        };
        let range_mm = log_uniform(&mut random, 0.005, 0.1);
        parameters.gms.elements = virgin_curve_elements(breakaway_v, range_mm, PLANT_ELEMENTS);
        parameters.gms.attraction_v_s = breakaway_v / 0.03;
        let stiffness_v_per_mm = 3.0 * breakaway_v / range_mm;
        parameters.model = match friction {
            "smoothed GMS" => FrictionParameters::Smoothed(SmoothedGmsParameters::default()),
            "LuGre" => FrictionParameters::Lugre(LugreParameters {
                stiffness_v_per_mm,
                damping_v_s_per_mm: mean.viscous_v_s_per_mm,
            }),
            "Dahl" => FrictionParameters::Dahl(DahlParameters {
                stiffness_v_per_mm,
                exponent: random.random_range(1.0..2.0),
            }),
            _ => FrictionParameters::Gms,
        };

        let mut resonance = None;
        let mut backlash_mm = 0.0;
        let drive: f64 = random.random();
        if drive < 0.5 {
            let frequency_hz = log_uniform(&mut random, 30.0, 500.0);
            let encoder = if random.random::<bool>() {
                EncoderSide::Motor
            } else {
                EncoderSide::Load
            };
            if random.random::<f64>() < 0.3 {
                backlash_mm = random.random_range(0.0..0.010);
            }
            let motor_share = random.random_range(0.3..0.7);
            let damping = log_uniform(&mut random, 0.01, 0.1);
            let gain = parameters.gain_mm_per_v_s2;
            parameters.drive = Drive::RackAndPinion(Backlash {
                width_mm: backlash_mm,
                ..Backlash::resonating(frequency_hz, damping, motor_share, gain, encoder)
            });
            resonance = Some((frequency_hz, encoder));
        } else if drive < 0.6 {
            let cogging_v = random.random_range(0.0..0.03);
            parameters.drive = Drive::Direct(Cogging {
                pole_pitch_mm: 16.0,
                amplitude_v: [cogging_v, 0.25 * cogging_v],
            });
        }
        let travel_mm = log_uniform(&mut random, 5.0, 250.0);
        let warms: f64 = random.random();
        let most = if warms < 0.5 { 0.25 } else { 0.0 };
        let warming = (
            most * random.random_range(-1.0..1.0),
            log_uniform(&mut random, 120.0, 1200.0),
        );
        if random.random::<f64>() < 0.2 {
            // What hangs, and friction holds, at rest and sliding, in its weaker direction too.
            let holding_v = (1.0 - f64::abs(asymmetry)) * level_v.min(breakaway_v);
            parameters.imperfections.gravity_v = holding_v * random.random_range(-0.6..0.6);
        }
        // Where the middle of the travel is in it.
        parameters.imperfections.friction_from_mm =
            parameters.imperfections.friction_period_mm * random.random::<f64>();
        Self {
            warming,
            seed,
            parameters,
            travel_mm,
            mass,
            friction,
            resonance,
            backlash_mm,
        }
    }

    /// The axis, to be commissioned from the middle of its travel.
    pub fn subject(&self) -> Subject {
        Subject {
            seed: self.seed,
            parameters: self.parameters.clone(),
            travel: Travel::either_way(self.travel_mm),
            resonance_hz: self.resonance.map(|(frequency_hz, _)| frequency_hz),
            warming: self.warming,
            description: self.to_string(),
        }
    }

    /// True if motor and table move as one.
    pub fn is_rigid(&self) -> bool {
        self.resonance.is_none()
    }
}

impl fmt::Display for RandomAxis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameters, .. } = self;
        write!(
            f,
            "{}; mass x {:.2}, delay {:.2} ms, encoder {:.2} um, travel +-{:.0} mm",
            self.friction,
            self.mass,
            1e3 * parameters.delay_s,
            1e3 * parameters.resolution_mm,
            self.travel_mm
        )?;
        if let Some((frequency_hz, encoder)) = self.resonance {
            let side = match encoder {
                EncoderSide::Motor => "motor",
                EncoderSide::Load => "table",
            };
            write!(f, ", resonance {frequency_hz:.0} Hz, encoder on the {side}")?;
        }
        if self.backlash_mm > 0.0 {
            write!(f, ", backlash {:.1} um", 1e3 * self.backlash_mm)?;
        }
        if self.warming.0 != 0.0 {
            write!(f, ", friction {:+.0} % when warm", 100.0 * self.warming.0)?;
        }
        if parameters.imperfections.gravity_v != 0.0 {
            write!(f, ", gravity {:.3} V", parameters.imperfections.gravity_v)?;
        }
        if let Drive::Direct(cogging) = parameters.drive {
            write!(f, ", cogging {:.3} V", cogging.amplitude_v[0])?;
        }
        Ok(())
    }
}
