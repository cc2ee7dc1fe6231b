//! The simulated axis behaves as the equations it is made from.

use quadrant_law::units::DacCode;
use quadrant_sim::plant::{SimulatedAxis, SimulatedStage, StageParameters};

const RATE_HZ: f64 = 10e3;

fn code(volts: f64) -> DacCode {
    DacCode::from_volts(volts, 10.0)
}

fn x_axis() -> SimulatedAxis {
    let [x, ..] = StageParameters::ideal().axes;
    SimulatedAxis::new(x, RATE_HZ, 1)
}

fn run(axis: &mut SimulatedAxis, volts: f64, seconds: f64) {
    for _ in 0..(seconds * RATE_HZ) as usize {
        axis.step(code(volts), true);
    }
}

#[test]
fn a_voltage_below_breakaway_moves_the_axis_by_less_than_its_pre_sliding_range() {
    let mut axis = x_axis();
    run(&mut axis, 0.08, 2.0);
    assert!(axis.velocity_mm_s().abs() < 1e-3);
    assert!((1e-3..0.030).contains(&axis.position_mm()));
}

#[test]
fn pre_sliding_displacement_springs_back_in_part_when_the_voltage_goes() {
    let mut axis = x_axis();
    run(&mut axis, 0.08, 2.0);
    let pushed = axis.position_mm();
    run(&mut axis, 0.0, 2.0);
    assert!((0.05 * pushed..0.95 * pushed).contains(&axis.position_mm()));
}

#[test]
fn a_constant_voltage_drives_the_axis_at_the_velocity_that_friction_and_damping_leave() {
    let truth = StageParameters::ideal().axes[0].clone();
    let mut axis = x_axis();
    run(&mut axis, 0.5, 3.0);
    let friction = truth.friction.positive;
    let damping = friction.viscous_v_s_per_mm + truth.damping_per_s / truth.gain_mm_per_v_s2;
    let expected =
        (f64::from(code(0.5).0) * 10.0 / DacCode::FULL_SCALE - friction.curve.coulomb_v) / damping;
    assert!((axis.velocity_mm_s() / expected - 1.0).abs() < 1e-3);
}

#[test]
fn nothing_arrives_before_the_delay_has_passed() {
    let mut axis = x_axis();
    run(&mut axis, 5.0, 1.2e-3);
    assert_eq!(axis.position_mm(), 0.0);
    run(&mut axis, 5.0, 0.2e-3);
    assert!(axis.position_mm() > 0.0);
}

#[test]
fn a_disabled_amplifier_gives_no_force() {
    let mut axis = x_axis();
    for _ in 0..5000 {
        axis.step(code(5.0), false);
    }
    assert_eq!(axis.position_mm(), 0.0);
}

#[test]
fn a_load_moves_the_axis_as_the_same_voltage_does() {
    let mut axis = x_axis();
    axis.set_load_v(-0.5);
    run(&mut axis, 0.0, 1.0);
    assert!(axis.velocity_mm_s() < -100.0);
}

#[test]
fn the_counter_shows_negative_positions_as_a_wrapped_32_bit_counter_does() {
    let mut axis = x_axis();
    run(&mut axis, -1.0, 0.1);
    let position_counts = axis.position_mm() / 5e-4;
    assert!(position_counts < -10.0);
    assert_eq!(
        f64::from(axis.read_counter().cast_signed()),
        position_counts.floor()
    );
}

#[test]
fn the_same_seed_gives_the_same_noise_and_another_seed_another() {
    let readings = |seed| {
        let mut stage = SimulatedStage::new(&StageParameters::real(), RATE_HZ, seed);
        (0..1000).map(|_| stage.read_counters()).collect::<Vec<_>>()
    };
    assert_eq!(readings(1), readings(1));
    assert_ne!(readings(1), readings(2));
}

#[test]
fn a_held_voltage_moves_the_axis_as_it_would_in_continuous_time() {
    let mut truth = StageParameters::ideal().axes[0].clone();
    for model in [&mut truth.friction.positive, &mut truth.friction.negative] {
        model.curve.coulomb_v = 1e-9;
        model.curve.breakaway_v = 1e-9;
    }
    let damping =
        truth.damping_per_s + truth.gain_mm_per_v_s2 * truth.friction.positive.viscous_v_s_per_mm;
    let mut axis = SimulatedAxis::new(truth.clone(), RATE_HZ, 1);
    let volts = DacCode(3276).to_volts(10.0);
    for tick in 1..=500 {
        axis.step(DacCode(3276), true);
        let time = (f64::from(tick) / RATE_HZ - truth.delay_s).max(0.0);
        let exact = truth.gain_mm_per_v_s2 * volts / damping
            * (time - (1.0 - (-damping * time).exp()) / damping);
        // A thousandth of a count, and a few millionths of the way.
        let apart = axis.position_mm() - exact;
        assert!(apart.abs() < 5e-7 + 3e-6 * exact, "tick {tick}: {apart} mm");
    }
}
