//! The states of the machine in which faults are brought about: enabled, moving, homed.

use anyhow::{Result, bail, ensure};
use quadrant::app::Translated;
use quadrant_law::axes::AxisName;
use quadrant_link::message::{AxisSet, Body};

use super::fixture::{A_WHILE, Fixture};

/// Largest speed of the motions, mm/s.
pub(crate) const SPEED_MM_S: f64 = 30.0;
/// Ticks within which anything is found here.
pub(crate) const LONGEST: u32 = 40_000;

/// The outputs enabled, long enough for the firmware to have seen it.
pub(super) fn enabled(fixture: &mut Fixture) -> Result<()> {
    fixture.done(Body::Enable)?;
    fixture.run(A_WHILE)
}

/// All axes along their sines, x at full speed.
pub(crate) fn moving(fixture: &mut Fixture, direction: f64) -> Result<()> {
    enabled(fixture)?;
    fixture.done(Body::Run)?;
    fixture.run_until(LONGEST, "full speed", |fixture| {
        direction * fixture.plant().axes()[0].velocity_mm_s() > 0.97 * SPEED_MM_S
    })
}

/// All axes homed, and at rest where they park.
pub(crate) fn homed(fixture: &mut Fixture) -> Result<()> {
    enabled(fixture)?;
    fixture.done(Body::Home(AxisSet::ALL))?;
    for _ in 0..LONGEST / 1_000 {
        fixture.run(1_000)?;
        let status = fixture.status()?;
        ensure!(status.fault.is_none(), "homing failed: {status:?}");
        if status.homed == AxisSet::ALL && !status.running {
            return Ok(());
        }
    }
    bail!("homing never ends")
}

/// Enables the outputs, and lets x home; gives the tick before.
pub(super) fn homing(fixture: &mut Fixture) -> Result<u32> {
    enabled(fixture)?;
    start_homing(fixture)
}

/// Lets x home; gives the tick before.
pub(super) fn start_homing(fixture: &mut Fixture) -> Result<u32> {
    let from = fixture.tick();
    fixture.done(Body::Home(
        AxisSet::NONE.with(Translated::translated(AxisName::X)),
    ))?;
    Ok(from)
}
