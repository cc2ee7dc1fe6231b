//! Every feedback law beside every other, tuned with equal effort at equal robustness.
//!
//! A comparison of control laws says more about who tuned them than about the laws, unless the tuning is part of it:
//!
//! - *Equal robustness.* On the axis' identified linear model, closed as it runs at the control rate, every law keeps
//!   `|S| <= 1.7` and `|T| <= 1.3` at small errors, where each of them is a PID. The bounds are used up, not undercut.
//! - *Equal effort.* What the bounds leave free in a law, one knob each (three for the schedule), is tried over a grid;
//!   the setting with the smallest RMS tracking error on the training sine stays, without feedforward.
//! - *No peeping.* Training runs on a twin of the axis made of its identified parameters alone. The comparison runs on
//!   the axis itself.
//!
//! [`tuning`] tunes, [`comparison`] compares, [`wrong_model`](crate::wrong_model) asks what remains when the feedforward's model is wrong.

pub mod command;
pub mod comparison;
pub mod page;
pub mod study;
pub mod tuning;
