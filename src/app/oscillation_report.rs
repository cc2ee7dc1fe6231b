//! The report of oscillations: what the law's monitor finds becomes an event, once.
//!
//! It runs in the supervising task on the snapshots.

use super::Snapshot;
use quadrant_law::axes::AxisName;
use quadrant_law::safety::oscillation::OscillationReading;
use quadrant_law::scalar::Scalar;
use quadrant_law::supervisor::Oscillated;

/// The memory of the report.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OscillationReport {
    /// Length of a count, mm.
    resolution_mm: [f32; 3],
    /// Number of the last oscillation of each axis.
    numbers: [u8; 3],
}

impl OscillationReport {
    /// The report before the first snapshot. `resolution_mm` are the lengths of the encoders' counts.
    pub fn new(resolution_mm: [f32; 3]) -> Self {
        Self {
            resolution_mm,
            numbers: [0; 3],
        }
    }

    /// Takes the next snapshot; returns what is new in it.
    pub fn step<S: Scalar>(&mut self, seen: &Snapshot<S>) -> [Option<Oscillated>; 3] {
        core::array::from_fn(|index| {
            let found: OscillationReading = seen.axes[index].oscillation;
            if core::mem::replace(&mut self.numbers[index], found.number) == found.number {
                return None;
            }
            let amplitude_um = 1e3 * found.amplitude_counts() * self.resolution_mm[index];
            Some(Oscillated {
                axis: AxisName::ALL[index],
                kind: found.kind,
                decihertz: (10.0 * found.frequency_hz() + 0.5) as u16,
                micrometres: (amplitude_um + 0.5) as u16,
            })
        })
    }
}
