//! Comparisons on the simulated stage, and the pages of these and of measured axes.
//!
//! - [`experiment`]: configurations of law and stage that runs compare;
//! - [`compare`], [`circle`], [`replay`]: the comparison, the circle test, recorded references and part programs, each with
//!   its tables and figures;
//! - [`identify`], [`design`], [`commission`]: tables and figures of what `quadrant-tune` finds;
//! - [`settings_reference`]: the meaning of every setting, as a page;
//! - [`parts`]: parts that several pages have.
//!
//! It knows no machine but the simulated stage, no link and no command line.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

pub mod circle;
pub mod commission;
pub mod compare;
pub mod design;
pub mod experiment;
pub mod identify;
pub mod parts;
pub mod replay;
pub mod settings_reference;
