//! Tables and figures of a design.

mod loop_figures;
pub mod npid;
pub mod pid;
