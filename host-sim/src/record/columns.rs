//! From bytes to columns of finite numbers.

use super::error::RecordError;
use super::limits::MIN_ROWS;
use csv::{ByteRecord, Reader, ReaderBuilder};
use std::fs::File;
use std::path::Path;

/// The columns of a record, as labelled.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) time: Column,
    pub(super) reference: Option<Column>,
    pub(super) position: Option<Column>,
    pub(super) voltage: Option<Column>,
    pub(super) injection: Option<Column>,
}

/// One column of a file.
#[derive(Debug)]
pub(super) struct Column {
    pub(super) name: &'static str,
    /// Millimetres in one unit of a position column; 1 for others.
    pub(super) mm_per_unit: f64,
    pub(super) values: Vec<f64>,
    /// Line of each value, by runs: blank lines and quoted line breaks make lines and rows differ.
    lines: Vec<(usize, u64)>,
}

impl Column {
    pub(super) fn into_mm(self) -> Vec<f64> {
        let Self {
            mm_per_unit,
            mut values,
            ..
        } = self;
        values.iter_mut().for_each(|value| *value *= mm_per_unit);
        values
    }

    /// The line in the file that holds value `index`.
    pub(super) fn line(&self, index: usize) -> u64 {
        let run = self
            .lines
            .partition_point(|(first, _)| *first <= index)
            .saturating_sub(1);
        self.lines
            .get(run)
            .map_or(0, |(first, line)| line + (index - first) as u64)
    }

    fn push(&mut self, value: f64, line: u64) {
        let index = self.values.len();
        if self.lines.is_empty() || self.line(index) != line {
            self.lines.push((index, line));
        }
        self.values.push(value);
    }
}

/// A name a header can have, and the scale of its unit.
type Name = (&'static str, f64);

const TIME: &[Name] = &[("t_s", 1.0)];
const REFERENCE: &[Name] = &[("reference_m", 1e3), ("reference_mm", 1.0)];
const POSITION: &[Name] = &[("position_m", 1e3), ("position_mm", 1.0)];
const VOLTAGE: &[Name] = &[("voltage_v", 1.0)];
const INJECTION: &[Name] = &[("injection_v", 1.0)];
const FORCES: [&[Name]; 3] = [
    &[("force_x_n", 1.0)],
    &[("force_y_n", 1.0)],
    &[("force_z_n", 1.0)],
];

/// Columns that a file must hold besides the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A motion to be followed: the reference.
    Motion,
    /// An experiment to be identified from: position and voltage.
    Experiment,
}

/// Rows between two reports of progress.
const PROGRESS_ROWS: usize = 1 << 16;

/// Most rows of a record: more than an hour at 10 kHz. All columns of an experiment then take less than 3 GiB of memory.
const MOST_ROWS: usize = 50_000_000;

/// `progress` is told the share of the file that is read, 0 to 1.
pub(super) fn read(
    path: &Path,
    purpose: Purpose,
    progress: &mut dyn FnMut(f64),
) -> Result<Columns, RecordError> {
    read_at_most(path, purpose, MOST_ROWS, progress)
}

fn read_at_most(
    path: &Path,
    purpose: Purpose,
    most_rows: usize,
    progress: &mut dyn FnMut(f64),
) -> Result<Columns, RecordError> {
    let (mut reader, header) = open(path)?;
    let mut time = header.required("t_s", TIME)?;
    let mut reference = header.optional("reference", REFERENCE)?;
    let mut position = header.optional("position", POSITION)?;
    let mut voltage = header.optional("voltage", VOLTAGE)?;
    let mut injection = header.optional("injection", INJECTION)?;
    let needed = match purpose {
        Purpose::Motion => [("reference_m (or reference_mm)", &reference); 2],
        Purpose::Experiment => [
            ("position_m (or position_mm)", &position),
            ("voltage_v", &voltage),
        ],
    };
    if let Some((missing, _)) = needed.into_iter().find(|(_, column)| column.is_none()) {
        return Err(header.missing(missing));
    }

    let columns = [
        Some(&mut time),
        reference.as_mut(),
        position.as_mut(),
        voltage.as_mut(),
        injection.as_mut(),
    ];
    fill(
        &mut reader,
        path,
        &mut columns.into_iter().flatten().collect::<Vec<_>>(),
        most_rows,
        progress,
    )?;
    Ok(Columns {
        time: time.0,
        reference: reference.map(|c| c.0),
        position: position.map(|c| c.0),
        voltage: voltage.map(|c| c.0),
        injection: injection.map(|c| c.0),
    })
}

/// The time, and the forces of x, y and z where they are recorded, of a file with one of them at least.
pub(super) fn read_forces(path: &Path) -> Result<(Column, [Option<Column>; 3]), RecordError> {
    let (mut reader, header) = open(path)?;
    let mut time = header.required("t_s", TIME)?;
    let mut forces = [None, None, None];
    for (force, names) in forces.iter_mut().zip(FORCES) {
        *force = header.optional(names[0].0, names)?;
    }
    if forces.iter().all(Option::is_none) {
        return Err(header.missing("force_x_n (or force_y_n, force_z_n)"));
    }
    let mut columns: Vec<&mut Place> = forces.iter_mut().flatten().collect();
    columns.push(&mut time);
    fill(&mut reader, path, &mut columns, MOST_ROWS, &mut |_| {})?;
    Ok((time.0, forces.map(|force| force.map(|(column, _)| column))))
}

/// A file's text for a terminal: what would steer it is escaped.
fn printable(text: &str) -> String {
    text.chars()
        .map(|sign| match sign.is_control() {
            true => sign.escape_default().to_string(),
            false => sign.to_string(),
        })
        .collect()
}

