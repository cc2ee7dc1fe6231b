//! Reports: one self-contained HTML page, and the same data as text, CSV, JSON and images.
//!
//! A report is built from plain data ([`Page`], [`Section`], [`Table`], [`Figure`]) and knows nothing of the
//! experiments behind it. The page carries its own style, scripts and data, asks the network for nothing (its content
//! security policy forbids it to), and is a pure function of its data: no time stamps, no random ids, so that two runs
//! with the same seed can be compared byte by byte.
//!
//! - [`Page::write`] writes the page in the formats wanted: HTML, CSV, JSON, SVG; [`Table::to_text`] serves the terminal.
//! - [`decimate()`] thins long traces in such a way that spikes, which are what this project is about, survive.
//! - [`PolarDeviation`] draws a circle test as a ball-bar instrument would (ISO 230-4).
#![forbid(unsafe_code)]

mod decimate;
mod dots;
mod error;
mod figure;
mod html;
mod lines;
mod mark;
mod number;
mod page;
mod palette;
mod png;
mod polar;
mod scale;
mod svg;
mod table;
#[cfg(test)]
mod vision;
mod write;

pub use decimate::decimate;
pub use dots::{DotSeries, Dots, Spread};
pub use error::ReportError;
pub use figure::{Dash, Figure, Plot, Style};
pub use lines::{Band, Lines, Series};
pub use page::{Block, Page, Provenance, Section};
pub use palette::Colour;
pub use polar::{DeviationTrace, Magnification, PolarDeviation};
pub use scale::Scale;
pub use table::{Cell, Column, Table};
pub use write::Format;
