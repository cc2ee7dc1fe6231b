//! With any readings of the encoders, the outputs stay within their limits and the memory stays sound.

use proptest::prelude::*;
use quadrant_law::axes::PerAxis;
use quadrant_law::axis::telemetry::LimitedBy;
use quadrant_law::command::Command;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::DacCode;
use quadrant_settings::{AxisSettings, StageSettings};

use quadrant_test_support::{Rig, repeatable, sine_on_x, with_x};

/// Outputs of 2 V on converters of 5 V, with an offset, and room for large errors.
fn limited(kind: FeedforwardKind, law: LawKind) -> StageSettings {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.amplifier.full_scale_v = 5.0;
        axis.amplifier.output_limit_v = 2.0;
        axis.amplifier.offset_v = 0.1;
        axis.limits.following_error_mm = 20.0;
        axis.limits.following_error_max_mm = 20.0;
        axis.limits.overspeed_ratio = 2.0;
        axis.feedforward.kind = kind;
        axis.feedback.law = law;
        // With less the law could not reach the limit.
        let sliding = axis.feedback.sliding_mode.as_mut().expect("by default");
        sliding.switching_v = axis.amplifier.output_limit_v;
    }
    settings
}

/// 2.1 V of 5 V, and half a code of rounding.
const MOST_CODE: f64 = 2.1 / 5.0 * DacCode::FULL_SCALE + 1.0;

fn check<S: Scalar>(rig: &mut Rig<S>) -> Result<bool, TestCaseError> {
    let outputs = rig.tick();
    for (code, axis) in outputs.codes.iter().zip(rig.state.axes()) {
        prop_assert!(f64::from(code.0).abs() <= MOST_CODE, "{outputs:?}");
        prop_assert!(outputs.enabled || code.0 == 0);
        let seen = axis.telemetry();
        let volts = [
            seen.feedback.proportional,
            seen.feedback.integral,
            seen.feedback.derivative,
            seen.feedforward.total(),
            seen.bumpless_offset,
        ];
        let finite = |volts: S| volts.to_f64(Quantity::Voltage).is_finite();
        prop_assert!(volts.into_iter().all(finite), "{seen:?}");
        prop_assert!(
            seen.output.to_f64(Quantity::Voltage).abs() <= 2.0 + 1e-6,
            "{seen:?}"
        );
    }
    Ok(outputs.enabled)
}

/// Every number of counts, and every command, at any time; then an orderly start.
fn anything<S: Scalar>(
    kind: FeedforwardKind,
    law: LawKind,
    ticks: &[([u32; 3], u32, bool)],
) -> Result<(), TestCaseError> {
    let mut rig = Rig::<S>::new(&limited(kind, law), &sine_on_x(1.0, 10.0));
    rig.start();
    for &(counts, command, changed) in ticks {
        rig.inputs.set_counts(counts);
        rig.inputs.command = Command::from_number(command);
        rig.inputs.settings_changed = PerAxis::splat(changed);
        check(&mut rig)?;
    }
    for command in [Command::Disable, Command::ResetFault, Command::Enable] {
        rig.inputs.command = Some(command);
        check(&mut rig)?;
        if command == Command::ResetFault {
            rig.stand();
        }
    }
    prop_assert!(check(&mut rig)?, "it works again");
    prop_assert_eq!(rig.state.axes()[0].telemetry().error, S::ZERO);
    Ok(())
}

/// Moves that the encoders may make, far enough to saturate, without a fault.
fn plausible<S: Scalar>(
    kind: FeedforwardKind,
    law: LawKind,
    moves: &[[i32; 3]],
) -> Result<(), TestCaseError> {
    let mut rig = Rig::<S>::new(&limited(kind, law), &sine_on_x(1.0, 10.0));
    rig.start();
    let mut saturated = false;
    for (tick, step) in moves.iter().enumerate() {
        for (reading, step) in rig.inputs.readings.iter_mut().zip(step) {
            reading.count = reading.count.wrapping_add_signed(*step);
        }
        rig.inputs.settings_changed = PerAxis::splat(tick % 7 == 0);
        prop_assert!(check(&mut rig)?);
        saturated |= rig.state.axes()[0].telemetry().limited_by == LimitedBy::OutputLimit;
    }
    prop_assert!(saturated, "the moves reach the limit");
    Ok(())
}

