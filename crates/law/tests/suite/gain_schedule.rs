//! Gain scheduling: at any speed the PID of that speed.

use proptest::prelude::*;
use quadrant_law::control::pid::{Pid, PidGains};
use quadrant_law::control::schedule::{GainSchedule, SchedulePoint, ScheduledPid};
use quadrant_law::control::terms::FeedbackInput;
use quadrant_law::control::terms::FeedbackState;
use quadrant_settings::presets::x_axis;

use quadrant_test_support::repeatable;

const PERIOD_S: f64 = 1e-4;

fn pid() -> PidGains {
    PidGains {
        ki_v_per_mm_s: 10.0,
        ..x_axis().feedback.pid
    }
}

fn schedule() -> GainSchedule {
    [
        (0.0, [2.0, 5.0, 1.5]),
        (1.0, [1.5, 3.0, 1.2]),
        (6.0, [1.0, 0.5, 1.0]),
    ]
    .into_iter()
    .map(
        |(speed_mm_s, [proportional, integral, derivative])| SchedulePoint {
            speed_mm_s,
            proportional,
            integral,
            derivative,
        },
    )
    .collect()
}

/// The shares by the definition.
fn shares(speed: f64) -> SchedulePoint {
    let points = schedule();
    let last = points[points.len() - 1];
    let Some(index) = points.iter().position(|point| speed < point.speed_mm_s) else {
        return last;
    };
    let (from, to) = (points[index - 1], points[index]);
    let place = (speed - from.speed_mm_s) / (to.speed_mm_s - from.speed_mm_s);
    let between = |a: f64, b: f64| a + place * (b - a);
    SchedulePoint {
        speed_mm_s: speed,
        proportional: between(from.proportional, to.proportional),
        integral: between(from.integral, to.integral),
        derivative: between(from.derivative, to.derivative),
    }
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn at_constant_speed_it_is_the_pid_of_that_speed(
        speed in 0.0f64..12.0,
        backwards in any::<bool>(),
        errors in prop::collection::vec(-0.05f64..0.05, 50),
    ) {
        let scheduled = ScheduledPid::<f64>::build(&pid(), &schedule(), 2.0, PERIOD_S);
        let frozen = Pid::<f64>::build(&shares(speed).gains(&pid()), 2.0, PERIOD_S);
        let velocity = if backwards { -speed } else { speed };
        let mut states = (FeedbackState::default(), FeedbackState::default());
        for error in errors {
            let ours = scheduled.step(&mut states.0, FeedbackInput { error, velocity }, 0.0, 10.0);
            let its = frozen.step(&mut states.1, error, 0.0, 10.0);
            prop_assert!((ours.output - its.output).abs() < 1e-12, "{ours:?} {its:?}");
        }
    }
}

#[test]
fn the_integral_stays_when_the_speed_changes() {
    let scheduled = ScheduledPid::<f64>::build(&pid(), &schedule(), 2.0, PERIOD_S);
    let mut state = FeedbackState::default();
    for _ in 0..1000 {
        let slow = FeedbackInput {
            error: 0.02,
            velocity: 0.0,
        };
        scheduled.step(&mut state, slow, 0.0, 10.0);
    }
    let input = |velocity| FeedbackInput {
        error: 0.0,
        velocity,
    };
    let before = scheduled.step(&mut state, input(0.0), 0.0, 10.0).integral;
    let after = scheduled.step(&mut state, input(9.0), 0.0, 10.0).integral;
    assert!(before > 0.05, "{before}");
    assert_eq!(before, after);
}
