//! The command `quadrant`.
#![forbid(unsafe_code)]
fn main() {}
