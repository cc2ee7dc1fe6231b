//! Traces of our own runs, as CSV.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use quadrant_written::whole;

/// A trace that was not written.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The columns differ in length.
    #[error(
        "column {column} has {found} values, column {first} has {expected}; all columns of a trace need as many"
    )]
    Length {
        /// Name of the first column.
        first: String,
        /// Number of its values.
        expected: usize,
        /// The first that differs.
        column: String,
        /// Number of its values.
        found: usize,
    },
    /// The file cannot be written.
    #[error("cannot write {}", path.display())]
    Write { path: PathBuf, source: io::Error },
}

/// Writes named columns of one length, every number in full, so that reading them back gives the same bits.
pub fn write_trace(path: &Path, columns: &[(&str, &[f64])]) -> Result<(), TraceError> {
    if let Some((first, values)) = columns.first()
        && let Some((column, other)) = columns
            .iter()
            .find(|(_, other)| other.len() != values.len())
    {
        return Err(TraceError::Length {
            first: (*first).to_owned(),
            expected: values.len(),
            column: (*column).to_owned(),
            found: other.len(),
        });
    }
    whole::write_by(path, |out| write_columns(out, columns)).map_err(|source| TraceError::Write {
        path: path.to_owned(),
        source,
    })
}

fn write_columns(out: &mut dyn Write, columns: &[(&str, &[f64])]) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    csv.write_record(columns.iter().map(|(name, _)| name))?;
    let mut cell = Vec::new();
    for row in 0..columns.first().map_or(0, |(_, values)| values.len()) {
        for (_, values) in columns {
            cell.clear();
            write!(cell, "{}", values[row])?;
            csv.write_field(&cell)?;
        }
        csv.write_record(None::<&[u8]>)?;
    }
    csv.flush()
}
