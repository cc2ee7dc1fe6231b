//! The numbers that a sample can hold, of an axis or of the stage: their names, units and numbers.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::{EnumString, FromRepr, IntoStaticStr};

use super::axis::AxisName;

/// A signal of an axis. The numbers are stable: they cross the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumString, FromRepr, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum AxisSignal {
    /// Reference position, 1/256 count; the low 32 bits, so it wraps at +-2^23 counts (4.2 m of half micrometres).
    Reference = 0,
    /// Measured position, counts; the low 32 bits.
    Position = 1,
    /// Tracking error, mm.
    Error = 2,
    /// Velocity of the reference as far ahead as the feedforward looks, mm/s.
    Velocity = 3,
    /// The feedback's proportional term, V.
    #[strum(serialize = "p")]
    Proportional = 4,
    /// The feedback's integral, V.
    #[strum(serialize = "i")]
    Integral = 5,
    /// The feedback's derivative term, V.
    #[strum(serialize = "d")]
    Derivative = 6,
    /// Feedforward of the static model's level, V.
    Level = 7,
    /// Feedforward of viscous friction, V.
    Viscous = 8,
    /// Feedforward of the pre-sliding model, V.
    // Its former name is still understood.
    #[strum(serialize = "presliding", serialize = "gms")]
    Presliding = 9,
    /// Feedforward of inertia, V.
    Inertia = 10,
    /// Remainder of a bumpless change's offset, V.
    #[strum(serialize = "transfer")]
    BumplessOffset = 11,
    /// Output after all limits, V.
    Output = 12,
    /// The converter's word.
    Code = 13,
    /// The active limit of the output: 0 none, 1 the output limit.
    LimitedBy = 14,
    /// Voltage that a host adds to the output, V.
    Injection = 15,
    /// The sum of the converter's words of all ticks before this one; wraps. The difference from one sample to the next is
    /// the sum over the ticks from the one on, up to the other.
    CodeSum = 16,
    /// Height of the last quadrant glitch: the error's peak after a reversal over its mean before it, um.
    Glitch = 17,
    /// Scale of the friction feedforward that was learnt; 1 is the commissioned one.
    FrictionScale = 18,
    /// The reason for not learning the scale: 0 learning is off, 1 nothing, 2 at rest, 3 a jog, homing, stop or injection, 4 the
    /// output's limit, 5 that or new settings a moment ago, 6 the scale is faded out.
    Learning = 19,
    /// Share of the friction's feedforward that vibration leaves.
    VibrationGate = 20,
    /// Sum of the error's squares, the last 2 s counting; its unit is learning's own.
    ErrorSquares = 21,
    /// The same of the error that there would be without feedforward, in the same unit.
    #[strum(serialize = "error-squares-off")]
    ErrorSquaresOff = 22,
}

/// A signal of the stage. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumString, FromRepr, IntoStaticStr)]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum StageSignal {
    /// The number of its [`MachineState`](super::MachineState).
    State = 0,
    /// The number of the fault that is latched, or for which the axes brake; 0 without one.
    Fault = 1,
    /// The control tick, numbered as in a fault.
    Tick = 2,
    /// Duration of the tick before, in cycles of the board's tick timer.
    Elapsed = 3,
    /// The worst radial deviation of the last full circle, outwards positive, um.
    CircleDeviation = 4,
    /// The angle at which it was, 0 to 360 degrees from the first axis towards the second.
    CircleAngle = 5,
}

/// The type of a sample's word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WordKind {
    /// The bits of an `f32`.
    Float,
    /// An `i32`, two's complement.
    Integer,
}

/// A number that a sample can hold. On the link it is one byte: the source (0, 1, 2: an axis; 3: the stage) times 32, plus the
/// signal's number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Channel {
    /// A signal of an axis.
    Axis(AxisName, AxisSignal),
    /// A signal of the stage.
    Stage(StageSignal),
}

/// No channel has this name or number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownChannel;

impl fmt::Display for UnknownChannel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(
            "no such channel; a channel is `x.`, `y.` or `z.` with a signal of an axis such as `error`, or `stage.` with \
             `state`, `fault`, `tick`, `elapsed`, `circle-deviation` or `circle-angle`",
        )
    }
}

impl core::error::Error for UnknownChannel {}

/// Largest number of signals of a source: the factor of its number.
const SIGNALS_PER_SOURCE: u8 = 32;
/// Number of the source that is the stage.
const STAGE_SOURCE: u8 = 3;
/// Units of a reference word in a count.
const REFERENCE_UNITS: f64 = 256.0;

impl AxisSignal {
    /// Its name in a channel's, such as `error`.
    pub fn as_str(self) -> &'static str {
        self.into()
    }
}

impl StageSignal {
    /// Its name in a channel's, such as `tick`.
    pub fn as_str(self) -> &'static str {
        self.into()
    }
}

