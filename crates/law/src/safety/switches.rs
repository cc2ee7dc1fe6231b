//! The board's digital inputs as a set of bits. All are active-true: polarity is the board's business, and a
//! broken wire reads as active.

use super::fault::{EnableInterlock, FaultCode};
use crate::axes::AxisName;

/// Number of bits of an axis.
const BITS_PER_AXIS: u32 = 5;
/// Bit of an axis' negative limit switch.
const NEGATIVE_LIMIT: u16 = 0b0_0001;
/// Bit of its positive limit switch.
const POSITIVE_LIMIT: u16 = 0b0_0010;
/// Bit of its home switch.
const HOME: u16 = 0b0_0100;
/// Bit of its amplifier's fault.
const AMPLIFIER_FAULT: u16 = 0b0_1000;
/// Bit of an output that the converter does not hold.
const OUTPUT_MISMATCH: u16 = 0b1_0000;
/// The stage's own bit, above all axes'.
const EMERGENCY_STOP: u16 = 1 << (3 * BITS_PER_AXIS);

/// The digital inputs of the stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Switches(u16);

/// The digital inputs of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AxisSwitches(u16);

impl AxisSwitches {
    /// The negative limit switch is pressed.
    pub const NEGATIVE_LIMIT: Self = Self(NEGATIVE_LIMIT);
    /// The positive limit switch is pressed.
    pub const POSITIVE_LIMIT: Self = Self(POSITIVE_LIMIT);
    /// The home switch is pressed.
    pub const HOME: Self = Self(HOME);
    /// The amplifier reports a fault.
    pub const AMPLIFIER_FAULT: Self = Self(AMPLIFIER_FAULT);
    /// The converter's channel read back another word than was written.
    pub const OUTPUT_MISMATCH: Self = Self(OUTPUT_MISMATCH);

    /// True if all of `others` are active.
    pub const fn has(self, others: Self) -> bool {
        self.0 & others.0 == others.0
    }

    /// The first that speaks against enabled outputs.
    pub(crate) const fn fault(self) -> Option<FaultCode> {
        if self.has(Self::AMPLIFIER_FAULT) {
            Some(FaultCode::AmplifierFault)
        } else if self.has(Self::OUTPUT_MISMATCH) {
            Some(FaultCode::OutputMismatch)
        } else {
            None
        }
    }

    /// True if a limit switch is pressed.
    pub const fn at_limit(self) -> bool {
        self.0 & (NEGATIVE_LIMIT | POSITIVE_LIMIT) != 0
    }

    /// The union of these and `others`.
    #[must_use]
    pub const fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// These but for `others`.
    #[must_use]
    pub const fn without(self, others: Self) -> Self {
        Self(self.0 & !others.0)
    }
}

impl Switches {
    /// The set in which nothing is active.
    pub const NONE: Self = Self(0);
    /// The emergency stop is pressed.
    pub const EMERGENCY_STOP: Self = Self(EMERGENCY_STOP);

    /// The inputs of three axes; the emergency stop is not pressed.
    pub const fn of_axes([x, y, z]: [AxisSwitches; 3]) -> Self {
        Self(x.0 | y.0 << BITS_PER_AXIS | z.0 << (2 * BITS_PER_AXIS))
    }

    /// The set of a word of the link; other bits are ignored.
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// The set as a word of the link: five bits an axis (negative limit, positive limit, home, amplifier fault, output
    /// mismatch), x lowest, and the emergency stop in bit 15.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The union of these and `others`.
    #[must_use]
    pub const fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// These and inputs of one axis.
    #[must_use]
    pub const fn with_axis(self, axis: AxisName, switches: AxisSwitches) -> Self {
        Self(self.0 | switches.0 << (BITS_PER_AXIS * axis as u32))
    }

    /// The inputs of one axis.
    pub const fn axis(self, axis: AxisName) -> AxisSwitches {
        AxisSwitches(self.0 >> (BITS_PER_AXIS * axis as u32) & ((1 << BITS_PER_AXIS) - 1))
    }

    /// True if the emergency stop is pressed.
    pub const fn emergency_stop(self) -> bool {
        self.0 & EMERGENCY_STOP != 0
    }

    /// True if nothing speaks against enabled outputs. Limit and home switches do not: an axis must be able to leave
    /// them.
    pub const fn are_good(self) -> bool {
        const BAD: u16 = AMPLIFIER_FAULT | OUTPUT_MISMATCH;
        self.0 & (EMERGENCY_STOP | BAD | BAD << BITS_PER_AXIS | BAD << (2 * BITS_PER_AXIS)) == 0
    }

    /// The first that speaks against enabled outputs.
    pub(crate) fn interlock(self) -> Option<EnableInterlock> {
        if self.emergency_stop() {
            return Some(EnableInterlock {
                code: FaultCode::EmergencyStop,
                axis: None,
            });
        }
        AxisName::ALL.into_iter().find_map(|axis| {
            let code = self.axis(axis).fault()?;
            Some(EnableInterlock {
                code,
                axis: Some(axis),
            })
        })
    }
}
