//! The bench in the browser: the control law on the simulated stage, tick by tick, for a page that turns its knobs; and the
//! same page's end of the link to a machine.
//!
//! - [`bench`](mod@bench): law, stage and motion, and what may be changed about them while the axes move;
//! - [`truth`]: the stage's own parameters, which the law does not know;
//! - [`controls`]: the settings that the page offers, from the table of all settings;
//! - [`loop_response`]: the open loop over frequency, with the plant of the settings and with the stage's own;
//! - [`request`]: requests of the page, and their replies, as JSON;
//! - [`ask`], [`session`], [`wording`]: the page's end of the link to a machine: requests by name, frames, what comes back;
//! - `exports`: the functions that WebAssembly calls.
//!
//! The same code runs on the host, where a test compares every converter word with the browser's.
#![deny(unsafe_code)]

pub mod ask;
pub mod bench;
pub mod controls;
#[allow(unsafe_code)]
mod exports;
pub mod loop_response;
pub mod request;
pub mod session;
pub mod truth;
pub mod wording;
