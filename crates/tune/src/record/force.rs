//! Recorded forces from CSV files.

use std::path::Path;

use quadrant_sim::plant::load::Force;

use super::columns::{self, Column};
use super::error::{RecordError, UnusableSignal};
use super::time;

/// Largest force that is believed, N: what a machine of this size never sees.
const MOST_N: f64 = 1e5;

/// Forces on the table, recorded or computed elsewhere: x, y, z, as far as the file has them.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceRecord {
    /// One an axis; positive pushes the table towards larger positions.
    pub axes: [Option<Force>; 3],
}

impl ForceRecord {
    /// Reads and checks recorded forces: `t_s`, even, and at least one of `force_x_n`, `force_y_n`, `force_z_n`.
    ///
    /// # Errors
    /// A file that cannot be read, with gaps or uneven time, or with a force beyond 100 kN; names line or column, the value,
    /// and what is allowed.
    pub fn read_csv(path: &Path) -> Result<Self, RecordError> {
        let columns = columns::read_forces(path)?;
        let sample_time_s = time::check(path, &columns.time, &columns.lines)?;
        let mut axes = [None, None, None];
        for (axis, column) in axes.iter_mut().zip(columns.forces) {
            if let Some(column) = column {
                check(path, &column)?;
                *axis = Some(Force {
                    sample_time_s,
                    force_n: column.values,
                });
            }
        }
        Ok(Self { axes })
    }
}

fn check(path: &Path, column: &Column) -> Result<(), RecordError> {
    let largest = column
        .values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    if largest <= MOST_N {
        return Ok(());
    }
    Err(RecordError::Useless {
        path: path.to_owned(),
        column: column.name,
        fault: UnusableSignal::NotForce {
            largest,
            most_n: MOST_N,
        },
    })
}
