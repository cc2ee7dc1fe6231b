//! Parts of a simulated machine that a person chooses: the stage that it drives, and its settings while nothing is stored.

use quadrant_law::friction::Direction;
use quadrant_settings::{
    AxisSettings, HomeSwitch, HomingSettings, LimitSettings, StageSettings, TravelSettings,
};

use crate::plant::{AxisParameters, MarkParameters, StageParameters};
use crate::stage_file::{DataSheet, LIMIT_BEYOND_MM, StageFile};

/// Name of the built-in stage, for captions.
pub const BUILT_IN_STAGE: &str = "the simulated stage";

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

    /// A stage of one's own under a firmware that nobody has commissioned, and whose settings have what data sheets say: limits,
    /// travel, and where the home switch is.
    pub fn of(file: &StageFile) -> Self {
        let mut setup = Self::fresh(file.truth.clone(), file.marks);
        for ((axis, known), marks) in setup
            .settings
            .axes
            .iter_mut()
            .zip(&file.known)
            .zip(&file.marks)
        {
            if let Some(known) = known {
                enter_limits(&mut axis.limits, known, axis.encoder.resolution_mm);
                axis.homing = Some(HomingSettings {
                    search_mm_s: SEARCH_MM_S.min(known.max_velocity_mm_s),
                    latch_mm_s: LATCH_MM_S.min(known.max_velocity_mm_s),
                    mark_mm: marks.index_count as f64 * axis.encoder.resolution_mm,
                    travel_mm: known.span_mm() + 2.0 * LIMIT_BEYOND_MM,
                    ..homing()
                });
            }
        }
        setup
    }

    /// The same stage under a firmware that starts with other settings, and with the encoders and converters that these say.
    #[must_use]
    pub fn started_with(self, settings: &StageSettings) -> Self {
        let Self {
            mut truth,
            mut marks,
            ..
        } = self;
        for ((truth, marks), axis) in truth.axes.iter_mut().zip(&mut marks).zip(&settings.axes) {
            equip(truth, marks, axis);
        }
        Self {
            settings: settings.clone(),
            truth,
            marks,
        }
    }

    /// The simulated stage with the settings that are chosen for it: for a quick look.
    pub fn commissioned() -> Self {
        Self {
            settings: StageSettings::simulated(),
            ..Self::simulated()
        }
    }
}

/// Gives a simulated axis the encoder and the converter that settings say. Its noise is as many counts as before, and an index pulse is
/// where it was.
fn equip(truth: &mut AxisParameters, marks: &mut MarkParameters, settings: &AxisSettings) {
    let finer = truth.resolution_mm / settings.encoder.resolution_mm;
    let rescaled = |counts: i64| (counts as f64 * finer).round() as i64;
    let spacing = settings.encoder.counts_per_index.map(i64::from);
    marks.counts_per_index = spacing.unwrap_or_else(|| rescaled(marks.counts_per_index).max(1));
    marks.index_count = rescaled(marks.index_count);
    truth.imperfections.encoder_noise_mm /= finer;
    truth.resolution_mm = settings.encoder.resolution_mm;
    truth.full_scale_v = settings.amplifier.full_scale_v;
}

/// Velocity of the search for the home switch, mm/s.
const SEARCH_MM_S: f64 = 20.0;
/// Velocity of its second, exact approach, mm/s.
const LATCH_MM_S: f64 = 2.0;
/// Time by which an axis lags behind its reference at most, s: that of the simulated stage's settings.
const LAG_S: f64 = 2e-3;
/// Largest deceleration of a stop, mm/s²: the settings' bound.
const MOST_BRAKING_MM_S2: f64 = 3e4;
/// Largest tracking error at any speed, mm.
const MOST_ERROR_MM: f64 = 20.0;
/// Largest tracking error at any speed, counts.
const MOST_ERROR_COUNTS: f64 = 8e6;

