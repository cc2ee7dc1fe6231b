//! The nominal characteristic trajectory of the simulated axes, against the physics they were made of.

use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::identify::characteristic::{
    Characteristic, CharacteristicError, CharacteristicSettings, evaluate, measure,
};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::SimulatedTestAxis;

fn coast(index: usize, truth: AxisParameters) -> Result<Characteristic, CharacteristicError> {
    let mut test_axis = SimulatedTestAxis::new(index, truth, 3);
    measure(
        &mut test_axis,
        &CharacteristicSettings::default(),
        &mut |_| {},
    )
}

/// Distance in which the axis stops from a speed, by small steps of the equation of motion, mm.
fn stopping_distance(truth: &AxisParameters, speed: f64) -> f64 {
    let (a, b) = (truth.gain_mm_per_v_s2, truth.damping_per_s);
    let friction = &truth.friction;
    let step_s = 1e-6;
    let (mut v, mut x) = (speed, 0.0);
    while v > 0.0 {
        let mean = 0.5 * (friction.positive.friction_v(v) - friction.negative.friction_v(-v));
        x += v * step_s;
        v -= (a * mean + b * v) * step_s;
    }
    x
}

#[test]
fn the_trajectory_is_how_the_axis_comes_to_rest() {
    for (index, truth) in StageParameters::real().axes.into_iter().enumerate() {
        let found = coast(index, truth.clone()).unwrap();
        // The last micrometres differ: friction is not the same both ways.
        assert!(found.scatter < 0.2, "{}", found.scatter);
        for &(distance, speed) in found.trajectory.iter().filter(|(_, speed)| *speed > 20.0) {
            let exact = stopping_distance(&truth, speed);
            // Friction gives way over tens of micrometres before the axis stands, and the screw ripples.
            assert!(
                (distance - exact).abs() < 0.05 * exact + 0.02,
                "axis {index}: {distance} mm at {speed} mm/s, {exact} expected"
            );
        }
    }
}

#[test]
fn control_follows_the_line_of_its_slope_up_to_the_knee_and_the_trajectory_beyond() {
    let mut light = StageParameters::real().axes[0].clone();
    // A tenth of the friction: the axis coasts far.
    for model in [&mut light.friction.positive, &mut light.friction.negative] {
        model.curve.coulomb_v *= 0.1;
        model.curve.breakaway_v *= 0.1;
    }
    for element in &mut light.gms.elements {
        element.stiffness_v_per_mm *= 0.1;
    }
    let found = coast(0, light).unwrap();
    let slope = 201.0;
    let knee = found.knee_mm(slope).expect("a knee");
    let points = found.points(slope, 90.0);
    assert!((points[0].velocity_mm_s / points[0].error_mm - slope).abs() < 1e-9);
    assert!(points.len() > 5, "{points:?}");
    for pair in points.windows(2) {
        assert!(
            pair[1].error_mm > pair[0].error_mm && pair[1].velocity_mm_s >= pair[0].velocity_mm_s
        );
        assert!(
            pair[1].error_mm > 0.9 * knee
                && pair[1].velocity_mm_s <= slope * pair[1].error_mm * 1.01
        );
    }
    // With more friction than control may brake with, the line is all there is.
    let heavy = coast(0, StageParameters::real().axes[0].clone()).unwrap();
    assert_eq!(heavy.knee_mm(slope), None);
    assert_eq!(heavy.points(slope, 250.0).len(), 1);
}

#[test]
fn an_axis_that_stays_slow_and_recordings_that_are_no_test_are_refused() {
    let mut test_axis = SimulatedTestAxis::new(0, StageParameters::real().axes[0].clone(), 1);
    let weak = CharacteristicSettings {
        most_voltage_v: 0.15,
        ..CharacteristicSettings::default()
    };
    let error = measure(&mut test_axis, &weak, &mut |_| {}).unwrap_err();
    assert!(matches!(error, CharacteristicError::Slow { .. }), "{error}");

    let still = Recording {
        sample_time_s: 1e-4,
        reference_mm: vec![0.0; 1000],
        position_mm: vec![0.0; 1000],
        voltage_v: vec![0.0; 1000],
        injection_v: vec![0.0; 1000],
        parts: Vec::new(),
    };
    let error = evaluate(still, 5e-4).unwrap_err();
    assert!(
        matches!(error, CharacteristicError::NoPasses { passes: 0 }),
        "{error}"
    );

    let found = coast(0, StageParameters::real().axes[0].clone()).unwrap();
    // Cut while the axis still moves.
    let driven = found
        .recording
        .voltage_v
        .iter()
        .rposition(|v| v.abs() > 0.0)
        .unwrap();
    let error = evaluate(found.recording.slice(0..driven + 60), 5e-4).unwrap_err();
    assert!(
        matches!(error, CharacteristicError::Coasting { .. }),
        "{error}"
    );
}
