//! The drives do what their equations say.

use quadrant_law::units::DacCode;
use quadrant_sim::plant::{
    AxisParameters, Backlash, Body, Drive, EncoderSide, Forcing, SimulatedAxis, StageParameters,
};

const RATE_HZ: f64 = 10e3;

fn code(volts: f64) -> DacCode {
    DacCode::from_volts(volts, 10.0)
}

fn ideal() -> AxisParameters {
    StageParameters::ideal().axes[0].clone()
}

#[test]
fn cogging_holds_an_unpowered_table_at_a_pole_and_does_no_net_work() {
    let truth = ideal().direct_drive(0.020);
    let Drive::Direct(cogging) = truth.drive else {
        panic!("not a linear motor: {:?}", truth.drive);
    };
    let count = 10_000;
    let step = cogging.pole_pitch_mm / f64::from(count);
    let work: f64 = (0..count)
        .map(|k| cogging.force_v(f64::from(k) * step) * step)
        .sum();
    assert!(work.abs() < 1e-12);
    assert!(cogging.force_v(0.1) < 0.0 && cogging.force_v(-0.1) > 0.0);
    // Pushed with less than cogging and friction hold, it stays within half a pole.
    let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
    axis.set_load_v(0.035);
    for _ in 0..50_000 {
        axis.step(DacCode::ZERO, false);
    }
    assert!(
        axis.position_mm() < 0.5 * cogging.pole_pitch_mm,
        "{}",
        axis.position_mm()
    );
}

/// Equal masses of 1/1000 V s^2/mm without damping, and a gap of 0.02 mm.
fn gap() -> (Backlash, [Forcing; 2]) {
    let mass = Forcing {
        gain_mm_per_v_s2: 1000.0,
        ..Forcing::default()
    };
    (Backlash::chosen(0.02, 500.0, EncoderSide::Load), [mass; 2])
}

#[test]
fn the_gap_never_gives_energy() {
    let (gap, forcings) = gap();
    for damping in [0.0, 1.0] {
        let gap = Backlash {
            damping_v_s_per_mm: damping * gap.damping_v_s_per_mm,
            ..gap
        };
        for (start, velocity) in [(0.0, 5.0), (0.004, -20.0), (-0.0093, 0.3), (0.011, 0.0)] {
            for step_s in [25e-6, 100e-6] {
                let mut bodies = [
                    Body {
                        position_mm: start,
                        velocity_mm_s: velocity,
                    },
                    Body::default(),
                ];
                let first = gap.energy_v_mm(bodies, &forcings);
                let mut energy = first;
                for _ in 0..40_000 {
                    bodies = gap.step(bodies, &forcings, step_s);
                    let now = gap.energy_v_mm(bodies, &forcings);
                    assert!(now <= energy * (1.0 + 1e-11), "{energy} became {now}");
                    energy = now;
                }
                if damping > 0.0 && first > 0.0 {
                    // Impacts have taken the relative motion; that of both masses together stays.
                    let common = 0.25 * velocity * velocity / 1000.0;
                    assert!(
                        energy < common + 0.1 * (first - common),
                        "{energy} of {first}"
                    );
                }
                let momentum = bodies[0].velocity_mm_s + bodies[1].velocity_mm_s;
                assert!((momentum - velocity).abs() < 1e-9 * velocity.abs().max(1.0));
            }
        }
    }
}

#[test]
fn nothing_passes_through_the_gap() {
    let (gap, forcings) = gap();
    let driven = [
        Forcing {
            acceleration_mm_s2: 10.0,
            ..forcings[0]
        },
        forcings[1],
    ];
    let mut bodies = [Body::default(); 2];
    while bodies[0].position_mm < 0.0099 {
        bodies = gap.step(bodies, &driven, 25e-6);
        assert_eq!(bodies[1], Body::default());
    }
}

/// The rack under a voltage that slowly swings to and fro, past breakaway: by how much the motor leads the table on its way
/// up and on its way down.
fn leads(width_mm: f64) -> [f64; 2] {
    let truth = ideal().rack_and_pinion(width_mm, EncoderSide::Load);
    let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
    let mut leads = [0.0; 2];
    for tick in 0..40_000 {
        let up = tick < 20_000;
        axis.step(code(if up { 0.2 } else { -0.2 }), true);
        if tick % 20_000 == 19_999 {
            leads[usize::from(!up)] = axis.motor_position_mm() - axis.position_mm();
        }
    }
    leads
}

#[test]
fn a_slow_reversal_shows_the_backlash_and_the_wind_up_of_the_teeth() {
    let wind_up = {
        let [up, down] = leads(0.0);
        up - down
    };
    assert!(wind_up > 0.0);
    for width_mm in [0.005, 0.020, 0.050] {
        let [up, down] = leads(width_mm);
        assert!(
            (up - down - wind_up - width_mm).abs() < 1e-6,
            "{}",
            up - down
        );
    }
}

#[test]
fn an_encoder_on_the_motor_does_not_see_the_table() {
    for (encoder, sees_motor) in [(EncoderSide::Motor, true), (EncoderSide::Load, false)] {
        let mut axis = SimulatedAxis::new(ideal().rack_and_pinion(0.05, encoder), RATE_HZ, 1);
        for _ in 0..2000 {
            axis.step(code(0.2), true);
        }
        let seen = f64::from(axis.read_counter().cast_signed()) * 5e-4;
        let expected = if sees_motor {
            axis.motor_position_mm()
        } else {
            axis.position_mm()
        };
        assert!((seen - expected).abs() < 5e-4);
        assert!(axis.motor_position_mm() - axis.position_mm() > 0.02);
    }
}

#[test]
fn without_a_gap_a_geared_axis_slides_as_a_rigid_one() {
    let run = |truth: AxisParameters| {
        let mut axis = SimulatedAxis::new(truth, RATE_HZ, 1);
        for _ in 0..10_000 {
            axis.step(code(0.5), true);
        }
        axis.velocity_mm_s()
    };
    let rigid = run(ideal());
    let geared = run(ideal().rack_and_pinion(0.0, EncoderSide::Load));
    assert!((geared / rigid - 1.0).abs() < 1e-3, "{geared}, {rigid}");
}
