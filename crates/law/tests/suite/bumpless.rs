//! A change of settings in motion does not jolt the machine.

use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::reference::{HarmonicSettings, MotionSettings};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_law::units::Position;
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};

use quadrant_test_support::{Rig, x_alone};

const RESOLUTION_MM: f64 = 5e-4;
/// Ticks before the change: into the motion, out of the lead-in.
const BEFORE: usize = 2000;
/// Ticks after the change.
const AFTER: usize = 4000;
/// Lag of the machine when the change comes.
const LAG_MM: f64 = 0.05;

fn plan() -> PlanSettings {
    let mut plan = PlanSettings::default();
    plan.motions[0] = MotionSettings::Harmonic(HarmonicSettings {
        cycles: None,
        ..HarmonicSettings::with_velocity(2.0, 10.0, 1.0, 0.1)
    });
    plan
}

/// Runs x along its sine while the machine lags by a growing distance, for any output: every law sees the same
/// counts. Returns the volts of every tick and the transfer offset.
fn volts<S: Scalar>(first: &StageSettings, second: Option<&StageSettings>) -> Vec<(f64, f64)> {
    let mut rig = Rig::<S>::new(first, &plan());
    let mut follower = Rig::<f64>::new(&x_alone(|_| {}), &plan());
    rig.start();
    follower.start();
    (0..BEFORE + AFTER)
        .map(|tick| {
            if let (BEFORE, Some(second)) = (tick, second) {
                rig.exchange(second);
            }
            let lag = LAG_MM * (tick as f64 / BEFORE as f64).min(1.0);
            let ideal = follower.state.axes()[0].telemetry().reference;
            let place = ideal - Position::from_mm(lag, RESOLUTION_MM);
            let count = (place.0 >> 16) as u32;
            follower.inputs.set_counts([count, 0, 0]);
            follower.tick();
            rig.inputs.set_counts([count, 0, 0]);
            assert!(rig.tick().enabled);
            let seen = rig.state.axes()[0].telemetry();
            (
                seen.output.to_f64(Quantity::Voltage),
                seen.bumpless_offset.to_f64(Quantity::Voltage),
            )
        })
        .collect()
}

fn largest_jump(volts: &[(f64, f64)]) -> f64 {
    volts
        .windows(2)
        .map(|pair| (pair[1].0 - pair[0].0).abs())
        .fold(0.0, f64::max)
}

/// The stated bound: around the change no tick jumps more than the most that either law does by itself nearby, where
/// a new count alone moves the output by tens of millivolts.
fn check<S: Scalar>(what: &str, first: &StageSettings, second: &StageSettings) {
    let around = BEFORE - 300..BEFORE + 300;
    let normal = largest_jump(&volts::<S>(first, None)[around.clone()])
        .max(largest_jump(&volts::<S>(second, None)[around]));
    let changed = volts::<S>(first, Some(second));
    let jump = largest_jump(&changed[BEFORE - 2..BEFORE + 100]);
    println!("{what}: jump {jump:.4} V, in normal ticks {normal:.4} V");
    assert!(
        jump <= 1.05 * normal + 1e-6,
        "{what}: {jump} V against {normal} V"
    );
    // Without the transfer offset it would have jumped: the test tests.
    let offset = changed[BEFORE].1.abs();
    let later = changed[BEFORE + 500].1.abs();
    let faded = (-500.0 * 1e-4 / second.axes[0].feedback.transfer_s).exp();
    assert!(
        (later - offset * faded).abs() <= 0.01 * offset + 4e-6,
        "{what}: {offset} V fades to {later} V"
    );
    let end = changed.last().expect("ticks").1.abs();
    assert!(
        end <= 1e-3 * offset + 5e-6,
        "{what}: {end} V is left of {offset} V"
    );
}

fn all_scalars(what: &str, first: &StageSettings, second: &StageSettings) {
    check::<f64>(what, first, second);
    check::<f32>(what, first, second);
    check::<Fixed>(what, first, second);
}

/// A change of settings and its name.
type Change = (&'static str, fn(&mut AxisSettings));

fn linear(axis: &mut AxisSettings) {
    axis.feedback.law = LawKind::Pid;
}

#[test]
fn gains_change_without_a_jump() {
    let first = x_alone(linear);
    let changes: [Change; 5] = [
        ("kp", |axis| axis.feedback.pid.kp_v_per_mm *= 0.4),
        ("ki", |axis| axis.feedback.pid.ki_v_per_mm_s *= 10.0),
        ("kd", |axis| axis.feedback.pid.kd_v_s_per_mm *= 0.5),
        ("kd off", |axis| axis.feedback.pid.kd_v_s_per_mm = 0.0),
        ("filter", |axis| {
            axis.feedback.pid.derivative_filter_s = 1e-3
        }),
    ];
    for (what, change) in changes {
        let second = x_alone(|axis| {
            linear(axis);
            change(axis);
        });
        all_scalars(what, &first, &second);
        all_scalars(what, &second, &first);
    }
}

#[test]
fn any_two_laws_exchange_without_a_jump() {
    let with = |law| x_alone(|axis| axis.feedback.law = law);
    for from in LawKind::ALL {
        for to in LawKind::ALL {
            let what = format!("{from:?} to {to:?}");
            check::<f32>(&what, &with(from), &with(to));
            check::<Fixed>(&what, &with(from), &with(to));
        }
    }
}

#[test]
fn feedforward_kinds_exchange_without_a_jump() {
    for from in FeedforwardKind::ALL {
        for to in FeedforwardKind::ALL {
            let kind = |kind| x_alone(|axis| axis.feedforward.kind = kind);
            check::<f32>(&format!("{from:?} to {to:?}"), &kind(from), &kind(to));
        }
    }
}

#[test]
fn feedforward_gains_and_preview_change_without_a_jump() {
    let first = x_alone(|_| {});
    let changes: [Change; 4] = [
        ("gms", |axis| axis.feedforward.gains.presliding = 0.0),
        ("viscous", |axis| axis.feedforward.gains.viscous = 2.0),
        ("inertia", |axis| {
            axis.feedforward.gains.inertia_v_s2_per_mm = 1e-3
        }),
        ("preview", |axis| axis.feedforward.preview_s = 0.0),
    ];
    for (what, change) in changes {
        let second = x_alone(change);
        all_scalars(what, &first, &second);
        all_scalars(what, &second, &first);
    }
}

#[test]
fn a_second_change_starts_from_the_first_ones_remainder() {
    let (pid, npid) = (x_alone(linear), x_alone(|_| {}));
    let weak = x_alone(|axis| axis.feedback.pid.kp_v_per_mm *= 0.4);
    let mut rig = Rig::<f32>::new(&pid, &PlanSettings::default());
    rig.start();
    rig.inputs.set_counts([100, 0, 0]);
    for _ in 0..50 {
        rig.tick();
    }
    let output = |rig: &Rig<f32>| rig.state.axes()[0].telemetry().output;
    let before = output(&rig);
    rig.exchange(&npid);
    rig.tick();
    rig.exchange(&weak);
    rig.tick();
    // At rest only the integral moves: microvolts.
    assert!((output(&rig) - before).abs() < 1e-4);
}

#[test]
fn settings_exchanged_while_disabled_leave_no_offset() {
    let mut rig = Rig::<f32>::new(&x_alone(|_| {}), &PlanSettings::default());
    rig.exchange(&x_alone(linear));
    rig.tick();
    rig.start();
    assert_eq!(rig.state.axes()[0].telemetry().bumpless_offset, 0.0);
}
