//! Pins that more than one piece of the board knows.

/// Number of the amplifiers' enable pin in port C.
pub(super) const ENABLE: u8 = 9;
/// Number of the brake's pin in port B.
pub(super) const BRAKE: u8 = 5;
/// Numbers of the converter's /SYNC and /LDAC in port B.
#[cfg(not(feature = "output-on-chip"))]
pub(super) const SYNC: u8 = 12;
#[cfg(not(feature = "output-on-chip"))]
pub(super) const LOAD: u8 = 1;
