//! An axis that has stood sets off with the friction that it has then.

use quadrant_law::axes::AxisName;
use quadrant_law::command::Command;
use quadrant_law::control::filter::{FilterList, FilterSettings};
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_law::safety::SafetyState;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::{AxisSettings, StageSettings};

use crate::learning::{Axis, fixed};
use quadrant_fault_bench::plant::PERIOD_S;

/// Length of a rest, s.
const REST_S: f64 = 3.0;

fn with(change: impl FnOnce(&mut AxisSettings)) -> StageSettings {
    let mut settings = fixed();
    change(&mut settings.axes[0]);
    settings
}

fn voltage<S: Scalar>(volts: S) -> f64 {
    volts.to_f64(Quantity::Voltage)
}

/// Largest error within a time, um.
fn largest_um<S: Scalar>(axis: &mut Axis<S>, seconds: f64) -> f64 {
    let ticks = (seconds / PERIOD_S) as usize;
    (0..ticks).fold(0.0, |most: f64, _| {
        axis.tick();
        most.max(1e3 * axis.seen().error.to_f64(Quantity::Length).abs())
    })
}

/// An axis that has worked on the sine and then stood.
fn rested<S: Scalar>(settings: &StageSettings, friction: f64, work_s: f64) -> Axis<S> {
    rested_after(settings, friction, Command::Run, work_s)
}

/// The same after another motion.
fn rested_after<S: Scalar>(
    settings: &StageSettings,
    friction: f64,
    work: Command,
    work_s: f64,
) -> Axis<S> {
    let mut axis = Axis::<S>::on_sine(settings, friction);
    axis.command(work);
    axis.run(work_s);
    axis.command(Command::Stop);
    axis.run(REST_S);
    assert_eq!(axis.rig.state.safety(), SafetyState::Enabled);
    axis
}

/// Largest error in motion, and that of the first motion after a rest, um.
fn errors_um<S: Scalar>(settings: &StageSettings) -> [f64; 2] {
    let mut axis = Axis::<S>::on_sine(settings, 1.0);
    axis.command(Command::Run);
    axis.run(3.0);
    let in_motion = largest_um(&mut axis, 3.0);
    axis.command(Command::Stop);
    axis.run(REST_S);
    axis.command(Command::Run);
    let after = largest_um(&mut axis, 2.0);
    assert_eq!(axis.rig.state.safety(), SafetyState::Enabled);
    [in_motion, after]
}

#[test]
fn the_first_motion_after_a_rest_errs_like_any_other() {
    let smoothed = with(|x| x.feedforward.kind = FeedforwardKind::SmoothedGms);
    let filtered = with(|x| {
        x.feedback.filters = FilterList::from_slice(&[FilterSettings::low_pass(900.0, 0.7)]).ok();
    });
    let half = with(|x| x.feedforward.gains.presliding = 0.9);
    // The sine reaches 5 mm/s.
    let fading = |from_mm_s| with(|x| x.feedforward.from_mm_s = from_mm_s);
    let level_alone = with(|x| x.feedforward.kind = FeedforwardKind::Static);
    for (what, [in_motion, after]) in [
        ("f32", errors_um::<f32>(&fixed())),
        ("fixed point", errors_um::<Fixed>(&fixed())),
        ("smoothed", errors_um::<f32>(&smoothed)),
        ("filtered", errors_um::<f32>(&filtered)),
        ("a smaller gain", errors_um::<f32>(&half)),
        ("fading a little", errors_um::<f32>(&fading(2.52))),
        (
            "fading a little, fixed point",
            errors_um::<Fixed>(&fading(2.52)),
        ),
        ("static", errors_um::<f32>(&level_alone)),
        ("static, fixed point", errors_um::<Fixed>(&level_alone)),
    ] {
        println!("{what}: {in_motion:.1} um in motion, {after:.1} um after a rest");
        // The model's elements share the adopted voltage by their weights, and the axis' by their springs.
        assert!(after < in_motion + 7.0, "{what}: {after} um");
    }
    // Where the integral holds a good part of friction, it has to turn round.
    for (what, [in_motion, after]) in [
        ("fading", errors_um::<f32>(&fading(3.1))),
        ("fading a lot", errors_um::<f32>(&fading(4.0))),
        ("in fixed point", errors_um::<Fixed>(&fading(4.0))),
    ] {
        println!("{what}: {in_motion:.1} um in motion, {after:.1} um after a rest");
        assert!(after < 1.25 * in_motion, "{what}: {after} um");
    }
}

/// The largest step of the output within the first 2 ms of a motion, and by how much the integral has moved until then, V.
fn at_start<S: Scalar>(settings: &StageSettings, friction: f64, command: Command) -> [f64; 2] {
    at_start_of(rested::<S>(settings, friction, 6.0), command)
}

/// The same of an axis.
fn at_start_of<S: Scalar>(mut axis: Axis<S>, command: Command) -> [f64; 2] {
    let before = voltage(axis.seen().feedback.integral);
    let mut last = voltage(axis.seen().output);
    axis.rig.inputs.command = Some(command);
    let mut step: f64 = 0.0;
    for _ in 0..20 {
        axis.tick();
        let output = voltage(axis.seen().output);
        step = step.max((output - last).abs());
        last = output;
    }
    [
        step,
        (voltage(axis.seen().feedback.integral) - before).abs(),
    ]
}

