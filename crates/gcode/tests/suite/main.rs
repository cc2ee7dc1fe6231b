//! Part programs, and the motion along them.
//!
//! One program of many modules: each would otherwise be linked with the whole library once more.

mod part_program;
