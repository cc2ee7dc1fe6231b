//! One simulated axis.

use std::f64::consts::TAU;
use std::hint::cold_path;

use quadrant_law::friction::{Direction, PerDirection};
use quadrant_law::units::DacCode;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::delay::Delay;
use super::{
    AxisParameters, Backlash, Body, Drive, EncoderSide, Forcing, Presliding, VelocityDrive,
};

/// Steps of the integration in a control period.
pub const SUBSTEPS: usize = 4;

/// A control period of an axis: what stays the same in it, and the motion, which the steps of the integration keep in registers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Period {
    /// Output of the amplifier after the plant's delay, V, in each step; the command of one in velocity mode.
    driven_v: [f64; SUBSTEPS],
    /// The amplifier is enabled.
    enabled: bool,
    /// Load, ripple, cogging and gravity, V at the amplifier's input.
    external_v: f64,
    /// Friction where the axis is over its mean.
    friction_factor: f64,
    moving: Moving,
}

/// Motion of an axis.
#[derive(Clone, Copy, Debug, Default)]
struct Moving {
    /// Of the table, and of the motor where it moves with it.
    position_mm: f64,
    velocity_mm_s: f64,
    /// The motor, where a gap lies between it and the table.
    motor: Body,
    /// Friction without its viscous part, V.
    presliding_v: f64,
    /// Viscous friction of the last step, V s/mm.
    viscous_v_s_per_mm: f64,
    /// Integral of an amplifier's own velocity loop, V.
    drive_integral_v: f64,
}

/// Damping of an axis in one sense of motion.
#[derive(Clone, Copy, Debug)]
struct Damping {
    viscous_v_s_per_mm: f64,
    /// One less and one plus what half a step takes away of the velocity of motor and table together.
    keeps: f64,
    slows: f64,
}

