//! Requests to move are checked against the settings, and refused with what was asked and what is allowed.

use quadrant_law::axes::AxisName;
use quadrant_law::reference::Velocity;
use quadrant_law::units::Position;
use quadrant_settings::{MoveFlaw, StageSettings};

use quadrant_test_support::with_x;

#[test]
fn a_move_to_a_position_ends_on_it_from_wherever_it_starts() {
    let settings = StageSettings::simulated();
    for from in [Position(0), Position(123_456_789), Position(-7)] {
        let made = settings
            .move_to(AxisName::Y, from, true, 12.345_678, 50.0)
            .expect("within the travel");
        let end = from + Position::from_mm(made.distance_mm, 5e-4);
        assert_eq!(end, Position::from_mm(12.345_678, 5e-4));
        assert_eq!(made.max_velocity_mm_s, 50.0);
    }
}

#[test]
fn a_move_is_refused_unless_the_axis_knows_where_it_is_and_may_go_there() {
    let settings = StageSettings::simulated();
    let refused = |homed, target_mm, velocity_mm_s| {
        settings
            .move_to(AxisName::Z, Position::ZERO, homed, target_mm, velocity_mm_s)
            .expect_err("refused")
    };
    assert_eq!(refused(false, 1.0, 1.0).flaw, MoveFlaw::NotHomed);
    for target_mm in [200.001, -200.001, f64::NAN, f64::INFINITY] {
        let error = refused(true, target_mm, 1.0);
        assert!(
            matches!(error.flaw, MoveFlaw::BeyondTravel { .. }),
            "{error}"
        );
    }
    let text = refused(true, 201.5, 1.0).to_string();
    assert_eq!(text, "z: 201.5 mm is outside the travel of -200 to 200 mm");
    for velocity_mm_s in [0.0, -1.0, 250.1, f64::NAN] {
        let error = refused(true, 1.0, velocity_mm_s);
        assert!(matches!(error.flaw, MoveFlaw::Velocity { .. }), "{error}");
    }
}

#[test]
fn a_jog_is_refused_beyond_the_largest_velocity() {
    let settings = StageSettings::simulated();
    let slow = settings.jog_at(AxisName::X, -3.0).expect("slow");
    assert_eq!(slow, Velocity::from_mm_s(-3.0, settings.motion_scale(0)));
    for velocity_mm_s in [250.1, -250.1, f64::NAN] {
        assert!(settings.jog_at(AxisName::X, velocity_mm_s).is_err());
    }
}

#[test]
fn an_axis_without_homing_cannot_be_homed() {
    let settings = with_x(|axis| axis.homing = None);
    assert_eq!(settings.validate(4), Ok(()));
    assert_eq!(settings.can_home(AxisName::Y), Ok(()));
    let error = settings.can_home(AxisName::X).expect_err("refused");
    assert!(error.to_string().starts_with("x: the axis has no homing"));
}

#[test]
fn the_travel_limits_a_stream_of_homed_axes_alone() {
    let [x, y, _] = StageSettings::simulated().stream_limits([true, false, true]);
    let end = Position::from_mm(200.0, 5e-4);
    assert_eq!(x.travel, Some((-end, end)));
    assert_eq!(y.travel, None);
    assert_eq!(y.max_velocity_mm_s, 250.0);
}
