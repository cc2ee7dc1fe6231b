//! From bytes to columns of finite numbers.
//!
//! A file is read in blocks of whole lines, which are cut into parts. The parts of a block are parsed in parallel, while the values of the
//! block before are joined and the next block is read; rows end where lines do, and cells at commas. Where a quotation mark stands, a line
//! break or a comma may be part of a cell: from its line on the rows are read one after the other, as CSV with all its rules. Neither the
//! size of blocks and parts nor the number of threads changes a value, a line or an error.

use super::error::RecordError;
use super::limits::MIN_ROWS;
use super::lines::Lines;
use csv::{ByteRecord, Reader, ReaderBuilder};
use memchr::{memchr, memchr_iter, memchr2, memchr3, memrchr2};
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, Cursor, Read};
use std::ops::Range;
use std::path::Path;

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

/// Sizes that a file is read in, bytes.
#[derive(Clone, Copy)]
struct Sizes {
    /// Size of a block: the columns of a long recording take far more memory.
    block: usize,
    /// Least size of a part of a block, which one thread parses.
    part: usize,
}

/// A part has some 3000 rows.
const SIZES: Sizes = Sizes {
    block: 1 << 22,
    part: 1 << 18,
};

/// Bytes from which on what has not come to an end is no header.
const MOST_HEADER_BYTES: usize = SIZES.block;

/// Most rows of a record: more than an hour at 10 kHz. All columns of an experiment then take less than 3 GiB of memory.
const MOST_ROWS: usize = 50_000_000;

/// `progress` is told the share of the file that is read, 0 to 1.
pub(super) fn read(
    path: &Path,
    purpose: Purpose,
    progress: &mut dyn FnMut(f64),
) -> Result<Columns, RecordError> {
    read_at_most(path, purpose, MOST_ROWS, SIZES, progress)
}

fn read_at_most(
    path: &Path,
    purpose: Purpose,
    most_rows: usize,
    sizes: Sizes,
    progress: &mut dyn FnMut(f64),
) -> Result<Columns, RecordError> {
    let opened = Source::open(path, sizes)?;
    fill(opened, purpose, most_rows, progress)
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
    let (mut source, header) = Source::of(path, SIZES, Box::new(Cursor::new(text)), bytes)?;
    source.line -= added_lines;
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
    let (source, header) = Source::open(path, SIZES)?;
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
    sizes: Sizes,
    file: Box<dyn Read + Send>,
    /// Length of the file, bytes; zero where it is not known beforehand.
    bytes: u64,
    /// Cells of a row.
    cells: usize,
    /// Bytes that were read.
    read: u64,
    /// True if these are all.
    ended: bool,
    /// Those of them that are in no block yet.
    text: Vec<u8>,
    /// Line that they begin in.
    line: u64,
    /// True if they begin with the line of a quotation mark.
    quoted: bool,
    /// Memory of a block that was parsed.
    spare: Vec<u8>,
}

/// Whole lines without a quotation mark.
struct Block {
    text: Vec<u8>,
    parts: Vec<PartPlace>,
}

/// Place of a part in its block, and in the file.
struct PartPlace {
    range: Range<usize>,
    /// Line that it begins in.
    line: u64,
    /// Line breaks in it.
    line_breaks: u64,
}

impl<'a> Source<'a> {
    fn open(path: &'a Path, sizes: Sizes) -> Result<(Self, Header<'a>), RecordError> {
        let file = File::open(path).map_err(|error| refuse(path, error.into()))?;
        let bytes = file.metadata().map_or(0, |file| file.len());
        Self::of(path, sizes, Box::new(file), bytes)
    }

    fn of(
        path: &'a Path,
        sizes: Sizes,
        file: Box<dyn Read + Send>,
        bytes: u64,
    ) -> Result<(Self, Header<'a>), RecordError> {
        let mut source = Self {
            path,
            sizes,
            bytes,
            file,
            cells: 0,
            read: 0,
            ended: false,
            text: Vec::new(),
            line: 1,
            quoted: false,
            spare: Vec::new(),
        };
        loop {
            source.read_block()?;
            let mut reader = ReaderBuilder::new().from_reader(&source.text[..]);
            let header = reader.byte_headers().map_err(|error| refuse(path, error))?;
            let names: Vec<String> = header
                .iter()
                .map(|name| String::from_utf8_lossy(name).trim().to_owned())
                .collect();
            let end = reader.position();
            let (end, line) = (end.byte() as usize, end.line());
            let read = source.text.len();
            // A header that ends with the block may go on in the next.
            if end < read || source.ended || read >= MOST_HEADER_BYTES {
                source.cells = names.len();
                source.line = line;
                source.text.drain(..end);
                return Ok((source, Header { path, names }));
            }
        }
    }

