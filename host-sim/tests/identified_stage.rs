//! The settings of the virtual machine are what commissioning its axes gives.

use quadrant_sim::commission::{CommissionSettings, commission};
use quadrant_sim::experiment::compensator::identified;
use quadrant_sim::plant::StageTruth;
use quadrant_sim::rig::SimulatedRig;
use quadrant_sim::settings_file::SettingsFile;
use rayon::prelude::*;

#[test]
fn commissioning_the_axes_again_gives_the_committed_settings() {
    let committed = identified().unwrap();
    let mut again = SettingsFile::new(quadrant::settings::StageSettings::default());
    again
        .stage
        .axes
        .par_iter_mut()
        .zip(StageTruth::real().axes)
        .enumerate()
        .for_each(|(index, (axis, truth))| {
            let mut rig = SimulatedRig::new(index, truth, 1);
            let request = CommissionSettings::default();
            *axis = commission(&mut rig, axis, &request, &mut |_, _| {})
                .unwrap()
                .settings;
        });
    assert_eq!(again.stage, committed.stage);
}
