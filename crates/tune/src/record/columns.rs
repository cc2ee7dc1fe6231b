//! From the text of a CSV file to columns of finite numbers.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;

use csv::{ByteRecord, Reader, ReaderBuilder, Terminator};

use super::error::RecordError;
use super::limits::MIN_ROWS;
use super::lines::Lines;

/// The columns of a record, as labelled.
#[derive(Debug)]
pub(super) struct Columns {
    pub(super) time: Column,
    pub(super) reference: Option<Column>,
    pub(super) position: Option<Column>,
    pub(super) voltage: Option<Column>,
    pub(super) injection: Option<Column>,
    pub(super) part: Option<Column>,
    /// Line of each value.
    pub(super) lines: Lines,
}

/// One column of a file.
#[derive(Clone, Debug)]
pub(super) struct Column {
    pub(super) name: &'static str,
    /// Millimetres in one unit of a position column; 1 for others.
    pub(super) mm_per_unit: f64,
    pub(super) values: Vec<f64>,
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
}

/// A name a header can have, and the scale of its unit.
type Name = (&'static str, f64);

const TIME: &[Name] = &[("t_s", 1.0)];
const REFERENCE: &[Name] = &[("reference_m", 1e3), ("reference_mm", 1.0)];
const POSITION: &[Name] = &[("position_m", 1e3), ("position_mm", 1.0)];
const VOLTAGE: &[Name] = &[("voltage_v", 1.0)];
const INJECTION: &[Name] = &[("injection_v", 1.0)];
const PART: &[Name] = &[("part", 1.0)];
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

/// Most rows of a record: more than an hour at 10 kHz. All columns of an experiment then take less than 3 GiB of memory.
const MOST_ROWS: usize = 50_000_000;

/// Rows between two reports of the progress.
const ROWS_PER_REPORT: usize = 1 << 16;

/// `progress` gets the share of the file that is read, 0 to 1.
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
    fill(Source::open(path)?, purpose, most_rows, progress)
}

/// Reads a text that stands for a file's, and begins with lines that the file does not have.
pub(super) fn read_text(
    path: &Path,
    text: Vec<u8>,
    added_lines: u64,
    purpose: Purpose,
    progress: &mut dyn FnMut(f64),
) -> Result<Columns, RecordError> {
    let bytes = text.len() as u64;
    let (mut source, header) = Source::of(path, Box::new(Cursor::new(text)), bytes)?;
    source.added_lines = added_lines;
    fill((source, header), purpose, MOST_ROWS, progress)
}

fn fill(
    (source, header): (Source<'_>, Header<'_>),
    purpose: Purpose,
    most_rows: usize,
    progress: &mut dyn FnMut(f64),
) -> Result<Columns, RecordError> {
    let mut time = header.required("t_s", TIME)?;
    let mut reference = header.optional("reference", REFERENCE)?;
    let mut position = header.optional("position", POSITION)?;
    let mut voltage = header.optional("voltage", VOLTAGE)?;
    let mut injection = header.optional("injection", INJECTION)?;
    let mut part = header.optional("part", PART)?;
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
        part.as_mut(),
    ];
    let lines = source.fill(
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
        part: part.map(|c| c.0),
        lines,
    })
}

/// Recorded forces and their time, as labelled.
pub(super) struct ForceColumns {
    pub(super) time: Column,
    /// The forces of x, y and z where they are recorded.
    pub(super) forces: [Option<Column>; 3],
    /// Line of each value.
    pub(super) lines: Lines,
}

/// Reads a file with one force at least.
pub(super) fn read_forces(path: &Path) -> Result<ForceColumns, RecordError> {
    let (source, header) = Source::open(path)?;
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
    let lines = source.fill(&mut columns, MOST_ROWS, &mut |_| {})?;
    Ok(ForceColumns {
        time: time.0,
        forces: forces.map(|force| force.map(|(column, _)| column)),
        lines,
    })
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

/// A file behind its header.
struct Source<'a> {
    path: &'a Path,
    reader: Reader<Box<dyn Read>>,
    /// Length of the file, bytes; zero where it is not known beforehand.
    bytes: u64,
    /// Cells of a row.
    cells: usize,
    /// Lines at its beginning that the file does not have.
    added_lines: u64,
}

