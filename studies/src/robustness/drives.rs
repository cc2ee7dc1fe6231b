//! The axis on other drives, each with a controller that was designed for it in the same way: by commissioning it.

use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_sim::plant::{AxisParameters, EncoderSide, StageParameters};
use quadrant_tune::commission::{CommissionError, CommissionSettings, commission};
use quadrant_tune::test_axis::SimulatedTestAxis;
use rayon::prelude::*;

use crate::robustness::Scenario;

/// A drive to be compared.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveCase {
    /// Its name in tables.
    pub name: String,
    /// Description, with its numbers.
    pub what: String,
    /// The axis on it.
    pub truth: AxisParameters,
}

/// Cogging of the linear motor, V: a sixth of the friction that is left to a direct drive. Chosen.
pub const COGGING_V: f64 = 0.004;

/// The drives that the axis (0 to 2) is put on: a linear motor, and a rack with a gap of `backlash_mm` and the encoder on
/// either side of it.
pub fn drive_cases(axis: usize, backlash_mm: f64) -> Vec<DriveCase> {
    let screw = || StageParameters::real().axes[axis].clone();
    let gap_um = 1e3 * backlash_mm;
    let rack = |name: &str, place: &str, encoder| DriveCase {
        name: name.to_owned(),
        what: format!("two masses, a gap of {gap_um} um, encoder on the {place}"),
        truth: screw().rack_and_pinion(backlash_mm, encoder),
    };
    vec![
        DriveCase {
            name: "direct drive".to_owned(),
            what: format!(
                "linear motor: a fifth of the friction, no ripple, cogging of {} mV",
                1e3 * COGGING_V
            ),
            truth: screw().direct_drive(COGGING_V),
        },
        rack("rack, encoder on table", "table", EncoderSide::Load),
        rack("rack, encoder on motor", "motor", EncoderSide::Motor),
    ]
}

/// Commissions the axis `index` (0 to 2) on a drive, through its rig alone.
///
/// # Errors
/// The step that fails.
pub fn commission_drive(
    index: usize,
    truth: &AxisParameters,
    seed: u64,
) -> Result<AxisSettings, CommissionError> {
    let mut rig = SimulatedTestAxis::new(index, truth.clone(), seed);
    let base = StageSettings::simulated().axes[index].clone();
    let request = CommissionSettings::thesis();
    Ok(commission(&mut rig, &base, &request, &mut |_, _| {})?.settings)
}

/// A drive on which commissioning ended early, and why.
pub type Refused = (DriveCase, CommissionError);

/// Commissions the axis on every drive, in parallel: the scenarios with those that were found, and the drives on which the
/// commissioning ended early. `progress` is called a drive.
pub fn commission_drives(
    index: usize,
    cases: Vec<DriveCase>,
    seed: u64,
    progress: &(dyn Fn() + Sync),
) -> (Vec<Scenario>, Vec<Refused>) {
    let found: Vec<_> = cases
        .into_par_iter()
        .map(|case| {
            let found = commission_drive(index, &case.truth, seed);
            progress();
            (case, found)
        })
        .collect();
    let mut scenarios = Vec::new();
    let mut refused = Vec::new();
    for (case, found) in found {
        match found {
            Ok(settings) => scenarios.push(Scenario::on_drive(
                &case.name, &case.what, case.truth, settings,
            )),
            Err(error) => refused.push((case, error)),
        }
    }
    (scenarios, refused)
}
