//! The load of a motor, I²t: against the time that the rating gives, worked out here.

use proptest::prelude::*;
use quadrant_law::command::Command;
use quadrant_law::safety::overload::{Overload, OverloadState};
use quadrant_law::safety::{FaultCode, SafetyState};
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_settings::StageSettings;

use quadrant_test_support::{Rig, repeatable, with_x};

const PERIOD_S: f64 = 1e-4;
/// Time between two looks, s.
const LOOK_S: f64 = 4e-4;

/// Time until the fault, s, at these words, one a look; `None` if it is never found.
fn found(overload: &Overload, words: impl IntoIterator<Item = i16>) -> Option<f64> {
    let mut state = OverloadState::default();
    let found = words
        .into_iter()
        .position(|word| !overload.step(&mut state, word))?;
    Some((found + 1) as f64 * LOOK_S)
}

#[test]
fn a_motor_withstands_the_largest_output_for_the_time_given_and_the_continuous_one_indefinitely() {
    let overload = Overload::new(8000.0, 32_000.0, 2.0, 0, PERIOD_S);
    let at = |word: i16| found(&overload, std::iter::repeat_n(word, 1_000_000));
    for word in [32_000, -32_000] {
        let s = at(word).expect("found");
        assert!((s - 2.0).abs() < 2.0 * LOOK_S, "{s} s");
    }
    // (32² - 8²) / (16² - 8²) times as long at half of it.
    let s = at(16_000).expect("found");
    assert!((s - 10.0).abs() < 2.0 * LOOK_S, "{s} s");
    assert_eq!((at(8000), at(-8000), at(0)), (None, None, None));
    assert!(at(9000).is_some());
}

#[test]
fn the_offset_of_the_amplifier_is_no_load() {
    let overload = Overload::new(8000.0, 32_000.0, 2.0, 300, PERIOD_S);
    let at = |word: i16| found(&overload, std::iter::repeat_n(word, 1_000_000));
    assert_eq!((at(8300), at(-7700)), (None, None));
    assert!(at(-8700).is_some());
}

#[test]
fn rest_pays_for_no_later_load_and_a_long_one_counts_no_more_than_the_budget() {
    let overload = Overload::new(8000.0, 32_000.0, 2.0, 0, PERIOD_S);
    let looks = |s: f64| (s / LOOK_S) as usize;
    // Ten minutes of rest: the motor is as cold as after one.
    let mut state = OverloadState::default();
    for _ in 0..looks(600.0) {
        assert!(overload.step(&mut state, 0));
    }
    let until: usize = (1..)
        .find(|_| !overload.step(&mut state, 32_000))
        .expect("found");
    assert!(until.abs_diff(looks(2.0)) <= 2, "{until} looks");
    // Ten times as long as it withstands: it cools from the budget. (32² - 8²) / 8² times 2 s at rest are enough for all of it.
    for _ in 0..looks(20.0) {
        overload.step(&mut state, 32_000);
    }
    let cooled: usize = (1..).find(|_| overload.step(&mut state, 0)).expect("cools");
    assert_eq!(cooled, 1);
    for _ in 0..looks(30.0) {
        overload.step(&mut state, 0);
    }
    let until: usize = (1..)
        .find(|_| !overload.step(&mut state, 32_000))
        .expect("found");
    assert!(until.abs_diff(looks(2.0)) <= 2, "{until} looks");
}

proptest! {
    #![proptest_config(repeatable(64))]

    #[test]
    fn a_duty_that_the_motor_withstands_is_never_found(
        continuous in 1000.0..30_000.0f64,
        peak in 1.05..4.0f64,
        burst_s in 0.01..1.0f64,
    ) {
        let peak = (continuous * peak).min(32_000.0);
        prop_assume!(peak > 1.02 * continuous);
        let overload = Overload::new(continuous, 32_500.0, 1.5, 0, PERIOD_S);
        // Bursts that use up nine tenths of the budget, each followed by what cools it all away.
        let beyond = peak * peak - continuous * continuous;
        let budget = (32_500.0f64.powi(2) - continuous * continuous) * 1.5;
        let on = (burst_s.min(0.9 * budget / beyond) / LOOK_S) as usize;
        let off = (on as f64 * beyond / (continuous * continuous) * 1.05) as usize + 2;
        let words = (0..40).flat_map(|_| {
            let on = std::iter::repeat_n(peak as i16, on);
            on.chain(std::iter::repeat_n(0, off))
        });
        prop_assert_eq!(found(&overload, words), None);
    }
}

/// An x axis that withstands 0.5 V indefinitely and 1 V for 50 ms.
fn settings() -> StageSettings {
    with_x(|x| {
        x.amplifier.output_limit_v = 1.0;
        x.amplifier.continuous_v = 0.5;
        x.amplifier.overload_s = 0.05;
        x.feedback.integral_limit_v = 1.0;
        x.limits.silent_s = 10.0;
    })
}

/// Holds the x axis away from its reference, so that it puts out its limit; returns the ticks to the fault.
fn hold_away<S: Scalar>(rig: &mut Rig<S>) -> u32 {
    for tick in 0..3000 {
        // Nine tenths of a millimetre, as fast as the encoder may go.
        rig.inputs.readings[0].count = (tick * 40).min(1800);
        rig.tick();
        if rig.state.safety().fault().is_some() {
            return tick;
        }
    }
    panic!("not found");
}

fn overloaded<S: Scalar>() -> (Rig<S>, u32) {
    let mut rig = Rig::<S>::new(&settings(), &Default::default());
    rig.tick();
    rig.command(Command::Enable);
    let ticks = hold_away(&mut rig);
    (rig, ticks)
}

#[test]
fn an_axis_that_pushes_too_long_brakes_and_says_so_whatever_it_computes_in() {
    let (rig, ticks) = overloaded::<f32>();
    let SafetyState::Stopping(fault) = rig.state.safety() else {
        panic!("{:?}", rig.state.safety());
    };
    assert_eq!(fault.code, FaultCode::Overload);
    // 500 ticks at the limit, of which every fourth is looked at, and at most the 45 in which the error grows.
    assert!((496..550).contains(&ticks), "{ticks}");
    let (fixed, at) = overloaded::<Fixed>();
    assert_eq!(at, ticks);
    assert_eq!(fixed.state.safety(), rig.state.safety());
}

#[test]
fn a_motor_stays_hot_when_the_outputs_are_switched_off_and_on() {
    let (mut rig, ticks) = overloaded::<f32>();
    for _ in 0..300 {
        rig.tick();
    }
    assert!(matches!(rig.state.safety(), SafetyState::Faulted(_)));
    rig.command(Command::ResetFault);
    rig.command(Command::Enable);
    let start = rig.inputs.readings[0].count;
    let mut again = 0;
    while rig.state.safety().is_enabled() {
        rig.inputs.readings[0].count = start + (again * 40).min(1800);
        rig.tick();
        again += 1;
        assert!(again < 3000);
    }
    assert!(again < ticks / 2, "{again} after {ticks}");
}

#[test]
fn by_default_no_load_is_watched() {
    let mut rig = Rig::<f32>::new(
        &with_x(|x| {
            x.amplifier.output_limit_v = 1.0;
            x.feedback.integral_limit_v = 1.0;
            x.limits.silent_s = 10.0;
        }),
        &Default::default(),
    );
    rig.tick();
    rig.command(Command::Enable);
    for tick in 0..20_000u32 {
        rig.inputs.readings[0].count = (tick * 40).min(1800);
        rig.tick();
    }
    assert!(rig.state.safety().is_enabled());
}
