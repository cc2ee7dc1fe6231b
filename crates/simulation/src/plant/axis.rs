//! One simulated axis.

use std::f64::consts::TAU;

use quadrant::friction::Direction;
use quadrant::units::DacCode;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::delay::Delay;
use super::{AxisParameters, Backlash, Body, Drive, EncoderSide, Forcing, Presliding};

/// Steps of the integration in a control period.
pub const SUBSTEPS: usize = 4;

/// Forces that an axis takes for the whole of a control period, V at the amplifier's input.
#[derive(Clone, Copy, Debug)]
pub(super) struct PeriodForces {
    /// Output of the amplifier, before the plant's delay.
    driven_v: f64,
    /// Load, ripple, cogging and gravity.
    external_v: f64,
    /// Friction where the axis is over its mean.
    friction_factor: f64,
}

/// One simulated axis in motion.
#[derive(Clone, Debug)]
pub struct SimulatedAxis {
    truth: AxisParameters,
    step_s: f64,
    volts_per_code: f64,
    /// The plant's delay, of one amplifier voltage a substep.
    delay: Delay,
    presliding: Presliding,
    /// Friction without its viscous part, V.
    presliding_v: f64,
    friction_v: f64,
    load_v: f64,
    position_mm: f64,
    velocity_mm_s: f64,
    /// The motor, where a gap lies between it and the table.
    motor: Body,
    noise: Xoshiro256PlusPlus,
}

impl SimulatedAxis {
    /// An axis at rest at zero, sampled at `rate_hz`; `seed` decides its noise.
    pub fn new(truth: AxisParameters, rate_hz: f64, seed: u64) -> Self {
        let step_s = 1.0 / (rate_hz * SUBSTEPS as f64);
        let delay = (truth.delay_s / step_s).round() as usize;
        Self {
            step_s,
            volts_per_code: truth.full_scale_v / DacCode::FULL_SCALE,
            delay: Delay::of(delay),
            presliding: Presliding::new(&truth, step_s),
            presliding_v: 0.0,
            friction_v: 0.0,
            load_v: 0.0,
            position_mm: 0.0,
            velocity_mm_s: 0.0,
            motor: Body::default(),
            noise: Xoshiro256PlusPlus::seed_from_u64(seed),
            truth,
        }
    }

    /// Gives the axis other parameters while it moves: position, velocity and the deflection of the friction's elements stay,
    /// as after a drop of oil.
    pub fn change(&mut self, truth: AxisParameters) {
        let delay = (truth.delay_s / self.step_s).round() as usize;
        self.delay.resize(delay);
        self.volts_per_code = truth.full_scale_v / DacCode::FULL_SCALE;
        self.presliding.change(&truth, self.step_s);
        self.truth = truth;
    }

    /// The true position, mm.
    pub fn position_mm(&self) -> f64 {
        self.position_mm
    }

    /// The true velocity, mm/s.
    pub fn velocity_mm_s(&self) -> f64 {
        self.velocity_mm_s
    }

    /// The motor's position as far as it has one of its own, mm.
    pub fn motor_position_mm(&self) -> f64 {
        match self.truth.drive {
            Drive::RackAndPinion(_) => self.motor.position_mm,
            Drive::BallScrew | Drive::Direct(_) => self.position_mm,
        }
    }

    /// The friction at this moment, V at the amplifier input.
    pub fn friction_v(&self) -> f64 {
        self.friction_v
    }

    /// Sets an external load (a cutting force, say), in V at the amplifier input; positive loads push towards larger
    /// positions.
    pub fn set_load_v(&mut self, load_v: f64) {
        self.load_v = load_v;
    }

    /// Reads the encoder's 32-bit counter: noisy, quantised, wrapped.
    pub fn read_counter(&mut self) -> u32 {
        let deviation = self.truth.imperfections.encoder_noise_mm;
        let noise = if deviation > 0.0 {
            let normal: f64 = StandardNormal.sample(&mut self.noise);
            deviation * normal
        } else {
            0.0
        };
        let seen_mm = match self.truth.drive {
            Drive::RackAndPinion(gap) if gap.encoder == EncoderSide::Motor => {
                self.motor.position_mm
            }
            _ => self.position_mm,
        };
        let error_mm = self.truth.imperfections.interpolation_error_mm(seen_mm);
        ((seen_mm + error_mm + noise) / self.truth.resolution_mm).floor() as i64 as u32
    }

    /// One control period with the converter at `code` (or the amplifier disabled).
    pub fn step(&mut self, code: DacCode, enabled: bool) {
        let forces = self.period_forces(code, enabled);
        for _ in 0..SUBSTEPS {
            self.substep(forces);
        }
    }

