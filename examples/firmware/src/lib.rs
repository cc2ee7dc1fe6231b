//! One axis, from encoder counts to the voltage of an amplifier.
#![no_std]

use quadrant_law::axis::{Axis, AxisError, AxisState, OutputStage};
use quadrant_law::command::Command;
use quadrant_law::control::pid::PidGains;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::FrictionSettings;
use quadrant_law::friction::gms::GmsParameters;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};
use quadrant_law::reference::{Motion, MotionScale};
use quadrant_law::safety::FaultCode;
use quadrant_law::safety::monitor::Following;
use quadrant_law::units::DacCode;

/// An encoder count in mm, and control periods per second.
pub const SCALE: MotionScale = MotionScale::new(0.5e-3, 10e3);

const GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.118,
    ki_v_per_mm_s: 0.74,
    kd_v_s_per_mm: 5.537e-3,
    derivative_filter_s: 52e-6,
};

const FRICTION: StaticFriction = StaticFriction {
    curve: StribeckCurve {
        coulomb_v: 0.12,
        breakaway_v: 0.15,
        stribeck_velocity_mm_s: 1.0,
        exponent: 1.0,
    },
    viscous_v_s_per_mm: 2.09e-3,
};

/// The axis, its memory, and the fault that switched it off.
pub struct Servo {
    axis: Axis<f32>,
    state: AxisState<f32>,
    fault: Option<FaultCode>,
}

impl Servo {
    /// Makes the axis. Once, before the first control period.
    ///
    /// # Errors
    /// The part that was refused.
    pub fn new() -> Result<Self, AxisError> {
        // Springs in V/mm and shares of the load: where friction's pre-sliding curve bends.
        let blocks = [(21.4, 0.30), (7.5, 0.30), (2.66, 0.25), (0.75, 0.15)];
        let friction = FrictionSettings::new(FRICTION, GmsParameters::new(blocks, 5.0));
        let gains = FeedforwardGains::whole(14.4e-6);
        let axis = Axis::build(SCALE, |axis| {
            axis.output(OutputStage::limited_to(9.0))
                .pid(&GAINS, 2.0)
                .feedforward(FeedforwardKind::Combined, &gains, &friction, 12)
                .overspeed_mm_s(250.0)
                .following(Following::new(0.5, 0.02, 2.0))
        })?;
        Ok(Self {
            axis,
            state: AxisState::default(),
            fault: None,
        })
    }

    /// One control period: the counter of the encoder in, the converter's word out. `None`: switch the amplifier off.
    pub fn tick(&mut self, motion: &Motion<f32>, count: u32, enable: bool) -> Option<DacCode> {
        let reading = EncoderReading::of(count);
        let word = self.axis.tick(&mut self.state, motion, &reading);
        self.fault = self.fault.or(word.err());
        if self.fault.is_some() || !enable {
            // While it is off the axis forgets, so that it holds from where it is when it is switched on.
            self.axis.hold_here(&mut self.state);
            return None;
        }
        word.ok()
    }

    /// Starts the motion from where the axis stands.
    pub fn run(&mut self) {
        self.axis.handle_command(&mut self.state, Command::Run);
    }

    /// The fault that switched the axis off, until it is acknowledged.
    pub fn fault(&self) -> Option<FaultCode> {
        self.fault
    }

    /// Clears the fault: a person has found its cause.
    pub fn acknowledge(&mut self) {
        self.fault = None;
    }
}
