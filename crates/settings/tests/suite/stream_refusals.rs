//! Set points that ask for too much are refused by their number, with the value and the limit.

use quadrant_law::axes::AxisName;
use quadrant_law::units::Position;
use quadrant_settings::stream_planner::{
    AxisPoint, SetPoint, StreamError, StreamFlaw, StreamLimits, StreamPlanner,
};

use crate::reference_stream::{LIMITS, mm, on_x, point};

#[test]
fn a_refused_set_point_is_named_with_its_flaw_and_its_limit() {
    let x = AxisName::X;
    let refused = |set_point: SetPoint| {
        let mut planner = StreamPlanner::new(
            [StreamLimits {
                travel: Some((mm(-1.0), mm(0.01))),
                ..LIMITS
            }; 3],
            10,
            [Position::ZERO; 3],
        );
        planner.plan(&on_x(1, AxisPoint::default())).expect("rest");
        planner.plan(&set_point).expect_err("refused")
    };
    let error = refused(on_x(1, AxisPoint::default()));
    assert_eq!(error.flaw, StreamFlaw::OutOfOrder { last: 1 });
    let error = refused(on_x(6, AxisPoint::default()));
    assert_eq!(error.flaw, StreamFlaw::Missing { missing: 4 });
    let error = refused(on_x(2, point(5.0, 0.0, 0.0)));
    assert!(
        matches!(error.flaw, StreamFlaw::Velocity { axis, value_mm_s, .. }
        if axis == x && (value_mm_s - 5000.0).abs() < 1.0)
    );
    let error = refused(on_x(2, point(0.0, 300.0, 0.0)));
    assert!(matches!(error.flaw, StreamFlaw::Velocity { axis, .. } if axis == x));
    let error = refused(on_x(2, point(0.005, 0.0, 0.0)));
    assert!(matches!(error.flaw, StreamFlaw::Acceleration { axis, .. } if axis == x));
    assert_eq!(error.number, 2);
    let text = error.to_string();
    assert!(
        text.starts_with("set point 2: x would accelerate at "),
        "{text}"
    );
    assert!(text.contains("above its limit of 2000.0 mm/s^2"), "{text}");
    let error = refused(SetPoint {
        last: true,
        ..on_x(2, point(0.0, 0.1, 0.0))
    });
    assert_eq!(error.flaw, StreamFlaw::NotAtRest { axis: x });
}

#[test]
fn the_way_between_two_set_points_within_the_travel_must_not_leave_it() {
    let limits = StreamLimits {
        travel: Some((mm(-1.0), mm(0.01))),
        ..LIMITS
    };
    let mut planner = StreamPlanner::new([limits; 3], 500, [Position::ZERO; 3]);
    // Both ends lie within; the speed at the second carries the way past it and back.
    let error = planner
        .plan(&on_x(1, point(0.009, -2.0, 0.0)))
        .expect_err("beyond the travel in between");
    let StreamFlaw::Travel {
        axis,
        value_mm,
        limit_mm,
    } = error.flaw
    else {
        panic!("{error}");
    };
    assert_eq!(axis, AxisName::X);
    assert!(value_mm > 0.01 && (limit_mm - 0.01).abs() < 1e-9, "{error}");
}

#[test]
fn a_refusal_is_an_error_like_any_other() {
    let error: &dyn core::error::Error = &StreamError {
        number: 3,
        flaw: StreamFlaw::NotAtRest { axis: AxisName::Z },
    };
    assert!(
        error
            .to_string()
            .contains("set point 3: it ends the stream, and z still moves")
    );
}

#[test]
fn a_set_point_that_moves_an_axis_without_a_law_is_refused() {
    let mut settings = quadrant_settings::StageSettings::simulated();
    settings.axes[0] = quadrant_settings::AxisSettings::default();
    let limits = settings.stream_limits([false; 3]);
    let mut planner = StreamPlanner::new(limits, 10, [Position::ZERO; 3]);
    planner
        .plan(&on_x(1, AxisPoint::default()))
        .expect("at rest");
    let error = planner
        .plan(&on_x(2, point(1e-6, 0.0, 0.0)))
        .expect_err("x has no law");
    assert_eq!(error.flaw, StreamFlaw::NoLaw { axis: AxisName::X });
    let text = error.to_string();
    assert!(
        text.starts_with("set point 2: x: ") && text.contains("no law"),
        "{text}"
    );
}
