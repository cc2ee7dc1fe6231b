//! Motions are held to their ranges and to what their axis can do.

use quadrant_law::axes::AxisName;
use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_settings::{PlanSettings, SettingsError, StageSettings};

use crate::whole_set::check_message;
use quadrant_test_support::with_x;

fn plan_refusal(motion: MotionSettings) -> SettingsError {
    let mut plan = PlanSettings::default();
    plan.motions[1] = motion;
    plan.validate(&StageSettings::simulated())
        .expect_err("refused")
}

#[test]
fn every_number_of_a_motion_is_refused_by_name() {
    type SineField = fn(&mut HarmonicSettings) -> &mut f64;
    let sine = HarmonicSettings::with_velocity(30.0, 10.0, 2.0, 0.5);
    let fields: [(&str, SineField, f64, f64); 4] = [
        ("motion.amplitude_mm", |s| &mut s.amplitude_mm, 0.0, 1.1e4),
        ("motion.frequency_hz", |s| &mut s.frequency_hz, 0.0, 501.0),
        ("motion.phase_rad", |s| &mut s.phase_rad, -101.0, 101.0),
        ("motion.lead_s", |s| &mut s.lead_s, 0.9e-4, 101.0),
    ];
    for (field, place, below, above) in fields {
        for value in [below, above, f64::NAN, f64::INFINITY] {
            let mut sine = sine;
            *place(&mut sine) = value;
            check_message(
                &plan_refusal(MotionSettings::Harmonic(sine)),
                AxisName::Y,
                field,
            );
        }
    }
    for cycles in [-0.1, 1e9, f64::NAN] {
        let sine = HarmonicSettings {
            cycles: Some(cycles),
            ..sine
        };
        let error = plan_refusal(MotionSettings::Harmonic(sine));
        check_message(&error, AxisName::Y, "motion.cycles");
    }

    type MoveField = fn(&mut PointToPointSettings) -> &mut f64;
    let to = PointToPointSettings {
        distance_mm: 10.0,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 1000.0,
        max_jerk_mm_s3: 1e5,
    };
    let fields: [(&str, MoveField, f64, f64); 4] = [
        ("motion.distance_mm", |m| &mut m.distance_mm, -1.1e4, 1.1e4),
        (
            "motion.max_velocity_mm_s",
            |m| &mut m.max_velocity_mm_s,
            0.0,
            1001.0,
        ),
        (
            "motion.max_acceleration_mm_s2",
            |m| &mut m.max_acceleration_mm_s2,
            0.0,
            3.1e4,
        ),
        (
            "motion.max_jerk_mm_s3",
            |m| &mut m.max_jerk_mm_s3,
            0.0,
            1.1e9,
        ),
    ];
    for (field, place, below, above) in fields {
        for value in [below, above, f64::NAN, f64::INFINITY] {
            let mut to = to;
            *place(&mut to) = value;
            check_message(
                &plan_refusal(MotionSettings::PointToPoint(to)),
                AxisName::Y,
                field,
            );
        }
    }
}

#[test]
fn motions_faster_than_the_axis_are_refused() {
    let fast = HarmonicSettings::with_velocity(30.0, 251.0, 2.0, 0.5);
    let error = plan_refusal(MotionSettings::Harmonic(fast));
    assert_eq!(error.field, "motion (peak velocity, mm/s)");
    let abrupt = HarmonicSettings::with_velocity(30.0, 200.0, 2.0, 0.1);
    let error = plan_refusal(MotionSettings::Harmonic(abrupt));
    assert_eq!(error.field, "motion (peak acceleration, mm/s^2)");
}

#[test]
fn a_move_longer_than_the_tick_counter_is_refused() {
    let endless = PointToPointSettings {
        distance_mm: 1e4,
        max_velocity_mm_s: 1e-6,
        max_acceleration_mm_s2: 1000.0,
        max_jerk_mm_s3: 1e5,
    };
    let error = plan_refusal(MotionSettings::PointToPoint(endless));
    check_message(&error, AxisName::Y, "motion (duration, s)");
}

#[test]
fn a_move_to_where_the_axis_is_takes_no_time() {
    let mut plan = PlanSettings::default();
    plan.motions[1] = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: 0.0,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 1000.0,
        max_jerk_mm_s3: 1e5,
    });
    assert_eq!(plan.validate(&StageSettings::simulated()), Ok(()));
}

#[test]
fn a_travel_beyond_the_references_format_is_refused() {
    let stage = with_x(|axis| {
        axis.encoder.resolution_mm = 1e-6;
        axis.limits.max_velocity_mm_s = 10.0;
        axis.limits.max_acceleration_mm_s2 = 20.0;
    });
    let mut plan = PlanSettings::default();
    let sine = HarmonicSettings::with_velocity(3000.0, 10.0, 1.0, 10.0);
    plan.motions[0] = MotionSettings::Harmonic(sine);
    let error = plan.validate(&stage).expect_err("refused");
    check_message(&error, AxisName::X, "motion.amplitude_mm");
    plan.motions[0] = MotionSettings::PointToPoint(PointToPointSettings {
        distance_mm: -3000.0,
        max_velocity_mm_s: 10.0,
        max_acceleration_mm_s2: 10.0,
        max_jerk_mm_s3: 10.0,
    });
    let error = plan.validate(&stage).expect_err("refused");
    check_message(&error, AxisName::X, "motion.distance_mm");
}
