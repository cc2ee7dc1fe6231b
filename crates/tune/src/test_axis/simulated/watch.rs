//! Limits that stop an experiment: travel, time, and the speed of an open loop. In a closed one the law has its own limit.

use crate::test_axis::{AxisInfo, Drive, Experiment, ExperimentError, open_loop_mm};

/// Control periods over which the velocity is watched.
const SPEED_TICKS: usize = 20;

/// Watches an experiment tick by tick.
pub(super) struct Watch<'a> {
    experiment: &'a Experiment,
    axis: AxisInfo,
    watched_mm: Option<f64>,
    /// Positions between which an axis in open loop stays, mm.
    open_loop_mm: Option<(f64, f64)>,
}

impl<'a> Watch<'a> {
    pub(super) fn new(experiment: &'a Experiment, axis: AxisInfo) -> Self {
        Self {
            experiment,
            axis,
            watched_mm: None,
            open_loop_mm: None,
        }
    }

    /// Checks the limits after `ticks` recorded control periods; `waits_for` is what the experiment has yet to do.
    pub(super) fn check(
        &mut self,
        ticks: usize,
        position_mm: f64,
        waits_for: &'static str,
    ) -> Result<(), ExperimentError> {
        let time_s = ticks as f64 / self.axis.rate_hz;
        let (low_mm, high_mm) = match self.experiment.drive {
            Drive::ClosedLoop(_) => (-self.axis.travel_mm, self.axis.travel_mm),
            Drive::OpenLoop => *self
                .open_loop_mm
                .get_or_insert_with(|| open_loop_mm(self.axis.travel_mm, position_mm)),
        };
        if !(low_mm..=high_mm).contains(&position_mm) {
            return Err(ExperimentError::Travel {
                experiment: self.experiment.name.clone(),
                travel_mm: self.axis.travel_mm,
                time_s,
            });
        }
        let is_open = matches!(self.experiment.drive, Drive::OpenLoop);
        if is_open && ticks.is_multiple_of(SPEED_TICKS) {
            let last_mm = self.watched_mm.replace(position_mm).unwrap_or(position_mm);
            let velocity_mm_s = (position_mm - last_mm) * self.axis.rate_hz / SPEED_TICKS as f64;
            if velocity_mm_s.abs() > self.axis.max_velocity_mm_s {
                return Err(ExperimentError::Overspeed {
                    experiment: self.experiment.name.clone(),
                    max_velocity_mm_s: self.axis.max_velocity_mm_s,
                    time_s,
                });
            }
        }
        if time_s >= self.experiment.time_limit_s {
            return Err(ExperimentError::TimedOut {
                experiment: self.experiment.name.clone(),
                time_limit_s: self.experiment.time_limit_s,
                reason: waits_for,
            });
        }
        Ok(())
    }
}
