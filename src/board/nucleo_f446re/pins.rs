//! Pins that more than one piece of the board knows.

/// Number of the amplifiers' enable pin in port C.
pub(super) const ENABLE: u8 = 9;
