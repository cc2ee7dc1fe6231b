//! Our controllers over a recorded reference, and along a part program.

pub mod part_program;
pub mod part_program_page;
pub mod recorded;
pub mod recorded_page;
