//! Channels of telemetry: one number of one axis, or of the stage, by name and by number.

use core::fmt;
use core::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::{EnumCount, EnumString, IntoStaticStr, VariantArray};

use super::observation::Observation;
use crate::law::axes::AxisName;
use crate::law::axis::AxisState;
use crate::law::safety::SafetyState;
use crate::law::scalar::{Quantity, Scalar};

/// A signal of an axis. The numbers are stable: they cross the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumCount, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum AxisSignal {
    /// Reference position, 1/256 count; the low 32 bits, so it wraps at +-2^23 counts (4.2 m of half micrometres).
    Reference = 0,
    /// Measured position, counts; the low 32 bits.
    Position = 1,
    /// Tracking error, reference minus measured, mm.
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
    Gms = 9,
    /// Feedforward of inertia, V.
    Inertia = 10,
    /// Rest of a bumpless change's offset, V.
    #[strum(serialize = "transfer")]
    BumplessOffset = 11,
    /// Output after all limits, V.
    Output = 12,
    /// The word sent to the converter.
    Code = 13,
    /// The limit that acts on the output: 0 none, 1 the output limit.
    LimitedBy = 14,
    /// Voltage that a host adds to the output, V.
    Injection = 15,
    /// The sum of the converter's words of all ticks before this one; wraps. The difference from one sample to the next is
    /// the sum over the ticks from the one on, up to the other.
    CodeSum = 16,
}

/// A signal of the stage. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, EnumCount, EnumString, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum StageSignal {
    /// The number of its [`MachineState`].
    State = 0,
    /// The number of the fault that is latched, or for which the axes brake; 0 without one.
    Fault = 1,
    /// The control tick, numbered as in a fault.
    Tick = 2,
    /// Duration of the tick before, cycles of the board's tick timer.
    Elapsed = 3,
}

/// The safety state as it is shown. The numbers are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
#[repr(u8)]
pub enum MachineState {
    /// Before the first good inputs.
    Start = 0,
    /// Nobody: the outputs are off.
    Disabled = 1,
    /// The homing routine of an axis at least. Samples show [`Enabled`](Self::Enabled) then.
    Homing = 2,
    /// The control law drives the outputs.
    Enabled = 3,
    /// Nobody, until the fault is reset.
    Fault = 4,
    /// The control law, while the axes brake after a fault.
    Stopping = 5,
}

impl MachineState {
    /// Its name in lower case.
    pub fn as_str(self) -> &'static str {
        self.into()
    }
}

impl From<SafetyState> for MachineState {
    #[inline(always)]
    fn from(state: SafetyState) -> Self {
        match state {
            SafetyState::Start => Self::Start,
            SafetyState::Disabled => Self::Disabled,
            SafetyState::Enabled => Self::Enabled,
            SafetyState::Stopping(_) => Self::Stopping,
            SafetyState::Faulted(_) => Self::Fault,
        }
    }
}

/// Format of the word of a sample.
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
             `state`, `fault`, `tick` or `elapsed`",
        )
    }
}

impl core::error::Error for UnknownChannel {}

/// Signals that a source can have at most: what its number is multiplied with.
const SIGNALS_PER_SOURCE: u8 = 32;
const STAGE_SOURCE: u8 = 3;

impl AxisSignal {
    /// All signals of an axis, in order of their numbers.
    pub const ALL: [Self; Self::COUNT] = *Self::VARIANTS.first_chunk().unwrap();

    /// Its name, as in `x.error` behind the dot.
    pub fn as_str(self) -> &'static str {
        self.into()
    }

    #[inline(always)]
    fn read<S: Scalar, const N: usize>(self, axis: &AxisState<S, N>) -> u32 {
        let seen = axis.telemetry();
        let volts = |value: S| value.to_f32(Quantity::Voltage).to_bits();
        match self {
            Self::Reference => (seen.reference.0 >> 8) as u32,
            Self::Position => seen.measured.0 as u32,
            Self::Error => seen.error.to_f32(Quantity::Length).to_bits(),
            Self::Velocity => seen.velocity.to_f32(Quantity::Velocity).to_bits(),
            Self::Proportional => volts(seen.feedback.proportional),
            Self::Integral => volts(seen.feedback.integral),
            Self::Derivative => volts(seen.feedback.derivative),
            Self::Level => volts(seen.feedforward.level),
            Self::Viscous => volts(seen.feedforward.viscous),
            Self::Gms => volts(seen.feedforward.gms),
            Self::Inertia => volts(seen.feedforward.inertia),
            Self::BumplessOffset => volts(seen.bumpless_offset),
            Self::Output => volts(seen.output),
            Self::Code => i32::from(seen.code.0) as u32,
            Self::LimitedBy => seen.limited_by as u32,
            Self::Injection => volts(axis.injected()),
            Self::CodeSum => seen.code_sum.wrapping_sub(seen.code.0.into()) as u32,
        }
    }
}

impl StageSignal {
    /// All signals of the stage, in order of their numbers.
    pub const ALL: [Self; Self::COUNT] = *Self::VARIANTS.first_chunk().unwrap();

    /// Its name, as in `x.error` behind the dot.
    pub fn as_str(self) -> &'static str {
        self.into()
    }

    #[inline(always)]
    fn read<S: Scalar, const N: usize>(self, seen: &Observation<'_, S, N>) -> u32 {
        match self {
            Self::State => MachineState::from(seen.stage.safety()) as u32,
            Self::Fault => match seen.stage.safety().fault() {
                Some(fault) => u32::from(fault.code.number()),
                None => 0,
            },
            Self::Tick => seen.tick(),
            Self::Elapsed => seen.elapsed_cycles,
        }
    }
}

impl Channel {
    /// All channels, in order of their numbers.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..=u8::MAX).filter_map(|number| Self::try_from(number).ok())
    }

    /// Format of its word.
    pub const fn word_kind(self) -> WordKind {
        match self {
            Self::Stage(_)
            | Self::Axis(
                _,
                AxisSignal::Reference
                | AxisSignal::Position
                | AxisSignal::Code
                | AxisSignal::LimitedBy
                | AxisSignal::CodeSum,
            ) => WordKind::Integer,
            Self::Axis(..) => WordKind::Float,
        }
    }

    /// The unit of its word; empty for a number without one.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Stage(StageSignal::Tick) => "tick",
            Self::Stage(StageSignal::Elapsed) => "cycle",
            Self::Stage(_)
            | Self::Axis(_, AxisSignal::Code | AxisSignal::LimitedBy | AxisSignal::CodeSum) => "",
            Self::Axis(_, AxisSignal::Reference) => "count/256",
            Self::Axis(_, AxisSignal::Position) => "count",
            Self::Axis(_, AxisSignal::Error) => "mm",
            Self::Axis(_, AxisSignal::Velocity) => "mm/s",
            Self::Axis(..) => "V",
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

    /// Its word at this tick.
    #[inline(always)]
    pub fn read<S: Scalar, const N: usize>(self, seen: &Observation<'_, S, N>) -> u32 {
        match self {
            Self::Stage(signal) => signal.read(seen),
            Self::Axis(name, signal) => signal.read(&seen.stage.axes()[name]),
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
        let signal = usize::from(number % SIGNALS_PER_SOURCE);
        let channel = if source == STAGE_SOURCE {
            StageSignal::ALL.get(signal).copied().map(Self::Stage)
        } else {
            let axis = AxisName::ALL.get(usize::from(source)).copied();
            axis.zip(AxisSignal::ALL.get(signal).copied())
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