    /// Reads as much as a block holds, or what is left.
    fn read_block(&mut self) -> Result<(), RecordError> {
        let block = self.sizes.block;
        self.text.reserve(block);
        let mut file = self.file.by_ref().take(block as u64);
        let read = file.read_to_end(&mut self.text);
        let read = read.map_err(|error| refuse(self.path, error.into()))?;
        self.read += read as u64;
        self.ended = read < block;
        Ok(())
    }

    /// Takes all whole lines that were read up to that of the first quotation mark, if there is one.
    fn cut(&mut self) -> Block {
        let quote = memchr(b'"', &self.text);
        self.quoted = quote.is_some();
        let end = match quote {
            None if self.ended => self.text.len(),
            // The last line may go on in the next block.
            _ => memrchr2(b'\n', b'\r', &self.text[..quote.unwrap_or(self.text.len())])
                .map_or(0, |last| last + 1),
        };
        let mut rest = std::mem::take(&mut self.spare);
        rest.clear();
        rest.extend_from_slice(&self.text[end..]);
        let mut text = std::mem::replace(&mut self.text, rest);
        text.truncate(end);
        let mut parts = Vec::new();
        let mut begin = 0;
        while begin < end {
            let least = (begin + self.sizes.part).min(end);
            let part =
                begin..memchr2(b'\n', b'\r', &text[least - 1..]).map_or(end, |at| least + at);
            begin = part.end;
            let line_breaks = memchr_iter(b'\n', &text[part.clone()]).count() as u64;
            parts.push(PartPlace {
                range: part,
                line: self.line,
                line_breaks,
            });
            self.line += line_breaks;
        }
        Block { text, parts }
    }

    /// Reads all rows into the columns, of which there is at least one; returns their lines.
    fn fill(
        mut self,
        columns: &mut [&mut Place],
        most_rows: usize,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Lines, RecordError> {
        let rows = Rows::new(self.path, self.cells, columns);
        let mut filled = Filled {
            path: self.path,
            columns,
            lines: Lines::default(),
            most_rows,
        };
        let bytes = self.bytes.max(1) as f64;
        let mut share = |parsed: u64| progress((parsed as f64 / bytes).min(1.0));
        let mut block = Some(self.cut());
        let mut parsed = Vec::new();
        while let Some(Block { text, parts }) = block {
            share(self.read - (text.len() + self.text.len()) as u64);
            let room = filled.room();
            let part = |place| rows.parse(&text, place, room);
            let (found, next) = rayon::join(
                || parts.into_par_iter().map(part).collect(),
                || {
                    filled.append(std::mem::take(&mut parsed))?;
                    if self.ended || self.quoted {
                        return Ok(None);
                    }
                    self.read_block()?;
                    Ok(Some(self.cut()))
                },
            );
            self.spare = text;
            (parsed, block) = (found, next?);
        }
        filled.append(parsed)?;
        if self.quoted {
            let before = self.read - self.text.len() as u64;
            let text = Recent::new(Cursor::new(self.text).chain(self.file));
            // The first row says nothing about the length of the others; the header does.
            let mut reader = ReaderBuilder::new()
                .has_headers(false)
                .flexible(true)
                .from_reader(text);
            while !reader.is_done() {
                share(before + reader.position().byte());
                let part = rows.parse_quoted(&mut reader, self.line - 1, filled.room());
                filled.append(vec![part])?;
            }
        }
        let lines = filled.lines;
        if lines.rows() < MIN_ROWS {
            return Err(RecordError::TooFewRows {
                path: self.path.to_owned(),
                rows: lines.rows(),
            });
        }
        Ok(lines)
    }
}

/// Columns as far as they are read.
struct Filled<'a, 'b> {
    path: &'a Path,
    columns: &'a mut [&'b mut Place],
    lines: Lines,
    most_rows: usize,
}