/// Enters what a data sheet says.
pub fn enter_limits(limits: &mut LimitSettings, known: &DataSheet, resolution_mm: f64) {
    let [negative, positive] = known.travel_mm;
    limits.max_velocity_mm_s = known.max_velocity_mm_s;
    limits.max_acceleration_mm_s2 = known.max_acceleration_mm_s2;
    // Twice the largest acceleration, so that a motion that ends at the end of the travel does not look like one that will not.
    limits.braking_mm_s2 = limits
        .braking_mm_s2
        .max((2.0 * known.max_acceleration_mm_s2).min(MOST_BRAKING_MM_S2))
        .max(known.max_velocity_mm_s);
    limits.braking_jerk_mm_s3 = limits.braking_jerk_mm_s3.max(limits.braking_mm_s2);
    limits.following_error_lag_s = LAG_S;
    limits.following_error_max_mm = (limits.following_error_mm + LAG_S * known.max_velocity_mm_s)
        .min(MOST_ERROR_MM)
        .min(MOST_ERROR_COUNTS * resolution_mm);
    limits.travel_mm = Some(TravelSettings { negative, positive });
}

/// Homing by the home switch and the index pulse beside it.
fn homing() -> HomingSettings {
    HomingSettings {
        direction: Direction::Negative,
        switch: HomeSwitch::Home,
        search_mm_s: SEARCH_MM_S,
        latch_mm_s: LATCH_MM_S,
        debounce_s: 5e-4,
        index: true,
        mark_mm: 0.0,
        park_mm: 0.0,
        travel_mm: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use quadrant_law::friction::gms::FIRMWARE_ELEMENTS;

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

    #[test]
    fn a_machine_that_starts_with_settings_has_the_encoder_and_the_converter_that_they_say() {
        let same = StageSetup::simulated().started_with(&StageSettings::simulated());
        assert_eq!(same, StageSetup::commissioned());
        let mut settings = StageSettings::simulated();
        settings.axes[1].encoder.resolution_mm = 1e-3;
        settings.axes[1].encoder.counts_per_index = Some(5000);
        settings.axes[1].amplifier.full_scale_v = 5.0;
        let setup = StageSetup::simulated().started_with(&settings);
        let (truth, marks) = (&setup.truth.axes[1], &setup.marks[1]);
        assert_eq!((truth.resolution_mm, truth.full_scale_v), (1e-3, 5.0));
        assert_eq!((marks.counts_per_index, marks.index_count), (5000, -36_000));
        let counts = truth.imperfections.encoder_noise_mm / truth.resolution_mm;
        let before = &same.truth.axes[1];
        let known = before.imperfections.encoder_noise_mm / before.resolution_mm;
        assert!((counts / known - 1.0).abs() < 1e-12, "{counts} {known}");
    }

    #[test]
    fn a_stage_of_ones_own_has_the_limits_that_its_file_says_and_settings_that_are_accepted() {
        for text in [
            "[x]\ntravel_mm = [-3, 37]\nmax_velocity_mm_s = 40\nmax_acceleration_mm_s2 = 9000\n",
            "[x]\nresolution_um = 0.001\n",
            "[x]\ntravel_mm = [0, 300]\nscrew_lead_mm = 0.1\nresolution_um = 10\n",
            "[x]\ntravel_mm = [-3000, 0]\nscrew_lead_mm = 1000\nmax_velocity_mm_s = 1000\nmax_acceleration_mm_s2 = 30000\n",
        ] {
            let file = StageFile::parse(text, Path::new("mine.toml")).unwrap();
            let setup = StageSetup::of(&file);
            setup.settings.validate(FIRMWARE_ELEMENTS).unwrap();
            let known = file.known[0].unwrap();
            let axis = &setup.settings.axes[0];
            assert_eq!(axis.limits.max_velocity_mm_s, known.max_velocity_mm_s);
            let travel = axis.limits.travel_mm.unwrap();
            assert_eq!([travel.negative, travel.positive], known.travel_mm);
            assert!(!axis.commissioned);
            assert_eq!(
                setup.settings.axes[1],
                StageSetup::simulated().settings.axes[1]
            );
        }
    }
}