/// A file, and its header read.
fn open(path: &Path) -> Result<(Reader<File>, Header<'_>), RecordError> {
    let mut reader = ReaderBuilder::new()
        .from_path(path)
        .map_err(|error| refuse(path, error))?;
    let header = reader
        .byte_headers()
        .map_err(|error| refuse(path, error))?
        .clone();
    let names = header
        .iter()
        .map(|name| String::from_utf8_lossy(name).trim().to_owned())
        .collect();
    Ok((reader, Header { path, names }))
}

/// Reads all rows into the columns, of which there is at least one.
fn fill(
    reader: &mut Reader<File>,
    path: &Path,
    columns: &mut [&mut Place],
    most_rows: usize,
    progress: &mut dyn FnMut(f64),
) -> Result<(), RecordError> {
    let bytes = std::fs::metadata(path).map_or(0, |file| file.len());
    let mut row = ByteRecord::new();
    let mut rows: usize = 0;
    while reader
        .read_byte_record(&mut row)
        .map_err(|error| refuse(path, error))?
    {
        let line = row.position().map_or(0, csv::Position::line);
        if rows.is_multiple_of(PROGRESS_ROWS) {
            let read = row.position().map_or(0, csv::Position::byte);
            progress((read as f64 / bytes.max(1) as f64).min(1.0));
        }
        rows += 1;
        if rows > most_rows {
            return Err(RecordError::TooManyRows {
                path: path.to_owned(),
                most_rows,
            });
        }
        for (column, index) in columns.iter_mut() {
            let value = number(path, column.name, line, &row[*index])?;
            column.push(value, line);
        }
    }
    if rows < MIN_ROWS {
        return Err(RecordError::TooFewRows {
            path: path.to_owned(),
            rows,
        });
    }
    Ok(())
}

fn number(path: &Path, column: &str, line: u64, cell: &[u8]) -> Result<f64, RecordError> {
    let refused = |expected| RecordError::Cell {
        path: path.to_owned(),
        line,
        column: column.to_owned(),
        value: String::from_utf8_lossy(cell).into_owned(),
        expected,
    };
    let text = str::from_utf8(cell)
        .map_err(|_| refused("text in UTF-8"))?
        .trim();
    let value: f64 = text
        .parse()
        .map_err(|_| refused("a number such as 0.012 or 1.2e-2"))?;
    if value.is_finite() {
        Ok(value)
    } else {
        Err(refused("a finite number"))
    }
}

/// The CSV reader's complaints, which name lines, as ours, which name the file too.
fn refuse(path: &Path, error: csv::Error) -> RecordError {
    let path = path.to_owned();
    let line = error.position().map(csv::Position::line);
    match error.into_kind() {
        csv::ErrorKind::Io(source) => RecordError::Read { path, source },
        csv::ErrorKind::UnequalLengths {
            pos,
            expected_len,
            len,
        } => {
            let line = pos.map(|pos| pos.line()).or(line).unwrap_or(0);
            let message = format!(
                "line {line} has {len} cells, the header has {expected_len}; every row needs as many"
            );
            RecordError::Malformed { path, message }
        }
        other => RecordError::Malformed {
            path,
            message: format!("line {}: not CSV: {other:?}", line.unwrap_or(0)),
        },
    }
}

struct Header<'a> {
    path: &'a Path,
    names: Vec<String>,
}

/// A column to be filled, and its place in a row.
type Place = (Column, usize);

impl Header<'_> {
    fn required(&self, needed: &'static str, names: &[Name]) -> Result<Place, RecordError> {
        self.optional(names[0].0, names)?
            .ok_or_else(|| self.missing(needed))
    }

    fn missing(&self, needed: &'static str) -> RecordError {
        RecordError::MissingColumn {
            path: self.path.to_owned(),
            needed,
            found: self.found(),
            hint: self.hint(),
        }
    }

    fn optional(
        &self,
        quantity: &'static str,
        names: &[Name],
    ) -> Result<Option<Place>, RecordError> {
        let mut matches = self.names.iter().enumerate().filter_map(|(index, found)| {
            let (name, mm_per_unit) = *names.iter().find(|(name, _)| name == found)?;
            Some((
                Column {
                    name,
                    mm_per_unit,
                    values: Vec::new(),
                    lines: Vec::new(),
                },
                index,
            ))
        });
        let first = matches.next();
        match (&first, matches.next()) {
            (Some((first, _)), Some((second, _))) => Err(RecordError::AmbiguousColumn {
                path: self.path.to_owned(),
                quantity,
                first: first.name.to_owned(),
                second: second.name.to_owned(),
            }),
            _ => Ok(first),
        }
    }

    fn found(&self) -> String {
        if self.names.iter().all(String::is_empty) {
            "no header".to_owned()
        } else {
            printable(&self.names.join(", "))
        }
    }

    fn hint(&self) -> &'static str {
        match self.names.as_slice() {
            [only] if only.contains([';', '\t']) => ". Cells must be separated by commas",
            names if !names.is_empty() && names.iter().all(|name| name.parse::<f64>().is_ok()) => {
                ". The first line must name the columns"
            }
            _ => "",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_more_rows_than_memory_bears_is_refused_while_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("endless.csv");
        // What comes after the last row that is allowed is not looked at.
        let rows = "0,1\n".repeat(20) + "nonsense,\n";
        std::fs::write(&path, format!("t_s,reference_mm\n{rows}")).unwrap();
        let error = read_at_most(&path, Purpose::Motion, 19, &mut |_| {}).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("more than 19 rows") && message.contains("split"),
            "{message}"
        );
        let error = read_at_most(&path, Purpose::Motion, 21, &mut |_| {}).unwrap_err();
        assert!(
            matches!(error, RecordError::Cell { line: 22, .. }),
            "{error}"
        );
    }
}
