//! Records of other programs: their delimiter, decimal sign, lines before the header, units and names of columns, brought into the
//! form that [`columns`](super::columns) reads. Every line stays where it is, so that errors name the file's own.

use std::path::Path;
use std::str::FromStr;

use super::error::RecordError;

/// Quantities of a motion record: the word for each on a command line, the name of its column here, and its units with their factors
/// to it. Units without a factor are taken as they are: the model then has them in the place of mm and V.
const QUANTITIES: [Quantity; 5] = [
    Quantity {
        word: "time",
        column: "t_s",
        units: TIMES,
    },
    Quantity {
        word: "position",
        column: "position_mm",
        units: LENGTHS,
    },
    Quantity {
        word: "reference",
        column: "reference_mm",
        units: LENGTHS,
    },
    Quantity {
        word: "voltage",
        column: "voltage_v",
        units: VOLTAGES,
    },
    Quantity {
        word: "injection",
        column: "injection_v",
        units: VOLTAGES,
    },
];

struct Quantity {
    word: &'static str,
    column: &'static str,
    units: &'static [(&'static str, Option<f64>)],
}

const TIMES: &[(&str, Option<f64>)] = &[
    ("s", Some(1.0)),
    ("ms", Some(1e-3)),
    ("us", Some(1e-6)),
    ("µs", Some(1e-6)),
    ("min", Some(60.0)),
];
const LENGTHS: &[(&str, Option<f64>)] = &[
    ("mm", Some(1.0)),
    ("um", Some(1e-3)),
    ("µm", Some(1e-3)),
    ("nm", Some(1e-6)),
    ("m", Some(1e3)),
    ("cm", Some(10.0)),
    ("in", Some(25.4)),
    ("inch", Some(25.4)),
    ("rad", None),
    ("deg", None),
    ("°", None),
    ("rev", None),
    ("counts", None),
];
const VOLTAGES: &[(&str, Option<f64>)] = &[
    ("V", Some(1.0)),
    ("mV", Some(1e-3)),
    ("A", None),
    ("mA", None),
    ("N", None),
    ("kN", None),
    ("Nm", None),
    ("Nmm", None),
    ("%", None),
];

/// The column of each quantity, as a person names it: `time=Time:ms,position=Pos:um,voltage=Torque:Nm`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ColumnNames(Vec<ColumnName>);

#[derive(Clone, Debug, PartialEq)]
struct ColumnName {
    /// Index in [`QUANTITIES`].
    quantity: usize,
    /// Name in the header, or number from 1.
    name: String,
    unit: Option<String>,
}

impl FromStr for ColumnNames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut names: Vec<ColumnName> = Vec::new();
        for part in text.split(',') {
            let words = || QUANTITIES.map(|quantity| quantity.word).join(", ");
            let (word, name) = part.split_once('=').ok_or_else(|| {
                format!("{part:?} is not QUANTITY=COLUMN or QUANTITY=COLUMN:UNIT")
            })?;
            let quantity = QUANTITIES
                .iter()
                .position(|quantity| quantity.word == word.trim())
                .ok_or_else(|| format!("{word:?} is none of {}", words()))?;
            if names.iter().any(|name| name.quantity == quantity) {
                return Err(format!("{word} stands twice"));
            }
            let (name, unit) = match name.rsplit_once(':') {
                Some((name, unit)) => (name, Some(unit.trim().to_owned())),
                None => (name, None),
            };
            if let Some(unit) = &unit {
                QUANTITIES[quantity].factor(unit).ok_or_else(|| {
                    format!(
                        "{unit:?} is no unit of {word}: {}",
                        QUANTITIES[quantity].known()
                    )
                })?;
            }
            names.push(ColumnName {
                quantity,
                name: name.trim().to_owned(),
                unit,
            });
        }
        Ok(Self(names))
    }
}

/// A unit of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    /// Factor to the unit of the column here.
    Scaled(f64),
    /// Taken as it is.
    AsItIs,
}

