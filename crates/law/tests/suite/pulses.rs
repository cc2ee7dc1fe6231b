//! A reference of counted pulses: the sum of them, without drift and without motion the other way, and its faults.

use proptest::prelude::*;
use quadrant_law::reference::{
    MAX_PULSE_DELAY_TICKS, MotionScale, PulseReference, PulseScale, PulseState, ReferenceSample,
};
use quadrant_law::safety::FaultCode;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::Position;
use quadrant_test_support::repeatable;

const SCALE: MotionScale = MotionScale {
    resolution_mm: 5e-4,
    rate_hz: 10e3,
};

/// Steps of 10 um, 6.4 ms of delay.
const PULSES: PulseScale = PulseScale {
    step_mm: 0.01,
    counter_bits: 32,
    delay_ticks: 63,
    wait_ticks: 0,
    preview_ticks: 12,
    max_velocity_mm_s: 250.0,
    max_acceleration_mm_s2: 2000.0,
};

/// The samples of counts.
fn samples<S: Scalar>(
    pulses: &PulseScale,
    scale: MotionScale,
    counts: impl IntoIterator<Item = u32>,
) -> Vec<ReferenceSample<S>> {
    let reference = PulseReference::<S>::new(pulses, scale);
    let mut state = PulseState::default();
    let step = |count| Ok(reference.step(&mut state, count)?.ahead);
    counts
        .into_iter()
        .map(step)
        .collect::<Result<_, FaultCode>>()
        .unwrap()
}

/// A count that follows a position, mm, in ticks.
fn count_of(step_mm: f64, position_mm: f64) -> u32 {
    (position_mm / step_mm).round() as i64 as u32
}

/// Counts of a motion of so many ticks, and then of its end for as long as any reference takes.
fn followed(
    step_mm: f64,
    ticks: usize,
    position_mm: impl Fn(f64) -> f64,
) -> impl Iterator<Item = u32> {
    let settling = 2 * MAX_PULSE_DELAY_TICKS as usize + 40;
    (0..ticks + settling).map(move |tick| {
        let time_s = tick.min(ticks) as f64 / SCALE.rate_hz;
        count_of(step_mm, position_mm(time_s))
    })
}

#[test]
fn the_position_is_the_sum_of_the_pulses_after_a_million_of_them() {
    // An inch screw: 6.35 counts a step.
    let pulses = PulseScale {
        step_mm: 3.175e-3,
        ..PULSES
    };
    let way = |t: f64| 1500.0 * (1.0 - (std::f64::consts::PI * t / 24.0).cos());
    let there = followed(pulses.step_mm, 240_000, way);
    let seen = samples::<f32>(&pulses, SCALE, there);
    let steps = (3000.0_f64 / 3.175e-3).round();
    let exact = Position::from_mm(steps * 3.175e-3, SCALE.resolution_mm);
    let last = seen.last().unwrap();
    assert!(
        steps > 9e5 && (last.position - exact).0.abs() <= 8,
        "{last:?}, {exact:?}"
    );
    assert_eq!((last.velocity, last.acceleration), (0.0, 0.0));
}

#[test]
fn to_and_fro_for_an_hour_leaves_no_drift() {
    let pulses = PulseScale {
        step_mm: 1.0 / 300.0,
        ..PULSES
    };
    let reference = PulseReference::<f32>::new(&pulses, SCALE);
    let mut state = PulseState::default();
    let mut last = ReferenceSample::default();
    for turn in 0..18_000_u32 {
        let size = 1 + turn % 7;
        for tick in 0..2000_u32 {
            let way = (tick.min(1500) as i32 - 750).abs() - 750;
            let count = (way * size as i32 / 9) as u32;
            last = reference.step(&mut state, count).unwrap().ahead;
        }
        assert_eq!(last, ReferenceSample::default());
    }
}

#[test]
fn a_motion_is_followed_by_the_delay_to_a_fraction_of_a_step() {
    for (rate_hz, delay_ticks) in [(10e3, 63), (1e3, 8), (10e3, 239)] {
        for step_mm in [1e-3, 5e-3, 1e-2] {
            let scale = MotionScale { rate_hz, ..SCALE };
            let pulses = PulseScale {
                step_mm,
                delay_ticks,
                ..PULSES
            };
            let speed = |t: f64| 40.0 * t.min(0.5);
            let position = |t: f64| 20.0 * t.min(0.5) * t.min(0.5) + 20.0 * (t - 0.5).max(0.0);
            let counts = (0..rate_hz as usize)
                .map(|tick| count_of(step_mm, position(tick as f64 / rate_hz)));
            let seen = samples::<f32>(&pulses, scale, counts);
            for (tick, sample) in seen.iter().enumerate().skip((0.6 * rate_hz) as usize) {
                let time = (tick as f64 - f64::from(delay_ticks)) / rate_hz;
                let error = sample.position.to_mm(5e-4) - position(time);
                assert!(error.abs() < 0.1 * step_mm, "{rate_hz} {step_mm}: {error}");
                let error = f64::from(sample.velocity) / speed(time) - 1.0;
                assert!(error.abs() < 0.04, "{rate_hz} {step_mm} {tick}: {error}");
            }
        }
    }
}

