//! What an experiment leaves.

use std::path::Path;

use crate::record::{TraceError, write_trace};

/// The signals of one experiment on one axis, sampled evenly. All columns have one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Time from one sample to the next, s.
    pub sample_time_s: f64,
    /// Position asked for, mm; the measured position in open loop.
    pub reference_mm: Vec<f64>,
    /// Position measured at the beginning of the sample's period, mm.
    pub position_mm: Vec<f64>,
    /// Voltage commanded at the amplifier's input, held over the sample's period, V; injection included.
    pub voltage_v: Vec<f64>,
    /// The part of it that was injected, V.
    pub injection_v: Vec<f64>,
}

impl Recording {
    /// Samples.
    pub fn len(&self) -> usize {
        self.position_mm.len()
    }

    /// Whether nothing was recorded.
    pub fn is_empty(&self) -> bool {
        self.position_mm.is_empty()
    }

    /// Its duration, s.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.sample_time_s
    }

    /// The samples of a range.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let part = |signal: &[f64]| signal[range.clone()].to_vec();
        Self {
            sample_time_s: self.sample_time_s,
            reference_mm: part(&self.reference_mm),
            position_mm: part(&self.position_mm),
            voltage_v: part(&self.voltage_v),
            injection_v: part(&self.injection_v),
        }
    }

    /// Writes it as CSV: `t_s`, `reference_mm`, `position_mm`, `voltage_v`, `injection_v`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), TraceError> {
        let time: Vec<f64> = (0..self.len())
            .map(|index| index as f64 * self.sample_time_s)
            .collect();
        write_trace(
            path,
            &[
                ("t_s", &time),
                ("reference_mm", &self.reference_mm),
                ("position_mm", &self.position_mm),
                ("voltage_v", &self.voltage_v),
                ("injection_v", &self.injection_v),
            ],
        )
    }
}
