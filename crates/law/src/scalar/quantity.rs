//! The physical quantities of the law's signals, and their fixed-point formats.

/// The physical quantity of a signal. In fixed point each has its own format; `docs/fixed-point.md` holds the range analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Tracking error and displacement in a tick, mm. Fixed: Q5.26, +-32 mm in steps of 0.015 nm.
    Length,
    /// Reference velocity, mm/s. Fixed: Q11.20, +-2048 mm/s in steps of 0.95 nm/s.
    Velocity,
    /// Reference acceleration, mm/s^2. Fixed: Q15.16, +-32 m/s^2 in steps of 15 nm/s^2.
    Acceleration,
    /// Voltage at the amplifier input, V. Fixed: Q5.26, +-32 V in steps of 15 nV.
    Voltage,
    /// A ratio within +-1, such as a decay per tick or a place within a table's interval. Fixed: Q1.30.
    Fraction,
    /// A ratio that may exceed 1, such as k(e). Fixed: Q5.26.
    Multiplier,
    /// A raw integer: counts, [`Position`](crate::units::Position) units, DAC codes. Fixed: Q31.0.
    Integer,
}

impl Quantity {
    /// Number of fraction bits of the fixed-point format.
    pub const fn fraction_bits(self) -> u32 {
        match self {
            Self::Length | Self::Voltage | Self::Multiplier => 26,
            Self::Velocity => 20,
            Self::Acceleration => 16,
            Self::Fraction => 30,
            Self::Integer => 0,
        }
    }

    /// The largest magnitude that the fixed-point format holds.
    pub fn limit(self) -> f64 {
        i32::MAX as f64 / (1u64 << self.fraction_bits()) as f64
    }
}
