//! The emulated board as the other end of a link.

use std::io;
use std::path::Path;
use std::time::Duration;

use quadrant_law::safety::Switches;
use quadrant_lockstep::FLASH_BYTES;
use quadrant_sim::stage_setup::StageSetup;

use super::emulated::EmulatedMachine;
use super::emulator::Program;
use super::flash_file::FlashFile;
use super::loopback::{Loopback, SimulatedPeer};
use super::simulated_io::SimulatedIo;
use super::timing::server_period;

/// The firmware's image in QEMU on a simulated stage, and the bytes to and from it.
pub struct EmulatedLink {
    machine: EmulatedMachine,
    flash: Option<FlashFile>,
    period: Duration,
}

impl EmulatedLink {
    /// A machine that has just been switched on, with the image `program`; `seed` decides the noise of its encoders, and a
    /// file keeps its flash.
    ///
    /// # Errors
    /// An image that is none, QEMU that is not installed, or a file that is no flash.
    pub fn start(
        program: &Path,
        setup: &StageSetup,
        seed: u64,
        flash: Option<&Path>,
    ) -> io::Result<Loopback<Self>> {
        let program = Program::read(program).map_err(io::Error::other)?;
        let flash = flash
            .map(|path| FlashFile::open(path, FLASH_BYTES))
            .transpose()?;
        let erased = vec![0xFF; FLASH_BYTES];
        let content = flash.as_ref().map_or(&erased[..], FlashFile::content);
        let machine =
            EmulatedMachine::start(program, setup, seed, content).map_err(io::Error::other)?;
        Ok(Loopback::new(Self {
            machine,
            flash,
            period: server_period(setup.settings.rate_hz),
        }))
    }
}

impl SimulatedPeer for EmulatedLink {
    fn exchange(&mut self, sent: &[u8]) -> io::Result<Vec<u8>> {
        self.machine.send(sent);
        self.machine.run().map_err(io::Error::other)?;
        if let Some(file) = &mut self.flash {
            file.keep(&self.machine.flash().map_err(io::Error::other)?)?;
        }
        Ok(self.machine.receive())
    }

    fn period(&self) -> Duration {
        self.period
    }

    fn endpoint(&self) -> String {
        "the emulated board".to_owned()
    }

    fn simulated_io(&mut self) -> Option<&mut dyn SimulatedIo> {
        Some(self)
    }
}

impl SimulatedIo for EmulatedLink {
    fn press(&mut self, switches: Switches) {
        self.machine.press(switches);
    }

    fn power_cycle(&mut self) -> io::Result<()> {
        self.machine.power_cycle().map_err(io::Error::other)
    }

    fn log(&mut self) -> io::Result<Option<Vec<String>>> {
        self.machine.new_lines().map(Some).map_err(io::Error::other)
    }
}
