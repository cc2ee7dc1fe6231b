//! A recorded motion, checked when it is read.

use std::path::Path;

use super::columns::{self, Purpose};
use super::error::{RecordError, RecordWarning};
use super::limits::AxisLimits;
use super::{plausible, time};

/// A recorded motion that passed every check.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Time from one sample to the next, s.
    pub sample_time_s: f64,
    /// Time of each sample as recorded, s.
    pub time_s: Vec<f64>,
    /// Position asked for, mm.
    pub reference_mm: Vec<f64>,
    /// Position that was measured, mm.
    pub position_mm: Option<Vec<f64>>,
    /// The controller's output, V.
    pub voltage_v: Option<Vec<f64>>,
    /// Oddities that can be true.
    pub doubts: Vec<RecordWarning>,
}

impl Record {
    /// Reads and checks a record for an axis with `limits`.
    pub fn read(path: &Path, limits: &AxisLimits) -> Result<Self, RecordError> {
        let columns = columns::read(path, Purpose::Motion, &mut |_| {})?;
        let sample_time_s = time::check(path, &columns.time, &columns.lines)?;
        plausible::check(path, &columns, sample_time_s, limits)?;
        let reference_mm = columns
            .reference
            .map_or_else(Vec::new, columns::Column::into_mm);
        let position_mm = columns.position.map(columns::Column::into_mm);
        let doubts = plausible::doubts(&reference_mm, position_mm.as_deref(), sample_time_s);
        Ok(Self {
            sample_time_s,
            time_s: columns.time.values,
            reference_mm,
            position_mm,
            voltage_v: columns.voltage.map(|column| column.values),
            doubts,
        })
    }
}
