//! Recorded motion: read from CSV, checked, in millimetres; and the traces of our own runs, written as CSV.
//!
//! A record that is not what it claims to be drives an axis into its stop, or makes a comparison worthless without anyone
//! noticing. So [`Record::read`] refuses every file it has reason to doubt, and says which line, which column, which value,
//! and what would be accepted.
//!
//! | column | unit | |
//! |---|---|---|
//! | `t_s` | s | uniform, 100 Hz to 100 kHz |
//! | `reference_m` or `reference_mm` | m or mm | the motion asked for |
//! | `position_m` or `position_mm` | m or mm | optional: the motion measured |
//! | `voltage_v` | V | optional: the controller's output |
//! | `injection_v` | V | optional, of an experiment: the part of the voltage that was injected |
//!
//! Other columns are passed over, and the order is free. A recorded force ([`ForceRecord`]) has `t_s` and at least one of
//! `force_x_n`, `force_y_n`, `force_z_n`, in N.

mod columns;
mod error;
mod force;
mod plausible;
mod recording;
mod time;
mod trace;

pub use error::{RecordError, RecordWarning, TimeFault, UnitFault, UnusableSignal};
pub use force::ForceRecord;
pub use recording::Recording;
pub use trace::{TraceError, write_trace};

use std::path::Path;

use columns::Purpose;

/// Fewest rows that make a motion.
const MIN_ROWS: usize = 16;

/// A recorded motion that passed every check.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Time from one sample to the next, s.
    pub sample_time_s: f64,
    /// Time of each sample as recorded, s.
    pub time_s: Vec<f64>,
    /// Position asked for, mm.
    pub reference_mm: Vec<f64>,
    /// Position measured, mm.
    pub position_mm: Option<Vec<f64>>,
    /// The controller's output, V.
    pub voltage_v: Option<Vec<f64>>,
    /// What looks odd but can be true.
    pub doubts: Vec<RecordWarning>,
}

/// What an axis can do: the yardstick for units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisLimits {
    /// Longest motion, mm.
    pub travel_mm: f64,
    /// Highest speed, mm/s.
    pub max_velocity_mm_s: f64,
    /// Highest acceleration, mm/s^2.
    pub max_acceleration_mm_s2: f64,
    /// One count of the encoder, mm.
    pub resolution_mm: f64,
}

impl Record {
    /// Reads and checks a record for an axis with `limits`.
    pub fn read(path: impl AsRef<Path>, limits: &AxisLimits) -> Result<Self, RecordError> {
        let path = path.as_ref();
        let columns = columns::read(path, Purpose::Motion, &mut |_| {})?;
        let sample_time_s = time::check(path, &columns.time)?;
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
