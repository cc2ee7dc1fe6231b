//! Output of programs for a person: files that are there whole or not at all, and numbers with no more digits than they need.
//!
//! It knows nothing of what is written.
#![forbid(unsafe_code)]

mod number;
pub mod whole;

pub use number::{Brief, fixed};
