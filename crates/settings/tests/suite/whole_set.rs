//! Every number out of its range is refused by name, with the value and what is allowed.

use quadrant_law::axes::AxisName;
use quadrant_law::control::pid::PidGains;
use quadrant_law::decimal::Decimal;
use quadrant_settings::{
    AxisSettings, FeedbackSettings, PlanSettings, PulseSettings, Reason, SerialSettings,
    SettingsError, StageSettings, TravelSettings,
};

use crate::fields::{FIELDS, number};
use crate::leaves::law_of;
use quadrant_test_support::with_x;

pub(crate) const ROOM: usize = 4;

pub(crate) fn refusal(settings: &StageSettings) -> SettingsError {
    settings.validate(ROOM).expect_err("refused")
}

/// Checks that the message names everything a person needs.
pub(crate) fn check_message(error: &SettingsError, axis: AxisName, field: &str) {
    assert_eq!((error.axis, error.field), (Some(axis), field));
    let text = error.to_string();
    assert!(
        text.starts_with(&format!(
            "{axis}/{} = {}",
            field.replace('.', "/"),
            Decimal(error.value)
        )),
        "{text}"
    );
    if let Reason::OutOfRange { least, most } = error.reason {
        let (least, most) = (Decimal(least), Decimal(most));
        assert!(
            text.ends_with(&format!("is outside {least} to {most}")),
            "{text}"
        );
    }
}

#[test]
fn every_number_out_of_its_range_is_refused_by_name_on_every_axis() {
    for (index, name) in AxisName::ALL.into_iter().enumerate() {
        for &(field, below, above) in FIELDS {
            for value in [below, above] {
                let mut settings = StageSettings::simulated();
                // Below breakaway is above x's coulomb level; other axes have other levels.
                settings.axes[index] = quadrant_settings::presets::x_axis();
                // An end that another setting decides is that of the law in force.
                if let Some(law) = law_of(field) {
                    settings.axes[index].feedback.law = law;
                }
                *number(&mut settings, name, field) = value;
                let error = refusal(&settings);
                check_message(&error, name, field);
                assert_eq!(error.value, value, "{field}");
                let outside = matches!(error.reason, Reason::OutOfRange { least, most }
                    if value < least || value > most);
                assert!(outside, "{field}: {error}");
            }
        }
    }
}

#[test]
fn a_serial_encoder_has_no_index() {
    let error = refusal(&with_x(|axis| {
        axis.encoder.serial = Some(SerialSettings::default())
    }));
    check_message(&error, AxisName::X, "encoder.counts_per_index");
    assert_eq!(error.reason, Reason::SerialHasNone);
}

#[test]
fn a_range_that_makes_a_spring_too_stiff_is_refused_by_its_own_name_with_its_least_value() {
    let error = refusal(&with_x(|axis| axis.feedforward.range = 0.05));
    check_message(&error, AxisName::X, "feedforward.range");
    let Reason::TooShortForRate { least } = error.reason else {
        panic!("{error}");
    };
    let mut settings = with_x(|axis| axis.feedforward.range = least * 1.001);
    settings.validate(10).unwrap();
    settings.axes[0].feedforward.range = least * 0.999;
    assert!(settings.validate(10).is_err());
}

#[test]
fn every_number_that_is_not_finite_is_refused_by_name() {
    for &(field, ..) in FIELDS {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut settings = StageSettings::simulated();
            *number(&mut settings, AxisName::X, field) = value;
            let error = refusal(&settings);
            check_message(&error, AxisName::X, field);
            assert_eq!(error.reason, Reason::NotFinite, "{field}");
        }
    }
}

#[test]
fn the_list_of_fields_is_complete() {
    fn numbers(value: &serde_json::Value) -> usize {
        match value {
            serde_json::Value::Number(_) => 1,
            serde_json::Value::Array(items) => items.iter().map(numbers).sum(),
            serde_json::Value::Object(fields) => fields.values().map(numbers).sum(),
            _ => 0,
        }
    }
    let axis = quadrant_settings::presets::x_axis();
    let elements = axis.friction.gms.elements.len();
    let stored = numbers(&serde_json::to_value(&axis).expect("plain data"));
    let points = axis.feedback.schedule.expect("by default").len();
    // One element and one point stand for all; the encoder has three whole numbers.
    assert_eq!(
        stored,
        FIELDS.len() + 2 * (elements - 1) + 4 * (points - 1) + 3
    );
}

#[test]
fn the_control_rate_the_brake_and_the_counter_width_have_ranges() {
    for rate_hz in [999.0, 1.01e5, f64::NAN] {
        let settings = StageSettings {
            rate_hz,
            ..StageSettings::simulated()
        };
        let error = refusal(&settings);
        assert_eq!((error.axis, error.field), (None, "rate_hz"));
        assert!(error.to_string().starts_with("rate_hz = "), "{error}");
    }
    for (release_s, apply_s, field) in [
        (-1e-3, 0.0, "brake.release_s"),
        (2.01, 0.0, "brake.release_s"),
        (0.0, -1e-3, "brake.apply_s"),
        (0.0, 2.01, "brake.apply_s"),
    ] {
        let mut settings = StageSettings::simulated();
        (settings.brake.release_s, settings.brake.apply_s) = (release_s, apply_s);
        let error = refusal(&settings);
        assert_eq!((error.axis, error.field), (None, field));
    }
    for bits in [0, 7, 33, 255] {
        let error = refusal(&with_x(|axis| axis.encoder.counter_bits = bits));
        check_message(&error, AxisName::X, "encoder.counter_bits");
    }
}