impl Damping {
    fn of(truth: &AxisParameters, step_s: f64) -> PerDirection<Self> {
        truth.friction.map(|friction| {
            let viscous = friction.viscous_v_s_per_mm;
            let rate_per_s = truth.damping_per_s + truth.gain_mm_per_v_s2 * viscous;
            let drag = 0.5 * step_s * rate_per_s;
            Self {
                viscous_v_s_per_mm: viscous,
                keeps: 1.0 - drag,
                slows: 1.0 + drag,
            }
        })
    }
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
    damping: PerDirection<Damping>,
    moving: Moving,
    load_v: f64,
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
            damping: Damping::of(&truth, step_s),
            moving: Moving::default(),
            load_v: 0.0,
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
        self.damping = Damping::of(&truth, self.step_s);
        self.truth = truth;
    }

    /// The true position, mm.
    pub fn position_mm(&self) -> f64 {
        self.moving.position_mm
    }

    /// The true velocity, mm/s.
    pub fn velocity_mm_s(&self) -> f64 {
        self.moving.velocity_mm_s
    }

    /// The motor's position as far as it has one of its own, mm.
    pub fn motor_position_mm(&self) -> f64 {
        match self.truth.drive {
            Drive::RackAndPinion(_) => self.moving.motor.position_mm,
            Drive::BallScrew | Drive::Direct(_) => self.moving.position_mm,
        }
    }

    /// The friction at this moment, V at the amplifier input.
    pub fn friction_v(&self) -> f64 {
        let moving = &self.moving;
        moving.presliding_v + moving.viscous_v_s_per_mm * moving.velocity_mm_s
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
                self.moving.motor.position_mm
            }
            _ => self.moving.position_mm,
        };
        let error_mm = self.truth.imperfections.interpolation_error_mm(seen_mm);
        floor((seen_mm + error_mm + noise) / self.truth.resolution_mm) as u32
    }

    /// One control period with the converter at `code` (or the amplifier disabled).
    pub fn step(&mut self, code: DacCode, enabled: bool) {
        let mut period = self.begin(code, enabled);
        for step in 0..SUBSTEPS {
            self.substep(&mut period, step);
        }
        self.end(&period);
    }

    /// Begins a control period with the converter at `code` (or the amplifier disabled).
    #[inline(always)]
    pub(super) fn begin(&mut self, code: DacCode, enabled: bool) -> Period {
        let Self { truth, .. } = self;
        let imperfections = &truth.imperfections;
        let limit = truth.full_scale_v;
        let driven = if enabled {
            let asked = f64::from(code.0) * self.volts_per_code + imperfections.offset_v;
            (asked * (1.0 + imperfections.amplifier_gain_error)).clamp(-limit, limit)
        } else {
            0.0
        };
        let position_mm = self.moving.position_mm;
        // In a control period the screw turns by a thousandth, and the axis moves by a thousandth of what friction varies over: both are
        // taken once.
        let ripple = if imperfections.ripple_v > 0.0 {
            imperfections.ripple_v * (TAU * position_mm / imperfections.lead_mm).sin()
        } else {
            0.0
        };
        let external = self.load_v - ripple + truth.drive.force_v(position_mm);
        // Without gravity the sum is the one above, to the bit.
        let external = if imperfections.gravity_v == 0.0 {
            external
        } else {
            external + imperfections.gravity_v
        };
        Period {
            driven_v: self.delay.pass(driven),
            enabled,
            external_v: external,
            friction_factor: imperfections.friction_factor(position_mm),
            moving: self.moving,
        }
    }

    /// One step of the integration.
    #[inline(always)]
    pub(super) fn substep(&mut self, period: &mut Period, step: usize) {
        let mut driven_v = period.driven_v[step];
        let external_v = period.external_v;
        let moving = &mut period.moving;
        if let Some(drive) = &self.truth.velocity_drive {
            cold_path();
            driven_v = self.velocity_loop(drive, moving, driven_v, period.enabled);
        }
        let damping = self.damping.of(Direction::of(moving.velocity_mm_s));
        let displacement = match self.truth.drive {
            Drive::RackAndPinion(gap) => {
                self.move_geared(moving, &gap, driven_v, external_v, damping)
            }
            Drive::BallScrew | Drive::Direct(_) => {
                self.move_rigid(moving, driven_v + external_v, damping)
            }
        };
        let speed = moving.velocity_mm_s.abs();
        let mut presliding_v = self.presliding.step(displacement, speed, self.step_s);
        if period.friction_factor != 1.0 {
            cold_path();
            presliding_v *= period.friction_factor;
        }
        moving.presliding_v = presliding_v;
        moving.viscous_v_s_per_mm = damping.viscous_v_s_per_mm;
    }

    /// Ends a control period.
    #[inline(always)]
    pub(super) fn end(&mut self, period: &Period) {
        self.moving = period.moving;
    }

    /// The motor's force by an amplifier in velocity mode, V: none while it is disabled.
    fn velocity_loop(
        &self,
        drive: &VelocityDrive,
        moving: &mut Moving,
        command_v: f64,
        enabled: bool,
    ) -> f64 {
        if !enabled {
            moving.drive_integral_v = 0.0;
            return 0.0;
        }
        let velocity_mm_s = match self.truth.drive {
            Drive::RackAndPinion(_) => moving.motor.velocity_mm_s,
            Drive::BallScrew | Drive::Direct(_) => moving.velocity_mm_s,
        };
        let integral_v = &mut moving.drive_integral_v;
        drive.step(integral_v, command_v, velocity_mm_s, self.step_s)
    }

    /// Moves motor and table as one; the displacement, mm.
    #[inline(always)]
    fn move_rigid(&self, moving: &mut Moving, force_v: f64, damping: &Damping) -> f64 {
        let truth = &self.truth;
        // The trapezoidal rule on the linear part: a held force moves the mass as it would in continuous time.
        let mut push = truth.gain_mm_per_v_s2 * (force_v - moving.presliding_v);
        // A stage has no spring to ground, and every step waits for this sum.
        if truth.stiffness_per_s2 != 0.0 {
            cold_path();
            push -= truth.stiffness_per_s2 * moving.position_mm;
        }
        let before = moving.velocity_mm_s;
        let after = (before * damping.keeps + push * self.step_s) / damping.slows;
        let displacement = (before + after) * (0.5 * self.step_s);
        moving.velocity_mm_s = after;
        moving.position_mm += displacement;
        displacement
    }

    /// Moves motor and table with the gap between them; the table's displacement, mm.
    fn move_geared(
        &self,
        moving: &mut Moving,
        gap: &Backlash,
        driven_v: f64,
        external_v: f64,
        damping: &Damping,
    ) -> f64 {
        let truth = &self.truth;
        let table = Body {
            position_mm: moving.position_mm,
            velocity_mm_s: moving.velocity_mm_s,
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
                acceleration_mm_s2: table_gain * (external_v - moving.presliding_v)
                    - truth.stiffness_per_s2 / (1.0 - gap.motor_share) * moving.position_mm,
                damping_per_s: truth.damping_per_s + table_gain * damping.viscous_v_s_per_mm,
            },
        ];
        let [motor, table] = gap.step([moving.motor, table], &forcings, self.step_s);
        let displacement = table.position_mm - moving.position_mm;
        moving.motor = motor;
        moving.position_mm = table.position_mm;
        moving.velocity_mm_s = table.velocity_mm_s;
        displacement
    }
}

/// The largest integer that is not above a number, as [`f64::floor`] and a conversion give it: that calls a function where the
/// processor need not have an instruction for it.
#[inline(always)]
fn floor(value: f64) -> i64 {
    let towards_zero = value as i64;
    towards_zero.saturating_sub(i64::from(towards_zero as f64 > value))
}
