//! An encoder of a wrong scale, or that drifts, without an index: what seconds of motion and rest show of it. Prints the table
//! of `docs/safety.md`.

use nalgebra::{Matrix4, Vector4};
use quadrant_fault_bench::lone::{BEFORE, Lone, Order};
use quadrant_fault_bench::plant::{
    COUNT_MM, Death, Encoder, MODEL, PERIOD_S, Plant, Presliding, Truth,
};
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::safety::FaultCode;
use quadrant_settings::StageSettings;

/// Ticks from enabling until the sine has reached its amplitude.
const RISE_TICKS: u32 = 5000;
/// Ticks that are examined.
const WINDOW_TICKS: u32 = 40_000;

/// A sine of 2 mm.
fn sine(velocity_mm_s: f64) -> Order {
    Order::Plan(MotionSettings::Harmonic(HarmonicSettings {
        cycles: None,
        ..HarmonicSettings::with_velocity(2.0, velocity_mm_s, 1.0, 0.1)
    }))
}

fn healthy() -> Encoder {
    Encoder::new(Death::Healthy, 7)
}

fn scaled(scale: f64) -> Encoder {
    let mut encoder = healthy();
    encoder.scale = scale;
    encoder
}

/// The x axis of the preset with another encoder and another truth, its springs `stiffer`.
fn axis(order: Order, truth: Truth, stiffer: f64, encoder: Encoder) -> Lone<f32> {
    let settings = StageSettings::simulated();
    let mut x = settings.axes[0].clone();
    for element in &mut x.friction.gms.elements {
        element.stiffness_v_per_mm *= stiffer;
    }
    let plant = Plant::of(&x, &truth, Presliding::Blocks);
    Lone::new(&settings, order, plant, encoder, u32::MAX)
}

#[test]
fn an_encoder_of_another_scale_shows_what_an_axis_of_another_mass_shows_bit_for_bit() {
    for scale in [0.5, 2.0] {
        // Mass and drag in the inverse ratio, and springs that yield in as much more way.
        let lighter = Truth {
            gain: scale,
            ..MODEL
        };
        let mut wrong = axis(sine(60.0), MODEL, 1.0, scaled(scale));
        let mut right = axis(sine(60.0), lighter, 1.0 / scale, healthy());
        for _ in 0..BEFORE + RISE_TICKS + WINDOW_TICKS {
            wrong.tick();
            right.tick();
            assert_eq!(wrong.output_v, right.output_v, "{scale}: {}", wrong.ticks);
        }
        let (wrong, right) = (&wrong.plant, &right.plant);
        assert_eq!(scale * wrong.position_mm, right.position_mm);
        assert_ne!(right.velocity_mm_s, 0.0);
    }
}

/// The parameters of a motion's fit, each over the settings' value, but for the load.
#[derive(Debug)]
struct Fit {
    /// A, B and the level of friction while sliding.
    gain: f64,
    damping: f64,
    friction: f64,
    /// V.
    load_v: f64,
}

/// A fit of `u = a / A + v B / A + F sign(v) + L` to seconds of a sine, to what the law knows: its output and the counts.
fn fit(mut axis: Lone<f32>) -> Result<Fit, FaultCode> {
    let settings = StageSettings::simulated();
    let x = &settings.axes[0];
    let plant = x.plant.expect("by default");
    // Differences over 4 ms, and the output by the dead time before.
    const SPAN: usize = 20;
    let lag = (plant.delay_s / PERIOD_S).round() as usize;
    for _ in 0..BEFORE + RISE_TICKS {
        axis.tick();
    }
    let (mut outputs, mut positions) = (vec![], vec![]);
    for _ in 0..WINDOW_TICKS {
        axis.tick();
        positions.push(axis.shown_mm);
        outputs.push(axis.output_v);
    }
    if let Some(fault) = axis.fault {
        return Err(fault);
    }
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    let dt = SPAN as f64 * PERIOD_S;
    for tick in SPAN + lag..positions.len() - SPAN {
        let (before, now, after) = (
            positions[tick - SPAN],
            positions[tick],
            positions[tick + SPAN],
        );
        let velocity = (after - before) / (2.0 * dt);
        if velocity.abs() < 30.0 {
            // Friction has not grown to its level yet.
            continue;
        }
        let acceleration = (after - 2.0 * now + before) / (dt * dt);
        let row = Vector4::new(acceleration, velocity, velocity.signum(), 1.0);
        normal += row * row.transpose();
        // Weighted as the second difference weighs the acceleration.
        let output: f64 = (1..2 * SPAN)
            .map(|k| (SPAN - SPAN.abs_diff(k)) as f64 * outputs[tick + k - SPAN - lag])
            .sum();
        right += row * (output / (SPAN * SPAN) as f64);
    }
    let found = normal.lu().solve(&right).expect("a sine separates them");
    Ok(Fit {
        gain: 1.0 / found[0] / plant.gain_mm_per_v_s2,
        damping: found[1] / found[0] / plant.damping_per_s,
        friction: found[2] / x.friction.sliding.positive.curve.breakaway_v,
        load_v: found[3],
    })
}

