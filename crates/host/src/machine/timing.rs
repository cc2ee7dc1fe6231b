//! Times that the simulated and the emulated machine have in common, so that a session is the same on both.

use std::time::Duration;

use quadrant_law::supervisor::PERIOD_TICKS;
use quadrant_settings::StageSettings;

/// Bytes that the port carries in a second: 921 600 baud.
const PORT_BYTES_PER_S: f64 = 92_160.0;
/// Ticks without supply in a power cycle: 1 s at 10 kHz.
pub(super) const OFF_TICKS: u32 = 10_000;

/// Time between two runs of the server, each of which reads its port once.
pub(super) fn server_period(settings: &StageSettings) -> Duration {
    Duration::from_secs_f64(f64::from(PERIOD_TICKS) / settings.rate_hz)
}

/// Bytes that the port carries between two runs of the server.
pub(super) fn port_bytes(settings: &StageSettings) -> usize {
    (PORT_BYTES_PER_S * server_period(settings).as_secs_f64()) as usize
}
