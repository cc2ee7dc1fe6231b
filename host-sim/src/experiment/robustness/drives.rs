//! The axis on other drives, each with a controller that was designed for it in the same way: by commissioning it.

use quadrant::settings::{AxisSettings, StageSettings};

use super::Scenario;
use crate::commission::{CommissionError, CommissionSettings, Commissioned, commission};
use crate::plant::{AxisTruth, EncoderSide, StageTruth};
use crate::rig::SimulatedRig;

/// A drive to be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveCase {
    /// Its name in tables.
    pub name: String,
    /// What it is, with its numbers.
    pub what: String,
    /// The axis on it.
    pub truth: AxisTruth,
}

/// Commissions the axis `index` (0 to 2) on a drive, through its rig alone.
///
/// # Errors
/// The step that fails.
pub fn commission_drive(
    index: usize,
    truth: &AxisTruth,
    seed: u64,
) -> Result<Commissioned, CommissionError> {
    let mut rig = SimulatedRig::new(index, truth.clone(), seed);
    let base = StageSettings::default().axes[index].clone();
    commission(
        &mut rig,
        &base,
        &CommissionSettings::default(),
        &mut |_, _| {},
    )
}
