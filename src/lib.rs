//! Quadrant: servo control that removes friction's quadrant glitches.
#![no_std]
#![forbid(unsafe_code)]
