//! What crosses the border of the target: frames and messages.

pub mod lockstep;