impl Filled<'_, '_> {
    /// Rows that may follow.
    fn room(&self) -> usize {
        self.most_rows - self.lines.rows()
    }

    /// Adds the rows that follow.
    fn append(&mut self, parts: Vec<Part>) -> Result<(), RecordError> {
        for part in parts {
            // A row that is refused is one, too.
            let rows = part.lines.rows() + usize::from(part.refused.is_some());
            if rows > self.room() {
                return Err(RecordError::TooManyRows {
                    path: self.path.to_owned(),
                    most_rows: self.most_rows,
                });
            }
            if let Some(error) = part.refused {
                return Err(error);
            }
            self.lines.append(&part.lines);
            for ((column, _), values) in self.columns.iter_mut().zip(part.values) {
                column.values.extend(values);
            }
        }
        Ok(())
    }
}

/// Rows that follow each other, up to the first that is refused.
struct Part {
    /// Values of each column.
    values: Vec<Vec<f64>>,
    lines: Lines,
    refused: Option<RecordError>,
}

impl Part {
    fn push(&mut self, row: &[f64], line: u64) {
        for (column, value) in self.values.iter_mut().zip(row) {
            column.push(*value);
        }
        self.lines.push(line);
    }
}

/// A text with what was read from it last.
struct Recent<R> {
    text: R,
    bytes: Vec<u8>,
    /// Bytes of the text before those.
    before: u64,
}

/// Bytes that are forgotten at a time.
const FORGOTTEN: usize = 1 << 16;

impl<R> Recent<R> {
    fn new(text: R) -> Self {
        Self {
            text,
            bytes: Vec::new(),
            before: 0,
        }
    }

    /// Line feeds among the line ends from a byte on; nothing before it is asked for again.
    fn line_breaks(&mut self, byte: u64) -> u64 {
        let begin = (byte - self.before) as usize;
        let ends = self.bytes[begin..]
            .iter()
            .take_while(|sign| matches!(sign, b'\n' | b'\r'));
        let found = ends.filter(|sign| **sign == b'\n').count() as u64;
        if begin > FORGOTTEN {
            self.bytes.drain(..begin);
            self.before = byte;
        }
        found
    }
}

impl<R: Read> Read for Recent<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.text.read(bytes)?;
        self.bytes.extend_from_slice(&bytes[..count]);
        Ok(count)
    }
}

/// Most rows of a part that is read as CSV with all its rules.
const QUOTED_ROWS: usize = 1 << 16;

/// Form of a file's rows, and the cells of them that are read.
struct Rows<'a> {
    path: &'a Path,
    /// Name of each column that is read, and the index of its cell in a row.
    columns: Vec<(&'static str, usize)>,
    /// Column of each cell of a row; nothing for those that are passed over.
    cells: Vec<Option<usize>>,
}

impl<'a> Rows<'a> {
    fn new(path: &'a Path, cells: usize, columns: &[&mut Place]) -> Self {
        let columns: Vec<(&str, usize)> = columns
            .iter()
            .map(|(column, cell)| (column.name, *cell))
            .collect();
        let column = |cell| columns.iter().position(|(_, index)| *index == cell);
        Self {
            path,
            cells: (0..cells).map(column).collect(),
            columns,
        }
    }

    /// No rows yet, and memory for some.
    fn part(&self, rows: usize) -> Part {
        Part {
            values: (0..self.columns.len())
                .map(|_| Vec::with_capacity(rows))
                .collect(),
            lines: Lines::default(),
            refused: None,
        }
    }

    /// Parses a part of a block; one row beyond `room` ends it. Empty lines are no rows.
    fn parse(&self, block: &[u8], place: PartPlace, room: usize) -> Part {
        let mut part = self.part(place.line_breaks as usize + 1);
        let mut row = vec![0.0; self.columns.len()];
        let (mut rest, mut line) = (&block[place.range], place.line);
        while !rest.is_empty() && part.lines.rows() <= room {
            let mut end = 0;
            if !matches!(rest[0], b'\n' | b'\r') {
                match self.row(rest, line, &mut row) {
                    Ok(length) => end = length,
                    Err(error) => {
                        part.refused = Some(error);
                        break;
                    }
                }
                part.push(&row, line);
            }
            line += u64::from(rest.get(end) == Some(&b'\n'));
            rest = rest.get(end + 1..).unwrap_or_default();
        }
        part
    }

