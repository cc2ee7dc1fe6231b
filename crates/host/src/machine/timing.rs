//! Times that the simulated and the emulated machine have in common, so that a session is the same on both.

use std::time::Duration;

use quadrant_law::supervisor::PERIOD_TICKS;

/// Bytes that the port carries in a second: 921 600 baud.
const PORT_BYTES_PER_S: f64 = 92_160.0;
/// Time without supply in a power cycle, s.
const OFF_S: f64 = 1.0;

/// Control ticks without supply in a power cycle.
pub(super) fn off_ticks(rate_hz: f64) -> u32 {
    (OFF_S * rate_hz) as u32
}

/// Time between two runs of the server, each of which reads its port once.
pub(super) fn server_period(rate_hz: f64) -> Duration {
    Duration::from_secs_f64(f64::from(PERIOD_TICKS) / rate_hz)
}

/// Bytes that the port carries between two runs of the server.
pub(super) fn port_bytes(rate_hz: f64) -> usize {
    (PORT_BYTES_PER_S * server_period(rate_hz).as_secs_f64()) as usize
}
