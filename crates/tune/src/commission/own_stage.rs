//! Settings for a simulated stage of one's own, by the way that a person has: its axes are commissioned.

use std::path::PathBuf;
use std::sync::Mutex;

use quadrant_law::axes::AxisName;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::identified_stage::identified_settings;
use quadrant_sim::settings_file::SettingsFileError;
use quadrant_sim::stage_file::StageFile;
use quadrant_sim::stage_setup::StageSetup;
use rayon::prelude::*;

use super::chain::commission;
use super::commissioned::CommissionSettings;
use super::error::CommissionError;
use crate::test_axis::{SimulatedTestAxis, Travel};

/// Reason why there are no settings for a stage.
#[derive(Debug, thiserror::Error)]
pub enum OwnStageError {
    /// The built-in settings of the axes that are not in the file.
    #[error(transparent)]
    Settings(#[from] SettingsFileError),
    /// The commissioning of an axis has ended early.
    #[error("{}: {axis} cannot be commissioned", path.display())]
    Axis {
        path: PathBuf,
        axis: AxisName,
        source: CommissionError,
    },
}

/// Commissions axes of a stage, in parallel, each as it is switched on: the law knows of it what a data sheet says, and what is measured.
/// The other axes have the settings that commissioning the built-in stage gave. `progress` receives the share that is done.
///
/// # Errors
/// The first axis whose commissioning ends early.
pub fn commission_stage(
    file: &StageFile,
    axes: &[AxisName],
    seed: u64,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<StageSettings, OwnStageError> {
    let mut stage = identified_settings()?.stage;
    let shares = Mutex::new([0.0; 3]);
    let advance = |axis: AxisName, share: f64| {
        let Ok(mut shares) = shares.lock() else {
            return;
        };
        shares[axis as usize] = share;
        progress(shares.iter().sum::<f64>() / axes.len() as f64);
    };
    let found: Result<Vec<AxisSettings>, OwnStageError> = axes
        .par_iter()
        .map(|&axis| {
            commission_axis(file, axis, seed, &|share| advance(axis, share)).map_err(|source| {
                OwnStageError::Axis {
                    path: file.path.clone(),
                    axis,
                    source,
                }
            })
        })
        .collect();
    for (&axis, settings) in axes.iter().zip(found?) {
        stage.axes[axis as usize] = settings;
    }
    Ok(stage)
}

fn commission_axis(
    file: &StageFile,
    axis: AxisName,
    seed: u64,
    progress: &dyn Fn(f64),
) -> Result<AxisSettings, CommissionError> {
    let index = axis as usize;
    let setup = StageSetup::of(file);
    let truth = setup.truth.axes[index].clone();
    let mut test_axis = SimulatedTestAxis::under(&setup.settings, index, truth, seed)
        .with_travel(Travel::of(file.known[index]));
    let base = &setup.settings.axes[index];
    let request = CommissionSettings::default();
    let found = commission(&mut test_axis, base, &request, &mut |_, share| {
        progress(share)
    })?;
    Ok(found.settings)
}
