//! Who may drive the outputs: states, faults and their meaning.
//!
//! The machine starts disabled. A fault disables it in the tick that finds it, before any other output is computed,
//! and is latched until a person resets it.

use core::fmt;

use serde::{Deserialize, Serialize};

/// One of the stage's three axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum AxisName {
    /// The first axis.
    X,
    /// The second axis.
    Y,
    /// The third axis.
    Z,
}

impl AxisName {
    /// All axes, in order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The axis' name in lower case.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }
}

impl fmt::Display for AxisName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Why the outputs were switched off. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum FaultCode {
    /// The axis did not follow its reference.
    FollowingError = 1,
    /// The encoder moved further in one tick than the axis can.
    EncoderJump = 2,
    /// A control tick ended too late.
    DeadlineMissed = 3,
}

impl FaultCode {
    /// All faults, in order of their numbers.
    pub const ALL: [Self; 3] = [
        Self::FollowingError,
        Self::EncoderJump,
        Self::DeadlineMissed,
    ];

    /// The stable number.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// What happened, in words.
    pub const fn cause(self) -> &'static str {
        match self {
            Self::FollowingError => {
                "the measured position left the reference by more than the limit"
            }
            Self::EncoderJump => "the encoder moved further in one tick than the axis can",
            Self::DeadlineMissed => "a control tick ended after its deadline",
        }
    }

    /// What to do about it.
    pub const fn remedy(self) -> &'static str {
        match self {
            Self::FollowingError => {
                "check for a blocked axis, a disabled amplifier, and the signs of encoder and amplifier; \
                 or raise following_error_mm"
            }
            Self::EncoderJump => {
                "check the encoder's cable, shield and supply; check max_velocity_mm_s and resolution_mm"
            }
            Self::DeadlineMissed => {
                "lower the control rate, or remove load above the control interrupt's priority"
            }
        }
    }
}

/// A latched fault: what, where, when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// What happened.
    pub code: FaultCode,
    /// On which axis, if on one.
    pub axis: Option<AxisName>,
    /// At which control tick.
    pub tick: u32,
}

/// Who drives the outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SafetyState {
    /// Nobody: zero volts, amplifiers disabled. The state at start.
    #[default]
    Disabled,
    /// The control law.
    Enabled,
    /// Nobody, until a reset.
    Faulted(Fault),
}

/// What a person or a host asks of the stage. Each takes effect once, at the next tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Command {
    /// Switch the outputs on, holding the present position. Refused while a fault is latched.
    Enable = 1,
    /// Switch the outputs off.
    Disable = 2,
    /// Clear a latched fault; the stage is then disabled.
    ResetFault = 3,
    /// Start the plan's motions from where the axes stand. Ignored unless enabled and at rest.
    Run = 4,
}

impl Command {
    /// The command of a number on the link.
    pub const fn from_number(number: u32) -> Option<Self> {
        match number {
            1 => Some(Self::Enable),
            2 => Some(Self::Disable),
            3 => Some(Self::ResetFault),
            4 => Some(Self::Run),
            _ => None,
        }
    }

    /// The number on the link.
    pub const fn number(self) -> u32 {
        self as u32
    }
}

impl SafetyState {
    /// Whether the control law drives the outputs.
    #[inline(always)]
    pub const fn is_enabled(self) -> bool {
        matches!(self, Self::Enabled)
    }

    /// Latches a fault; the first one stays.
    #[inline(always)]
    pub fn trip(&mut self, fault: Fault) {
        if !matches!(self, Self::Faulted(_)) {
            *self = Self::Faulted(fault);
        }
    }

    /// Takes a command; says whether the outputs have just been enabled.
    #[inline(always)]
    pub fn apply(&mut self, command: Command) -> bool {
        match (command, *self) {
            (Command::Enable, Self::Disabled) => {
                *self = Self::Enabled;
                return true;
            }
            (Command::Disable, Self::Enabled) | (Command::ResetFault, Self::Faulted(_)) => {
                *self = Self::Disabled;
            }
            _ => {}
        }
        false
    }
}
