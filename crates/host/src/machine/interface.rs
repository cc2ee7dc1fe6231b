//! A machine whose axes can be measured.

use quadrant_law::axes::AxisName;
use quadrant_settings::StageSettings;
use quadrant_tune::test_axis::{MachineError, TestAxis, Travel};

/// A machine with three axes: the one start of identification and commissioning.
pub trait Machine {
    /// Name for messages and pages, such as "the simulated stage".
    fn description(&self) -> String;

    /// True if no real axis moves.
    fn is_simulated(&mut self) -> bool;

    /// Reads the settings that measurements start from.
    ///
    /// # Errors
    /// A connection that is broken.
    fn settings(&mut self) -> Result<StageSettings, MachineError>;

    /// Returns the position of an axis as the machine counts it, mm.
    ///
    /// # Errors
    /// A connection that is broken.
    fn position_mm(&mut self, axis: AxisName) -> Result<f64, MachineError>;

    /// Returns the travel that an axis has from where it stands; `None` if it is not known.
    ///
    /// # Errors
    /// A connection that is broken.
    fn free_travel(&mut self, axis: AxisName) -> Result<Option<Travel>, MachineError>;

    /// Returns an axis for experiments, which keep it within `travel` of where it stands.
    ///
    /// # Errors
    /// A connection that is broken.
    fn test_axis(
        &mut self,
        axis: AxisName,
        travel: Travel,
    ) -> Result<Box<dyn TestAxis + '_>, MachineError>;

    /// Switches the outputs off and puts settings in force.
    ///
    /// # Errors
    /// Settings that are refused; the old ones stay in force.
    fn load(&mut self, settings: &StageSettings) -> Result<(), MachineError>;

    /// Keeps the settings in force for the next start, with the text that says where they come from.
    ///
    /// # Errors
    /// A machine without a flash, or a flash that failed.
    fn store(&mut self, provenance: &str) -> Result<(), MachineError>;
}