    /// Takes the row without a quotation mark that a text begins with, in a line of the file; returns its length.
    fn row(&self, text: &[u8], line: u64, row: &mut [f64]) -> Result<usize, RecordError> {
        if let Some(length) = self.plain(text, row) {
            return Ok(length);
        }
        let length = memchr2(b'\n', b'\r', text).unwrap_or(text.len());
        let cells: Vec<&[u8]> = text[..length].split(|sign| *sign == b',').collect();
        self.take(&cells, line, row)?;
        Ok(length)
    }

    /// As [`row`](Self::row), where each cell that is read is a number and no more, as almost all are; nothing where it is not.
    fn plain(&self, text: &[u8], row: &mut [f64]) -> Option<usize> {
        let mut end = 0;
        for (index, column) in self.cells.iter().enumerate() {
            if index > 0 {
                if text.get(end) != Some(&b',') {
                    return None;
                }
                end += 1;
            }
            let cell = &text[end..];
            end += match column {
                Some(column) => {
                    let (value, length) = fast_float2::parse_partial::<f64, _>(cell).ok()?;
                    row[*column] = Some(value).filter(|value| value.is_finite())?;
                    length
                }
                None => memchr3(b',', b'\n', b'\r', cell).unwrap_or(cell.len()),
            };
        }
        matches!(text.get(end), None | Some(b'\n' | b'\r')).then_some(end)
    }

