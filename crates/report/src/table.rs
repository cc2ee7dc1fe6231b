//! Tables: one value, three readers (page, terminal, spreadsheet).

use std::path::Path;

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, LineStyle, TableStyle};
use quadrant_written::fixed;
use serde::Serialize;

use super::ReportError;
use super::wrap::wrapped;

/// Rules above, below and under the head, as in print.
const RULED: TableStyle = TableStyle::new()
    .top_border(RULE)
    .header_separator(RULE)
    .bottom_border(RULE);
const RULE: LineStyle = LineStyle::new('─', '─', '─', '─');

/// Characters in one line of a head in the terminal, unless a word is longer.
const HEAD_WIDTH: usize = 12;
/// Least width of a column of words in the terminal, characters, unless they or one of them take less or more.
const WRAPPED_WIDTH: usize = 24;
/// Characters between two columns; one more stands before the first.
const SPACE: usize = 3;

/// A table of results.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
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
        let mut lines = wrapped(&self.heading, HEAD_WIDTH);
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
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum Cell {
    /// Words.
    Text(String),
    /// A number, shown rounded, exported in full.
    Number {
        /// The value.
        #[serde(serialize_with = "super::number::one")]
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

/// Rounds, with a proper minus sign.
fn shown_number(value: f64, decimals: usize) -> String {
    fixed(value, decimals).replacen('-', "\u{2212}", 1)
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
        quadrant_written::whole::write(path, self.to_csv()?).map_err(|source| ReportError::Write {
            path: path.to_owned(),
            source,
        })
    }

    /// The table as aligned plain text of at most `width` characters, caption first, for a terminal. Where its columns do not fit,
    /// words are wrapped; where that does not do, the columns stand in several parts, one below the other, each with those that
    /// name its rows.
    #[must_use]
    pub fn to_text(&self, width: usize) -> String {
        let mut text = wrapped(&self.caption, width).join("\n");
        text.push('\n');
        for part in self.parts(width) {
            text.push_str(&self.part_text(&part, width));
            text.push('\n');
        }
        text
    }

    /// The columns of each part that fits into `width` characters: all of them in one, if that goes.
    fn parts(&self, width: usize) -> Vec<Vec<usize>> {
        let all: Vec<usize> = (0..self.columns.len()).collect();
        if self.least_width(&all) <= width {
            return vec![all];
        }
        // A row is named by its columns up to the last one of words.
        let names = all
            .iter()
            .rposition(|&column| !self.is_numeric(column) && column + 1 < all.len())
            .map_or(0, |last| last + 1);
        let (names, values) = all.split_at(names);
        let mut parts: Vec<Vec<usize>> = Vec::new();
        for &value in values {
            if let Some(part) = parts.last_mut() {
                part.push(value);
                if self.least_width(part) <= width {
                    continue;
                }
                part.pop();
            }
            parts.push(names.iter().copied().chain([value]).collect());
        }
        parts
    }

    /// The least width of some columns, characters: numbers and heads as they are, words wrapped.
    fn least_width(&self, columns: &[usize]) -> usize {
        let least = |&column: &usize| SPACE + self.least_column_width(column);
        1 + columns.iter().map(least).sum::<usize>()
    }

    fn least_column_width(&self, column: usize) -> usize {
        let head = self.columns[column].stacked();
        let cells = self.rows.iter().map(|row| row[column].shown());
        let lines = cells.flat_map(|cell| {
            if self.is_numeric(column) {
                vec![cell]
            } else {
                wrapped(&cell, WRAPPED_WIDTH)
            }
        });
        let heads = head.lines().map(str::to_owned);
        lines
            .chain(heads)
            .map(|line| line.chars().count())
            .max()
            .unwrap_or(0)
    }

    fn part_text(&self, columns: &[usize], width: usize) -> String {
        let mut text = comfy_table::Table::new();
        text.load_style(RULED)
            .set_content_arrangement(ContentArrangement::Dynamic)
            .set_width(u16::try_from(width).unwrap_or(u16::MAX))
            .set_header(columns.iter().map(|&column| self.columns[column].stacked()));
        for row in &self.rows {
            text.add_row(columns.iter().map(|&column| row[column].shown()));
        }
        for (&column, shown) in columns.iter().zip(text.column_iter_mut()) {
            if self.is_numeric(column) {
                shown.set_cell_alignment(CellAlignment::Right);
                shown.set_constraint(ColumnConstraint::ContentWidth);
            }
        }
        text.trim_fmt()
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
        let text = table().to_text(80);
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

    fn widest(text: &str) -> usize {
        text.lines().map(|line| line.chars().count()).max().unwrap()
    }

    #[test]
    fn columns_that_do_not_fit_stand_below_each_other_beside_the_names_of_their_rows() {
        let mut wide = table();
        wide.caption = "Tracking error of two laws ".repeat(6);
        for number in 0..12 {
            wide.columns
                .push(Column::with_unit(format!("Error at {number} mm/s"), "µm"));
            for row in &mut wide.rows {
                row.push(Cell::number(f64::from(number) - 1234.5, 1));
            }
        }
        let full = wide.to_text(200);
        assert!(widest(&full) > 80);
        for width in [40, 60, 80, 99] {
            let narrow = wide.to_text(width);
            assert!(widest(&narrow) <= width, "{width}:\n{narrow}");
            let names = narrow.matches("static").count();
            assert!(names > 1, "{width}:\n{narrow}");
            for number in 0..12 {
                let shown = Cell::number(f64::from(number) - 1234.5, 1).shown();
                assert_eq!(
                    narrow.matches(&shown).count(),
                    wide.rows.len(),
                    "{width}:\n{narrow}"
                );
            }
        }
    }

    #[test]
    fn words_are_wrapped_before_columns_are_parted() {
        let mut wordy = table();
        wordy.columns.push(Column::new("Reason"));
        for row in &mut wordy.rows {
            row.push(Cell::text(
                "the path leaves the travel of an axis ".repeat(3),
            ));
        }
        let narrow = wordy.to_text(60);
        assert!(widest(&narrow) <= 60, "{narrow}");
        assert_eq!(narrow.matches("static").count(), 1, "{narrow}");
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
