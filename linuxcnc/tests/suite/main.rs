//! Tests of the components by the functions that their C calls.
// They take pointers.
#![allow(unsafe_code)]

mod component;
mod faults;
mod forbidding;
mod gains;
mod header;
mod homing;
mod link;
mod reference;
mod words;