    /// Parses some rows of a text as CSV with all its rules; one row beyond `room` ends them. The text begins behind `before` lines of the
    /// file.
    fn parse_quoted(
        &self,
        reader: &mut Reader<Recent<impl Read>>,
        before: u64,
        room: usize,
    ) -> Part {
        let mut part = self.part(0);
        let mut record = ByteRecord::new();
        let mut row = vec![0.0; self.columns.len()];
        while part.lines.rows() < QUOTED_ROWS.min(room + 1) {
            match reader.read_byte_record(&mut record) {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    part.refused = Some(refuse(self.path, error));
                    break;
                }
            }
            // The reader begins a row where it ended the one before: between the bytes of a line end, or before blank lines.
            let place = record
                .position()
                .map_or((1, 0), |at| (at.line(), at.byte()));
            let line = before + place.0 + reader.get_mut().line_breaks(place.1);
            let cells: Vec<&[u8]> = record.iter().collect();
            if let Err(error) = self.take(&cells, line, &mut row) {
                part.refused = Some(error);
                break;
            }
            part.push(&row, line);
        }
        part
    }

    /// Takes the cells of a row, which stands in a line of the file.
    fn take(&self, cells: &[&[u8]], line: u64, row: &mut [f64]) -> Result<(), RecordError> {
        if cells.len() != self.cells.len() {
            let (found, expected) = (cells.len(), self.cells.len());
            let message = format!(
                "line {line} has {found} cells, the header has {expected}; every row needs as many"
            );
            return Err(RecordError::Malformed {
                path: self.path.to_owned(),
                message,
            });
        }
        for (value, (name, cell)) in row.iter_mut().zip(&self.columns) {
            *value = number(self.path, name, line, cells[*cell])?;
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
                ". `identify motion --columns time=...,position=...,voltage=...` takes other names"
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
    use proptest::prelude::*;

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
            assert!(text.len() > 2 * SIZES.block);
            std::fs::write(&path, &text).unwrap();
            read(&path, Purpose::Motion, &mut |_| {}).unwrap()
        };
        let (in_parts, by_row) = (read("a note"), read("\"a note\""));
        let lines = |columns: &Columns| (0..rows).map(|row| columns.lines.line(row)).collect();
        let (in_parts_at, by_row_at): (Vec<u64>, Vec<u64>) = (lines(&in_parts), lines(&by_row));
        for row in 0..rows {
            assert_eq!(in_parts.time.values[row], row as f64);
        }
        assert_eq!(in_parts_at, by_row_at);
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
        let read = |most_rows| {
            read_at_most(&path, Purpose::Motion, most_rows, SIZES, &mut |_| {}).unwrap_err()
        };
        let message = read(19).to_string();
        assert!(
            message.contains("more than 19 rows") && message.contains("split"),
            "{message}"
        );
        let error = read(21);
        assert!(
            matches!(error, RecordError::Cell { line: 22, .. }),
            "{error}"
        );
    }

    /// Bits and line of each row's values, or the error.
    type Outcome = Result<(Vec<Vec<u64>>, Vec<u64>), String>;

    /// A text as it is read with some sizes and a bound of its rows.
    fn outcome(path: &Path, most_rows: usize, sizes: Sizes) -> Outcome {
        let columns = read_at_most(path, Purpose::Motion, most_rows, sizes, &mut |_| {})
            .map_err(|error| error.to_string())?;
        let lines = (0..columns.lines.rows()).map(|row| columns.lines.line(row));
        let lines = lines.collect();
        let values = [Some(columns.time), columns.reference, columns.position];
        let bits = |column: Column| column.values.iter().map(|value| value.to_bits()).collect();
        Ok((values.into_iter().flatten().map(bits).collect(), lines))
    }

    /// A text as the CSV reader and the standard library read it.
    fn as_csv(path: &Path, bytes: &[u8]) -> Outcome {
        let mut reader = ReaderBuilder::new().flexible(true).from_reader(bytes);
        let header = reader.byte_headers().unwrap().clone();
        let place = |name: &str| header.iter().position(|cell| cell == name.as_bytes());
        let names = ["t_s", "reference_mm", "position_mm"];
        let places: Vec<(&str, usize)> = names
            .into_iter()
            .filter_map(|name| Some((name, place(name)?)))
            .collect();
        let (mut values, mut lines) = (vec![Vec::new(); places.len()], Vec::new());
        for record in reader.byte_records() {
            let record = record.unwrap();
            let at = record.position().unwrap();
            let ends = bytes[at.byte() as usize..]
                .iter()
                .take_while(|sign| matches!(sign, b'\n' | b'\r'));
            let line = at.line() + ends.filter(|sign| **sign == b'\n').count() as u64;
            if record.len() != header.len() {
                return Err(format!(
                    "{}: line {line} has {} cells, the header has {}; every row needs as many",
                    path.display(),
                    record.len(),
                    header.len()
                ));
            }
            for (column, (name, place)) in values.iter_mut().zip(&places) {
                let value = number(path, name, line, &record[*place]);
                column.push(value.map_err(|error| error.to_string())?.to_bits());
            }
            lines.push(line);
        }
        match lines.len() {
            rows @ ..MIN_ROWS => Err(RecordError::TooFewRows {
                path: path.to_owned(),
                rows,
            }
            .to_string()),
            _ => Ok((values, lines)),
        }
    }

    /// Twenty rows with line ends in turn, the eighth row and what comes after it replaced.
    fn small(header: &str, ends: &[&str], eighth: &str) -> Vec<u8> {
        let mut text = header.to_owned();
        for row in 0..20 {
            let end = ends[row % ends.len()];
            match row {
                7 => text += eighth,
                _ => text += &format!("{}e-4,{}.25,n", row, 3 * row),
            }
            text += end;
        }
        text.into_bytes()
    }

    #[test]
    fn a_cut_at_any_byte_changes_neither_values_nor_lines_nor_errors() {
        let header = "t_s,reference_mm,note\n";
        let good = "7e-4,21.25,n";
        let mut not_text = small(header, &["\n"], good);
        let place = not_text.iter().position(|sign| *sign == b'5').unwrap();
        not_text[place] = 0xff;
        let mut texts = vec![
            small(header, &["\n"], good),
            small("t_s,reference_mm,note\r\n", &["\r\n"], good),
            small("t_s,reference_mm,note\r", &["\r"], good),
            small("\u{feff}t_s,reference_mm,note\n", &["\n"], good),
            small("\"t_s\",\"reference_mm\",\"note\"\n", &["\n"], good),
            small(header, &["\n", "\r\n", "\n\n", "\r\n\r\n\r\n"], good),
            small(header, &["\n"], "7e-4,21.25,n\n")
                .trim_ascii_end()
                .to_vec(),
            small("t_s,reference_mm\n", &["\n"], good),
            small("t_s,reference_m,reference_mm\n", &["\n"], good),
            small("time,reference_mm,note\n", &["\n"], good),
            b"t_s,reference_mm,note\n0,1,2\n".to_vec(),
            b"t_s,reference_mm,note".to_vec(),
            Vec::new(),
            not_text,
        ];
        for eighth in [
            "  7e-4 ,\t21.25,n",
            "7e-4,\"21.25\",n",
            "7e-4,21.25,\"a, note \"\"in\"\"\nlines\"",
            "7e-4,21.25,5\"",
            "7e-4,21.25,\"open",
            "7e-4,x,n",
            "7e-4,,n",
            "inf,21.25,n",
            "7e-4,1e999,n",
            "7e-4,21.25",
            "7e-4,21.25,n,",
            "7e-4,\"x\",n",
            "7e-4,1.2.3,é",
        ] {
            texts.push(small(header, &["\n"], eighth));
            texts.push(small(header, &["\r\n", "\n\n"], eighth));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("small.csv");
        for text in texts {
            std::fs::write(&path, &text).unwrap();
            let length = text.len();
            for most_rows in [MOST_ROWS, 20, 7] {
                let whole = outcome(&path, most_rows, SIZES);
                let parts = (1..=length).map(|part| (length + 1, part));
                for (block, part) in (1..=length + 1).map(|block| (block, 1)).chain(parts) {
                    let cut = outcome(&path, most_rows, Sizes { block, part });
                    assert_eq!(
                        cut,
                        whole,
                        "{block}, {part}: {}",
                        String::from_utf8_lossy(&text)
                    );
                }
            }
        }
    }

    /// Pieces of a file that is read as rows of three cells.
    fn piece() -> impl Strategy<Value = Vec<u8>> {
        let good = (any::<f64>(), -1e3..1e3, 0..4)
            .prop_map(|(a, b, c)| format!("{a:e},{b},{c}\n").into_bytes());
        let odd = prop::sample::select(vec![
            "\n",
            "\r\n",
            "\r",
            "1,2,3\r\n",
            "1,2,3\r",
            "1, 2,3\n",
            "+1,.5,-0\n",
            "1.,2E+3,3\n",
            "1,2,\n",
            "1,2\n",
            "1,2,3,4\n",
            ",,\n",
            "1,nan,3\n",
            "1,inf,3\n",
            "1,2,é\n",
            "1,0x1,3\n",
            "1,1_0,3\n",
            "1,2e,3\n",
            "1,-,3\n",
            "1,.,3\n",
            "\"1\",2,3\n",
            "1,2,\"3,\n\"\n",
            "1,2,3\"\n",
        ]);
        prop_oneof![
            40 => good,
            1 => odd.prop_map(|text| text.as_bytes().to_vec()),
            1 => Just(b"1,2,\xff\n".to_vec()),
        ]
    }

    proptest! {
        #[test]
        fn any_file_reads_as_the_csv_reader_reads_it(
            pieces in prop::collection::vec(piece(), 0..60),
            block in 1_usize..500,
            part in 1_usize..100,
        ) {
            let text = [b"note,t_s,reference_mm\n".to_vec(), pieces.concat()].concat();
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("any.csv");
            std::fs::write(&path, &text).unwrap();
            let expected = as_csv(&path, &text);
            prop_assert_eq!(outcome(&path, MOST_ROWS, Sizes { block, part }), expected.clone());
            prop_assert_eq!(outcome(&path, MOST_ROWS, SIZES), expected);
        }

        #[test]
        fn a_plain_number_has_the_bits_that_the_standard_library_gives_it(
            text in prop_oneof![
                "[+-]?[0-9]{0,25}(\\.[0-9]{0,25})?([eE][+-]?[0-9]{0,4})?",
                any::<f64>().prop_map(|value| value.to_string()),
                any::<f64>().prop_map(|value| format!("{value:e}")),
                (any::<f64>(), 0_usize..20).prop_map(|(value, digits)| format!("{value:.digits$e}")),
            ],
        ) {
            let rows = Rows {
                path: Path::new(""),
                columns: vec![("t_s", 0)],
                cells: vec![Some(0)],
            };
            let mut row = [0.0];
            let taken = rows.plain(text.as_bytes(), &mut row);
            let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
            prop_assert_eq!(taken.is_some(), value.is_some());
            if let Some(value) = value {
                prop_assert_eq!(row[0].to_bits(), value.to_bits());
            }
        }
    }
}