#[test]
fn half_a_million_steps_a_second_are_followed() {
    for rate_hz in [10e3, 1e3] {
        let scale = MotionScale { rate_hz, ..SCALE };
        let pulses = PulseScale {
            step_mm: 5e-4,
            delay_ticks: 9,
            ..PULSES
        };
        // To 249 mm/s within 0.2 s.
        let path = |t: f64| 622.5 * t.min(0.2) * t.min(0.2) + 249.0 * (t - 0.2).max(0.0);
        let counts = (0..rate_hz as usize).map(|tick| count_of(5e-4, path(tick as f64 / rate_hz)));
        let seen = samples::<f32>(&pulses, scale, counts);
        let last = seen.last().unwrap();
        let there = path((rate_hz - 10.0) / rate_hz);
        assert!(
            (last.position.to_mm(5e-4) - there).abs() < 5e-4,
            "{last:?} {there}"
        );
        assert!((last.velocity - 249.0).abs() < 0.5, "{last:?}");
    }
}

#[test]
fn a_step_every_fifty_ticks_is_a_motion_that_does_not_stop() {
    let pulses = PulseScale {
        delay_ticks: 149,
        ..PULSES
    };
    let counts = (0..20_000_u32).map(|tick| tick / 50);
    let seen = samples::<f32>(&pulses, SCALE, counts);
    // 2 mm/s.
    for sample in &seen[400..] {
        assert!((sample.velocity - 2.0).abs() < 0.02, "{sample:?}");
    }
}

#[test]
fn an_axis_at_rest_on_the_edge_of_a_step_moves_by_no_more_than_it() {
    // A control that dithers by one step.
    let counts = (0..5000_u32).map(|tick| tick / 7 % 2);
    let seen = samples::<f32>(&PULSES, SCALE, counts);
    for sample in &seen[200..] {
        assert!((0.0..=0.01).contains(&sample.position.to_mm(5e-4)));
        assert!(sample.velocity.abs() < 0.2, "{sample:?}");
    }
}

#[test]
fn the_correction_leads_back_to_a_curved_path_and_is_none_at_rest() {
    for (delay_ticks, step_mm) in [(63, 1e-3), (239, 5e-3)] {
        let pulses = PulseScale {
            delay_ticks,
            step_mm,
            ..PULSES
        };
        // A radius of 10 mm at 80 mm/s.
        let path = |t: f64| 10.0 * (1.0 - (8.0 * t).cos());
        let reference = PulseReference::<f32>::new(&pulses, SCALE);
        let mut state = PulseState::default();
        let lag = (delay_ticks + pulses.preview_ticks) as usize;
        let mut ahead = vec![];
        for (tick, count) in followed(step_mm, 7854, path).enumerate() {
            let found = reference.step(&mut state, count).unwrap();
            ahead.push(found.ahead.position);
            if (1000..7854).contains(&tick) {
                let now = ahead[tick - 12] + found.correction;
                let error = now.to_mm(5e-4) - path((tick - lag) as f64 / SCALE.rate_hz);
                // Without it, 2 and 30 um.
                assert!(error.abs() < 0.2 * step_mm + 4e-4, "{delay_ticks}: {error}");
            }
        }
        let at_rest = reference.step(&mut state, count_of(step_mm, path(7854.0 / SCALE.rate_hz)));
        assert_eq!(at_rest.unwrap().correction, Position::ZERO);
    }
}

#[test]
fn a_reversal_is_found_after_the_delay() {
    // At 20 mm/s, and back.
    let delay = PULSES.delay_ticks as usize;
    let counts = followed(0.01, 4000, |t| 4.0 - 20.0 * (t - 0.2).abs());
    let seen = samples::<f32>(&PULSES, SCALE, counts);
    let turned = seen
        .iter()
        .position(|sample| sample.velocity < 0.0)
        .unwrap();
    assert!(turned.abs_diff(2000 + delay) <= 5, "{turned}");
}

#[test]
fn a_narrow_counter_wraps_without_a_jump() {
    for bits in [10, 16, 24] {
        let narrow = PulseScale {
            counter_bits: bits,
            ..PULSES
        };
        let motion = |t: f64| 30.0 * (1.0 - (std::f64::consts::TAU * t).cos());
        let wide = followed(0.01, 10_000, motion);
        let cut = followed(0.01, 10_000, motion).map(|count| count & ((1 << bits) - 1));
        assert_eq!(
            samples::<f32>(&PULSES, SCALE, wide),
            samples::<f32>(&narrow, SCALE, cut)
        );
    }
}

#[test]
fn a_wait_delays_the_same_reference() {
    let waiting = PulseScale {
        wait_ticks: 13,
        ..PULSES
    };
    let motion = |t: f64| 10.0 * (5.0 * t).sin();
    let seen = samples::<f32>(&PULSES, SCALE, followed(0.01, 10_000, motion));
    let waited = samples::<f32>(&waiting, SCALE, followed(0.01, 10_000, motion));
    assert_eq!(seen[..10_000], waited[13..10_013]);
}