#[test]
fn the_spacing_of_the_index_and_its_tolerance_have_ranges() {
    for counts in [0, 15, 1_000_000_001] {
        let error = refusal(&with_x(|axis| axis.encoder.counts_per_index = Some(counts)));
        check_message(&error, AxisName::X, "encoder.counts_per_index");
    }
    let error = refusal(&with_x(|axis| axis.encoder.index_tolerance_counts = 5001));
    check_message(&error, AxisName::X, "encoder.index_tolerance_counts");
    let without = with_x(|axis| {
        axis.encoder.counts_per_index = None;
        axis.encoder.index_tolerance_counts = 5001;
        axis.homing.as_mut().expect("by default").index = false;
    });
    assert_eq!(without.validate(ROOM), Ok(()));
    let error = refusal(&with_x(|axis| axis.encoder.counts_per_index = None));
    check_message(&error, AxisName::X, "homing.index");
    assert!(error.to_string().contains("encoder/counts_per_index"));
}

#[test]
fn a_position_from_the_start_is_that_of_a_serial_encoder_alone_and_of_one_place_in_the_travel() {
    let with = |change: fn(&mut AxisSettings)| {
        with_x(|axis| {
            axis.homing = None;
            axis.encoder.counts_per_index = None;
            axis.encoder.counter_bits = 20;
            axis.encoder.serial = Some(SerialSettings::default());
            axis.encoder.offset_mm = Some(12.5);
            // 20 bits of 0.5 um are 524.3 mm.
            axis.limits.travel_mm = Some(TravelSettings {
                negative: -71.0,
                positive: 400.0,
            });
            change(axis);
        })
    };
    assert_eq!(with(|_| {}).validate(ROOM), Ok(()));
    assert_eq!(
        with(|axis| axis.limits.travel_mm = None).validate(ROOM),
        Ok(())
    );
    type Change = fn(&mut AxisSettings);
    let refused: [(Change, &str, &str); 4] = [
        (
            |axis| axis.encoder.serial = None,
            "encoder.offset_mm",
            "give encoder/serial",
        ),
        (
            |axis| {
                axis.homing = StageSettings::simulated().axes[0].homing;
                axis.homing.as_mut().expect("by default").index = false;
            },
            "encoder.offset_mm",
            "leave this or homing out",
        ),
        (
            |axis| axis.encoder.counter_bits = 19,
            "limits.travel_mm.positive",
            "the travel is longer than the 235.9",
        ),
        (
            |axis| {
                axis.encoder.serial = Some(SerialSettings {
                    clock_hz: 1.1e7,
                    ..SerialSettings::default()
                });
            },
            "encoder.serial.clock_hz",
            "is outside",
        ),
    ];
    for (change, field, says) in refused {
        let error = refusal(&with(change));
        check_message(&error, AxisName::X, field);
        assert!(error.to_string().contains(says), "{error}");
    }
}

#[test]
fn the_pulses_of_another_control_have_ranges_and_a_step_of_at_most_1024_counts() {
    let with = |change: fn(&mut PulseSettings)| {
        let mut pulses = PulseSettings {
            step_mm: 5e-3,
            ..PulseSettings::default()
        };
        change(&mut pulses);
        with_x(|axis| axis.pulses = Some(pulses))
    };
    assert_eq!(with(|_| {}).validate(ROOM), Ok(()));
    assert_eq!(
        with(|pulses| pulses.gear_numerator = 102).validate(ROOM),
        Ok(())
    );
    type Change = fn(&mut PulseSettings);
    let refused: [(Change, &str); 8] = [
        (|pulses| pulses.step_mm = 0.0, "pulses.step_mm"),
        (|pulses| pulses.step_mm = f64::NAN, "pulses.step_mm"),
        (|pulses| pulses.step_mm = 0.513, "pulses.step_mm"),
        (|pulses| pulses.gear_numerator = 103, "pulses.step_mm"),
        (|pulses| pulses.gear_numerator = 0, "pulses.gear_numerator"),
        (
            |pulses| pulses.gear_denominator = 0,
            "pulses.gear_denominator",
        ),
        (|pulses| pulses.delay_s = -1e-6, "pulses.delay_s"),
        (|pulses| pulses.delay_s = 24e-3, "pulses.delay_s"),
    ];
    for (change, field) in refused {
        check_message(&refusal(&with(change)), AxisName::X, field);
    }
    let missing = with_x(|axis| axis.pulses = Some(PulseSettings::default()));
    check_message(&refusal(&missing), AxisName::X, "pulses.step_mm");
}

#[test]
fn defaults_are_valid_at_every_rate_they_claim_and_with_room() {
    assert_eq!(StageSettings::simulated().validate(4), Ok(()));
    assert_eq!(StageSettings::simulated().validate(10), Ok(()));
    assert_eq!(
        PlanSettings::default().validate(&StageSettings::simulated()),
        Ok(())
    );
}

#[test]
fn all_laws_of_a_pid_are_within_the_ranges_of_their_parameters_however_soft_it_is() {
    for step in 0..2000 {
        let soft = 1.01_f64.powi(-step);
        let pid = PidGains {
            kp_v_per_mm: 5.0 * soft,
            ki_v_per_mm_s: 20.0 * soft,
            kd_v_s_per_mm: 0.02 * soft,
            derivative_filter_s: 1e-4,
        };
        let sliding_mode = FeedbackSettings::all_laws(pid, None, 250.0).sliding_mode;
        let widest = sliding_mode.map(|gains| gains.boundary_mm_s);
        assert!(widest.is_none_or(|mm_s| mm_s <= 1e3), "{soft}: {widest:?}");
    }
}