impl Quantity {
    /// The unit of a name, with a number before it or not: `0.5um` is half a micrometre for one.
    fn factor(&self, unit: &str) -> Option<Unit> {
        let digits = unit
            .find(|sign: char| !(sign.is_ascii_digit() || sign == '.'))
            .unwrap_or(unit.len());
        let (number, name) = unit.split_at(digits);
        let (_, factor) = self.units.iter().find(|(known, _)| *known == name)?;
        match (number, factor) {
            ("", Some(factor)) => Some(Unit::Scaled(*factor)),
            ("", None) => Some(Unit::AsItIs),
            (number, Some(factor)) => {
                let number: f64 = number.parse().ok().filter(|number| *number > 0.0)?;
                Some(Unit::Scaled(number * factor))
            }
            (_, None) => None,
        }
    }

    fn known(&self) -> String {
        let names: Vec<&str> = self.units.iter().map(|(name, _)| *name).collect();
        names.join(", ")
    }
}

/// A record in the form that is read here.
#[derive(Debug)]
pub(super) struct Translated {
    pub(super) text: Vec<u8>,
    /// Lines that it has before those of the file: a header, where the file has none.
    pub(super) added_lines: u64,
    /// Guesses and assumptions, for the user.
    pub(super) notes: Vec<String>,
    /// True if positions are in no unit of length, or voltages in none of voltage.
    pub(super) other_length: bool,
    pub(super) other_voltage: bool,
}

/// Form of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Form {
    delimiter: char,
    decimal_comma: bool,
    /// Index of the line of the header; nothing where the file begins with numbers.
    header: Option<usize>,
    units: Option<usize>,
    /// Index of the first line of numbers.
    first: usize,
}

/// Lines in which the first rows of numbers are looked for.
const LOOKED_AT: usize = 200;
/// Rows of one form that are a table.
const ALIKE_ROWS: usize = 3;

/// Translates a text, unless it is in our form already.
///
/// # Errors
/// A column that is named and not there, or a unit that its quantity does not have.
pub(super) fn translate(
    path: &Path,
    bytes: &[u8],
    names: &ColumnNames,
) -> Result<Option<Translated>, RecordError> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start_matches('\u{feff}');
    let lines: Vec<&str> = text.lines().collect();
    let first = lines.first().copied().unwrap_or_default();
    let ours = cells(first, ',').contains(&QUANTITIES[0].column);
    if names.0.is_empty() && ours {
        return Ok(None);
    }
    let Some(form) = Form::of(&lines) else {
        return Ok(None);
    };
    let translation = Translation::new(path, &lines, form, names)?;
    let header = translation.header.join(",");
    let mut out = String::with_capacity(text.len());
    if form.header.is_none() {
        out += &header;
        out.push('\n');
    }
    for (index, line) in lines.iter().enumerate() {
        if form.header == Some(index) {
            out += &header;
        }
        if index >= form.first && !line.trim().is_empty() {
            translation.row(line, &mut out);
        }
        out.push('\n');
    }
    Ok(Some(Translated {
        text: out.into_bytes(),
        added_lines: u64::from(form.header.is_none()),
        notes: translation.notes,
        other_length: translation.other_length,
        other_voltage: translation.other_voltage,
    }))
}

/// Names of a column of the time, the first that is there.
const TIME_NAMES: [&str; 5] = ["t_s", "time_s", "t", "time", "seconds"];

/// The guess that is not worth a line.
const TIME_IN_S: &str = "time taken in s";

/// A table of numbers over time, of any program: to be drawn, not to be identified from.
#[derive(Debug)]
pub struct NumberTable {
    /// Time of each row, s.
    pub time_s: Vec<f64>,
    /// Name of each other column that holds a number, and its values: NaN where a cell holds none.
    pub columns: Vec<(String, Vec<f64>)>,
    /// Cells of these columns that hold no number.
    pub other_cells: usize,
    /// Guesses and assumptions, for the user.
    pub notes: Vec<String>,
}

