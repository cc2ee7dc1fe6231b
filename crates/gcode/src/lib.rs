//! Part programs in G-code (ISO 6983, as RS274/NGC reads it), and the motion along them.
//!
//! ```text
//!   text --lexer--> blocks --interpret--> moves --blending--> moves --speeds, velocity_profile--> trajectory --> tables
//! ```
//!
//! A move is a straight line or a circular or helical arc, with its feed. The speed along the path is limited in jerk and
//! acceleration, holds the feed where the axes' limits allow it, runs through joints that are tangent and stops at those that
//! are not; [`Limits`] says how each axis' limits are kept. The firmware follows the result as recorded tables, a sample a control period.
//!
//! It knows no machine and no stage.
#![forbid(unsafe_code)]
// A tool, not a library for others: a comment that only repeats a name is left out.
#![allow(missing_docs)]

mod arc;
mod blending;
mod error;
mod interpret;
mod lexer;
mod modal;
mod runs;
mod segment;
mod speeds;
mod trajectory;
mod velocity_profile;

pub use error::ProgramError;
pub use interpret::{Ignored, Move, Program};
pub use modal::PathControl;
pub use segment::{Segment, Vector};
pub use speeds::Limits;
pub use trajectory::{Place, Trajectory};
