//! One axis under PID against a simulated mass with friction: the largest error, without feedforward and with it.
use quadrant_law::axis::{Axis, AxisBuilder, AxisError, AxisState};
use quadrant_law::control::{feedback::Feedback, pid::Pid};
use quadrant_law::friction::{Direction, gms, stribeck::SlidingTable};
use quadrant_law::reference::{HarmonicSettings, Motion, MotionScale, MotionSettings};
use quadrant_law::{command::Command, encoder::EncoderReading, feedforward::FeedforwardKind};

fn largest_error_um(kind: FeedforwardKind) -> Result<f32, AxisError> {
    let x = quadrant_settings::presets::x_axis();
    let sine = MotionSettings::Harmonic(HarmonicSettings::with_velocity(10.0, 5.0, 1.0, 0.5));
    let motion = Motion::build(&sine, MotionScale::new(0.5e-3, 1e4));
    let mut axis = Axis::<f32, 8>::blank();
    AxisBuilder::new(&mut axis, 0.5e-3, 1e-4)
        .amplifier(10.0, 10.0, 0.0, false)
        .feedback(Feedback::Pid(Pid::build(&x.feedback.pid, 2.0, 1e-4)))
        .feedforward(kind, &x.feedforward.gains, &x.friction, 0)
        .try_build()?;
    let (curves, gms) = (x.friction.sliding.map(|side| side.curve), &x.friction.gms);
    let surface = SlidingTable::<f64>::build(&curves, gms.attraction_v_s, 1e-4);
    let elements = gms::Gms::<f64, 10>::build(&gms.elements);
    let (mut state, mut friction) = (AxisState::default(), gms::GmsState::default());
    let (mut position, mut velocity, mut largest) = (0.0, 0.0, 0.0_f32);
    axis.handle_command(&mut state, Command::Run);
    for tick in 0..150_000 {
        let reading = EncoderReading::of(f64::round(position / 0.5e-3) as i32 as u32);
        let code = axis.tick(&mut state, &motion, &reading, tick).unwrap();
        let sliding = surface.at(f64::abs(velocity), Direction::of(velocity));
        let friction_v = elements.step(&mut friction, velocity * 1e-4, sliding);
        let driving_v = f64::from(code.0) / 3276.7 - friction_v;
        velocity += (69_390.0 * driving_v - 144.8 * velocity) * 1e-4;
        position += velocity * 1e-4;
        largest = largest.max(state.telemetry().error_mm().abs());
    }
    Ok(1000.0 * largest)
}

fn main() -> Result<(), AxisError> {
    let [without, with] = [FeedforwardKind::None, FeedforwardKind::Combined].map(largest_error_um);
    println!("PID: {:.2} um, with feedforward: {:.2} um", without?, with?);
    Ok(())
}
