//! An encoder that dies in a jog, by speed and way of dying, also with counts of its own; and axes that are healthy, drawn by
//! the thousand, which are left alone. Prints the tables of `docs/safety.md`.

use quadrant_fault_bench::lone::{BEFORE, Lone, Order};
use quadrant_fault_bench::plant::{Death, Encoder, FLICKERS, MODEL, Plant, Presliding, Truth};
use quadrant_law::control::feedback::LawKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_law::safety::FaultCode;
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_settings::{AxisSettings, StageSettings};

use quadrant_test_support::Noise;

/// Jogs, mm/s.
const SPEEDS: [f64; 10] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 100.0, 250.0];

/// Way that is not planned until the outputs are off, mm, at most, at each of these speeds.
const STILL_MM: [f64; 10] = [25.0, 14.0, 7.0, 4.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0];
/// With some counts of noise, or a count astray now and then.
const FLICKERING_MM: [f64; 10] = [90.0, 50.0, 22.0, 12.0, 5.0, 4.0, 3.0, 3.0, 3.0, 3.0];
/// With twenty, with a count astray in every tick, or in bursts: at the slowest the following error is the bound.
const WILD_MM: [f64; 10] = [600.0, 600.0, 350.0, 60.0, 25.0, 12.0, 6.0, 4.0, 4.0, 3.0];

/// Bound from which on an encoder need not be found within the two seconds.
const UNSEEN_MM: f64 = 300.0;

/// The end of a jog whose encoder has died.
struct End {
    fault: Option<FaultCode>,
    /// Largest way off what a healthy axis does until the outputs are off, mm, at most in two seconds.
    unplanned_mm: f64,
    /// Time from the first 0.05 mm of it, ms.
    unplanned_ms: f64,
}

fn jog_with<S: Scalar>(speed_mm_s: f64, death: Death, seed: u64) -> End {
    let settings = StageSettings::simulated();
    let dies = match speed_mm_s {
        ..1.0 => 10_000 + (2000.0 / speed_mm_s) as u32,
        1.0..=100.0 => 6500,
        _ => 3000,
    };
    let lone = |death, dies| {
        let encoder = Encoder::new(death, seed);
        Lone::<S>::new(
            &settings,
            Order::Jog(speed_mm_s),
            Plant::new(&MODEL),
            encoder,
            dies,
        )
    };
    let (mut dead, mut healthy) = (lone(death, dies), lone(Death::Healthy, u32::MAX));
    let (mut since, mut unplanned_mm) = (None, 0.0f64);
    while dead.ticks < dies + 20_000 && dead.fault.is_none() {
        dead.tick();
        healthy.tick();
        if dead.ticks > dies {
            let off_mm = (dead.plant.position_mm - healthy.plant.position_mm).abs();
            unplanned_mm = unplanned_mm.max(off_mm);
            if off_mm > 0.05 && since.is_none() {
                since = Some(dead.ticks);
            }
        }
    }
    End {
        fault: dead.fault,
        unplanned_mm,
        unplanned_ms: since.map_or(0.0, |since| 0.1 * f64::from(dead.ticks - since)),
    }
}

fn every_speed<S: Scalar>(name: &str, seeds: u64) {
    let mut head = format!("| {name}: mm, ms unplanned |");
    for speed_mm_s in SPEEDS {
        head += &format!(" {speed_mm_s} mm/s |");
    }
    println!("{head}");
    let mut beyond = vec![];
    let still = [Death::Frozen, Death::OneLine, Death::Dithering];
    for death in still.into_iter().chain(FLICKERS) {
        let most_mm = match death {
            Death::Frozen | Death::OneLine | Death::Dithering => STILL_MM,
            Death::Flickering(..=5) | Death::NoisyLine(_) | Death::Walking(10..) => FLICKERING_MM,
            _ => WILD_MM,
        };
        let mut line = format!("| {death:?} |");
        for (speed_mm_s, most_mm) in SPEEDS.into_iter().zip(most_mm) {
            let worst = (1..=seeds)
                .map(|seed| jog_with::<S>(speed_mm_s, death, seed))
                .max_by(|a, b| a.unplanned_mm.total_cmp(&b.unplanned_mm))
                .expect("a seed");
            let by = match worst.fault {
                Some(FaultCode::EncoderImplausible) => "",
                Some(fault) => fault.name(),
                None => "not found",
            };
            line += &format!(
                " {:.1}, {:.0} {by} |",
                worst.unplanned_mm, worst.unplanned_ms
            );
            if worst.unplanned_mm > most_mm || (worst.fault.is_none() && most_mm < UNSEEN_MM) {
                beyond.push(format!(
                    "{name} {death:?} at {speed_mm_s} mm/s: {:.2} mm of {most_mm}, {:?}",
                    worst.unplanned_mm, worst.fault
                ));
            }
        }
        println!("{line}");
    }
    assert!(beyond.is_empty(), "{beyond:#?}");
}