impl NumberTable {
    /// Reads a file's text. Delimiter, decimal comma, lines before the header and a row of units are guessed unless the first line is a
    /// header with commas; columns are renamed as `names` says, and the time is found by its name where that does not.
    ///
    /// # Errors
    /// No header, no column of the time, a column that is named and not there, or a row of another length.
    pub fn parse(path: &Path, bytes: &[u8], names: &ColumnNames) -> Result<Self, RecordError> {
        let text = String::from_utf8_lossy(bytes);
        let text = text.trim_start_matches('\u{feff}');
        let lines: Vec<&str> = text.lines().collect();
        let refused = |message: String| RecordError::Malformed {
            path: path.to_owned(),
            message,
        };
        let form = Form::of_table(&lines).ok_or_else(|| {
            refused("no header: the first line must name the columns, t_s for the time in s".into())
        })?;
        let names = names.with_time(&lines, form).ok_or_else(|| {
            refused(format!(
                "no column of the time: name one t_s, or give --columns time=NAME:UNIT; found {}",
                form.names(&lines).join(", ")
            ))
        })?;
        let mut translation = Translation::new(path, &lines, form, &names)?;
        translation.notes.retain(|note| note != TIME_IN_S);
        let mut values = vec![Vec::new(); translation.header.len()];
        for (index, line) in lines.iter().enumerate().skip(form.first) {
            if is_passed_over(line) {
                continue;
            }
            let row = cells(line, form.delimiter);
            if row.len() != values.len() {
                return Err(refused(format!(
                    "line {}: {} cells, and the header has {}",
                    index + 1,
                    row.len(),
                    values.len()
                )));
            }
            for ((column, cell), factor) in values.iter_mut().zip(row).zip(&translation.factors) {
                let value = number(cell, form.decimal_comma).unwrap_or(f64::NAN);
                column.push(value * factor.unwrap_or(1.0));
            }
        }
        let time = translation
            .header
            .iter()
            .position(|name| name == QUANTITIES[0].column);
        let time_s = time.map_or_else(Vec::new, |time| std::mem::take(&mut values[time]));
        if time_s.iter().filter(|time_s| time_s.is_finite()).count() < 2 {
            return Err(refused("fewer than two rows with a time".to_owned()));
        }
        let columns: Vec<(String, Vec<f64>)> = translation
            .header
            .into_iter()
            .zip(values)
            .filter(|(_, values)| values.iter().any(|value| value.is_finite()))
            .collect();
        let cells = columns.iter().flat_map(|(_, values)| values);
        Ok(Self {
            other_cells: cells.filter(|value| value.is_nan()).count(),
            time_s,
            columns,
            notes: translation.notes,
        })
    }
}

impl ColumnNames {
    /// These names, and that of the time by the header where it is not among them; nothing where there is none.
    fn with_time(&self, lines: &[&str], form: Form) -> Option<Self> {
        let mut names = self.clone();
        if !names.0.iter().any(|name| name.quantity == 0) {
            let found = form.names(lines);
            let is = |time: &&str, cell: &&String| name_and_unit(cell).0.eq_ignore_ascii_case(time);
            let name = TIME_NAMES
                .iter()
                .find_map(|time| found.iter().find(|cell| is(time, cell)))?;
            names.0.push(ColumnName {
                quantity: 0,
                name: name.clone(),
                unit: None,
            });
        }
        Some(names)
    }
}

/// True for a line without a row: an empty one, or a comment.
fn is_passed_over(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with('#')
}

/// Cells of a line, without quotation marks.
fn cells(line: &str, delimiter: char) -> Vec<&str> {
    if delimiter == ' ' {
        return line.split_whitespace().collect();
    }
    line.split(delimiter)
        .map(|cell| cell.trim().trim_matches('"').trim())
        .collect()
}

fn number(cell: &str, decimal_comma: bool) -> Option<f64> {
    let value = if decimal_comma {
        cell.replace(',', ".").parse()
    } else {
        cell.parse()
    };
    value.ok().filter(|value: &f64| value.is_finite())
}

impl Form {
    fn of(lines: &[&str]) -> Option<Self> {
        [
            (';', true),
            (';', false),
            ('\t', true),
            ('\t', false),
            (',', false),
            (' ', true),
            (' ', false),
        ]
        .into_iter()
        .find_map(|(delimiter, decimal_comma)| Self::with(lines, delimiter, decimal_comma))
    }

