//! Loads and changed axes do what their equations say.

use quadrant_law::units::DacCode;
use quadrant_sim::plant::cutting::{Component, Milling};
use quadrant_sim::plant::load::{ENTRY_S, Force, Load};
use quadrant_sim::plant::{AxisParameters, SimulatedAxis, StageParameters};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

const RATE_HZ: f64 = 10e3;
const COMPONENTS: [Component; 2] = [Component::Feed, Component::Normal];

fn code(volts: f64) -> DacCode {
    DacCode::from_volts(volts, 10.0)
}

fn ideal() -> AxisParameters {
    StageParameters::ideal().axes[0].clone()
}

/// The force over one turn of the spindle, at `count` times in the middle of equal intervals.
fn turn(cut: &Milling, component: Component, count: usize) -> Vec<f64> {
    let turn_s = 60.0 / cut.spindle_rpm;
    (0..count)
        .map(|k| cut.force_n(component, (k as f64 + 0.5) / count as f64 * turn_s))
        .collect()
}

/// Amplitude of the `order`th harmonic of a turn.
fn harmonic(force: &[f64], order: usize) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (k, value) in force.iter().enumerate() {
        let (sin, cos) = (TAU * (order * k) as f64 / force.len() as f64).sin_cos();
        re += value * cos;
        im += value * sin;
    }
    2.0 * re.hypot(im) / force.len() as f64
}

#[test]
fn the_mean_of_the_cutting_force_is_the_published_integral() {
    let slot = Milling::slot();
    let half = Milling {
        engagement_rad: (0.0, FRAC_PI_2),
        teeth: 3,
        ..slot
    };
    for cut in [slot, half] {
        for component in COMPONENTS {
            let force = turn(&cut, component, 60_000);
            let mean = force.iter().sum::<f64>() / force.len() as f64;
            let expected = cut.mean_force_n(component);
            assert!(
                (mean - expected).abs() < 2e-3 * expected.abs().max(1.0),
                "{component:?}: {mean}, {expected}"
            );
        }
    }
    // A slot's mean force across the feed: N a c Ktc / 4 + N a Kte / pi.
    let expected = 2.0 * 2.0 * (0.05 * 800.0 / 4.0 + 15.0 / PI);
    assert!((slot.mean_force_n(Component::Normal) / expected - 1.0).abs() < 1e-12);
}

#[test]
fn without_runout_the_force_repeats_with_the_teeth_and_with_it_with_the_spindle() {
    let even = Milling {
        runout: 0.0,
        ..Milling::slot()
    };
    assert_eq!(even.tooth_passing_hz(), 100.0);
    for component in COMPONENTS {
        let force = turn(&even, component, 6000);
        assert!(harmonic(&force, 1) < 1e-9 * harmonic(&force, 2));
        assert!(harmonic(&force, 2) > 10.0);
        let uneven = turn(&Milling::slot(), component, 6000);
        assert!(harmonic(&uneven, 1) > 0.01 * harmonic(&uneven, 2));
    }
}

#[test]
fn the_tool_enters_and_leaves_the_material_when_it_should() {
    let load = Load::Milling {
        cut: Milling::slot(),
        component: Component::Normal,
        engaged_s: (1.0, 3.0),
        newtons_per_volt: 100.0,
    };
    let largest = |from: f64, to: f64| {
        (0..1000)
            .map(|k| load.at_v(from + (to - from) * f64::from(k) / 1000.0).abs())
            .fold(0.0, f64::max)
    };
    assert_eq!(largest(0.0, 1.0), 0.0);
    assert_eq!(largest(3.0 + 1e-9, 5.0), 0.0);
    let full = largest(1.0 + ENTRY_S, 3.0 - ENTRY_S);
    let force = turn(&Milling::slot(), Component::Normal, 6000);
    let peak = force.into_iter().fold(0.0, f64::max) / 100.0;
    assert!((full / peak - 1.0).abs() < 0.01);
    assert!(largest(1.0, 1.0 + 0.5 * ENTRY_S) < 0.55 * full);
}

#[test]
fn a_recorded_force_is_met_at_its_samples_and_repeats() {
    let force = Force {
        sample_time_s: 2e-4,
        force_n: vec![10.0, 30.0, -5.0],
    };
    let load = Load::Recorded {
        force: Arc::new(force),
        newtons_per_volt: 10.0,
    };
    for (time_s, volts) in [
        (0.0, 1.0),
        (1e-4, 2.0),
        (2e-4, 3.0),
        (4e-4, -0.5),
        (5e-4, 0.25),
        (8e-4, 3.0),
    ] {
        assert!((load.at_v(time_s) - volts).abs() < 1e-9, "{time_s}");
    }
}

