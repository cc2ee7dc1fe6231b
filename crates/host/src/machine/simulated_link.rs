//! The simulated machine as the other end of a link.

use std::io;
use std::path::Path;
use std::time::Duration;

use quadrant_law::safety::Switches;
use quadrant_law::supervisor::PERIOD_TICKS;
use quadrant_sim::stage_setup::StageSetup;

use super::loopback::{Loopback, SimulatedPeer};
use super::memory_flash::MemoryFlash;
use super::simulated::SimulatedMachine;
use super::simulated_io::SimulatedIo;
use super::timing::server_period;

/// The firmware's application on a simulated stage, and the bytes to and from it.
pub struct SimulatedLink {
    machine: SimulatedMachine,
}

impl SimulatedLink {
    /// A machine that has just been switched on; `seed` decides the noise of its encoders, and a file keeps its flash.
    ///
    /// # Errors
    /// Defaults that are refused, or a file that is no flash.
    pub fn start(
        setup: &StageSetup,
        seed: u64,
        flash: Option<&Path>,
    ) -> io::Result<Loopback<Self>> {
        let StageSetup {
            settings,
            truth,
            marks,
        } = setup;
        let flash = flash.map(MemoryFlash::kept_in).transpose()?;
        let flash = flash.unwrap_or_default();
        let mut machine =
            SimulatedMachine::with_flash(settings, truth, seed, flash).map_err(io::Error::other)?;
        machine.plant_mut().set_marks(*marks);
        Ok(Loopback::new(Self { machine }))
    }
}

impl SimulatedPeer for SimulatedLink {
    fn exchange(&mut self, sent: &[u8]) -> io::Result<Vec<u8>> {
        self.machine.send(sent);
        self.machine.run(PERIOD_TICKS);
        // An answer of the emulated board is seen a tick late. SimulatedIo are to act in the same tick on both.
        while self.machine.tick() % PERIOD_TICKS != 1 {
            self.machine.run(1);
        }
        Ok(self.machine.receive())
    }

    fn period(&self) -> Duration {
        server_period(self.machine.rate_hz())
    }

    fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        Some(self)
    }
}

impl SimulatedIo for SimulatedLink {
    fn press(&mut self, switches: Switches) {
        self.machine.press(switches);
    }

    fn power_cycle(&mut self) -> io::Result<()> {
        self.machine.power_cycle();
        Ok(())
    }

    fn been_mm(&self) -> Option<[(f64, f64); 3]> {
        Some(self.machine.been_mm())
    }

    /// The library's code logs nothing: that is the firmware's business.
    fn log(&mut self) -> io::Result<Option<Vec<String>>> {
        Ok(None)
    }
}
