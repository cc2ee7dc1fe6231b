//! Reports: one self-contained HTML page, and its tables as text and CSV.
//!
//! A report is built from plain data ([`Page`], [`Section`], [`Table`], [`Figure`]) and knows nothing of the
//! experiments behind it. The page carries its own style, scripts and data, asks the network for nothing (its content
//! security policy forbids it to), and is a pure function of its data: no time stamps, no random ids, so that two runs
//! with the same seed can be compared byte by byte.
//!
//! - [`Page::write_html`] writes the page; [`Table::write_csv`] and [`Table::to_text`] serve the other readers.
//! - [`decimate()`] thins long traces in such a way that spikes, which are what this project is about, survive.
//! - [`PolarDeviation`] draws a circle test as a ball-bar instrument would (ISO 230-4).

mod decimate;
mod error;
mod figure;
mod lines;
mod number;
mod page;
mod palette;
mod polar;
mod table;

pub use decimate::decimate;
pub use error::ReportError;
pub use figure::{Dash, Figure, Plot, Style};
pub use lines::{Lines, Scale, Series};
pub use page::{Block, Page, Provenance, Section};
pub use palette::Colour;
pub use polar::{DeviationTrace, Magnification, PolarDeviation};
pub use table::{Cell, Column, Table};
