//! From bytes to columns of finite numbers.
//!
//! A file is read in blocks, and the lines of a block are parsed in parts, in parallel, while the next block is read; rows end where
//! lines do, and cells at commas. Where a quotation mark stands, a line break or a comma may be part of a cell: from there on the
//! rows are read one after the other, as CSV with all its rules.

use super::error::RecordError;
use super::limits::MIN_ROWS;
use csv::{ByteRecord, ReaderBuilder};
use memchr::{memchr, memchr_iter, memchr2, memrchr2};
use rayon::prelude::*;
use std::fs::File;
use std::io::{Cursor, Read};
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
#[derive(Clone, Debug)]
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
        self.begin_run(self.values.len(), line);
        self.values.push(value);
    }

    /// Adds the rows of a part that follows.
    fn append(&mut self, part: Self) {
        let before = self.values.len();
        for (index, line) in part.lines {
            self.begin_run(before + index, line);
        }
        self.values.extend(part.values);
    }

    /// Notes the line of a value where it does not follow from those before.
    fn begin_run(&mut self, index: usize, line: u64) {
        if self.lines.is_empty() || self.line(index) != line {
            self.lines.push((index, line));
        }
    }

    /// The same column of another part of the file.
    fn emptied(&self) -> Self {
        Self {
            values: Vec::new(),
            lines: Vec::new(),
            ..*self
        }
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

/// Bytes of a block: the columns of a long recording take far more memory.
const BLOCK_BYTES: u64 = 1 << 22;

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
    let (source, header) = Source::open(path)?;
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
    source.fill(
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
    source.fill(&mut columns, MOST_ROWS, &mut |_| {})?;
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

/// A file behind its header.
struct Source<'a> {
    rows: Rows<'a>,
    file: File,
    /// Length of the file, bytes; zero where it is not known beforehand.
    bytes: u64,
    /// Bytes that were read.
    read: u64,
    /// Those that are not parsed yet.
    text: Vec<u8>,
    /// Line that they begin in.
    line: u64,
}

/// Form of a file's rows.
#[derive(Clone, Copy)]
struct Rows<'a> {
    path: &'a Path,
    cells: usize,
}

/// Rows that follow each other, up to the first that is refused.
struct Part {
    columns: Vec<Place>,
    rows: usize,
    refused: Option<RecordError>,
}

impl<'a> Source<'a> {
    fn open(path: &'a Path) -> Result<(Self, Header<'a>), RecordError> {
        let file = File::open(path).map_err(|error| refuse(path, error.into()))?;
        let mut source = Self {
            rows: Rows { path, cells: 0 },
            bytes: file.metadata().map_or(0, |file| file.len()),
            file,
            read: 0,
            text: Vec::new(),
            line: 1,
        };
        source.read_block()?;
        let mut reader = ReaderBuilder::new().from_reader(&source.text[..]);
        let header = reader
            .byte_headers()
            .map_err(|error| refuse(path, error))?
            .clone();
        let end = reader.position().clone();
        source.text.drain(..end.byte() as usize);
        source.line = end.line();
        source.rows.cells = header.len();
        let names = header
            .iter()
            .map(|name| String::from_utf8_lossy(name).trim().to_owned())
            .collect();
        Ok((source, Header { path, names }))
    }

    /// Reads a block more; returns false at the end of the file.
    fn read_block(&mut self) -> Result<bool, RecordError> {
        let mut block = self.file.by_ref().take(BLOCK_BYTES);
        let read = block.read_to_end(&mut self.text);
        let read = read.map_err(|error| refuse(self.rows.path, error.into()))?;
        self.read += read as u64;
        Ok(read > 0)
    }

