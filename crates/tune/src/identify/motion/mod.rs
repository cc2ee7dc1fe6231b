//! Inertia and friction from an ordinary motion record, by inverse dynamics.
//!
//! The voltage that a motion took is explained, sample by sample and linearly in the parameters, by the motion:
//!
//! ```text
//! u(t - Td) = M' a + sigma v + s(v) h + offset,   M' = 1/A
//! ```
//!
//! (level and offset may also change with time, and along the travel)
//!
//! `h` is the sign of the velocity, or, with pre-sliding friction, a bank of Maxwell-slip elements driven by the measured
//! position. Velocity and acceleration come from the position alone, by zero-phase filtering and central differences; what
//! the filter does to the edges is cut, and all signals, the regressors among them, pass the same decimation filter.
//!
//! What such a record cannot separate: an amplifier's offset, gravity, and a Coulomb friction that differs between the senses
//! of motion are one and the same; so are viscous friction and linear damping (sigma here holds `B / A`).
//!
//! Source: Janot, Gautier and Brunot, *Data Set and Reference Models of EMPS*, 2019; Gautier, *Dynamic identification of
//! robots with power model*, ICRA 1997.

mod error;
mod fit;
mod model;
mod regressors;
mod shuttle;
mod signals;
mod simulate;
mod solution;
mod uncertainty;
mod zero_phase;

pub use error::MotionFitError;
pub use fit::{Candidate, Rows, fit_motion, recommended, recommended_by, refined, validate};
pub use model::{Change, Doubt, Estimate, MotionModel, Span, Structure};
pub use shuttle::shuttle;
pub use signals::{MotionFitSettings, Signals};
pub use simulate::{CascadeLoop, Replayed, replay_closed_loop, replay_open_loop};
pub use zero_phase::low_pass;
