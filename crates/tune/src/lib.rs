//! From an unknown axis to settings of its control law: recordings, identification, design, commissioning.
//!
//! - [`test_axis`]: an axis that is measured, of any kind, and the simulated one;
//! - [`record`]: recorded motions from CSV files, checked;
//! - [`identify`]: from recordings to the parameters of an axis;
//! - [`design`]: loop shaping, the choice of gains;
//! - [`commission`]: the whole chain.
//!
//! It knows neither the machines to which a real axis belongs nor the pages on which results are shown.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

pub mod commission;
pub mod design;
pub mod identify;
pub mod record;
pub mod test_axis;
