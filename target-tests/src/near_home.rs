//! Axes that are homed within a few hundred ticks: they stand on their home switches.

use quadrant_settings::StageSettings;
use quadrant_sim::plant::MarkParameters;

/// Tick in which the outputs of a machine that homes and then runs its plan are asked for.
pub(crate) const ENABLE_TICK: u32 = 100;
/// Tick in which the first axis is asked to home.
pub(crate) const HOME_TICK: u32 = 200;
/// Tick in which the plan is asked for: homing has ended.
pub(crate) const RUN_TICK: u32 = 1_500;

/// Position at which the axes rest after homing, mm: off the switch, and between two index pulses.
pub(crate) const PARK_MM: f64 = 1.0;

/// Shortens the homing of a stage; returns where its switches and index pulses are to be.
pub(crate) fn prepare(stage: &mut StageSettings) -> MarkParameters {
    let marks = MarkParameters {
        home_mm: 0.02,
        ..MarkParameters::default()
    };
    for axis in &mut stage.axes {
        axis.encoder.counts_per_index = u32::try_from(marks.counts_per_index).ok();
        // The last move takes at least some three times as long as the acceleration takes to build up.
        axis.limits.max_jerk_mm_s3 = 1e6;
        if let Some(homing) = &mut axis.homing {
            homing.latch_mm_s = 10.0;
            // The reference mark is the release of the switch.
            homing.index = false;
            homing.mark_mm = 0.0;
            homing.park_mm = PARK_MM;
        }
    }
    marks
}