#[test]
fn a_heavier_axis_accelerates_less_in_proportion() {
    let moved = |ratio: f64| {
        let mut truth = ideal().with_mass(ratio);
        for model in [&mut truth.friction.positive, &mut truth.friction.negative] {
            model.curve.coulomb_v = 1e-9;
            model.curve.breakaway_v = 1e-9;
            model.viscous_v_s_per_mm = 0.0;
        }
        truth.damping_per_s = 0.0;
        truth.delay_s = 0.0;
        let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
        for _ in 0..200 {
            axis.step(code(2.0), true);
        }
        axis.velocity_mm_s()
    };
    for ratio in [0.7, 1.3] {
        assert!((moved(1.0) / moved(ratio) / ratio - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_heavier_axis_slides_no_slower_at_a_constant_voltage() {
    let settled = |truth: AxisParameters| {
        let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
        for _ in 0..20_000 {
            axis.step(code(0.5), true);
        }
        axis.velocity_mm_s()
    };
    let nominal = settled(ideal());
    assert!((settled(ideal().with_mass(1.3)) / nominal - 1.0).abs() < 1e-3);
    assert!(settled(ideal().with_friction(1.5)) < 0.85 * nominal);
}

#[test]
fn grown_friction_holds_against_as_much_more_load() {
    for factor in [0.7, 1.0, 1.5] {
        let held = |load_v: f64| {
            let mut axis = SimulatedAxis::new(ideal().with_friction(factor), RATE_HZ, 1);
            // Slowly: a sudden load swings past what it holds at.
            for tick in 0..30_000 {
                axis.set_load_v(load_v * (f64::from(tick) / 20_000.0).min(1.0));
                axis.step(DacCode::ZERO, false);
            }
            axis.velocity_mm_s().abs() < 1e-3 && axis.position_mm() < 0.030
        };
        let breakaway = factor * ideal().friction.positive.curve.breakaway_v;
        assert!(held(0.97 * breakaway), "{factor}");
        assert!(!held(1.03 * breakaway), "{factor}");
    }
}

#[test]
fn more_delay_holds_the_first_motion_back_by_as_much() {
    let first = |truth: AxisParameters| {
        let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
        (0..100).find(|_| {
            axis.step(code(5.0), true);
            axis.position_mm() > 0.0
        })
    };
    let nominal = first(ideal()).unwrap();
    assert_eq!(first(ideal().with_more_delay(1e-4)).unwrap(), nominal + 1);
}

#[test]
fn the_interpolation_error_repeats_with_the_grating_and_never_exceeds_its_amplitude() {
    let truth = ideal().with_imperfection(|it| {
        it.interpolation_mm = 3e-4;
        it.grating_mm = 0.020;
    });
    let error = |x: f64| truth.imperfections.interpolation_error_mm(x);
    assert!((error(0.005) - 3e-4).abs() < 1e-12);
    assert!((error(0.005) - error(0.025)).abs() < 1e-12);
    assert_eq!(error(0.0), 0.0);
    // The counter shows it.
    let fine = AxisParameters {
        resolution_mm: 1e-6,
        ..truth.clone()
    };
    let mut axis = SimulatedAxis::new(fine, RATE_HZ, 1);
    axis.set_load_v(0.05);
    for _ in 0..5000 {
        axis.step(DacCode::ZERO, false);
    }
    let seen = f64::from(axis.read_counter().cast_signed()) * 1e-6;
    let at = axis.position_mm();
    assert!(at > 1e-3);
    assert!((seen - at - error(at)).abs() < 2e-6);
}

#[test]
fn friction_along_the_travel_is_its_mean_where_it_should_be() {
    let truth = ideal().with_imperfection(|it| {
        it.friction_variation = 0.2;
        it.friction_period_mm = 40.0;
        it.friction_from_mm = 5.0;
    });
    let mut axis = SimulatedAxis::new(truth.clone(), RATE_HZ, 1);
    let (mut highest, mut highest_at_mm) = (0.0_f64, 0.0);
    let mut lowest = f64::INFINITY;
    while axis.position_mm() < 80.0 {
        axis.step(code(0.3), true);
        if axis.position_mm() > 40.0 {
            let viscous = truth.friction.positive.viscous_v_s_per_mm * axis.velocity_mm_s();
            let level = axis.friction_v() - viscous;
            if level > highest {
                (highest, highest_at_mm) = (level, axis.position_mm());
            }
            lowest = lowest.min(level);
        }
    }
    assert!((highest_at_mm - 55.0_f64).abs() < 0.5, "{highest_at_mm}");
    let coulomb = truth.friction.positive.curve.coulomb_v;
    assert!((highest / coulomb - 1.2).abs() < 0.01, "{highest}");
    assert!((lowest / coulomb - 0.8).abs() < 0.01, "{lowest}");
}

#[test]
fn an_amplifier_of_wrong_gain_is_a_wrong_voltage() {
    let moved = |error: f64, volts: f64| {
        let truth = ideal().with_imperfection(|it| it.amplifier_gain_error = error);
        let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
        for _ in 0..1000 {
            axis.step(code(volts), true);
        }
        axis.position_mm()
    };
    assert!((moved(0.1, 1.0) / moved(0.0, 1.1) - 1.0).abs() < 1e-3);
}
