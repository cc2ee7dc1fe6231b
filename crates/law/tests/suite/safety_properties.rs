//! With any input: nothing is driven unasked, and what a fault promises is kept.

use proptest::prelude::*;
use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety::monitor::{IndexSpacing, IndexState};
use quadrant_law::safety::{Reaction, SafetyState, Switches};
use quadrant_law::scalar::{Fixed, Scalar};
use quadrant_law::stage::{Inputs, Outputs};
use quadrant_settings::{LossReaction, StageSettings};

use crate::safety_faults::{follow, moving, sines};
use quadrant_test_support::{Rig, repeatable};

/// Ticks from the end of the ramp until the outputs are off.
const SETTLING_TICKS: u32 = 201;

/// A reading near the last, with a flaw now and then.
fn reading() -> impl Strategy<Value = (i32, Option<i32>, bool, bool)> {
    (
        prop_oneof![60 => -20i32..=20, 1 => any::<i32>()],
        prop_oneof![30 => Just(None), 1 => any::<i32>().prop_map(Some)],
        prop::bool::weighted(0.99),
        prop::bool::weighted(0.99),
    )
}

fn switches() -> impl Strategy<Value = u16> {
    prop_oneof![20 => Just(0), 1 => any::<u16>(), 1 => (0u32..16).prop_map(|bit| 1 << bit)]
}

fn command() -> impl Strategy<Value = u32> {
    prop_oneof![2 => Just(0), 2 => Just(1), 1 => Just(2), 3 => Just(3), 2 => Just(4)]
}

type Flaws = (
    [(i32, Option<i32>, bool, bool); 3],
    u16,
    u32,
    [bool; 3],
    bool,
    bool,
);

fn flaws() -> impl Strategy<Value = Flaws> {
    (
        [reading(), reading(), reading()],
        switches(),
        command(),
        any::<[bool; 3]>(),
        prop::bool::weighted(0.01),
        prop::bool::weighted(0.02),
    )
}

fn inputs(before: &Inputs, (readings, switches, command, changed, late, lost): Flaws) -> Inputs {
    let mut inputs = Inputs {
        switches: Switches::from_bits(switches),
        command: Command::from_number(command),
        settings_changed: changed.into(),
        deadline_missed: late,
        link_lost: lost,
        ..Inputs::default()
    };
    for (axis, (step, index, fresh, valid)) in readings.into_iter().enumerate() {
        let count = before.readings[axis].count.wrapping_add_signed(step);
        inputs.readings[axis] = EncoderReading {
            count,
            index: index.map(|offset| count.wrapping_add_signed(offset)),
            fresh,
            valid,
        };
    }
    inputs
}

fn promises<S: Scalar>(
    homed: [bool; 3],
    loss: LossReaction,
    sequence: &[Flaws],
) -> Result<usize, TestCaseError> {
    let mut settings = StageSettings::simulated();
    settings.streaming.link_lost = loss;
    for axis in &mut settings.axes {
        let travel = axis.limits.travel_mm.as_mut().expect("by default");
        (travel.negative, travel.positive) = (-0.05, 0.05);
        axis.limits.following_error_mm = 0.1;
        axis.limits.following_error_max_mm = 0.2;
    }
    let mut rig = Rig::<S>::new(&settings, &sines());
    for (axis, homed) in quadrant_law::axes::AxisName::ALL.into_iter().zip(homed) {
        rig.state.set_homed(axis, homed);
    }
    let mut enabled = 0;
    for (tick, flaws) in sequence.iter().enumerate() {
        let before = rig.state.safety();
        let mut flaws = *flaws;
        if tick % 64 < 40 {
            // The axes stand, so that they may be enabled.
            for reading in &mut flaws.0 {
                reading.0 = 0;
            }
        }
        rig.inputs = inputs(&rig.inputs, flaws);
        let given = rig.inputs;
        let outputs = rig.tick();
        let after = rig.state.safety();
        enabled += usize::from(outputs.enabled);

        prop_assert_eq!(outputs.enabled, after.drives());
        if !outputs.enabled {
            prop_assert_eq!(outputs, Outputs::default());
        }
        if after.drives() && !before.drives() {
            prop_assert_eq!(given.command, Some(Command::Enable));
            prop_assert!(given.switches.are_good());
            prop_assert!(
                given
                    .readings
                    .iter()
                    .all(|reading| reading.fresh && reading.valid)
            );
            prop_assert!(!matches!(before, SafetyState::Faulted(_)));
        }
        // Nothing that calls for switching off is driven for one tick more.
        let bad = !given.switches.are_good()
            || given
                .readings
                .iter()
                .any(|reading| !reading.fresh || !reading.valid)
            || (given.deadline_missed && before.drives());
        prop_assert!(!(bad && outputs.enabled), "{given:?}");
        match (before.fault(), after.fault()) {
            // The first stays until it is reset.
            (Some(first), Some(now)) => prop_assert_eq!(first, now),
            (Some(_), None) => {
                prop_assert!(matches!(before, SafetyState::Faulted(_)));
                prop_assert_eq!(given.command, Some(Command::ResetFault));
            }
            (None, Some(found)) if found.code.reaction() == Reaction::Off => {
                prop_assert_eq!(outputs, Outputs::default());
                prop_assert_eq!(after, SafetyState::Faulted(found));
            }
            (None, Some(found)) => {
                prop_assert!(before.drives());
                prop_assert!(
                    after == SafetyState::Stopping(found) || after == SafetyState::Faulted(found)
                );
            }
            (None, None) => {}
        }
    }
    Ok(enabled)
}