#[test]
fn the_output_goes_on_from_where_it_was() {
    let learning = with(|x| x.feedforward.learning = Some(LearningSettings::default()));
    let filtered = with(|x| {
        x.feedback.filters = FilterList::from_slice(&[FilterSettings::notch(120.0, 0.4, 0.1)]).ok();
    });
    let run = Command::Run;
    let jog = Command::Jog(AxisName::X, fixed().jog_at(AxisName::X, 5.0).unwrap());
    let fading = |from_mm_s| with(|x| x.feedforward.from_mm_s = from_mm_s);
    for (what, [step, moved]) in [
        ("f32", at_start::<f32>(&fixed(), 1.0, run)),
        ("fixed point", at_start::<Fixed>(&fixed(), 1.0, run)),
        ("learning", at_start::<f32>(&learning, 1.3, run)),
        (
            "learning, fixed point",
            at_start::<Fixed>(&learning, 1.3, run),
        ),
        ("filtered", at_start::<f32>(&filtered, 1.0, run)),
        ("a jog", at_start::<f32>(&fixed(), 1.0, jog)),
        // A hundredth less is fed forward on the sine before.
        ("fading", at_start::<f32>(&fading(2.52), 1.0, run)),
        ("fading, a jog", at_start::<f32>(&fading(2.52), 1.0, jog)),
        (
            "fading, a jog, fixed point",
            at_start::<Fixed>(&fading(2.52), 1.0, jog),
        ),
    ] {
        println!("{what}: a step of {step:.4} V, {moved:.4} V adopted");
        // A count moves the derivative by half as much as is adopted here, and is there without a rest, too.
        assert!(moved > 0.1, "{what}: {moved} V adopted");
        assert!(step < 0.5 * moved, "{what}: {step} V");
    }
    // Half of friction was the integral's.
    let [step, moved] = at_start::<f32>(&fading(3.4), 1.0, jog);
    assert!(moved > 0.06 && step < 0.1 * moved, "{step} V, {moved} V");
}

/// After a jog at 5 mm/s, all of whose friction is fed forward, and a rest: the step of the output at the start of the sine, where less of
/// it is, and the adopted voltage, V; the largest error of its first 2 s, and 3 s later, um.
fn after_a_jog<S: Scalar>(from_mm_s: f64) -> [f64; 4] {
    let settings = with(|x| x.feedforward.from_mm_s = from_mm_s);
    let jog = Command::Jog(AxisName::X, settings.jog_at(AxisName::X, 5.0).unwrap());
    let rested = || rested_after::<S>(&settings, 1.0, jog, 2.0);
    let [step, moved] = at_start_of(rested(), Command::Run);
    let mut axis = rested();
    axis.command(Command::Run);
    let first = largest_um(&mut axis, 2.0);
    axis.run(3.0);
    let later = largest_um(&mut axis, 2.0);
    [step, moved, first, later]
}

#[test]
fn a_motion_with_less_friction_fed_forward_than_the_one_before_its_rest_is_not_thrown() {
    for from_mm_s in [2.52, 3.1, 3.4, 4.0] {
        for (numbers, [step, moved, first, later]) in [
            ("f32", after_a_jog::<f32>(from_mm_s)),
            ("fixed point", after_a_jog::<Fixed>(from_mm_s)),
        ] {
            println!(
                "{from_mm_s} mm/s, {numbers}: a step of {step:.4} V, {moved:.4} V adopted, {first:.1} um, {later:.1} um later"
            );
            assert!(moved > 0.1 && step < 0.5 * moved, "{step} V, {moved} V");
            assert!(first < later + 7.0, "{first} um, then {later} um");
        }
    }
}

#[test]
fn without_friction_fed_forward_the_integral_keeps_what_it_has() {
    let settings = with(|x| x.feedforward.kind = FeedforwardKind::None);
    let mut axis = rested::<f32>(&settings, 1.0, 3.0);
    let before = axis.seen().feedback.integral;
    axis.command(Command::Run);
    axis.run(2e-3);
    let after = axis.seen().feedback.integral;
    assert!(
        before != 0.0 && (after - before).abs() < 1e-3,
        "{before} V, {after} V"
    );
}

#[test]
fn no_more_than_friction_can_be_is_adopted() {
    let breakaway_v = fixed().axes[0].friction.sliding.positive.curve.breakaway_v;
    for pushed_v in [-0.5, 0.5] {
        let mut axis = Axis::<f32>::on_sine(&fixed(), 1.0);
        axis.command(Command::Run);
        axis.run(3.0);
        axis.command(Command::Stop);
        axis.run(1.0);
        axis.pushed_v = pushed_v;
        axis.run(REST_S);
        let before = axis.seen().feedback.integral;
        axis.command(Command::Run);
        axis.run(5e-4);
        let taken = f64::from(before - axis.seen().feedback.integral).abs();
        let gms = f64::from(axis.seen().feedforward.presliding).abs();
        println!("{pushed_v} V: {taken:.4} V of {before:.4} V adopted, then {gms:.4} V");
        assert!(gms < 1.02 * breakaway_v && taken < 2.02 * breakaway_v && taken > 0.0);
        // The load stays the integral's, and the axis runs on.
        axis.run(3.0);
        assert!(largest_um(&mut axis, 2.0) < 10.0);
    }
}

#[test]
fn other_settings_and_enabling_begin_without_a_stop() {
    for disables in [false, true] {
        let mut axis = rested::<f32>(&fixed(), 1.0, 3.0);
        if disables {
            axis.command(Command::Disable);
            axis.run(0.2);
            axis.command(Command::Enable);
            axis.run(REST_S);
        } else {
            axis.rig
                .exchange(&with(|x| x.feedback.pid.kp_v_per_mm *= 0.99));
            axis.tick();
        }
        let before = axis.seen().feedback.integral;
        axis.command(Command::Run);
        axis.run(5e-4);
        let after = axis.seen().feedback.integral;
        assert!((after - before).abs() < 1e-3, "{before} V, {after} V");
    }
}
