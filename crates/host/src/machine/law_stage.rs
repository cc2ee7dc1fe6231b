//! The simulated stage under the control law alone, as a machine.

use quadrant_law::axes::AxisName;
use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;
use quadrant_settings::StageSettings;
use quadrant_sim::settings_file::without_law;
use quadrant_sim::stage_file::StageFile;
use quadrant_sim::stage_setup::{BUILT_IN_STAGE, StageSetup};
use quadrant_tune::test_axis::{MachineError, SimulatedTestAxis, TestAxis, Travel};

use crate::machine::interface::Machine;

/// The simulated stage, with everything a real one has, under the control law alone.
#[derive(Clone, Debug)]
pub struct LawStage {
    setup: StageSetup,
    seed: u64,
    travel: [Travel; 3],
    description: String,
}

impl LawStage {
    /// A stage on the default settings; `seed` decides its noise.
    pub fn new(seed: u64) -> Self {
        Self {
            setup: StageSetup::commissioned(),
            seed,
            travel: [Travel::BUILT_IN; 3],
            description: BUILT_IN_STAGE.to_owned(),
        }
    }

    /// A stage of one's own, which nobody has commissioned.
    pub fn of(file: &StageFile, seed: u64) -> Self {
        Self {
            setup: StageSetup::of(file),
            seed,
            travel: file.known.map(Travel::of),
            description: format!("{BUILT_IN_STAGE} of {}", file.path.display()),
        }
    }

    /// The same stage under a firmware that starts with other settings: with the encoders and converters that these say, and with their
    /// travels.
    #[must_use]
    pub fn started_with(mut self, settings: &StageSettings) -> Self {
        self.setup = self.setup.started_with(settings);
        for (travel, axis) in self.travel.iter_mut().zip(&settings.axes) {
            if let Some(limits) = axis.limits.travel_mm {
                *travel = Travel::between([limits.negative, limits.positive]);
            }
        }
        self
    }

    /// The same stage while only one of its axes has a law.
    #[must_use]
    pub fn with_law_of(mut self, axis: AxisName) -> Self {
        for other in AxisName::ALL.into_iter().filter(|other| *other != axis) {
            without_law(
                &mut self.setup.settings.axes[other as usize],
                self.setup.settings.rate_hz,
            );
        }
        self
    }

    /// The travel of an axis from where it stands.
    pub const fn travel(&self, axis: AxisName) -> Travel {
        self.travel[axis as usize]
    }
}

impl Machine for LawStage {
    fn description(&self) -> String {
        self.description.clone()
    }

    fn is_simulated(&mut self) -> bool {
        true
    }

    fn settings(&mut self) -> Result<StageSettings, MachineError> {
        Ok(self.setup.settings.clone())
    }

    fn position_mm(&mut self, _: AxisName) -> Result<f64, MachineError> {
        Ok(0.0)
    }

    fn free_travel(&mut self, axis: AxisName) -> Result<Option<Travel>, MachineError> {
        Ok(Some(self.travel(axis)))
    }

    /// The axis as it was switched on, under its PID alone.
    fn test_axis(
        &mut self,
        axis: AxisName,
        travel: Travel,
    ) -> Result<Box<dyn TestAxis + '_>, MachineError> {
        let truth = self.setup.truth.axes[axis as usize].clone();
        let test_axis =
            SimulatedTestAxis::under(&self.setup.settings, axis as usize, truth, self.seed)
                .with_travel(travel);
        Ok(Box::new(test_axis))
    }

    fn load(&mut self, settings: &StageSettings) -> Result<(), MachineError> {
        settings.validate(FIRMWARE_ELEMENTS)?;
        self.setup.settings.copy_from(settings);
        Ok(())
    }

    fn store(&mut self, _: &str) -> Result<(), MachineError> {
        let reason =
            "the control law alone has no flash to store settings in: take another --machine";
        Err(MachineError::Connection(reason.into()))
    }
}