    /// Reads all rows into the columns, of which there is at least one.
    fn fill(
        mut self,
        columns: &mut [&mut Place],
        most_rows: usize,
        progress: &mut dyn FnMut(f64),
    ) -> Result<(), RecordError> {
        let empty: Vec<Place> = columns
            .iter()
            .map(|(column, index)| (column.emptied(), *index))
            .collect();
        let bytes = self.bytes.max(1) as f64;
        let mut share = |parsed: u64| progress((parsed as f64 / bytes).min(1.0));
        let mut rows = 0;
        let mut goes_on = true;
        while goes_on {
            let parsed = self.read - self.text.len() as u64;
            share(parsed);
            let room = most_rows - rows;
            let parts = if memchr(b'"', &self.text).is_some() {
                goes_on = false;
                let text = std::mem::take(&mut self.text);
                let text = Cursor::new(text).chain(&mut self.file);
                let mut share = |within: u64| share(parsed + within);
                vec![
                    self.rows
                        .parse(text, self.line, empty.clone(), room, &mut share),
                ]
            } else {
                // The last line may go on in the next block, or be the file's last.
                let end = memrchr2(b'\n', b'\r', &self.text).map_or(0, |last| last + 1);
                let mut lines = std::mem::take(&mut self.text);
                self.text.extend_from_slice(&lines[end..]);
                lines.truncate(end);
                let (rows, line) = (self.rows, self.line);
                let (mut parts, more) = rayon::join(
                    || rows.parse_lines(&lines, line, &empty, room),
                    || self.read_block(),
                );
                self.line += line_breaks(&lines);
                if !more? {
                    goes_on = false;
                    let last = std::mem::take(&mut self.text);
                    parts.push(rows.parse_part(&last, self.line, empty.clone(), room));
                }
                parts
            };
            for part in parts {
                rows += part.rows;
                if rows > most_rows {
                    return Err(RecordError::TooManyRows {
                        path: self.rows.path.to_owned(),
                        most_rows,
                    });
                }
                if let Some(error) = part.refused {
                    return Err(error);
                }
                for ((column, _), (more, _)) in columns.iter_mut().zip(part.columns) {
                    column.append(more);
                }
            }
        }
        if rows < MIN_ROWS {
            return Err(RecordError::TooFewRows {
                path: self.rows.path.to_owned(),
                rows,
            });
        }
        Ok(())
    }
}

/// Lines that end in a text.
fn line_breaks(text: &[u8]) -> u64 {
    memchr_iter(b'\n', text).count() as u64
}

/// Rows between two reports of progress.
const PROGRESS_ROWS: usize = 1 << 16;

/// Bytes of a part of a block, some 3000 rows.
const PART_BYTES: usize = 1 << 18;

