//! From an unknown axis to settings that the firmware runs: the whole chain, unattended.

pub mod bootstrap;
pub mod verify;
