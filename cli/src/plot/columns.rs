//! A CSV file as columns of numbers over time.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};

/// A run: a file's columns.
pub(super) struct Run {
    /// Path of the file.
    pub(super) path: PathBuf,
    /// Time, s.
    pub(super) time_s: Vec<f64>,
    /// Name with its unit, and values, NaN where a cell holds no number.
    pub(super) columns: Vec<(String, Vec<f64>)>,
}

/// Names of a column of time in s, the first that is there.
const TIME: [&str; 5] = ["t_s", "time_s", "t", "time", "seconds"];

/// A name without quotes and without a unit in brackets.
fn bare(name: &str) -> String {
    let end = name.find(['[', '(']).unwrap_or(name.len());
    name[..end].trim().to_ascii_lowercase()
}

impl Run {
    /// Reads a file.
    ///
    /// # Errors
    /// A file that cannot be read, without a header, without a column of time, or with a row of another length.
    pub(super) fn read(path: &Path) -> anyhow::Result<Self> {
        let shown = path.display();
        let text =
            std::fs::read_to_string(path).with_context(|| format!("{shown} cannot be read"))?;
        let cells = |line: &str| -> Vec<String> {
            let cells = line.split(',').map(|cell| cell.trim().trim_matches('"'));
            cells.map(str::to_owned).collect()
        };
        let mut lines = text.lines().enumerate().filter(|(_, line)| {
            let line = line.trim();
            !line.is_empty() && !line.starts_with('#')
        });
        let header = lines.next().map(|(_, line)| cells(line));
        let names = header.filter(|names| names.iter().any(|name| name.parse::<f64>().is_err()));
        let Some(names) = names else {
            bail!(
                "{shown}: no header: the first line must name the columns, t_s for the time in s"
            );
        };
        let time = TIME
            .iter()
            .find_map(|time| names.iter().position(|name| bare(name) == *time));
        let Some(time) = time else {
            bail!(
                "{shown}: no column of the time in s: name one t_s; found {}",
                names.join(", ")
            );
        };
        let mut values = vec![Vec::new(); names.len()];
        for (index, line) in lines {
            let row = cells(line);
            ensure!(
                row.len() == names.len(),
                "{shown}, line {}: {} cells, and the header has {}",
                index + 1,
                row.len(),
                names.len()
            );
            for (column, cell) in values.iter_mut().zip(&row) {
                column.push(cell.parse().unwrap_or(f64::NAN));
            }
        }
        let time_s = values[time].clone();
        ensure!(
            time_s.iter().filter(|time_s| time_s.is_finite()).count() > 1,
            "{shown}: fewer than two rows with a time"
        );
        let columns = names.into_iter().zip(values).enumerate();
        Ok(Self {
            path: path.to_owned(),
            time_s,
            columns: columns
                .filter(|(index, (_, values))| {
                    *index != time && values.iter().any(|value| value.is_finite())
                })
                .map(|(_, column)| column)
                .collect(),
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
