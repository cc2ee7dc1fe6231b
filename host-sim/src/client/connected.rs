//! A connected machine as one that is measured.

use std::error::Error;

use quadrant::axes::AxisName;
use quadrant::link::message::Body;
use quadrant::settings::StageSettings;

use super::session::Client;
use super::settings;
use super::test_axis::ConnectedAxis;
use crate::machine::{Machine, MachineError, TestAxis};

fn connection(error: impl Error + Send + Sync + 'static) -> MachineError {
    MachineError::Connection(Box::new(error))
}

impl Machine for Client {
    fn description(&self) -> String {
        format!("{} ({})", self.endpoint(), self.identity().board)
    }

    fn is_simulated(&mut self) -> bool {
        self.simulated_io().is_some()
    }

    fn settings(&mut self) -> Result<StageSettings, MachineError> {
        settings::dump(self).map_err(connection)
    }

    /// The way to the nearer soft limit; `None` while the axis is not homed, or has no soft limits.
    fn free_travel_mm(&mut self, axis: AxisName) -> Result<Option<f64>, MachineError> {
        let status = self.status().map_err(connection)?;
        let stage = Machine::settings(self)?;
        let here = status.axes[axis as usize].position_mm;
        let limits = &stage.axes[axis as usize].limits;
        let travel = limits
            .travel_mm
            .filter(|_| status.homed.contains(axis.into()));
        Ok(travel.map(|travel| (here - travel.negative).min(travel.positive - here)))
    }

    fn test_axis(
        &mut self,
        axis: AxisName,
        travel_mm: f64,
    ) -> Result<Box<dyn TestAxis + '_>, MachineError> {
        let test_axis = ConnectedAxis::new(self, axis, travel_mm).map_err(connection)?;
        Ok(Box::new(test_axis))
    }

    fn load(&mut self, stage: &StageSettings) -> Result<(), MachineError> {
        self.order(Body::Disable).map_err(connection)?;
        settings::load(self, stage).map_err(connection)?;
        Ok(())
    }

    fn store(&mut self, provenance: &str) -> Result<(), MachineError> {
        settings::store(self, provenance).map_err(connection)
    }
}