    /// The form of a table to be drawn: the first line that is no comment names its columns, the time among them, or the form is guessed; a
    /// short one has a header with commas.
    fn of_table(lines: &[&str]) -> Option<Self> {
        let header = lines.iter().position(|line| !is_passed_over(line))?;
        let names = cells(lines[header], ',');
        let is_time = |cell: &&str| {
            let name = name_and_unit(cell).0;
            TIME_NAMES
                .iter()
                .any(|time| name.eq_ignore_ascii_case(time))
        };
        let plain = Self {
            delimiter: ',',
            decimal_comma: false,
            header: Some(header),
            units: None,
            first: header + 1,
        };
        if names.len() > 1 && names.iter().any(is_time) {
            return Some(plain);
        }
        let is_named = names.iter().any(|name| number(name, false).is_none());
        Self::of(lines).or(is_named.then_some(plain))
    }

    /// Names of the columns in the header, or their numbers.
    fn names(&self, lines: &[&str]) -> Vec<String> {
        match self.header {
            Some(index) => cells(lines[index], self.delimiter)
                .into_iter()
                .map(str::to_owned)
                .collect(),
            None => (1..=cells(lines[self.first], self.delimiter).len())
                .map(|number| number.to_string())
                .collect(),
        }
    }

    /// The form of a table with this delimiter, if there is one: rows of as many cells, two of them numbers at least.
    fn with(lines: &[&str], delimiter: char, decimal_comma: bool) -> Option<Self> {
        let numbers = |line: &&str| -> (usize, usize) {
            let cells = cells(line, delimiter);
            let found = cells
                .iter()
                .filter(|cell| number(cell, decimal_comma).is_some())
                .count();
            (cells.len(), found)
        };
        let filled: Vec<usize> = (0..lines.len())
            .filter(|&index| !lines[index].trim().is_empty())
            .take(LOOKED_AT)
            .collect();
        let table = filled.windows(ALIKE_ROWS).position(|rows| {
            let forms: Vec<(usize, usize)> =
                rows.iter().map(|&index| numbers(&lines[index])).collect();
            forms[0].1 >= 2 && forms.iter().all(|form| *form == forms[0])
        })?;
        let first = filled[table];
        if decimal_comma {
            // Without a comma in the numbers there is no decimal one.
            let with_comma = filled[table..]
                .iter()
                .any(|&index| lines[index].contains(','));
            if !with_comma {
                return None;
            }
        }
        let width = numbers(&lines[first]).0;
        let before = |place: usize| {
            let index = *filled.get(table.checked_sub(place)?)?;
            (cells(lines[index], delimiter).len() == width).then_some(index)
        };
        let is_units = |index: usize| {
            cells(lines[index], delimiter)
                .iter()
                .all(|cell| unit_of(cell).is_some() || cell.is_empty())
        };
        let (header, units) = match (before(1), before(2)) {
            (Some(units), Some(header)) if is_units(units) => (Some(header), Some(units)),
            (header, _) => (header, None),
        };
        Some(Self {
            delimiter,
            decimal_comma,
            header,
            units,
            first,
        })
    }
}

/// Cell of a row of units for a column that has none.
const NO_UNIT: &str = "-";

/// The unit that a cell or the bracket of a name holds, if any quantity has it.
fn unit_of(cell: &str) -> Option<&str> {
    let bare = cell.trim_matches(['[', ']', '(', ')']).trim();
    let known = QUANTITIES
        .iter()
        .any(|quantity| quantity.factor(bare).is_some());
    (known || bare == NO_UNIT).then_some(bare)
}

/// A name of a header without the unit in its bracket, and that unit.
fn name_and_unit(cell: &str) -> (&str, Option<&str>) {
    match cell.find(['[', '(']) {
        Some(place) if place > 0 => (cell[..place].trim(), unit_of(&cell[place..])),
        _ => (cell, None),
    }
}

struct Translation {
    form: Form,
    header: Vec<String>,
    /// Factor of each column that has one.
    factors: Vec<Option<f64>>,
    notes: Vec<String>,
    other_length: bool,
    other_voltage: bool,
}

