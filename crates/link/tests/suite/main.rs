//! Frames and messages: golden bytes, sizes, and what a hostile host sends.

mod frames;
mod fuzz;
mod golden;
mod golden_answers;
mod hostile;
mod model;
mod sizes;
