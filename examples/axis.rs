//! One axis under PID against a simulated mass with friction: the largest error, without feedforward and with it.
use quadrant_law::axis::{Axis, AxisError, AxisState, OutputStage};
use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
use quadrant_law::friction::gms::{Gms, GmsParameters, GmsState};
use quadrant_law::friction::stribeck::{SlidingTable, StaticFriction, StribeckCurve};
use quadrant_law::friction::{Direction, FrictionSettings};
use quadrant_law::reference::{HarmonicSettings, Motion, MotionScale, MotionSettings};
use quadrant_law::{command::Command, control::pid::PidGains, encoder::EncoderReading};

fn main() -> Result<(), AxisError> {
    let friction = friction();
    let sine = HarmonicSettings::with_velocity(10.0, 5.0, 1.0, 0.5);
    let motion = Motion::build(&MotionSettings::Harmonic(sine), SCALE);
    for kind in [FeedforwardKind::None, FeedforwardKind::Combined] {
        let axis = Axis::<f32>::build(SCALE, |axis| {
            axis.output(OutputStage::limited_to(10.0))
                .pid(&GAINS, 2.0)
                .feedforward(kind, &FeedforwardGains::whole(INERTIA), &friction, 0)
        })?;
        let (mut state, mut mass) = (AxisState::default(), Mass::new(&friction));
        let mut largest_mm = 0.0_f32;
        axis.handle_command(&mut state, Command::Run);
        for _ in 0..150_000 {
            let reading = EncoderReading::of(mass.count());
            let code = axis.tick(&mut state, &motion, &reading).unwrap();
            mass.step(code.to_volts(10.0));
            largest_mm = largest_mm.max(state.telemetry().error_mm().abs());
        }
        println!("feedforward {}: {:.2} um", kind.name(), 1e3 * largest_mm);
    }
    Ok(())
}

/// Counts of 0.5 um, 10 000 ticks a second.
const SCALE: MotionScale = MotionScale::new(0.5e-3, 1e4);
const GAINS: PidGains = PidGains {
    kp_v_per_mm: 1.118,
    ki_v_per_mm_s: 0.74,
    kd_v_s_per_mm: 5.537e-3,
    derivative_filter_s: 52e-6,
};
/// V s^2/mm.
const INERTIA: f64 = 1.0 / 69_390.0;

/// The friction of the axis, as it would be identified.
fn friction() -> FrictionSettings {
    let curve = StribeckCurve {
        coulomb_v: 0.12,
        breakaway_v: 0.15,
        stribeck_velocity_mm_s: 1.0,
        exponent: 1.0,
    };
    let sliding = StaticFriction {
        curve,
        viscous_v_s_per_mm: 144.8 / 69_390.0,
    };
    let blocks = [(21.4, 0.30), (7.5, 0.30), (2.66, 0.25), (0.75, 0.15)];
    FrictionSettings::new(sliding, GmsParameters::new(blocks, 5.0))
}

/// A mass that the motor moves, in double precision.
struct Mass {
    surface: SlidingTable<f64>,
    elements: Gms<f64, 10>,
    memory: GmsState<f64, 10>,
    position_mm: f64,
    velocity_mm_s: f64,
}

impl Mass {
    fn new(friction: &FrictionSettings) -> Self {
        let curves = friction.sliding.map(|side| side.curve);
        let attraction_v_s = friction.gms.attraction_v_s;
        Self {
            surface: SlidingTable::build(&curves, attraction_v_s, SCALE.period_s()),
            elements: Gms::build(&friction.gms.elements),
            memory: GmsState::default(),
            position_mm: 0.0,
            velocity_mm_s: 0.0,
        }
    }

    fn count(&self) -> u32 {
        (self.position_mm / SCALE.resolution_mm).round() as i32 as u32
    }

    fn step(&mut self, volts: f64) {
        let (velocity, period_s) = (self.velocity_mm_s, SCALE.period_s());
        let sliding = self.surface.at(velocity.abs(), Direction::of(velocity));
        let displacement = velocity * period_s;
        let friction_v = self.elements.step(&mut self.memory, displacement, sliding);
        self.velocity_mm_s += (69_390.0 * (volts - friction_v) - 144.8 * velocity) * period_s;
        self.position_mm += self.velocity_mm_s * period_s;
    }
}
