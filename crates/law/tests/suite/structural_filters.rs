//! Filters behind the feedback law: the response of their definition, in every number type, without a jolt.

use quadrant_settings::response::{LinearResponse, sampled_filter_response};
use std::f64::consts::TAU;

use proptest::prelude::*;
use quadrant_law::axis::telemetry::LimitedBy;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::control::filter::{FilterList, FilterSettings, Filters, FiltersState};
use quadrant_law::scalar::{Fixed, Quantity, Scalar};
use quadrant_settings::Reason;
use quadrant_settings::{AxisSettings, PlanSettings, StageSettings};

use quadrant_test_support::{Rig, repeatable, sine_on_x, x_alone};

const PERIOD_S: f64 = 1e-4;
const ROOM: usize = 10;

fn run<S: Scalar>(settings: &[FilterSettings], inputs: impl Iterator<Item = f64>) -> Vec<f64> {
    let filters = Filters::<S>::build(settings, PERIOD_S);
    let mut state = FiltersState::default();
    inputs
        .map(|input| {
            let output = filters.step(&mut state, S::quantise(input, Quantity::Voltage));
            output.to_f64(Quantity::Voltage)
        })
        .collect()
}

/// Gain and phase at a frequency with whole periods in half a second.
fn measured(settings: &[FilterSettings], frequency_hz: f64) -> (f64, f64) {
    const TICKS: usize = 20_000;
    let phase = |tick: usize| TAU * frequency_hz * PERIOD_S * tick as f64;
    let outputs = run::<f64>(settings, (0..TICKS).map(|tick| phase(tick).cos()));
    let (mut re, mut im) = (0.0, 0.0);
    for (tick, output) in outputs.iter().enumerate().skip(TICKS - 5000) {
        re += output * phase(tick).cos() / 2500.0;
        im -= output * phase(tick).sin() / 2500.0;
    }
    (re.hypot(im), im.atan2(re))
}

fn pair() -> [FilterSettings; 2] {
    [
        FilterSettings::notch(120.0, 0.4, 0.1),
        FilterSettings::low_pass(900.0, 0.7),
    ]
}

#[test]
fn the_filters_have_the_response_of_their_definition() {
    for frequency_hz in [10.0, 60.0, 120.0, 200.0, 900.0, 3000.0] {
        let omega = TAU * frequency_hz;
        let sampled = pair().map(|filter| sampled_filter_response(&filter, omega, PERIOD_S));
        let expected = sampled[0] * sampled[1];
        let (gain, phase) = measured(&pair(), frequency_hz);
        assert!(
            (gain - expected.norm()).abs() < 1e-6,
            "{frequency_hz} Hz: {gain}"
        );
        assert!(
            (phase - expected.arg()).abs() < 1e-5,
            "{frequency_hz} Hz: {phase}"
        );
    }
}

#[test]
fn a_notch_has_its_gain_at_its_frequency_and_one_far_from_it() {
    let notch = FilterSettings::notch(300.0, 0.3, 0.05);
    assert!((measured(&[notch], 300.0).0 - 0.05).abs() < 1e-6);
    assert!((measured(&[notch], 10.0).0 - 1.0).abs() < 1e-3);
    assert!((measured(&[notch], 4600.0).0 - 1.0).abs() < 1e-3);
}

#[test]
fn a_low_pass_falls_with_the_square_of_the_frequency() {
    let low_pass = FilterSettings::low_pass(50.0, 0.7);
    let gain = low_pass.response(TAU * 5000.0).norm();
    assert!((gain * 1e4 - 1.0).abs() < 1e-2, "{gain}");
}

#[test]
fn settled_filters_pass_the_output_they_are_settled_behind_to_the_bit() {
    let filters = Filters::<f32>::build(&pair(), PERIOD_S);
    let mut state = FiltersState::default();
    filters.settle(&mut state, 1.234);
    for _ in 0..100 {
        assert_eq!(filters.step(&mut state, 1.234), 1.234);
    }
}

