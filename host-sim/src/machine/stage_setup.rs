//! Parts of a simulated machine that a person chooses: the stage that it drives, and its settings while nothing is stored.

use quadrant::settings::StageSettings;

use crate::plant::{MarkParameters, StageParameters};
use crate::stage_file::StageFile;

/// The stage of a simulated machine, and the settings of its firmware while its flash is empty.
#[derive(Clone, Debug, PartialEq)]
pub struct StageSetup {
    /// Settings without stored ones.
    pub settings: StageSettings,
    /// The stage.
    pub truth: StageParameters,
    /// Its switches and index pulses.
    pub marks: [MarkParameters; 3],
}

impl StageSetup {
    /// A stage under a firmware that nobody has commissioned: it knows no more than the encoders and the converter's full
    /// scale.
    pub fn fresh(truth: StageParameters, marks: [MarkParameters; 3]) -> Self {
        let mut settings = StageSettings::default();
        for ((axis, truth), marks) in settings.axes.iter_mut().zip(&truth.axes).zip(&marks) {
            axis.encoder.resolution_mm = truth.resolution_mm;
            axis.encoder.counts_per_index = u32::try_from(marks.counts_per_index).ok();
            axis.amplifier.full_scale_v = truth.full_scale_v;
        }
        Self {
            settings,
            truth,
            marks,
        }
    }

    /// The simulated stage under a firmware that nobody has commissioned.
    pub fn simulated() -> Self {
        Self::fresh(StageParameters::real(), [MarkParameters::default(); 3])
    }

    /// A stage of one's own under a firmware that nobody has commissioned.
    pub fn of(file: &StageFile) -> Self {
        Self::fresh(file.truth.clone(), file.marks)
    }

    /// The simulated stage with the settings that are chosen for it: for a quick look.
    pub fn commissioned() -> Self {
        Self {
            settings: StageSettings::simulated(),
            ..Self::simulated()
        }
    }
}

#[cfg(test)]
mod tests {
    use quadrant::friction::gms::FIRMWARE_ELEMENTS;

    use super::*;

    #[test]
    fn a_fresh_machine_has_a_boards_defaults_and_its_encoders_and_is_not_commissioned() {
        let fresh = StageSetup::simulated();
        let mut known = StageSettings::default();
        for axis in &mut known.axes {
            axis.encoder = StageSettings::simulated().axes[0].encoder;
        }
        assert_eq!(fresh.settings, known);
        assert!(!fresh.settings.is_commissioned());
        assert!(StageSetup::commissioned().settings.is_commissioned());
        let mut truth = StageParameters::real();
        truth.axes[1].resolution_mm = 1e-4;
        let other = StageSetup::fresh(truth, fresh.marks);
        assert_eq!(other.settings.axes[1].encoder.resolution_mm, 1e-4);
        other.settings.validate(FIRMWARE_ELEMENTS).unwrap();
    }
}
