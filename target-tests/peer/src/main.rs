//! The control law alone on the emulated machine, beside the same law in C (`law.c`): both get the same inputs, and every word
//! of their outputs is compared. The instructions are counted from outside, by `cargo xtask count --peer`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[allow(unsafe_code)]
mod c;
#[cfg(target_os = "none")]
mod compare;
#[cfg(target_os = "none")]
mod parameters;
#[cfg(target_os = "none")]
mod rust;

/// Explains how to run it: on a host there is nothing to count.
#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("This runs on an emulated microcontroller, not here: cargo xtask count --peer");
    std::process::exit(2);
}