impl Channel {
    /// All channels, in order of their numbers.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..=u8::MAX).filter_map(|number| Self::try_from(number).ok())
    }

    /// The type of its word.
    pub const fn word_kind(self) -> WordKind {
        match self {
            Self::Stage(
                StageSignal::State | StageSignal::Fault | StageSignal::Tick | StageSignal::Elapsed,
            )
            | Self::Axis(
                _,
                AxisSignal::Reference
                | AxisSignal::Position
                | AxisSignal::Code
                | AxisSignal::LimitedBy
                | AxisSignal::CodeSum
                | AxisSignal::Learning,
            ) => WordKind::Integer,
            Self::Stage(StageSignal::CircleDeviation | StageSignal::CircleAngle)
            | Self::Axis(..) => WordKind::Float,
        }
    }

    /// The unit of its word; empty for a number without one.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Stage(StageSignal::Tick) => "tick",
            Self::Stage(StageSignal::Elapsed) => "cycle",
            Self::Stage(StageSignal::CircleDeviation) | Self::Axis(_, AxisSignal::Glitch) => "um",
            Self::Stage(StageSignal::CircleAngle) => "deg",
            Self::Stage(_)
            | Self::Axis(
                _,
                AxisSignal::Code
                | AxisSignal::LimitedBy
                | AxisSignal::CodeSum
                | AxisSignal::FrictionScale
                | AxisSignal::Learning
                | AxisSignal::VibrationGate
                | AxisSignal::ErrorSquares
                | AxisSignal::ErrorSquaresOff,
            ) => "",
            Self::Axis(_, AxisSignal::Reference) => "count/256",
            Self::Axis(_, AxisSignal::Position) => "count",
            Self::Axis(_, AxisSignal::Error) => "mm",
            Self::Axis(_, AxisSignal::Velocity) => "mm/s",
            Self::Axis(..) => "V",
        }
    }

    /// The unit of its word as a physical quantity: of positions mm, by [`physical`](Self::physical).
    pub const fn physical_unit(self) -> &'static str {
        match self {
            Self::Axis(_, AxisSignal::Reference | AxisSignal::Position) => "mm",
            other => other.unit(),
        }
    }

    /// A value in the channel's unit as one in its physical unit, by the length of a count of each axis, mm.
    pub const fn physical(self, value: f64, resolution_mm: &[f64; 3]) -> f64 {
        match self {
            Self::Axis(axis, AxisSignal::Position) => value * resolution_mm[axis as usize],
            Self::Axis(axis, AxisSignal::Reference) => {
                value * (resolution_mm[axis as usize] / REFERENCE_UNITS)
            }
            _ => value,
        }
    }

    /// The unit in which people read it, and how many of them its physical unit is: errors are shown in um.
    pub const fn shown_unit(self) -> (&'static str, f64) {
        match self {
            Self::Axis(_, AxisSignal::Error) => ("um", 1e3),
            other => (other.physical_unit(), 1.0),
        }
    }

    /// A word of this channel as a number, in the channel's unit: integers exactly, as an `f64`.
    pub fn value(self, word: u32) -> f64 {
        match self.word_kind() {
            WordKind::Float => f64::from(f32::from_bits(word)),
            // Ticks and cycles count upwards from zero through all 32 bits.
            WordKind::Integer if matches!(self, Self::Stage(_)) => f64::from(word),
            WordKind::Integer => f64::from(word as i32),
        }
    }
}

impl From<Channel> for u8 {
    fn from(channel: Channel) -> Self {
        match channel {
            Channel::Axis(axis, signal) => axis as Self * SIGNALS_PER_SOURCE + signal as Self,
            Channel::Stage(signal) => STAGE_SOURCE * SIGNALS_PER_SOURCE + signal as Self,
        }
    }
}

impl TryFrom<u8> for Channel {
    type Error = UnknownChannel;

    fn try_from(number: u8) -> Result<Self, UnknownChannel> {
        let source = number / SIGNALS_PER_SOURCE;
        let signal = number % SIGNALS_PER_SOURCE;
        let channel = if source == STAGE_SOURCE {
            StageSignal::from_repr(signal).map(Self::Stage)
        } else {
            let axis = AxisName::ALL.get(usize::from(source)).copied();
            axis.zip(AxisSignal::from_repr(signal))
                .map(|(axis, signal)| Self::Axis(axis, signal))
        };
        channel.ok_or(UnknownChannel)
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Axis(axis, signal) => write!(f, "{axis}.{}", signal.as_str()),
            Self::Stage(signal) => write!(f, "stage.{}", signal.as_str()),
        }
    }
}

impl FromStr for Channel {
    type Err = UnknownChannel;

    /// The channel of a name such as `x.error`.
    fn from_str(name: &str) -> Result<Self, UnknownChannel> {
        let (source, signal) = name.split_once('.').ok_or(UnknownChannel)?;
        let channel = if source == "stage" {
            signal.parse().ok().map(Self::Stage)
        } else {
            let axis = source.parse().ok();
            axis.zip(signal.parse().ok())
                .map(|(axis, signal)| Self::Axis(axis, signal))
        };
        channel.ok_or(UnknownChannel)
    }
}