fn any_filter() -> impl Strategy<Value = FilterSettings> {
    (1.0..4500.0f64, 0.1..2.0f64, 0.0..=1.0f64, 0.0..=1.0f64).prop_map(
        |(frequency_hz, damping, centre_gain, high_frequency_gain)| FilterSettings {
            frequency_hz,
            damping,
            centre_gain,
            high_frequency_gain,
        },
    )
}

proptest! {
    #![proptest_config(repeatable(200))]

    /// The bound grows with the inverse of the frequency: a rounding is integrated for as long.
    #[test]
    fn fixed_point_differs_from_f64_by_a_bound(
        filter in any_filter(),
        inputs in prop::collection::vec(-4.0..4.0f64, 2000),
    ) {
        let exact = run::<f64>(&[filter], inputs.iter().copied());
        let fixed = run::<Fixed>(&[filter], inputs.iter().copied());
        let bound = 3e-7 + 2e-4 / filter.frequency_hz;
        for (exact, fixed) in exact.iter().zip(&fixed) {
            prop_assert!((exact - fixed).abs() < bound, "{exact} {fixed}");
        }
    }

    #[test]
    fn a_steady_voltage_comes_through(filter in any_filter(), volts in -5.0..5.0f64) {
        let filter = FilterSettings { frequency_hz: filter.frequency_hz.max(30.0), ..filter };
        let outputs = run::<Fixed>(&[filter], std::iter::repeat_n(volts, 20_000));
        prop_assert!((outputs[19_999] - volts).abs() < 1e-5);
    }
}

/// The x axis under its PID alone: the filters' lag takes some of the nonlinear gain that an N-PID may have.
fn pid_alone() -> StageSettings {
    x_alone(|axis| axis.feedback.law = LawKind::Pid)
}

fn with_filters(filters: &[FilterSettings]) -> StageSettings {
    x_alone(|axis: &mut AxisSettings| {
        axis.feedback.law = LawKind::Pid;
        axis.feedback.filters = Some(filters.iter().copied().collect::<FilterList>());
    })
}

fn outputs(settings: &StageSettings, plan: &PlanSettings) -> Vec<f32> {
    let mut rig = Rig::<f32>::new(settings, plan);
    rig.start();
    (0..3000)
        .map(|tick| {
            let reference = rig.state.axes()[0].telemetry().reference;
            let count = (reference.0 >> 16) - tick / 100;
            rig.inputs.set_counts([count as u32, 0, 0]);
            assert!(rig.tick().enabled);
            rig.state.axes()[0].telemetry().output
        })
        .collect()
}

#[test]
fn every_parameter_of_a_filter_changes_the_output() {
    let plan = sine_on_x(10.0, 20.0);
    let base = FilterSettings {
        frequency_hz: 400.0,
        damping: 0.4,
        centre_gain: 0.3,
        high_frequency_gain: 0.8,
    };
    let unchanged = outputs(&with_filters(&[base]), &plan);
    assert_ne!(unchanged, outputs(&pid_alone(), &plan));
    let changes: [fn(&mut FilterSettings); 4] = [
        |filter| filter.frequency_hz *= 1.1,
        |filter| filter.damping *= 1.1,
        |filter| filter.centre_gain *= 1.1,
        |filter| filter.high_frequency_gain *= 1.1,
    ];
    for change in changes {
        let mut changed = base;
        change(&mut changed);
        assert_ne!(
            unchanged,
            outputs(&with_filters(&[changed]), &plan),
            "{changed:?}"
        );
    }
}

