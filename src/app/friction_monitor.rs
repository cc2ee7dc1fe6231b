//! The friction monitor: reports an axis whose friction, as learning finds it, is no longer what was commissioned.
//!
//! It runs in the supervising task on the snapshots. What it finds is shown, in the log and over the link, and never fed back.
//! A scale has settled when it has stayed within 3 % for 5 s of learning without vibration: a cut takes friction's hysteresis
//! away, and says nothing about the machine. It is reported when it is 5 % or more from the last one reported, so that an axis
//! fills neither log nor link.

use super::Snapshot;
use quadrant_law::axes::AxisName;
use quadrant_law::learning::{LearningReading, LearningStatus};
use quadrant_law::scalar::Scalar;
use quadrant_law::supervisor::FrictionChange;

/// Change of a scale that has settled.
const STEADY: f32 = 0.03;

/// Runs of learning for which it stays so: 5 s at 10 kHz.
const SETTLED_RUNS: u16 = 5_000;

/// Least change of a scale that is reported.
const MIN_REPORTED_CHANGE: f32 = 0.05;

/// Scales beyond which the axis needs maintenance: half as much friction again, or a third less.
const MAINTENANCE: [f32; 2] = [0.67, 1.5];

/// Least gate at which nothing vibrates.
const QUIET: f32 = 0.9;

/// The monitor's memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrictionMonitor {
    axes: [AxisMonitor; 3],
}

/// The memory of one axis; scales less 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct AxisMonitor {
    /// The scale that was reported last.
    reported: f32,
    /// The scale around which the present one may settle.
    anchor: f32,
    /// Runs of learning near the anchor.
    steady: u16,
}

impl FrictionMonitor {
    /// Takes the next snapshot; returns what has settled with it.
    pub fn step<S: Scalar>(&mut self, seen: &Snapshot<S>) -> [Option<FrictionChange>; 3] {
        core::array::from_fn(|index| {
            let scale = self.axes[index].step(&seen.axes[index].learning)?;
            Some(FrictionChange {
                axis: AxisName::ALL[index],
                percent: (100.0 * scale + 0.5) as u16,
                needs_maintenance: !(MAINTENANCE[0]..=MAINTENANCE[1]).contains(&scale),
            })
        })
    }
}

impl AxisMonitor {
    /// The scale, if it is to be reported now.
    fn step<S: Scalar>(&mut self, seen: &LearningReading<S>) -> Option<f32> {
        let scale = seen.scale();
        let deviation = scale - 1.0;
        if deviation == 0.0 {
            // Learning has begun again: what was reported counted from other settings.
            *self = Self::default();
        }
        if seen.status != LearningStatus::Learning || seen.gate() < QUIET {
            return None;
        }
        if (deviation - self.anchor).abs() > STEADY {
            self.anchor = deviation;
            self.steady = 0;
        }
        self.steady = self.steady.saturating_add(1);
        let changed = (deviation - self.reported).abs() >= MIN_REPORTED_CHANGE;
        if self.steady < SETTLED_RUNS || !changed {
            return None;
        }
        self.reported = deviation;
        Some(scale)
    }
}