#[test]
fn fixed_point_follows_as_the_floats_do() {
    let motion = |t: f64| 10.0 * (5.0 * t).sin();
    let floats = samples::<f64>(&PULSES, SCALE, followed(0.01, 10_000, motion));
    let fixed = samples::<Fixed>(&PULSES, SCALE, followed(0.01, 10_000, motion));
    for (float, fixed) in floats.iter().zip(&fixed) {
        assert_eq!(float.position, fixed.position);
        let velocity = fixed.velocity.to_f64(Quantity::Velocity);
        let acceleration = fixed.acceleration.to_f64(Quantity::Acceleration);
        assert!((float.velocity - velocity).abs() < 1e-4);
        assert!((float.acceleration - acceleration).abs() < 1e-2);
    }
}

/// The fault of counts, and the tick that finds it.
fn fault_of(
    pulses: &PulseScale,
    counts: impl IntoIterator<Item = u32>,
) -> Option<(usize, FaultCode)> {
    let reference = PulseReference::<f32>::new(pulses, SCALE);
    let mut state = PulseState::default();
    counts
        .into_iter()
        .map(|count| reference.step(&mut state, count))
        .enumerate()
        .find_map(|(tick, found)| Some((tick, found.err()?)))
}

#[test]
fn pulses_faster_than_the_axis_are_an_overspeed() {
    let ramp = |most: f64| {
        let reached_s = most / 1900.0;
        followed(0.01, 20_000, move |t| {
            let rising = t.min(reached_s);
            950.0 * rising * rising + most * (t - rising)
        })
        .take(20_000)
    };
    assert_eq!(fault_of(&PULSES, ramp(249.0)), None);
    let (tick, code) = fault_of(&PULSES, ramp(265.0)).unwrap();
    assert_eq!(code, FaultCode::PulseOverspeed);
    // 250 mm/s are reached after 1316 ticks, and are seen when the delay has passed.
    assert!((1316..1316 + 200).contains(&tick), "{tick}");
}

#[test]
fn a_burst_and_an_impossible_turn_are_a_jump() {
    let burst = (0..1000_u32).map(|tick| if tick < 500 { 0 } else { 40 });
    assert_eq!(fault_of(&PULSES, burst), Some((500, FaultCode::PulseJump)));
    // From 100 mm/s forth to 100 mm/s back at once; and the same within 0.2 s.
    let turn = |ramp_s: f64| {
        followed(0.01, 10_000, move |t| {
            if t < 0.5 {
                100.0 * t * t
            } else {
                let braking = (t - 0.5).min(ramp_s);
                25.0 + 100.0 * (t - 0.5)
                    - 200.0 * (t - 0.5 - braking)
                    - 100.0 * braking * braking / ramp_s
            }
        })
        .take(10_000)
    };
    assert_eq!(fault_of(&PULSES, turn(0.2)), None);
    let (tick, code) = fault_of(&PULSES, turn(1e-4)).unwrap();
    assert_eq!(code, FaultCode::PulseJump);
    assert!((5000..5100).contains(&tick), "{tick}");
}

proptest! {
    #![proptest_config(repeatable(300))]

    #[test]
    fn steps_in_one_sense_never_move_the_reference_in_the_other(
        steps in prop::collection::vec(prop_oneof![4 => Just(0_u32), 1 => 1_u32..4], 1..2000),
        delay_ticks in 0_u32..=MAX_PULSE_DELAY_TICKS,
    ) {
        let pulses = PulseScale { delay_ticks, max_acceleration_mm_s2: 1e9, ..PULSES };
        let counts = steps.iter().scan(0_u32, |count, step| {
            *count += step;
            Some(*count)
        });
        let mut before = Position::ZERO;
        for sample in samples::<f32>(&pulses, SCALE, counts) {
            prop_assert!(sample.velocity >= 0.0);
            prop_assert!(sample.position >= before);
            // Friction's model sees both: a way without a velocity would be one.
            prop_assert!(sample.velocity > 0.0 || sample.position == before);
            before = sample.position;
        }
    }

    #[test]
    fn any_counts_and_any_settings_do_not_panic(
        counts in prop::collection::vec(prop_oneof![any::<u32>(), 0_u32..100], 0..700),
        step_mm in prop_oneof![-1e3_f64..1e3, Just(0.0), Just(f64::NAN), Just(1e-9)],
        counter_bits in 0_u32..40,
        delay_ticks in any::<u32>(),
        wait_ticks in any::<u32>(),
        preview_ticks in any::<u32>(),
        max_velocity_mm_s in prop_oneof![0.0_f64..1e9, Just(f64::INFINITY)],
    ) {
        let pulses = PulseScale {
            step_mm, counter_bits, delay_ticks, wait_ticks, preview_ticks, max_velocity_mm_s,
            max_acceleration_mm_s2: max_velocity_mm_s,
        };
        let reference = PulseReference::<f32>::new(&pulses, SCALE);
        let mut state = PulseState::default();
        for count in counts {
            let _ = reference.step(&mut state, count);
        }
    }
}