impl<'a> Source<'a> {
    fn open(path: &'a Path) -> Result<(Self, Header<'a>), RecordError> {
        let file = File::open(path).map_err(|error| refuse(path, error.into()))?;
        let bytes = file.metadata().map_or(0, |file| file.len());
        Self::of(path, Box::new(file), bytes)
    }

    fn of(
        path: &'a Path,
        text: Box<dyn Read>,
        bytes: u64,
    ) -> Result<(Self, Header<'a>), RecordError> {
        // Every row ends with a line feed, also the last: so the line behind a row is one more than the row's.
        let text: Box<dyn Read> = Box::new(text.chain(&b"\n"[..]));
        let mut reader = ReaderBuilder::new()
            .flexible(true)
            .terminator(Terminator::Any(b'\n'))
            .buffer_capacity(1 << 18)
            .from_reader(text);
        let header = reader.byte_headers().map_err(|error| refuse(path, error))?;
        let names: Vec<String> = header
            .iter()
            .map(|name| String::from_utf8_lossy(name).trim().to_owned())
            .collect();
        let source = Self {
            path,
            reader,
            bytes,
            cells: names.len(),
            added_lines: 0,
        };
        Ok((source, Header { path, names }))
    }

    /// Reads all rows into the columns, of which there is at least one; returns their lines, a row of several lines by its last.
    fn fill(
        mut self,
        columns: &mut [&mut Place],
        most_rows: usize,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Lines, RecordError> {
        let path = self.path;
        let mut lines = Lines::default();
        let mut row = ByteRecord::new();
        let bytes = self.bytes.max(1) as f64;
        loop {
            let more = self.reader.read_byte_record(&mut row);
            if !more.map_err(|error| refuse(path, error))? {
                break;
            }
            if row.len() == 1 && row[0].trim_ascii().is_empty() {
                continue;
            }
            if lines.rows() == most_rows {
                return Err(RecordError::TooManyRows {
                    path: path.to_owned(),
                    most_rows,
                });
            }
            let place = self.reader.position();
            if lines.rows().is_multiple_of(ROWS_PER_REPORT) {
                progress((place.byte() as f64 / bytes).min(1.0));
            }
            let line = place.line() - 1 - self.added_lines;
            if row.len() != self.cells {
                let (found, expected) = (row.len(), self.cells);
                let message = format!(
                    "line {line} has {found} cells, the header has {expected}; every row needs as many"
                );
                return Err(RecordError::Malformed {
                    path: path.to_owned(),
                    message,
                });
            }
            for (column, cell) in columns.iter_mut() {
                let value = number(path, column.name, line, &row[*cell])?;
                column.values.push(value);
            }
            lines.push(line);
        }
        if lines.rows() < MIN_ROWS {
            return Err(RecordError::TooFewRows {
                path: path.to_owned(),
                rows: lines.rows(),
            });
        }
        Ok(lines)
    }
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

/// The CSV reader's complaints as ours, which name the file.
fn refuse(path: &Path, error: csv::Error) -> RecordError {
    let path = path.to_owned();
    match error.into_kind() {
        csv::ErrorKind::Io(source) => RecordError::Read { path, source },
        other => RecordError::Malformed {
            path,
            message: format!("not CSV: {other:?}"),
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
            names if names.len() >= 2 && names.iter().all(|name| name.parse::<f64>().is_err()) => {
                ". Rename the columns; or `identify motion --columns time=...,position=...,voltage=...`, which takes other names"
            }
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

    fn read_bytes(text: &[u8], most_rows: usize) -> Result<Columns, RecordError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("record.csv");
        std::fs::write(&path, text).unwrap();
        read_at_most(&path, Purpose::Motion, most_rows, &mut |_| {})
    }

    #[test]
    fn rows_of_more_than_memory_allows_are_refused_while_they_are_read() {
        // What comes after the last row that is allowed is not looked at.
        let rows = "0,1\n".repeat(20) + "nonsense,\n";
        let text = format!("t_s,reference_mm\n{rows}");
        let message = read_bytes(text.as_bytes(), 19).unwrap_err().to_string();
        assert!(
            message.contains("more than 19 rows") && message.contains("split"),
            "{message}"
        );
        let error = read_bytes(text.as_bytes(), 21).unwrap_err();
        assert!(
            matches!(error, RecordError::Cell { line: 22, .. }),
            "{error}"
        );
    }

    /// Twenty rows with line ends in turn, the eighth replaced.
    fn small(header: &str, ends: &[&str], eighth: &str) -> Vec<u8> {
        let mut text = header.to_owned();
        for row in 0..20 {
            match row {
                7 => text += eighth,
                _ => text += &format!("{}e-4,{}.25,n", row, 3 * row),
            }
            text += ends[row % ends.len()];
        }
        text.into_bytes()
    }

    #[test]
    fn every_way_of_writing_a_table_gives_the_same_numbers_and_the_lines_of_the_file() {
        let header = "t_s,reference_mm,note\n";
        let good = "7e-4,21.25,n";
        for (text, line_of_the_ninth) in [
            (small(header, &["\n"], good), 10),
            (small("t_s,reference_mm,note\r\n", &["\r\n"], good), 10),
            (small("\u{feff}t_s,reference_mm,note\n", &["\n"], good), 10),
            (
                small("\"t_s\",\"reference_mm\",\"note\"\n", &["\n"], good),
                10,
            ),
            (small(header, &["\n\n", "\r\n\r\n"], good), 18),
            (small(header, &["\n"], good).trim_ascii_end().to_vec(), 10),
            (small(header, &["\n"], "  7e-4 ,\t21.25,n"), 10),
            (small(header, &["\n"], "7e-4,\"21.25\",n"), 10),
            (
                small(
                    header,
                    &["\n"],
                    "7e-4,21.25,\"a, \"\"note\"\"\nof two lines\"",
                ),
                11,
            ),
        ] {
            let shown = String::from_utf8_lossy(&text);
            let columns = read_bytes(&text, MOST_ROWS).unwrap();
            let time: Vec<f64> = (0..20).map(|row| f64::from(row) * 1e-4).collect();
            for (found, expected) in columns.time.values.iter().zip(&time) {
                assert!((found - expected).abs() < 1e-18, "{shown}");
            }
            assert_eq!(columns.time.values.len(), 20, "{shown}");
            assert_eq!(columns.reference.unwrap().values[7], 21.25, "{shown}");
            assert_eq!(columns.lines.line(8), line_of_the_ninth, "{shown}");
        }
    }

    #[test]
    fn a_row_that_is_none_is_refused_with_its_line() {
        for eighth in [
            "7e-4,x,n",
            "7e-4,,n",
            "inf,21.25,n",
            "7e-4,1e999,n",
            "7e-4,21.25",
            "7e-4,21.25,n,",
            "7e-4,1.2.3,e",
            "7e-4,\"x\",n",
        ] {
            let text = small("t_s,reference_mm,note\n", &["\n"], eighth);
            let message = read_bytes(&text, MOST_ROWS).unwrap_err().to_string();
            assert!(message.contains("line 9"), "{eighth}: {message}");
        }
        let mut not_text = small("t_s,reference_mm,note\n", &["\n"], "7e-4,5,n");
        let place = not_text.iter().position(|sign| *sign == b'5').unwrap();
        not_text[place] = 0xff;
        let message = read_bytes(&not_text, MOST_ROWS).unwrap_err().to_string();
        assert!(message.contains("UTF-8"), "{message}");
    }
}