impl Translation {
    fn new(
        path: &Path,
        lines: &[&str],
        form: Form,
        names: &ColumnNames,
    ) -> Result<Self, RecordError> {
        let found = form.names(lines);
        let width = found.len();
        let units: Vec<&str> = form
            .units
            .map_or_else(Vec::new, |index| cells(lines[index], form.delimiter));
        let mut translation = Self {
            form,
            header: found
                .iter()
                .map(|name| name.replace([',', '"'], " "))
                .collect(),
            factors: vec![None; width],
            notes: Vec::new(),
            other_length: false,
            other_voltage: false,
        };
        translation.notes.extend(form.note());
        for ColumnName {
            quantity,
            name,
            unit,
        } in &names.0
        {
            let quantity = &QUANTITIES[*quantity];
            let same =
                |cell: &String| cell == name || name_and_unit(cell).0.eq_ignore_ascii_case(name);
            let by_number = || {
                let number: usize = name.parse().ok()?;
                (1..=width).contains(&number).then(|| number - 1)
            };
            let refused = |message: String| RecordError::Malformed {
                path: path.to_owned(),
                message,
            };
            let index = found
                .iter()
                .position(same)
                .or_else(by_number)
                .ok_or_else(|| {
                    refused(format!(
                        "no column {name:?} for the {}; found {}",
                        quantity.word,
                        found.join(", ")
                    ))
                })?;
            let written = unit
                .as_deref()
                .or_else(|| units.get(index).copied().and_then(unit_of))
                .or_else(|| name_and_unit(&found[index]).1)
                .filter(|unit| *unit != NO_UNIT);
            let own = quantity.units[0].0;
            let factor = quantity.factor(written.unwrap_or(own)).ok_or_else(|| {
                refused(format!(
                    "column {name:?} is in {}, which is no unit of {}: {}",
                    written.unwrap_or_default(),
                    quantity.word,
                    quantity.known()
                ))
            })?;
            translation.take(
                quantity,
                index,
                factor,
                written.unwrap_or(own),
                unit.is_none(),
            );
        }
        Ok(translation)
    }

    fn take(
        &mut self,
        quantity: &Quantity,
        index: usize,
        unit: Unit,
        written: &str,
        guessed: bool,
    ) {
        // A column of that name that was not asked for is another one.
        for name in self
            .header
            .iter_mut()
            .filter(|name| *name == quantity.column)
        {
            name.insert(0, '_');
        }
        quantity.column.clone_into(&mut self.header[index]);
        match unit {
            Unit::Scaled(factor) => {
                self.factors[index] = Some(factor).filter(|factor| *factor != 1.0);
                if guessed {
                    self.notes
                        .push(format!("{} taken in {written}", quantity.word));
                }
            }
            Unit::AsItIs => {
                let own = quantity.units[0].0;
                self.notes.push(format!(
                    "{} taken in {written}: where {own} stands in what follows, read {written}",
                    quantity.word
                ));
                self.other_length |= own == "mm";
                self.other_voltage |= own == "V";
            }
        }
    }

    fn row(&self, line: &str, out: &mut String) {
        for (index, cell) in cells(line, self.form.delimiter).into_iter().enumerate() {
            if index > 0 {
                out.push(',');
            }
            let value = number(cell, self.form.decimal_comma);
            match (value, self.factors.get(index).copied().flatten()) {
                (Some(value), Some(factor)) => *out += &(value * factor).to_string(),
                (Some(_), None) if self.form.decimal_comma => *out += &cell.replace(',', "."),
                _ => *out += &cell.replace(',', " "),
            }
        }
    }
}

impl Form {
    /// Names the guesses, if the form is not ours.
    fn note(&self) -> Option<String> {
        let mut parts = Vec::new();
        match self.delimiter {
            ',' => {}
            ';' => parts.push("cells separated by semicolons".to_owned()),
            '\t' => parts.push("cells separated by tabs".to_owned()),
            _ => parts.push("cells separated by spaces".to_owned()),
        }
        if self.decimal_comma {
            parts.push("a decimal comma".to_owned());
        }
        match self.header {
            None => parts.push("no header, columns by number".to_owned()),
            Some(0) => {}
            Some(lines) => parts.push(format!("{lines} lines before the header")),
        }
        if let Some(units) = self.units {
            parts.push(format!("units in line {}", units + 1));
        }
        (!parts.is_empty()).then(|| parts.join(", "))
    }
}
