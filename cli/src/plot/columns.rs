//! A CSV file as columns of numbers over time.

use std::path::{Path, PathBuf};

use anyhow::Context;
use quadrant_cli::warn;
use quadrant_tune::record::{ColumnNames, NumberTable};

/// A run: a file's columns.
pub(super) struct Run {
    /// Path of the file.
    pub(super) path: PathBuf,
    /// Time, s.
    pub(super) time_s: Vec<f64>,
    /// Name with its unit, and values, NaN where a cell holds no number.
    pub(super) columns: Vec<(String, Vec<f64>)>,
}

impl Run {
    /// Reads a file, with columns named as `names` says; what is guessed and what is no number is said.
    ///
    /// # Errors
    /// A file that cannot be read, without a header, without a column of time, or with a row of another length.
    pub(super) fn read(path: &Path, names: &ColumnNames) -> anyhow::Result<Self> {
        let shown = path.display();
        let bytes = std::fs::read(path).with_context(|| format!("{shown} cannot be read"))?;
        let table = NumberTable::parse(path, &bytes, names)?;
        for note in &table.notes {
            warn!("note: {shown}: {note}");
        }
        match table.other_cells {
            0 => {}
            1 => warn!("note: {shown}: 1 cell holds no number, and is not drawn"),
            count => warn!("note: {shown}: {count} cells hold no number, and are not drawn"),
        }
        Ok(Self {
            path: path.to_owned(),
            time_s: table.time_s,
            columns: table.columns,
        })
    }

    /// Name for the legend: the file's.
    pub(super) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        name.display().to_string()
    }

    /// The values of a column, if it is there.
    pub(super) fn column(&self, name: &str) -> Option<&[f64]> {
        let found = self.columns.iter().find(|(known, _)| known == name);
        found.map(|(_, values)| values.as_slice())
    }

    /// Names of the columns.
    pub(super) fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Leaves what is from `from_s` to `to_s`.
    pub(super) fn cut(&mut self, from_s: f64, to_s: f64) {
        let inside: Vec<bool> = self
            .time_s
            .iter()
            .map(|time_s| (from_s..=to_s).contains(time_s))
            .collect();
        let keep = |values: &mut Vec<f64>| {
            let mut inside = inside.iter();
            values.retain(|_| inside.next().is_some_and(|inside| *inside));
        };
        keep(&mut self.time_s);
        self.columns.iter_mut().for_each(|(_, values)| keep(values));
    }
}
