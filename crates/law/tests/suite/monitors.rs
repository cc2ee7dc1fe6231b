//! The monitors of an axis at their very limits.

use quadrant_law::admission::{Refusal, refusal};
use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::safety::FaultCode;
use quadrant_law::safety::monitor::{Following, FollowingState, SignalLoss, SignalLossState};
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::{Noise, Rig, with_x};

/// Ticks until an encoder whose counts move like this is found silent, at an output of 2 V; at most 1000.
fn silent(steps: impl Fn(u32) -> i32) -> Option<u32> {
    let monitor = SignalLoss::<f32>::new(1.0, 100);
    let mut state = SignalLossState::default();
    (0..1000).find(|&tick| !monitor.step(&mut state, steps(tick), 2.0))
}

#[test]
fn counts_that_come_and_go_are_silence_and_64_one_way_are_motion() {
    // Back and forth, from where it stood and to either side.
    let dither = |counts: i32| {
        move |tick: u32| {
            if tick.is_multiple_of(2) {
                counts
            } else {
                -counts
            }
        }
    };
    for counts in [0, 1, -1, 2, -2, 5, -20, 63, -63] {
        assert_eq!(silent(dither(counts)), Some(100), "{counts}");
    }
    for counts in [64, -64] {
        assert_eq!(silent(dither(counts)), None, "{counts}");
    }
    // As slow as it may be: 66 counts within the time, and 50.
    assert_eq!(silent(|tick| i32::from(!tick.is_multiple_of(3))), None);
    assert_eq!(silent(|tick| -i32::from(!tick.is_multiple_of(3))), None);
    assert!(silent(|tick| i32::from(tick.is_multiple_of(2))).is_some());
}

#[test]
fn counts_that_go_astray_are_silence() {
    for seed in 1..=20 {
        let noise = std::cell::RefCell::new(Noise::new(seed));
        let astray = |_| noise.borrow_mut().counts(1) as i32;
        assert!(silent(astray).is_some(), "{seed}");
    }
}

#[test]
fn an_output_below_the_level_is_no_reason_to_move_and_one_at_it_is() {
    let monitor = SignalLoss::<f32>::new(1.0, 100);
    for (volts, found) in [(0.999, false), (-0.999, false), (1.0, true), (-1.0, true)] {
        let mut state = SignalLossState::default();
        let alive = (0..1000).all(|_| monitor.step(&mut state, 0, volts));
        assert_eq!(!alive, found, "{volts} V");
    }
}

/// Ticks from a jump of y's counter until nothing keeps the outputs from being enabled any more.
fn ticks_of_unrest(jump: i32) -> u32 {
    let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &Default::default());
    rig.stand();
    let said = |rig: &Rig<f32>| {
        refusal(
            rig.stage.as_ref().view(&rig.plan, &rig.state),
            Command::Enable,
        )
    };
    assert_eq!(said(&rig), None);
    rig.inputs.readings[1].count = jump as u32;
    for ticks in 0..1000 {
        rig.tick();
        match said(&rig) {
            None => return ticks,
            refused => assert_eq!(refused, Some(Refusal::NotAtStandstill(AxisName::Y))),
        }
    }
    panic!("{jump}: never at rest");
}

/// Ticks out of `ticks` in which `Enable` is refused because x moves. It does so at `speed`, counts per tick, and its encoder has noise, of
/// which `most` sets the size: 6, 16 and 52 make 1.2, 3 and 10 counts RMS.
fn ticks_refused(rig: &mut Rig<f32>, noise: &mut Noise, most: i64, speed: f64, ticks: u32) -> u32 {
    let start = f64::from(rig.inputs.readings[0].count.cast_signed());
    let mut refused = 0;
    for tick in 1..=ticks {
        let sum: i64 = (0..12).map(|_| noise.counts(most)).sum();
        let count = start + speed * f64::from(tick) + sum as f64 / 12.0_f64.sqrt() / 3.0;
        rig.inputs.readings[0].count = (count.round() as i32).cast_unsigned();
        rig.tick();
        let said = refusal(
            rig.stage.as_ref().view(&rig.plan, &rig.state),
            Command::Enable,
        );
        refused += u32::from(said == Some(Refusal::NotAtStandstill(AxisName::X)));
    }
    refused
}