#[test]
fn an_encoder_that_dies_in_a_jog_switches_off_within_the_way_that_is_stated_for_its_speed() {
    every_speed::<f32>("f32", 5);
    every_speed::<Fixed>("fixed point", 2);
}

/// Gives an axis another mass and dead time, and the gains of the same design for it: its crossover rises `faster`.
fn redesign(axis: &mut AxisSettings, mass: f64, delay: f64, faster: f64) {
    let plant = axis.plant.as_mut().expect("by default");
    plant.gain_mm_per_v_s2 /= mass;
    plant.damping_per_s /= mass;
    plant.delay_s *= delay;
    let pid = &mut axis.feedback.pid;
    pid.kp_v_per_mm *= mass * faster.powi(2);
    pid.ki_v_per_mm_s *= mass * faster.powi(3);
    pid.kd_v_s_per_mm *= mass * faster;
    axis.feedforward.preview_s *= delay;
    if (mass, delay) != (1.0, 1.0) {
        axis.feedback.nonlinear = None;
        axis.feedback.law = LawKind::Pid;
    }
}

/// A healthy axis in a motion, for 1.5 s, and what is drawn of it.
fn healthy(seed: u64) -> (Lone<f32>, f64, u32, String) {
    let mut noise = Noise::new(seed + 1);
    for _ in 0..8 {
        noise.bits();
    }
    let mut pick = |below: u64| ((noise.bits() >> 20) % below) as usize;
    let mut settings = StageSettings::simulated();
    let axis = &mut settings.axes[0];
    let mass = [1.0, 1.0, 2.15, 0.6][pick(4)];
    let (delay, faster) = [(1.0, 1.0), (1.0, 1.0), (0.25, 2.2), (0.5, 1.5)][pick(4)];
    redesign(axis, mass, delay, faster);
    let limit_v = [10.0, 10.0, 10.0, 0.2, 0.3, 0.4, 0.7, 1.0, 2.0][pick(9)];
    axis.amplifier.output_limit_v = limit_v;
    axis.feedback.integral_limit_v = axis.feedback.integral_limit_v.min(limit_v);
    axis.feedback.sliding_mode = None;
    // With 30 % more gain and 30 % more dead time the loop is not stable.
    let (gain, damping, delay) = [
        (1.0, 1.0, 1.0),
        (0.7, 0.7, 0.7),
        (0.7, 1.3, 1.3),
        (1.3, 0.7, 0.7),
        (1.15, 1.3, 1.0),
        (1.0, 1.3, 1.15),
    ][pick(6)];
    let truth = Truth {
        gain,
        damping,
        delay,
        friction: 0.5 + 0.9 * pick(1001) as f64 / 1000.0,
        reversed: false,
    };
    let presliding = [
        Presliding::Blocks,
        Presliding::Blocks,
        Presliding::Dahl { coulomb: true },
        Presliding::Dahl { coulomb: false },
        Presliding::Lugre,
    ][pick(5)];
    let speed_mm_s = SPEEDS[pick(10)] * [1.0, -1.0][pick(2)];
    let order = match pick(5) {
        0 => Order::Rest,
        1 | 2 => Order::Jog(speed_mm_s),
        3 => Order::Plan(MotionSettings::PointToPoint(PointToPointSettings {
            distance_mm: [0.02, 0.5, 5.0, 16.5, 100.0][pick(5)],
            max_velocity_mm_s: [80.0, 250.0][pick(2)],
            max_acceleration_mm_s2: [800.0, 2000.0][pick(2)],
            max_jerk_mm_s3: 1e5,
        })),
        _ => Order::Plan(MotionSettings::Harmonic(HarmonicSettings {
            cycles: None,
            ..HarmonicSettings::with_velocity(
                [0.05, 0.5, 5.0][pick(3)],
                [1.0, 10.0, 30.0][pick(3)],
                1.0,
                0.1,
            )
        })),
    };
    let mut encoder = Encoder::new(Death::Healthy, seed);
    encoder.rms = [0.0, 0.0, 0.3, 1.0, 3.0][pick(5)];
    let load_v = [0.0, 0.5, -0.5, 0.25, -0.25, 0.1][pick(6)];
    // A low output holds no such load.
    let load_v = if limit_v < 10.0 { 0.0 } else { load_v };
    let every = 1000 + pick(3000) as u32;
    let what = format!(
        "seed {seed}: mass x {mass}, {limit_v} V, {truth:?}, {presliding:?}, noise of {} counts, \
         {load_v} V every {every} ticks, {order:?}",
        encoder.rms
    );
    let plant = Plant::of(&settings.axes[0], &truth, presliding);
    let lone = Lone::new(&settings, order, plant, encoder, u32::MAX);
    (lone, load_v, every, what)
}

