//! Tables: one value, three readers (page, terminal, spreadsheet).

use super::ReportError;
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, TableStyle};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Rules above, below and under the head, as in print.
const RULED: TableStyle = TableStyle::new()
    .top_border(RULE)
    .header_separator(RULE)
    .bottom_border(RULE);
const RULE: LineStyle = LineStyle::new('─', '─', '─', '─');

/// Characters in one line of a head in the terminal, unless a word is longer.
const HEAD_WIDTH: usize = 12;

/// A table of results.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Table {
    /// Unique on its page; also the name of its CSV file.
    pub id: String,
    /// Caption: the subject of the table.
    pub caption: String,
    /// One per column, left to right.
    pub columns: Vec<Column>,
    /// One cell per column each.
    pub rows: Vec<Vec<Cell>>,
}

/// The head of a column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Column {
    /// Heading of the column.
    pub heading: String,
    /// Unit of its numbers, if they have one.
    pub unit: Option<String>,
}

impl Column {
    /// A column of text, or of numbers without a unit.
    pub fn new(heading: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            unit: None,
        }
    }

    /// A column of numbers in `unit`.
    pub fn with_unit(heading: impl Into<String>, unit: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            unit: Some(unit.into()),
        }
    }

    /// The head as several short lines, the unit on the last, so that the numbers set a column's width.
    fn stacked(&self) -> String {
        let mut lines: Vec<String> = Vec::new();
        for word in self.heading.split_whitespace() {
            match lines.last_mut() {
                Some(line) if line.chars().count() + 1 + word.chars().count() <= HEAD_WIDTH => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines.extend(self.unit.as_ref().map(|unit| format!("({unit})")));
        lines.join("\n")
    }

    fn label(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} ({unit})", self.heading),
            None => self.heading.clone(),
        }
    }
}

/// One entry of a table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number, shown rounded, exported in full.
    Number {
        /// The value.
        #[serde(with = "super::number")]
        value: f64,
        /// Digits shown after the decimal point.
        decimals: usize,
    },
    /// Nothing was measured or printed here.
    Missing,
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// A number shown with `decimals` digits after the point.
    #[must_use]
    pub const fn number(value: f64, decimals: usize) -> Self {
        Self::Number { value, decimals }
    }

    /// As shown to a reader.
    #[must_use]
    pub fn shown(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number { value, decimals } => shown_number(*value, *decimals),
            Self::Missing => "–".to_owned(),
        }
    }

    fn exported(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            Self::Number { value, .. } => value.to_string(),
            Self::Missing => String::new(),
        }
    }
}

/// Rounds, with a proper minus sign, and without one where nothing but zeros would follow it.
fn shown_number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.bytes().all(|b| b == b'0' || b == b'.') => digits.to_owned(),
        Some(digits) => format!("\u{2212}{digits}"),
        None => text,
    }
}

impl Table {
    /// True for columns that hold a number anywhere: they are set flush right.
    pub(super) fn is_numeric(&self, column: usize) -> bool {
        self.rows
            .iter()
            .any(|row| matches!(row.get(column), Some(Cell::Number { .. })))
    }

    pub(super) fn check(&self) -> Result<(), ReportError> {
        let expected = self.columns.len();
        match self.rows.iter().position(|row| row.len() != expected) {
            None => Ok(()),
            Some(row) => Err(ReportError::RowLength {
                table: self.id.clone(),
                row: row + 1,
                found: self.rows[row].len(),
                expected,
            }),
        }
    }

    /// The table as CSV: headings with units, numbers in full, missing cells empty.
    pub fn to_csv(&self) -> Result<String, ReportError> {
        self.check()?;
        let mut csv = csv::Writer::from_writer(Vec::new());
        let heads: Vec<String> = self.columns.iter().map(Column::label).collect();
        let rows = self
            .rows
            .iter()
            .map(|row| row.iter().map(Cell::exported).collect());
        for record in std::iter::once(heads).chain(rows) {
            csv.write_record(&record)
                .expect("rows of one length go into memory");
        }
        let bytes = csv.into_inner().expect("memory takes every byte");
        Ok(String::from_utf8(bytes).expect("CSV of text is text"))
    }

    /// Writes [`Self::to_csv`] into a file.
    pub fn write_csv(&self, path: &Path) -> Result<(), ReportError> {
        crate::whole::write(path, self.to_csv()?).map_err(|source| ReportError::Write {
            path: path.to_owned(),
            source,
        })
    }

    /// The table as aligned plain text, caption first, for a terminal.
    #[must_use]
    pub fn to_text(&self) -> String {
        let mut text = comfy_table::Table::new();
        text.load_style(RULED)
            .set_content_arrangement(ContentArrangement::Disabled)
            .set_header(self.columns.iter().map(Column::stacked));
        for row in &self.rows {
            text.add_row(row.iter().map(Cell::shown));
        }
        for (i, column) in text.column_iter_mut().enumerate() {
            if self.is_numeric(i) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        format!("{}\n{}\n", self.caption, text.trim_fmt())
    }
}

#[cfg(test)]
mod tests {
    use super::{Cell, Column, Table, shown_number};
    use crate::ReportError;

    fn table() -> Table {
        Table {
            id: "errors".into(),
            caption: "Tracking error".into(),
            columns: vec![
                Column::new("Feedforward, law"),
                Column::with_unit("Error", "µm"),
            ],
            rows: vec![
                vec![Cell::text("none"), Cell::number(123.456, 1)],
                vec![Cell::text("static"), Cell::number(-5.0004, 1)],
                vec![Cell::text("GMS"), Cell::Missing],
            ],
        }
    }

    #[test]
    fn csv_holds_units_and_unrounded_numbers() {
        let csv = table().to_csv().unwrap();
        assert_eq!(
            csv,
            "\"Feedforward, law\",Error (µm)\nnone,123.456\nstatic,-5.0004\nGMS,\n"
        );
    }

    #[test]
    fn text_aligns_numbers_to_the_right() {
        let text = table().to_text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "Tracking error");
        let end = |needle: &str| {
            let line = lines.iter().find(|l| l.contains(needle)).unwrap();
            line.trim_end().chars().count()
        };
        assert_eq!(end("123.5"), end("\u{2212}5.0"));
        assert_eq!(
            end("123.5"),
            end("GMS"),
            "a missing number is set where numbers are"
        );
    }

    #[test]
    fn a_row_of_the_wrong_length_is_named() {
        let mut bad = table();
        bad.rows[1].pop();
        let error = bad.to_csv().unwrap_err();
        assert!(
            matches!(
                error,
                ReportError::RowLength {
                    row: 2,
                    found: 1,
                    expected: 2,
                    ..
                }
            ),
            "{error}"
        );
    }

    #[test]
    fn zero_has_no_sign() {
        assert_eq!(shown_number(-0.04, 1), "0.0");
        assert_eq!(shown_number(-0.06, 1), "\u{2212}0.1");
        assert_eq!(shown_number(-0.0, 0), "0");
    }
}