#[test]
fn seconds_of_motion_show_a_scale_only_as_another_mass() {
    let truth = |gain: f64, damping: f64, friction: f64| Truth {
        gain,
        damping,
        friction,
        ..MODEL
    };
    let drifting = |mm_s: f64| {
        let mut encoder = healthy();
        encoder.drift = mm_s * PERIOD_S / COUNT_MM;
        encoder
    };
    let rows = [
        ("as the settings", MODEL, healthy()),
        ("counts x 0.5", MODEL, scaled(0.5)),
        ("counts x 0.8", MODEL, scaled(0.8)),
        ("counts x 1.25", MODEL, scaled(1.25)),
        ("counts x 2", MODEL, scaled(2.0)),
        ("counts drift by 0.1 mm/s", MODEL, drifting(0.1)),
        ("counts drift by 1 mm/s", MODEL, drifting(1.0)),
        ("amplifier x 0.5", truth(0.5, 1.0, 2.0), healthy()),
        ("amplifier x 2", truth(2.0, 1.0, 0.5), healthy()),
        ("healthy, mass x 2", truth(0.5, 0.5, 1.0), healthy()),
        (
            "healthy, mass and drag x 2",
            truth(0.5, 1.0, 1.0),
            healthy(),
        ),
        ("healthy, mass x 0.6", truth(1.67, 1.67, 1.0), healthy()),
        ("healthy, drag x 0.5", truth(1.0, 0.5, 1.0), healthy()),
        ("healthy, friction x 1.4", truth(1.0, 1.0, 1.4), healthy()),
    ];
    println!("| the axis | A | B | friction | load, mV |\n|---|---|---|---|---|");
    let mut gains = vec![];
    for (name, truth, encoder) in rows {
        match fit(axis(sine(60.0), truth, 1.0, encoder)) {
            Ok(found) => {
                println!(
                    "| {name} | {:.2} | {:.2} | {:.2} | {:.1} |",
                    found.gain,
                    found.damping,
                    found.friction,
                    1e3 * found.load_v
                );
                gains.push(found.gain);
            }
            Err(fault) => println!("| {name} | fault: {} | | | |", fault.name()),
        }
    }
    // The scale is A's, and so is the mass.
    for (gain, scale) in gains.iter().zip([1.0, 0.5, 0.8, 1.25, 2.0]) {
        assert!((gain / scale - 1.0).abs() < 0.05, "{scale}: {gain}");
    }
}

/// Amplitude that an axis at rest shows under a sine of 10 Hz added to its load, counts: whether it would show a dead encoder.
fn counts_at_rest(probe_v: f64) -> f64 {
    let mut axis = axis(Order::Rest, MODEL, 1.0, healthy());
    let (mut across, mut along) = (0.0, 0.0);
    for _ in 0..BEFORE + RISE_TICKS + WINDOW_TICKS {
        let turns = 10.0 * f64::from(axis.ticks) * PERIOD_S;
        let (sine, cosine) = (core::f64::consts::TAU * turns).sin_cos();
        axis.plant.load_v = probe_v * sine;
        axis.tick();
        if axis.ticks > BEFORE + RISE_TICKS {
            let share = axis.plant.position_mm / COUNT_MM * 2.0 / f64::from(WINDOW_TICKS);
            (across, along) = (across + share * sine, along + share * cosine);
        }
    }
    across.hypot(along)
}

#[test]
fn a_probe_that_would_show_a_dead_encoder_moves_a_healthy_axis_at_rest_by_counts() {
    println!("| probe, V | counts |\n|---|---|");
    for probe_v in [0.0, 0.005, 0.02, 0.05] {
        println!("| {probe_v} | {:.1} |", counts_at_rest(probe_v));
    }
    assert!(counts_at_rest(0.02) > 1.0);
}