#[test]
fn a_filter_that_is_put_in_while_the_output_stands_does_not_jolt() {
    let plan = PlanSettings::default();
    let mut rig = Rig::<f32>::new(&pid_alone(), &plan);
    rig.start();
    let mut output = 0.0;
    for tick in 0..4000 {
        if tick == 2000 {
            rig.exchange(&with_filters(&pair()));
        }
        rig.inputs.set_counts([(-20i32) as u32, 0, 0]);
        assert!(rig.tick().enabled);
        let now = rig.state.axes()[0].telemetry().output;
        if tick >= 1990 {
            // The integral goes on.
            assert!(
                (now - output).abs() < 1e-3,
                "tick {tick}: {output} then {now}"
            );
        }
        output = now;
    }
}

#[test]
fn an_output_that_the_filters_take_beyond_its_limit_counts_as_limited() {
    // Five times as much at its frequency, of which the tests' encoder shows an error.
    let mut settings = with_filters(&[FilterSettings::low_pass(1500.0, 0.1)]);
    settings.axes[0].amplifier.output_limit_v = 2.0;
    let mut rig = Rig::<f32>::new(&settings, &PlanSettings::default());
    rig.start();
    let mut limited = 0;
    for tick in 0..2000 {
        let phase = TAU * 1500.0 * PERIOD_S * f64::from(tick);
        let counts = (30.0 * phase.sin()).round() as i32;
        rig.inputs.set_counts([counts as u32, 0, 0]);
        assert!(rig.tick().enabled);
        let seen = rig.state.axes()[0].telemetry();
        let at_limit = seen.output.abs() == 2.0;
        assert_eq!(at_limit, seen.limited_by == LimitedBy::OutputLimit);
        limited += u32::from(at_limit);
    }
    assert!(limited > 100, "{limited}");
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let good = FilterSettings::notch(300.0, 0.4, 0.1);
    let refused: [(&str, FilterSettings); 5] = [
        (
            "feedback.filters.frequency_hz",
            FilterSettings {
                frequency_hz: 4501.0,
                ..good
            },
        ),
        (
            "feedback.filters.frequency_hz",
            FilterSettings {
                frequency_hz: f64::NAN,
                ..good
            },
        ),
        (
            "feedback.filters.damping",
            FilterSettings {
                damping: 0.09,
                ..good
            },
        ),
        (
            "feedback.filters.centre_gain",
            FilterSettings {
                centre_gain: 1.1,
                ..good
            },
        ),
        (
            "feedback.filters.high_frequency_gain",
            FilterSettings {
                high_frequency_gain: -0.1,
                ..good
            },
        ),
    ];
    for (field, filter) in refused {
        let error = with_filters(&[good, filter]).validate(ROOM).unwrap_err();
        assert_eq!(error.field, field);
    }
    assert_eq!(with_filters(&[good]).validate(ROOM), Ok(()));
    assert_eq!(
        with_filters(&[]).validate(ROOM).unwrap_err().field,
        "feedback.filters"
    );
}

#[test]
fn filters_whose_lag_makes_the_loop_unstable_are_refused() {
    let slow = with_filters(&[FilterSettings::low_pass(20.0, 0.7)]);
    let error = slow.validate(ROOM).unwrap_err();
    assert!(
        matches!(error.reason, Reason::Unstable | Reason::BeyondPopov { .. }),
        "{error}"
    );
}

#[test]
fn the_list_is_read_and_written_by_its_path() {
    let path = "/axes/x/feedback/filters";
    let mut settings = StageSettings::simulated();
    let json =
        br#"[{"frequency_hz":120.0,"damping":0.4,"centre_gain":0.1,"high_frequency_gain":1.0}]"#;
    settings.set_json(path, json).unwrap();
    assert_eq!(
        settings.axes[0].feedback.filters.as_deref(),
        Some(&[FilterSettings::notch(120.0, 0.4, 0.1)][..])
    );
    let mut bytes = [0; 128];
    let (kind, length) = settings.get_bytes(path, &mut bytes).unwrap();
    let mut other = StageSettings::simulated();
    other.set_bytes(path, kind, &bytes[..length]).unwrap();
    assert_eq!(other, settings);
    other.set_json(path, b"null").unwrap();
    assert_eq!(other, StageSettings::simulated());
}
