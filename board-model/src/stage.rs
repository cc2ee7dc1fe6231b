//! Three axes behind converter and encoders.
//!
//! x'' = A (u(t - Td) - F) - B x', F after Dahl: the coefficients of docs/parameters.md, in round numbers; chosen, not measured.

use std::collections::VecDeque;

/// Step, ns.
pub const STEP_NS: u64 = 20_000;
/// Dead time of the amplifier, ns.
const DEAD_TIME_NS: u64 = 1_200_000;
/// Acceleration by voltage, mm/s^2/V.
const GAIN: f64 = 69_390.0;
/// Deceleration by velocity, 1/s.
const DAMPING: f64 = 144.8;
/// Stiffness of friction before sliding, V/mm.
const STIFFNESS: f64 = 15.0;
/// Friction while sliding, V.
const COULOMB: f64 = 0.14;
/// Travel of a count, mm.
pub const COUNT_MM: f64 = 5e-4;
/// Counts between two index pulses.
pub const INDEX_COUNTS: i64 = 20_000;

/// An axis.
#[derive(Debug)]
pub struct Axis {
    mm: f64,
    mm_s: f64,
    friction: f64,
    delayed: VecDeque<f64>,
}

impl Default for Axis {
    fn default() -> Self {
        let delayed = vec![0.0; (DEAD_TIME_NS / STEP_NS) as usize].into();
        Self {
            mm: 0.0,
            mm_s: 0.0,
            friction: 0.0,
            delayed,
        }
    }
}

impl Axis {
    /// Steps by [`STEP_NS`] at an amplifier's input.
    pub fn step(&mut self, volts: f64) {
        let dt = STEP_NS as f64 * 1e-9;
        self.delayed.push_back(volts);
        let volts = self.delayed.pop_front().unwrap_or(0.0);
        let sign = self.mm_s.signum();
        self.friction += dt * STIFFNESS * self.mm_s * (1.0 - sign * self.friction / COULOMB);
        self.friction = self.friction.clamp(-COULOMB, COULOMB);
        self.mm_s += dt * (GAIN * (volts - self.friction) - DAMPING * self.mm_s);
        self.mm += dt * self.mm_s;
    }

    /// The encoder's count.
    pub fn count(&self) -> i64 {
        (self.mm / COUNT_MM).floor() as i64
    }
}