proptest! {
    #![proptest_config(repeatable(200))]

    #[test]
    fn outputs_are_off_unless_enabled_by_request_with_good_inputs(
        homed in any::<[bool; 3]>(),
        hold in any::<bool>(),
        sequence in prop::collection::vec(flaws(), 300),
    ) {
        let loss = if hold { LossReaction::Hold } else { LossReaction::Stop };
        let single = promises::<f32>(homed, loss, &sequence)?;
        let fixed = promises::<Fixed>(homed, loss, &sequence)?;
        prop_assert!(single > 0 && fixed > 0, "it is enabled at times");
    }

    /// Against the remainder of a division, which the tick does without.
    #[test]
    fn the_spacing_of_index_pulses_is_judged_as_by_division(
        counts in 16u32..1_000_000_000,
        share in 0.0f64..0.25,
        first in any::<u32>(),
        turns in 0u32..1000,
        off in -20i32..20,
        anything in any::<u32>(),
    ) {
        let tolerance = (f64::from(counts) * share) as u32;
        let near = first.wrapping_add(turns.wrapping_mul(counts)).wrapping_add_signed(off);
        for second in [near, anything] {
            let spacing = IndexSpacing::new(Some(counts), tolerance);
            let mut state = IndexState::default();
            prop_assert!(spacing.step(&mut state, first));
            let distance = (second.wrapping_sub(first) as i32).unsigned_abs();
            let rest = distance % counts;
            let fits = rest.min(counts - rest) <= tolerance;
            prop_assert_eq!(spacing.step(&mut state, second), fits);
        }
        let unknown = IndexSpacing::new(None, tolerance);
        let mut state = IndexState::default();
        prop_assert!(unknown.step(&mut state, first) && unknown.step(&mut state, anything));
    }

    /// A stop from any point of a motion is over after v / a + a / j and the settling.
    #[test]
    fn a_stop_ends_at_rest_in_time(
        ticks in 0u32..4000,
        braking_mm_s2 in 2000f64..30_000.0,
        braking_jerk_mm_s3 in 1e5f64..1e8,
        hold in any::<bool>(),
    ) {
        let mut settings = StageSettings::simulated();
        settings.streaming.link_lost = if hold { LossReaction::Hold } else { LossReaction::Stop };
        for axis in &mut settings.axes {
            axis.limits.braking_mm_s2 = braking_mm_s2;
            axis.limits.braking_jerk_mm_s3 = braking_jerk_mm_s3;
        }
        let mut rig = moving(&settings);
        let reference = |rig: &Rig<f32>| rig.state.axes()[0].telemetry().reference;
        for _ in 0..ticks {
            follow(&mut rig);
            rig.tick();
        }
        let start = reference(&rig);
        rig.inputs.link_lost = true;
        let mut seen = reference(&rig);
        let mut rest = 0;
        let mut braking = 0u32;
        while rig.state.is_running() || rest < SETTLING_TICKS {
            follow(&mut rig);
            let outputs = rig.tick();
            braking += 1;
            prop_assert!(braking < 4000, "it never ends");
            if !outputs.enabled {
                prop_assert!(rest > 0, "switched off in motion");
                break;
            }
            let moved = reference(&rig) - seen;
            seen = reference(&rig);
            rest = if moved.0 == 0 { rest + 1 } else { 0 };
        }
        // 31 mm/s at most: with lead-in and rounding.
        let speed = 31.0;
        let ramp_s = speed / braking_mm_s2 + braking_mm_s2.min(speed * braking_jerk_mm_s3 / braking_mm_s2) / braking_jerk_mm_s3
            + 2.0 * (speed / braking_jerk_mm_s3).sqrt();
        // The preview, and whole ticks at the ramp's corners.
        let bound = ramp_s * 1e4 + 13.0 + 6.0 + f64::from(SETTLING_TICKS);
        prop_assert!(f64::from(braking) <= bound, "{braking} ticks, {bound} allowed");
        let distance_mm = (seen - start).to_mm(5e-4).abs();
        prop_assert!(distance_mm <= speed * (ramp_s + 20e-4), "{distance_mm} mm");
        if hold {
            prop_assert!(rig.state.safety().is_enabled());
            let held = rig.state.held().expect("a fault is reported");
            prop_assert_eq!(held.code, quadrant_law::safety::FaultCode::LinkLost);
        } else {
            prop_assert!(matches!(rig.state.safety(), SafetyState::Faulted(_)));
        }
    }
}
