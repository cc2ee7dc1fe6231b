//! The law on `f32` and in fixed point differs from the law on `f64` by microvolts.

use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::{PlanSettings, StageSettings};

use quadrant_test_support::{Noise, Rig, sine_on_x};

/// One axis at one tick: proportional, integral, derivative, feedforward, output (V), and the code.
type Shown = ([f64; 5], i16);

/// All axes over a motion with noise on the counts: the same counts for every type.
fn run<S: Scalar>(kind: FeedforwardKind, plan: &PlanSettings, ticks: usize) -> Vec<[Shown; 3]> {
    let mut settings = StageSettings::simulated();
    for axis in &mut settings.axes {
        axis.feedforward.kind = kind;
    }
    let mut rig = Rig::<S>::new(&settings, plan);
    let mut noise = Noise::new(3);
    let mut lag = [0i64; 3];
    rig.start();
    (0..ticks)
        .map(|_| {
            for (index, lag) in lag.iter_mut().enumerate() {
                // A machine that wanders about its reference by up to 0.15 mm, past the knee of k(e).
                *lag = (*lag + noise.counts(2)).clamp(-300, 300);
                let reference = rig.state.axes()[index].telemetry().reference;
                rig.inputs.readings[index].count = ((reference.0 >> 16) + *lag) as u32;
            }
            assert!(rig.tick().enabled);
            core::array::from_fn(|index| {
                let seen = rig.state.axes()[index].telemetry();
                let volts = [
                    seen.feedback.proportional,
                    seen.feedback.integral,
                    seen.feedback.derivative,
                    seen.feedforward.total(),
                    seen.output,
                ];
                (volts.map(|v| v.to_f64(Quantity::Voltage)), seen.code.0)
            })
        })
        .collect()
}

/// Largest deviations from `f64`, per term, and the share of codes that differ, none by more than one.
fn deviation<S: Scalar>(name: &str, kind: FeedforwardKind) -> [f64; 5] {
    const TICKS: usize = 250_000;
    let (exact, other) = (
        run::<f64>(kind, &three_sines(), TICKS),
        run::<S>(kind, &three_sines(), TICKS),
    );
    let mut worst = [0.0f64; 5];
    let mut differ = 0u32;
    for (exact, other) in exact.iter().flatten().zip(other.iter().flatten()) {
        for ((worst, exact), other) in worst.iter_mut().zip(exact.0).zip(other.0) {
            *worst = worst.max((exact - other).abs());
        }
        let step = (i32::from(exact.1) - i32::from(other.1)).abs();
        assert!(step <= 1, "codes differ by {step}");
        differ += u32::from(step != 0);
    }
    let share = 100.0 * f64::from(differ) / (3 * TICKS) as f64;
    let [p, i, d, feedforward, output] = worst.map(|volts| volts * 1e6);
    println!(
        "{name}, {kind:?}, against f64 over 25 s, uV: P {p:.3}, I {i:.3}, D {d:.3}, feedforward {feedforward:.3}, \
         output {output:.3}; {share:.2} % of the words differ, by one code"
    );
    worst
}

fn three_sines() -> PlanSettings {
    let sine = sine_on_x(30.0, 10.0).motions[0];
    PlanSettings { motions: [sine; 3] }
}

#[test]
fn fixed_point_output_is_within_microvolts_of_double_precision() {
    let [p, i, d, feedforward, output] = deviation::<Fixed>("fixed", FeedforwardKind::Combined);
    assert!(
        p < 1e-6 && i < 1e-6 && d < 25e-6 && feedforward < 10e-6,
        "{p} {i} {d} {feedforward}"
    );
    assert!(output < 30e-6, "{output} V");
}

#[test]
fn single_precision_output_is_within_microvolts_of_double_precision() {
    let [p, i, d, feedforward, output] = deviation::<f32>("f32", FeedforwardKind::Combined);
    assert!(
        p < 1e-6 && i < 1e-6 && d < 25e-6 && feedforward < 10e-6,
        "{p} {i} {d} {feedforward}"
    );
    assert!(output < 20e-6, "{output} V");
}

#[test]
fn the_other_friction_models_are_within_microvolts_of_double_precision_too() {
    for (kind, most_fixed) in [
        (FeedforwardKind::Dahl, 10e-6),
        (FeedforwardKind::Lugre, 10e-6),
        (FeedforwardKind::SmoothedGms, 15e-6),
    ] {
        let [.., fixed, _] = deviation::<Fixed>("fixed", kind);
        let [.., single, _] = deviation::<f32>("f32", kind);
        assert!(
            fixed < most_fixed && single < 10e-6,
            "{kind:?}: {fixed} {single} V"
        );
    }
}

#[test]
fn the_law_is_not_the_same_to_the_bit_in_every_type() {
    let plan = three_sines();
    let kind = FeedforwardKind::Combined;
    assert_ne!(
        run::<f64>(kind, &plan, 2000),
        run::<Fixed>(kind, &plan, 2000)
    );
}