impl Rows<'_> {
    /// Rows of whole lines without a quotation mark, of which the first is a line of the file, in parts.
    fn parse_lines(&self, lines: &[u8], line: u64, empty: &[Place], room: usize) -> Vec<Part> {
        let mut parts = Vec::new();
        let (mut rest, mut line) = (lines, line);
        while !rest.is_empty() {
            let least = PART_BYTES.min(rest.len());
            let end = memchr2(b'\n', b'\r', &rest[least - 1..]);
            let (part, after) = rest.split_at(end.map_or(rest.len(), |end| least + end));
            parts.push((part, line));
            line += line_breaks(part);
            rest = after;
        }
        parts
            .into_par_iter()
            .map(|(part, line)| self.parse_part(part, line, empty.to_vec(), room))
            .collect()
    }

    /// Rows of lines without a quotation mark, into columns that are empty; one beyond `room` ends them. Empty lines are no rows.
    fn parse_part(&self, lines: &[u8], line: u64, columns: Vec<Place>, room: usize) -> Part {
        let mut part = Part {
            columns,
            rows: 0,
            refused: None,
        };
        let mut cells = Vec::with_capacity(self.cells);
        let (mut rest, mut line) = (lines, line);
        while !rest.is_empty() && part.refused.is_none() && part.rows <= room {
            let end = memchr2(b'\n', b'\r', rest).unwrap_or(rest.len());
            let row = &rest[..end];
            if !row.is_empty() {
                part.rows += 1;
                cells.clear();
                let mut begin = 0;
                for comma in memchr_iter(b',', row) {
                    cells.push(&row[begin..comma]);
                    begin = comma + 1;
                }
                cells.push(&row[begin..]);
                part.refused = self.take(&cells, line, &mut part.columns).err();
            }
            line += u64::from(rest.get(end) == Some(&b'\n'));
            rest = rest.get(end + 1..).unwrap_or_default();
        }
        part
    }

    /// Rows of a text that begins in a line of the file, into columns that are empty; one beyond `room` ends it. `progress` is told how
    /// many bytes were parsed.
    fn parse(
        &self,
        text: impl Read,
        line: u64,
        columns: Vec<Place>,
        room: usize,
        progress: &mut dyn FnMut(u64),
    ) -> Part {
        let mut part = Part {
            columns,
            rows: 0,
            refused: None,
        };
        // The first row says nothing about the length of the others; the header does.
        let mut reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .from_reader(text);
        let mut row = ByteRecord::new();
        while part.refused.is_none() && part.rows <= room {
            match reader.read_byte_record(&mut row) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    part.refused = Some(refuse(self.path, error));
                    break;
                }
            }
            let place = row.position().map_or((1, 0), |at| (at.line(), at.byte()));
            if part.rows.is_multiple_of(PROGRESS_ROWS) {
                progress(place.1);
            }
            part.rows += 1;
            let cells: Vec<&[u8]> = row.iter().collect();
            let line = line + place.0 - 1;
            part.refused = self.take(&cells, line, &mut part.columns).err();
        }
        part
    }

    /// Takes a row, which stands in a line of the file, into the columns.
    fn take(&self, row: &[&[u8]], line: u64, columns: &mut [Place]) -> Result<(), RecordError> {
        if row.len() != self.cells {
            let (found, expected) = (row.len(), self.cells);
            let message = format!(
                "line {line} has {found} cells, the header has {expected}; every row needs as many"
            );
            return Err(RecordError::Malformed {
                path: self.path.to_owned(),
                message,
            });
        }
        for (column, index) in columns {
            let value = number(self.path, column.name, line, row[*index])?;
            column.push(value, line);
        }
        Ok(())
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

    /// Rows of which some have blank lines before them, with a note each.
    fn text(rows: usize, note: &str) -> String {
        let row = |index: usize| {
            let blank = if index % 1000 == 7 { "\r\n\n" } else { "" };
            format!("{blank}{index},{}.5,{note}\n", index % 97)
        };
        let rows: String = (0..rows).map(row).collect();
        format!("t_s,reference_mm,note\n{rows}")
    }

    #[test]
    fn a_file_of_many_blocks_reads_as_row_by_row() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.csv");
        let rows = 700_000;
        let read = |note: &str| {
            let text = text(rows, note);
            assert!(text.len() as u64 > 2 * BLOCK_BYTES);
            std::fs::write(&path, &text).unwrap();
            read(&path, Purpose::Motion, &mut |_| {}).unwrap()
        };
        let (in_parts, by_row) = (read("a note"), read("\"a note\""));
        let lines = |columns: &Columns| (0..rows).map(|row| columns.time.line(row)).collect();
        let (in_parts_at, by_row_at): (Vec<u64>, Vec<u64>) = (lines(&in_parts), lines(&by_row));
        for row in 0..rows {
            assert_eq!(in_parts.time.values[row], row as f64);
            // Behind blank lines, a row counts from the first of them unless a part begins with it.
            assert!((by_row_at[row]..by_row_at[row] + 3).contains(&in_parts_at[row]));
        }
        assert_eq!(in_parts_at[rows - 1], by_row_at[rows - 1]);
        assert_eq!(in_parts.time.values, by_row.time.values);
        let reference = |columns: Columns| columns.reference.unwrap().values;
        assert_eq!(reference(in_parts), reference(by_row));
    }

    #[test]
    fn the_first_row_that_is_refused_is_named_whatever_part_it_is_in() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("spoilt.csv");
        let spoilt = text(700_000, "")
            .replace("\n600000,", "\n600000,x")
            .replace("\n650000,", "\n650000,1,");
        std::fs::write(&path, spoilt).unwrap();
        let error = read(&path, Purpose::Motion, &mut |_| {}).unwrap_err();
        // The header, 600 times two blank lines, and the row itself.
        assert!(
            matches!(error, RecordError::Cell { line: 601_202, .. }),
            "{error}"
        );
    }

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
