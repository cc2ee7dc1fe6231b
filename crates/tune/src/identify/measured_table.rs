//! A measured table as CSV: named columns of numbers, each within its bounds.

use std::path::{Path, PathBuf};

use quadrant_written::whole;

/// Reasons for which a file holds no such table.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be read or written, or is no CSV.
    #[error("{}: {source}", path.display())]
    Csv { path: PathBuf, source: csv::Error },
    /// A column is missing.
    #[error("{}: no column {name}; {what} has the columns {}", path.display(), columns.join(", "))]
    Column {
        path: PathBuf,
        name: &'static str,
        what: &'static str,
        columns: &'static [&'static str],
    },
    /// A value that cannot be.
    #[error("{}, row {row}, column {name}: {value:?} is not {expected}", path.display())]
    Value {
        path: PathBuf,
        /// Row of data, from 1.
        row: usize,
        name: &'static str,
        value: String,
        expected: &'static str,
    },
    /// Too few rows to be of use.
    #[error("{}: {rows} rows; {what} takes at least {least}", path.display())]
    TooShort {
        path: PathBuf,
        rows: usize,
        what: &'static str,
        least: usize,
    },
}

/// The columns of a kind of table.
pub(super) struct Columns<const N: usize> {
    /// The kind, with its article.
    pub(super) what: &'static str,
    pub(super) names: &'static [&'static str; N],
    /// Values allowed in each column.
    pub(super) expected: [&'static str; N],
}

impl<const N: usize> Columns<N> {
    /// Writes rows under the columns' names.
    pub(super) fn write(
        &self,
        path: &Path,
        rows: impl Iterator<Item = [f64; N]>,
    ) -> Result<(), TableError> {
        let refuse = |source| TableError::Csv {
            path: path.to_owned(),
            source,
        };
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(self.names).map_err(refuse)?;
        for row in rows {
            writer
                .write_record(row.map(|value| value.to_string()))
                .map_err(refuse)?;
        }
        let text = writer
            .into_inner()
            .map_err(|error| refuse(error.into_error().into()))?;
        whole::write(path, text).map_err(|source| refuse(source.into()))
    }

    /// Reads what [`write`](Self::write) writes; the order of the columns is free, others are passed over. `allows` is
    /// asked for each value with its column and the row before.
    ///
    /// # Errors
    /// A file that cannot be read or is no such table; names the row and the column.
    pub(super) fn read(
        &self,
        path: &Path,
        allows: impl Fn(usize, f64, Option<&[f64; N]>) -> bool,
    ) -> Result<Vec<[f64; N]>, TableError> {
        let refuse = |source| TableError::Csv {
            path: path.to_owned(),
            source,
        };
        let mut reader = csv::Reader::from_path(path).map_err(refuse)?;
        let header = reader.headers().map_err(refuse)?.clone();
        let mut places = [0; N];
        for (place, name) in places.iter_mut().zip(self.names) {
            *place = header
                .iter()
                .position(|heading| heading.trim() == *name)
                .ok_or_else(|| TableError::Column {
                    path: path.to_owned(),
                    name,
                    what: self.what,
                    columns: self.names,
                })?;
        }
        let mut rows: Vec<[f64; N]> = Vec::new();
        for (index, record) in reader.records().enumerate() {
            let record = record.map_err(refuse)?;
            let mut row = [0.0; N];
            for (column, value) in row.iter_mut().enumerate() {
                let text = record.get(places[column]).unwrap_or_default().trim();
                let number = text.parse().ok().filter(|number: &f64| number.is_finite());
                *value = number
                    .filter(|number| allows(column, *number, rows.last()))
                    .ok_or_else(|| TableError::Value {
                        path: path.to_owned(),
                        row: index + 1,
                        name: self.names[column],
                        value: text.to_owned(),
                        expected: self.expected[column],
                    })?;
            }
            rows.push(row);
        }
        Ok(rows)
    }
}