#[test]
fn noise_at_rest_is_no_motion_and_a_motion_in_noise_is_one() {
    // 1.2, 3 and 10 counts RMS.
    for most in [6, 16, 52] {
        for seed in 1..=5 {
            let mut noise = Noise::new(seed);
            let mut rig = Rig::<f32>::new(&StageSettings::simulated(), &Default::default());
            rig.stand();
            ticks_refused(&mut rig, &mut noise, most, 0.0, 500);
            let at_rest = ticks_refused(&mut rig, &mut noise, most, 0.0, 50_000);
            assert_eq!(at_rest, 0, "{most}");
            // 25 mm/s.
            ticks_refused(&mut rig, &mut noise, most, 2.5, 500);
            let moving = ticks_refused(&mut rig, &mut noise, most, 2.5, 20_000);
            assert_eq!(moving, 20_000, "{most}");
            ticks_refused(&mut rig, &mut noise, most, 0.0, 500);
            assert_eq!(ticks_refused(&mut rig, &mut noise, most, 0.0, 1_000), 0);
        }
    }
}

#[test]
fn a_jump_of_the_counter_is_motion_until_the_filter_has_forgotten_it() {
    // The filter takes an eighth of a step, and forgets an eighth a tick: down to the 1.5 counts a tick of standstill.
    let expected = |counts: f64| (counts / 8.0 / 1.5).ln() / (8.0_f64 / 7.0).ln();
    for jump in [100, -100, 9_000, 40_000, -40_000, 65_535, -65_536] {
        let ticks = f64::from(ticks_of_unrest(jump));
        let expected = expected(f64::from(jump).abs());
        assert!(
            (ticks - expected).abs() < 1.5,
            "{jump}: {ticks}, {expected}"
        );
    }
    // One that is longer counts as one of 2^16.
    for jump in [1 << 17, 1 << 24, i32::MAX, -(1 << 17), -(1 << 24), i32::MIN] {
        let ticks = f64::from(ticks_of_unrest(jump));
        assert!((ticks - expected(65536.0)).abs() < 1.5, "{jump}: {ticks}");
    }
}

/// The fault of a standing axis that may move by a count and a half in a tick, after readings `shown` by their tick.
fn fault_of_a_slow_axis(shown: impl Fn(u32) -> i32) -> Option<FaultCode> {
    let settings = with_x(|x| {
        x.encoder.resolution_mm = 2e-3;
        x.limits.max_velocity_mm_s = 30.0;
        x.limits.unhomed_mm_s = None;
    });
    let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
    for tick in 0..500 {
        rig.inputs.command = (tick == 1).then_some(Command::Enable);
        rig.inputs.readings[0].count = shown(tick) as u32;
        rig.tick();
    }
    rig.state.safety().fault().map(|fault| fault.code)
}

#[test]
fn noise_of_three_counts_is_no_jump_of_an_axis_however_slow() {
    // 26 counts in the difference of two readings are six times its standard deviation.
    let noise = |tick| if tick % 2 == 0 { 13 } else { -13 };
    assert_eq!(fault_of_a_slow_axis(noise), None);
    for counts in [40, -40] {
        let fault = fault_of_a_slow_axis(|tick| if tick == 10 { counts } else { 0 });
        assert_eq!(fault, Some(FaultCode::EncoderJump), "{counts}");
    }
}

#[test]
fn the_high_mark_is_the_largest_error_as_a_share_of_the_limit_of_its_time() {
    assert_eq!(FollowingState::<f32>::default().high_mark(), 0.0);
    // 0.5 mm at rest, 0.01 s times the speed more, at most 2 mm.
    let following = Following::<f32>::new(0.5, 0.01, 2.0);
    let mut state = following.start();
    assert_eq!(state.high_mark(), 0.0);
    let mut mark = |error, speed| {
        let follows = following.step(&mut state, error, speed);
        (follows, state.high_mark())
    };
    assert_eq!(mark(0.125, 0.0), (true, 0.25));
    // A larger error, but a smaller share.
    assert_eq!(mark(0.25, 100.0), (true, 0.25));
    assert_eq!(mark(-0.75, 100.0), (true, 0.5));
    assert_eq!(mark(-1.5, 1e6), (true, 0.75));
    assert_eq!(mark(0.5, 0.0), (true, 1.0));
    assert_eq!(mark(0.625, 0.0), (false, 1.25));
}
