//! The friction monitor: what has settled away from what was commissioned is reported once, and nothing else is.

use quadrant::app::Snapshot;
use quadrant::app::friction_monitor::FrictionMonitor;
use quadrant_law::axes::AxisName;
use quadrant_law::learning::{LearningReading, LearningStatus};
use quadrant_law::supervisor::FrictionChange;

/// Runs of the supervising task in a second.
const RUNS_PER_S: usize = 1_000;

/// A y axis of a scale, for some seconds; the changes that were reported.
fn reports(
    monitor: &mut FrictionMonitor,
    seconds: f64,
    reading: impl Fn(f64) -> LearningReading<f32>,
) -> Vec<FrictionChange> {
    (0..(seconds * RUNS_PER_S as f64) as usize)
        .flat_map(|run| {
            let mut seen = Snapshot::<f32>::default();
            seen.axes[1].learning = reading(run as f64 / RUNS_PER_S as f64);
            monitor.step(&seen)
        })
        .flatten()
        .collect()
}

fn learning(scale: f32) -> LearningReading<f32> {
    LearningReading {
        deviation: scale - 1.0,
        status: LearningStatus::Learning,
        ..LearningReading::default()
    }
}

fn change(percent: u16, needs_maintenance: bool) -> FrictionChange {
    FrictionChange {
        axis: AxisName::Y,
        percent,
        needs_maintenance,
    }
}

#[test]
fn a_friction_that_has_settled_elsewhere_is_reported_once() {
    let mut monitor = FrictionMonitor::default();
    let rising = |time_s: f64| learning(1.0 + (0.05 * time_s).min(0.18) as f32);
    assert_eq!(reports(&mut monitor, 8.0, rising), []);
    assert_eq!(
        reports(&mut monitor, 600.0, |_| learning(1.18)),
        [change(118, false)]
    );
    // Little more is not worth a line; as commissioned again is.
    assert_eq!(reports(&mut monitor, 60.0, |_| learning(1.21)), []);
    assert_eq!(
        reports(&mut monitor, 60.0, |_| learning(1.001)),
        [change(100, false)]
    );
}

#[test]
fn far_from_what_was_commissioned_asks_for_maintenance() {
    for (scale, percent, needs_maintenance) in [
        (1.49, 149, false),
        (1.51, 151, true),
        (0.68, 68, false),
        (0.66, 66, true),
    ] {
        let mut monitor = FrictionMonitor::default();
        assert_eq!(
            reports(&mut monitor, 20.0, |_| learning(scale)),
            [change(percent, needs_maintenance)]
        );
    }
}

#[test]
fn a_scale_that_moves_or_stands_or_is_shaken_by_a_cut_is_not_reported() {
    let none = |reading: &dyn Fn(f64) -> LearningReading<f32>| {
        assert_eq!(reports(&mut FrictionMonitor::default(), 60.0, reading), []);
    };
    none(&|time_s| learning(1.3 + 0.1 * (0.5 * time_s).sin() as f32));
    none(&|_| LearningReading {
        status: LearningStatus::AtRest,
        ..learning(1.3)
    });
    none(&|_| LearningReading {
        gate: -0.5,
        ..learning(0.4)
    });
}

#[test]
fn nothing_is_reported_when_learning_begins_anew_with_other_settings() {
    let mut monitor = FrictionMonitor::default();
    assert_eq!(
        reports(&mut monitor, 20.0, |_| learning(1.3)),
        [change(130, false)]
    );
    assert_eq!(reports(&mut monitor, 1.0, |_| learning(1.0)), []);
    assert_eq!(reports(&mut monitor, 60.0, |_| learning(1.01)), []);
}