fn laws() -> impl Strategy<Value = LawKind> {
    prop::sample::select(LawKind::ALL.to_vec())
}

fn kinds() -> impl Strategy<Value = FeedforwardKind> {
    prop::sample::select(FeedforwardKind::ALL.to_vec())
}

proptest! {
    #![proptest_config(repeatable(60))]

    #[test]
    fn any_counts_give_outputs_within_limits(
        kind in kinds(),
        law in laws(),
        ticks in prop::collection::vec((any::<[u32; 3]>(), 0u32..6, any::<bool>()), 40),
    ) {
        anything::<f32>(kind, law, &ticks)?;
        anything::<f64>(kind, law, &ticks)?;
        anything::<Fixed>(kind, law, &ticks)?;
    }

    #[test]
    fn any_plausible_motion_gives_outputs_within_limits(
        kind in kinds(),
        law in laws(),
        moves in prop::collection::vec([-100i32..=100, -100i32..=100, -100i32..=100], 200),
    ) {
        plausible::<f32>(kind, law, &moves)?;
        plausible::<f64>(kind, law, &moves)?;
        plausible::<Fixed>(kind, law, &moves)?;
    }
}

/// The code of x for a large error in one direction, with no memory of it.
fn code_at_error(change: impl FnOnce(&mut AxisSettings)) -> i16 {
    let settings = with_x(|axis| {
        axis.feedback.pid.kp_v_per_mm = 200.0;
        axis.feedback.law = LawKind::Pid;
        // Nothing is closed: the plant's stability does not matter here.
        axis.plant = None;
        change(axis);
    });
    let mut rig = Rig::<f32>::new(&settings, &Default::default());
    rig.start();
    // -0.05 mm at 200 V/mm, and more from the derivative.
    rig.inputs.readings[0].count = 100;
    let outputs = rig.tick();
    assert!(outputs.enabled);
    outputs.codes[0].0
}

#[test]
fn limit_offset_and_sign_make_the_code() {
    assert_eq!(
        code_at_error(|axis| axis.amplifier.output_limit_v = 4.0),
        -13107
    );
    let reversed = code_at_error(|axis| {
        axis.amplifier.output_limit_v = 4.0;
        axis.amplifier.reversed = true;
    });
    assert_eq!(reversed, 13107);
    // The offset is of the converter, for either sense of the axis.
    for reversed in [false, true] {
        let code = code_at_error(|axis| {
            axis.amplifier.output_limit_v = 4.0;
            axis.amplifier.offset_v = 0.5;
            axis.amplifier.reversed = reversed;
        });
        assert_eq!(code, if reversed { 13107 } else { -13107 } + 1638);
    }
    // The converter's own range is the last limit.
    let beyond = code_at_error(|axis| axis.amplifier.offset_v = -0.5);
    assert_eq!(beyond, -32768);
}

#[test]
fn a_reversed_encoder_turns_the_error_around() {
    let plain = code_at_error(|_| {});
    let reversed = code_at_error(|axis| axis.encoder.reversed = true);
    assert_eq!(plain, -reversed);
}

#[test]
fn following_error_is_allowed_up_to_the_limit_and_not_beyond() {
    // Including the largest limit at the finest resolution, where the error must not saturate below it.
    for (resolution_mm, limit_mm) in [(5e-4, 1.0), (1e-4, 0.5), (1e-6, 8.0)] {
        let settings = with_x(|axis| {
            axis.encoder.resolution_mm = resolution_mm;
            axis.limits.following_error_mm = limit_mm;
            axis.limits.following_error_max_mm = limit_mm;
            axis.limits.max_velocity_mm_s = 1.0f64.min(4000.0 * resolution_mm * 1e4);
        });
        let mut rig = Rig::<f64>::new(&settings, &Default::default());
        rig.start();
        let largest = 2.0 * settings.axes[0].limits.max_velocity_mm_s * 1e-4 / resolution_mm;
        let step = (largest as u32 / 2).max(1);
        let within = (limit_mm / resolution_mm * (1.0 - 1e-9)) as u32;
        let mut moved = 0;
        while rig.state.safety().is_enabled() {
            moved += step;
            rig.inputs.readings[0].count = moved;
            // A count a tick would be too fast for the slowest.
            for _ in 0..4 {
                rig.tick();
            }
            assert!(moved <= within + 2 * step, "no fault at {moved} counts");
        }
        assert!(moved > within, "fault at {moved} counts already");
    }
}
