//! Errors in a report's data.

use std::path::PathBuf;

/// A report that cannot be built or written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// An id that would not work as a link target or a file name.
    #[error("id {id:?}: use ASCII letters, digits, '-' and '_', beginning with a letter")]
    BadId {
        /// The id.
        id: String,
    },
    /// Two parts of one page with one id.
    #[error("id {id:?} is used twice on one page")]
    DuplicateId {
        /// The id.
        id: String,
    },
    /// A table row that does not have one cell per column.
    #[error("table {table:?}, row {row}: {found} cells for {expected} columns")]
    RowLength {
        /// The table's id.
        table: String,
        /// The row, counted from 1.
        row: usize,
        /// Cells in it.
        found: usize,
        /// Columns of the table.
        expected: usize,
    },
    /// A series whose two coordinates differ in length.
    #[error("figure {figure:?}, series {series:?}: {x} abscissas for {y} ordinates")]
    SeriesLength {
        /// The figure's id.
        figure: String,
        /// The series' name.
        series: String,
        /// Length of the first coordinate.
        x: usize,
        /// Length of the second coordinate.
        y: usize,
    },
    /// A circle without a usable radius.
    #[error("figure {figure:?}: nominal radius {radius_mm} mm; it must be positive and finite")]
    Radius {
        /// The figure's id.
        figure: String,
        /// The radius given.
        radius_mm: f64,
    },
    /// An image that cannot be drawn.
    #[error("the image cannot be drawn: {reason}")]
    Image {
        /// Reason.
        reason: String,
    },
    /// The file could not be written.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
}

impl ReportError {
    pub(super) fn image(reason: impl std::fmt::Display) -> Self {
        Self::Image {
            reason: reason.to_string(),
        }
    }
}