/// `QUADRANT_HEALTHY_AXES=20000 cargo test -p quadrant-law --test suite healthy_axes -- --nocapture`: as many as one likes.
#[test]
fn healthy_axes_of_every_kind_are_left_alone_at_every_output_limit() {
    let count = std::env::var("QUADRANT_HEALTHY_AXES").map_or(1500, |count| {
        count.parse().expect("QUADRANT_HEALTHY_AXES: a number")
    });
    let (mut found, mut others) = (vec![], 0);
    for seed in 0..count {
        let (mut axis, load_v, every, what) = healthy(seed);
        while axis.ticks < 15_000 && axis.fault.is_none() {
            let loaded = axis.ticks / every % 2 == 1;
            axis.plant.load_v = if loaded { load_v } else { 0.0 };
            axis.tick();
        }
        match axis.fault {
            Some(FaultCode::EncoderImplausible | FaultCode::EncoderSignalLoss) => {
                found.push(format!("{:?} in tick {}, {what}", axis.fault, axis.ticks));
            }
            // A low limit follows no fast reference.
            Some(_) => others += 1,
            None => {}
        }
    }
    println!(
        "{count} healthy axes, {} taken for dead, {others} other faults",
        found.len()
    );
    assert!(found.is_empty(), "{found:#?}");
}

/// The axis of the commissioning: 2.15 times the mass, 0.3 ms of dead time, friction of Dahl, in moves within its limits.
#[test]
fn an_axis_that_its_settings_describe_makes_every_move_within_its_limits() {
    let mut settings = StageSettings::simulated();
    redesign(&mut settings.axes[0], 2.15, 0.25, 2.2);
    for friction in [0.7, 1.0, 1.3, 1.4] {
        for distance_mm in [0.1, 1.0, 5.0, 16.0, 16.14, 30.0, 60.0] {
            for (max_velocity_mm_s, max_acceleration_mm_s2) in [(80.0, 800.0), (250.0, 2000.0)] {
                let order = Order::Plan(MotionSettings::PointToPoint(PointToPointSettings {
                    distance_mm,
                    max_velocity_mm_s,
                    max_acceleration_mm_s2,
                    max_jerk_mm_s3: 1e5,
                }));
                let truth = Truth { friction, ..MODEL };
                let presliding = Presliding::Dahl { coulomb: false };
                let plant = Plant::of(&settings.axes[0], &truth, presliding);
                let encoder = Encoder::new(Death::Healthy, 7);
                let mut axis = Lone::<f32>::new(&settings, order, plant, encoder, u32::MAX);
                while axis.ticks < BEFORE + 10_000 && axis.fault.is_none() {
                    axis.tick();
                }
                assert_eq!(axis.fault, None, "{distance_mm} mm, friction x {friction}");
                let end_mm = axis.plant.position_mm;
                assert!((end_mm - distance_mm).abs() < 0.02, "{end_mm} mm");
            }
        }
    }
}
