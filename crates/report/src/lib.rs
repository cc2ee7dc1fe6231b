//! Reports: one self-contained HTML page, and the same data as text, CSV, JSON and images.
//!
//! A report is built from plain data ([`Page`], [`Section`], [`Table`], [`Figure`]) and knows nothing of the
//! experiments behind it. The page carries its own style, scripts and data, asks the network for nothing (its content
//! security policy forbids it to), and is a pure function of its data: no time stamps, no random ids, so that two runs
//! with the same seed can be compared byte by byte.
//!
//! - [`Page::write`] writes the page in the requested formats: HTML, CSV, JSON, SVG; [`Table::to_text`] serves the terminal.
//! - [`decimate()`] thins long traces in such a way that spikes, which are what this project is about, survive.
//! - [`PolarDeviation`] draws a circle test as a ball-bar instrument would (ISO 230-4).
//!
//! # Who draws
//!
//! A figure becomes a `Drawing` (axes, curves, marks: `drawing.rs`), and two things draw it.
//!
//! - **On the page**, a script of this crate (`chart.js`) draws SVG into the document, in the colours of the style sheet:
//!   zoom, values under the pointer, a legend that hides curves, keys, images saved by the reader as SVG or PNG. No
//!   plotting library is used there: none was found that is a Rust crate, quick to build, and carries its script; `plotly`
//!   cost 12 s of processor time, some 50 s for what only it brought (`askama`, `darling` twice, `serde_with`, `chrono`),
//!   and 4.7 MB in every page.
//! - **In image files** `plotters` draws, with its SVG backend alone: 3 s of processor time, so it is not worth a
//!   feature on which the formats offered would depend. What it cannot do is done in `print.rs`: a scale chosen at run
//!   time, a legend beside the drawing, tenths of pixels (it places everything at whole ones).
//!
//! Not offered, unlike by a large library: three dimensions, formulas in labels, lasso selection, animation.

#![forbid(unsafe_code)]

mod decimate;
mod drawing;
mod error;
mod figure;
mod html;
mod lines;
mod number;
mod page;
mod palette;
mod polar;
mod print;
mod samples;
mod scale;
mod style;
mod table;
mod wrap;
mod write;

pub use decimate::decimate;
pub use error::ReportError;
pub use figure::{Figure, Plot};
pub use lines::{Lines, Series};
pub use page::{Block, Page, Provenance, Section};
pub use palette::Colour;
pub use polar::{DeviationTrace, Magnification, PolarDeviation};
pub use print::stacked_svg;
pub use scale::Scale;
pub use style::{Dash, Style};
pub use table::{Cell, Column, Table};
pub use wrap::wrapped;
pub use write::{FIGURES, Format};