    /// The forces of a control period with the converter at `code` (or the amplifier disabled).
    pub(super) fn period_forces(&self, code: DacCode, enabled: bool) -> PeriodForces {
        let Self { truth, .. } = self;
        let imperfections = &truth.imperfections;
        let limit = truth.full_scale_v;
        let driven = if enabled {
            let asked = f64::from(code.0) * self.volts_per_code + imperfections.offset_v;
            (asked * (1.0 + imperfections.amplifier_gain_error)).clamp(-limit, limit)
        } else {
            0.0
        };
        // In a control period the screw turns by a thousandth, and the axis moves by a thousandth of what friction varies over: both are
        // taken once.
        let ripple = if imperfections.ripple_v > 0.0 {
            imperfections.ripple_v * (TAU * self.position_mm / imperfections.lead_mm).sin()
        } else {
            0.0
        };
        let external = self.load_v - ripple + truth.drive.force_v(self.position_mm);
        // Without gravity the sum is the one above, to the bit.
        let external = if imperfections.gravity_v == 0.0 {
            external
        } else {
            external + imperfections.gravity_v
        };
        PeriodForces {
            driven_v: driven,
            external_v: external,
            friction_factor: imperfections.friction_factor(self.position_mm),
        }
    }

    /// One step of the integration.
    #[inline(always)]
    pub(super) fn substep(&mut self, forces: PeriodForces) {
        let driven_v = self.delay.pass(forces.driven_v);
        let external_v = forces.external_v;
        let along = |velocity: f64| {
            if velocity < 0.0 {
                Direction::Negative
            } else {
                Direction::Positive
            }
        };
        let truth = &self.truth;
        let viscous = truth
            .friction
            .of(along(self.velocity_mm_s))
            .viscous_v_s_per_mm;
        let displacement = match truth.drive {
            Drive::RackAndPinion(gap) => self.move_geared(&gap, driven_v, external_v, viscous),
            Drive::BallScrew | Drive::Direct(_) => self.move_rigid(driven_v + external_v, viscous),
        };
        let factor = forces.friction_factor;
        let after = self.velocity_mm_s;
        self.presliding_v = factor * self.presliding.step(displacement, after.abs(), self.step_s);
        self.friction_v = self.presliding_v + viscous * after;
    }

    /// Moves motor and table as one; the displacement, mm.
    fn move_rigid(&mut self, force_v: f64, viscous: f64) -> f64 {
        let truth = &self.truth;
        let gain = truth.gain_mm_per_v_s2;
        // The trapezoidal rule on the linear part: a held force moves the mass as it would in continuous time.
        let drag = 0.5 * self.step_s * (truth.damping_per_s + gain * viscous);
        let push = gain * (force_v - self.presliding_v) - truth.stiffness_per_s2 * self.position_mm;
        let before = self.velocity_mm_s;
        let after = (before * (1.0 - drag) + push * self.step_s) / (1.0 + drag);
        let displacement = 0.5 * (before + after) * self.step_s;
        self.velocity_mm_s = after;
        self.position_mm += displacement;
        displacement
    }

    /// Moves motor and table with the gap between them; the table's displacement, mm.
    fn move_geared(&mut self, gap: &Backlash, driven_v: f64, external_v: f64, viscous: f64) -> f64 {
        let truth = &self.truth;
        let table = Body {
            position_mm: self.position_mm,
            velocity_mm_s: self.velocity_mm_s,
        };
        let motor_gain = truth.gain_mm_per_v_s2 / gap.motor_share;
        let table_gain = truth.gain_mm_per_v_s2 / (1.0 - gap.motor_share);
        let forcings = [
            Forcing {
                gain_mm_per_v_s2: motor_gain,
                acceleration_mm_s2: motor_gain * driven_v,
                damping_per_s: truth.damping_per_s,
            },
            Forcing {
                gain_mm_per_v_s2: table_gain,
                acceleration_mm_s2: table_gain * (external_v - self.presliding_v)
                    - truth.stiffness_per_s2 / (1.0 - gap.motor_share) * self.position_mm,
                damping_per_s: truth.damping_per_s + table_gain * viscous,
            },
        ];
        let [motor, table] = gap.step([self.motor, table], &forcings, self.step_s);
        let displacement = table.position_mm - self.position_mm;
        self.motor = motor;
        self.position_mm = table.position_mm;
        self.velocity_mm_s = table.velocity_mm_s;
        displacement
    }
}
