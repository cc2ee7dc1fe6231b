//! The PID alone on a slow sine, where the friction that was measured under it is uneven.
//!
//! While friction holds the axis, it is not the one that the PID was designed on: its springs resonate, and the motor does against a
//! table that stands still. A PID that oscillates there makes the axis break away, and the friction that is measured or fed forward is not
//! the one that acts.

use quadrant_settings::AxisSettings;
use quadrant_sim::sine_test::SineTest;

use super::bootstrap::measuring_settings;
use super::linear_model::HOME_MM;
use super::models::{Controller, MAX_SOFTENINGS};
use super::ringing::{Ringing, lasting};
use super::verify::{run_sine, sines};
use crate::test_axis::{AxisInfo, MachineError, TestAxis, approach};

/// The slowest of the sines on which laws are tried.
fn slow_sine(info: &AxisInfo) -> SineTest {
    let mut sines = sines(info);
    sines.sort_by(|a, b| a.velocity_mm_s.total_cmp(&b.velocity_mm_s));
    sines[0]
}

/// Softens the controller in `settings` until it does not oscillate on a slow sine; true if that made it another one. One that still
/// oscillates after the last of them stays as it was: the trials judge it.
///
/// # Errors
/// Settings that the machine refuses.
pub(super) fn soften(
    test_axis: &mut dyn TestAxis,
    settings: &AxisSettings,
    controller: &mut Controller,
) -> Result<bool, MachineError> {
    let mut settings = settings.clone();
    let mut softer = controller.clone();
    let mut first = None;
    for softenings in 0..MAX_SOFTENINGS {
        softer.put_into(&mut settings);
        let Some(ringing) = oscillation(test_axis, &settings)? else {
            if let Some(ringing) = first {
                softer.note_softening(&ringing, softenings);
                *controller = softer;
            }
            return Ok(first.is_some());
        };
        first = first.or(Some(ringing));
        softer.soften();
    }
    Ok(false)
}

/// The oscillation of the PID alone on the slow sine, if it lasts; none of one that is stopped: what comes next will be, too.
fn oscillation(
    test_axis: &mut dyn TestAxis,
    settings: &AxisSettings,
) -> Result<Option<Ringing>, MachineError> {
    let info = test_axis.info();
    let sine = slow_sine(&info);
    test_axis.apply(&measuring_settings(settings))?;
    let run =
        approach(test_axis, HOME_MM).and_then(|()| run_sine(test_axis, "PID", sine, &mut |_| {}));
    Ok(run.ok().and_then(|(_, recording)| {
        lasting(&recording, info.resolution_mm).filter(|found| found.outruns(sine.velocity_mm_s))
    }))
}
