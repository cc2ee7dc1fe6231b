//! A connected machine as one that is measured.

use std::error::Error;

use quadrant::app::Translated;
use quadrant_law::axes::AxisName;
use quadrant_link::message::Body;
use quadrant_settings::StageSettings;
use quadrant_tune::test_axis::{MachineError, TestAxis, Travel};

use super::session::Client;
use super::settings;
use super::test_axis::ConnectedAxis;
use crate::machine::Machine;

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
        settings::in_force(self).map_err(connection)
    }

    fn position_mm(&mut self, axis: AxisName) -> Result<f64, MachineError> {
        let status = self.status().map_err(connection)?;
        Ok(status.axes[axis as usize].position_mm)
    }

    /// The ways to the soft limits; `None` while the axis is not homed, has no soft limits, or stands beyond one.
    fn free_travel(&mut self, axis: AxisName) -> Result<Option<Travel>, MachineError> {
        let status = self.status().map_err(connection)?;
        let stage = Machine::settings(self)?;
        let here = status.axes[axis as usize].position_mm;
        let limits = &stage.axes[axis as usize].limits;
        let travel = limits
            .travel_mm
            .filter(|_| status.homed.contains(Translated::translated(axis)));
        let room = travel.map(|travel| Travel {
            negative_mm: here - travel.negative,
            positive_mm: travel.positive - here,
        });
        Ok(room.filter(|room| room.nearer_mm() >= 0.0))
    }

    fn test_axis(
        &mut self,
        axis: AxisName,
        travel: Travel,
    ) -> Result<Box<dyn TestAxis + '_>, MachineError> {
        let test_axis = ConnectedAxis::new(self, axis, travel).map_err(connection)?;
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
