//! The simulated machine as the other end of a link.

use std::time::Duration;

use quadrant::settings::{SettingsError, StageSettings};
use quadrant::supervisor::PERIOD_TICKS;

use super::transport::{Exchange, InProcess};
use crate::plant::StageTruth;
use crate::simulated_machine::SimulatedMachine;

/// The firmware's application on the simulated stage, with the firmware's default settings, and the bytes to and from it.
pub struct SimulatedLink {
    machine: SimulatedMachine,
    period: Duration,
}

impl SimulatedLink {
    /// A machine that has just been switched on; `seed` decides the noise of its encoders.
    ///
    /// # Errors
    /// Defaults that are refused.
    pub fn start(seed: u64) -> Result<InProcess<Self>, SettingsError> {
        let settings = StageSettings::default();
        let machine = SimulatedMachine::new(&settings, &StageTruth::real(), seed)?;
        Ok(InProcess::new(Self {
            machine,
            period: Duration::from_secs_f64(f64::from(PERIOD_TICKS) / settings.rate_hz),
        }))
    }
}

impl Exchange for SimulatedLink {
    fn exchange(&mut self, sent: &[u8]) -> Vec<u8> {
        self.machine.send(sent);
        self.machine.run(PERIOD_TICKS);
        self.machine.receive()
    }

    fn period(&self) -> Duration {
        self.period
    }
}
