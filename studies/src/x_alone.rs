//! One axis under the law; the others are left out.

use quadrant_law::reference::MotionSettings;
use quadrant_settings::{AxisSettings, Job, PlanSettings, SettingsError, StageSettings};
use quadrant_sim::law_machine::LawMachine;
use quadrant_sim::run::ELEMENTS;

/// The law of an axis, as the x axis of a stage, with a motion to run.
///
/// # Errors
/// Settings that are refused.
pub(crate) fn law_of(
    axis: &AxisSettings,
    stage: &StageSettings,
    motion: MotionSettings,
) -> Result<LawMachine<f32, ELEMENTS>, SettingsError> {
    let machine = LawMachine::new(&Job {
        stage: StageSettings {
            // The others are like it, so that it waits for none.
            axes: [axis.clone(), axis.clone(), axis.clone()],
            ..stage.clone()
        },
        plan: PlanSettings {
            motions: [motion, MotionSettings::Hold, MotionSettings::Hold],
        },
    })?;
    Ok(machine.with_x_alone())
}
