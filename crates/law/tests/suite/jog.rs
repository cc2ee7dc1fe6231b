//! Jogging: at the velocity asked for, within acceleration and jerk, and never past the end of the travel.

use proptest::prelude::*;
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::motion::MotionMode;
use quadrant_law::reference::{JogState, MotionScale, Ramp, RampState, Velocity};
use quadrant_law::units::Position;
use quadrant_settings::{PlanSettings, StageSettings, TravelSettings};

use quadrant_test_support::{Rig, repeatable, with_x};

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};

fn mm(value: f64) -> Position {
    Position::from_mm(value, SCALE.resolution_mm)
}

fn velocity(value_mm_s: f64) -> Velocity {
    Velocity::from_mm_s(value_mm_s, SCALE)
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn no_sequence_of_jogs_leaves_the_travel(
        acceleration in 2.0f64..4.4,
        jerk in 0.5f64..3.5,
        jogs in prop::collection::vec((-200.0f64..200.0, 1u32..3000), 1..8),
        half_span_mm in 0.01f64..10.0,
    ) {
        let acceleration = 10f64.powf(acceleration);
        let ramp = Ramp::<f64>::new(acceleration, acceleration * 10f64.powf(jerk), SCALE);
        let span = Some((mm(-half_span_mm), mm(half_span_mm)));
        let mut state = RampState::at_rest(Position::ZERO);
        for (target, ticks) in jogs {
            let mut jog = JogState::new(velocity(target));
            for _ in 0..ticks {
                let sample = jog.step(&ramp, &mut state, span);
                prop_assert!(
                    sample.position >= mm(-half_span_mm) && sample.position <= mm(half_span_mm),
                    "{} of {half_span_mm}", sample.position.to_mm(SCALE.resolution_mm)
                );
            }
        }
    }

    #[test]
    fn a_jog_uses_the_travel_up_to_a_small_rest(
        speed in 1.0f64..200.0,
        forward in any::<bool>(),
    ) {
        let ramp = Ramp::<f64>::new(2000.0, 1e5, SCALE);
        let mut state = RampState::at_rest(Position::ZERO);
        let target = velocity(if forward { speed } else { -speed });
        let mut jog = JogState::new(target);
        let span = Some((mm(-50.0), mm(50.0)));
        while !jog.finished(&state) {
            jog.step(&ramp, &mut state, span);
        }
        let rest = 50.0 - state.position().to_mm(SCALE.resolution_mm).abs();
        // A slow stop does not reach full braking, and its bound is loose: by less than half of a / j, 10 ms; and a few ticks.
        prop_assert!((0.0..speed * 0.0105).contains(&rest), "{rest} at {speed}");
    }
}

#[test]
fn an_axis_beyond_its_travel_jogs_back_only() {
    let ramp = Ramp::<f64>::new(2000.0, 1e5, SCALE);
    let span = Some((mm(-1.0), mm(1.0)));
    let mut state = RampState::at_rest(mm(3.0));
    let mut outward = JogState::new(velocity(5.0));
    for _ in 0..100 {
        outward.step(&ramp, &mut state, span);
    }
    assert_eq!(state.position(), mm(3.0));
    assert!(outward.finished(&state));
    let mut back = JogState::new(velocity(-5.0));
    for _ in 0..6_000 {
        back.step(&ramp, &mut state, span);
    }
    assert!(state.position() < mm(1.0));
}

fn travel(settings: &mut quadrant_settings::AxisSettings) {
    settings.limits.travel_mm = Some(TravelSettings {
        negative: -2.0,
        positive: 2.0,
    });
    if let Some(homing) = &mut settings.homing {
        homing.park_mm = 0.0;
    }
}

/// A rig whose axes follow their references to the count.
fn follow(rig: &mut Rig<f32>, ticks: u32) {
    for _ in 0..ticks {
        for index in 0..3 {
            let reference = rig.state.axes()[index].telemetry().reference;
            rig.inputs.readings[index].count = (reference.0 >> 16) as u32;
        }
        rig.tick();
    }
}

fn enabled(settings: &StageSettings) -> Rig<f32> {
    let mut rig = Rig::new(settings, &PlanSettings::default());
    rig.tick();
    rig.command(Command::Enable);
    rig
}

#[test]
fn the_travel_holds_a_jog_once_the_axis_is_homed_and_not_before() {
    for homed in [false, true] {
        let mut rig = enabled(&with_x(travel));
        rig.state.set_homed(AxisName::X, homed);
        rig.command(Command::Jog(AxisName::X, velocity(20.0)));
        follow(&mut rig, 5_000);
        let at = rig.state.axes()[0].reference().to_mm(5e-4);
        assert!(rig.state.safety().is_enabled(), "{:?}", rig.state.safety());
        if homed {
            assert!((1.7..2.0).contains(&at), "{at}");
            assert_eq!(rig.state.axes()[0].mode(), MotionMode::Hold);
        } else {
            assert!(at > 9.0, "{at}");
        }
    }
}

#[test]
fn a_jog_is_held_to_the_largest_velocity_and_follows_changes() {
    let mut rig = enabled(&StageSettings::simulated());
    rig.command(Command::Jog(AxisName::Y, velocity(1e6)));
    follow(&mut rig, 3_000);
    let before = rig.state.axes()[1].reference();
    follow(&mut rig, 1);
    let per_tick = (rig.state.axes()[1].reference() - before).to_mm(5e-4);
    let largest = StageSettings::simulated().axes[1].limits.max_velocity_mm_s;
    assert!(
        (per_tick * 1e4 - largest).abs() < 1e-3 * largest,
        "{per_tick}"
    );
    assert_eq!(rig.state.axes()[0].mode(), MotionMode::Hold);
    rig.command(Command::Jog(AxisName::Y, Velocity::ZERO));
    follow(&mut rig, 3_000);
    assert_eq!(rig.state.axes()[1].mode(), MotionMode::Hold);
    assert!(rig.state.safety().is_enabled());
}
