//! Faults: their stable numbers and names, what they mean, what to do, and what the stage does by itself.

use crate::axes::AxisName;

/// Reaction of the stage by itself to a fault it finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Zero volts and disabled in the tick that finds it.
    Off,
    /// All axes brake under control, along their braking limits; then zero volts and disabled.
    Stop,
    /// All axes brake under control and hold; nothing is latched.
    Hold,
}

/// Cause for which the outputs were switched off. The numbers and the names are stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(
    feature = "names",
    derive(
        strum::EnumCount,
        strum::FromRepr,
        strum::IntoStaticStr,
        strum::VariantArray
    ),
    strum(serialize_all = "kebab-case")
)]
#[repr(u8)]
pub enum FaultCode {
    /// The axis did not follow its reference.
    FollowingError = 1,
    /// The encoder moved further in one tick than the axis can.
    EncoderJump = 2,
    /// A control tick began or ended too late.
    DeadlineMissed = 3,
    /// The emergency stop is pressed.
    EmergencyStop = 4,
    /// The axis moves towards its pressed negative limit switch.
    NegativeLimitSwitch = 5,
    /// The axis moves towards its pressed positive limit switch.
    PositiveLimitSwitch = 6,
    /// The measured position lies beyond the travel.
    TravelExceeded = 7,
    /// The reference would not come to rest within the travel.
    #[cfg_attr(feature = "names", strum(serialize = "travel-ahead"))]
    PredictedSoftLimit = 8,
    /// The axis moves faster than it may.
    Overspeed = 9,
    /// A reading of the encoder is not valid: both lines changed at once, or a serial encoder's frame is not to be used.
    EncoderInvalid = 10,
    /// The encoder shows no motion though the output is high.
    #[cfg_attr(feature = "names", strum(serialize = "encoder-silent"))]
    EncoderSignalLoss = 11,
    /// The index pulse is not where the counts say.
    IndexMismatch = 12,
    /// A reading of the encoder was not taken in this tick.
    StaleSample = 13,
    /// The amplifier reports a fault.
    AmplifierFault = 14,
    /// The converter holds another word than was written.
    OutputMismatch = 15,
    /// The host that started a motion has fallen silent.
    LinkLost = 16,
    /// The next set point of a stream did not come in time.
    StreamUnderrun = 17,
    /// The watchdog ended the last run.
    WatchdogReset = 18,
    /// A panic ended the last run.
    Panic = 19,
    /// A hard fault of the processor ended the last run.
    HardFault = 20,
    /// The stored settings were refused.
    SettingsInvalid = 21,
    /// Homing did not find its switch.
    HomeSwitchMissing = 22,
    /// Homing moved away from its switch, and it stayed pressed.
    HomeSwitchStuck = 23,
    /// Homing did not find the index pulse.
    IndexMissing = 24,
    /// The home switch lets go too near an index pulse to decide which of them follows.
    IndexNearSwitch = 25,
    /// The next value of an injected voltage did not come in time.
    InjectionUnderrun = 26,
    /// The axis left the travel, or exceeded the velocity, that was given with its injected voltage.
    InjectionBounds = 27,
    /// The encoder does not show the motion that the output must have caused.
    EncoderImplausible = 28,
    /// A controlled stop lasted longer than its limits allow.
    StopOverrun = 29,
    /// The motor was loaded for longer than it withstands.
    Overload = 30,
    /// The axis swung to and fro by itself.
    Oscillation = 31,
    /// The pulses of the control are faster than the axis may go.
    PulseOverspeed = 32,
    /// The pulses of the control changed in speed or sense as no axis does.
    PulseJump = 33,
}

impl FaultCode {
    /// All faults, in order of their numbers.
    #[cfg(feature = "names")]
    pub const ALL: [Self; <Self as strum::EnumCount>::COUNT] =
        *<Self as strum::VariantArray>::VARIANTS
            .first_chunk()
            .unwrap();

    /// The stable number, 1 to 33.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The fault of a number.
    #[cfg(feature = "names")]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::from_repr(number)
    }

    /// The stable name, such as `following-error`.
    #[cfg(feature = "names")]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The cause in words.
    pub const fn cause(self) -> &'static str {
        self.text()[0]
    }

    /// The remedy in words.
    pub const fn remedy(self) -> &'static str {
        self.text()[1]
    }

    /// The reaction of the stage by itself; of [`Self::EmergencyStop`], [`Self::LinkLost`] and [`Self::StreamUnderrun`]
    /// unless the settings say otherwise ([`Operation`](super::Operation)).
    pub const fn reaction(self) -> Reaction {
        match self {
            // The measured position can be trusted, and an axis under control stops shorter than one that coasts.
            Self::NegativeLimitSwitch
            | Self::PositiveLimitSwitch
            | Self::TravelExceeded
            | Self::PredictedSoftLimit
            | Self::LinkLost
            | Self::StreamUnderrun
            | Self::HomeSwitchMissing
            | Self::HomeSwitchStuck
            | Self::IndexMissing
            | Self::IndexNearSwitch
            | Self::InjectionUnderrun
            | Self::InjectionBounds
            | Self::Overload
            | Self::Oscillation
            | Self::PulseOverspeed
            | Self::PulseJump => Reaction::Stop,
            _ => Reaction::Off,
        }
    }

    /// Cause and remedy.
    const fn text(self) -> [&'static str; 2] {
        match self {
            Self::FollowingError => [
                "the measured position left the reference by more than the limit",
                "check for a blocked axis, a disabled amplifier, and the signs of encoder and amplifier; \
                 or raise following_error_mm",
            ],
            Self::EncoderJump => [
                "the encoder moved further in one tick than the axis can",
                "check the encoder's cable, shield and supply; check max_velocity_mm_s and resolution_mm",
            ],
            Self::DeadlineMissed => [
                "a control tick began late, or ended after its deadline",
                "lower the control rate, or remove load above the control interrupt's priority",
            ],
            Self::EmergencyStop => [
                "the emergency stop is pressed, or its circuit is broken",
                "clear the danger, release the emergency stop, reset, and enable",
            ],
            Self::NegativeLimitSwitch => [
                "the axis moved towards its pressed negative limit switch",
                "reset, enable, and move to larger positions; check travel_mm and the home position",
            ],
            Self::PositiveLimitSwitch => [
                "the axis moved towards its pressed positive limit switch",
                "reset, enable, and move to smaller positions; check travel_mm and the home position",
            ],
            Self::TravelExceeded => [
                "the measured position lies beyond the travel",
                "reset, enable, and move back; check for overshoot and a pushing load, or widen travel_mm",
            ],
            Self::PredictedSoftLimit => [
                "the motion would not have come to rest within the travel",
                "end the motion within travel_mm, or reach the end more slowly; \
                 raise braking_mm_s2 if the axis can brake harder",
            ],
            Self::Overspeed => [
                "the axis moved faster than overspeed_ratio times max_velocity_mm_s",
                "check the signs of encoder and amplifier, the gains, and what drives the axis from outside",
            ],
            Self::EncoderInvalid => [
                "the encoder's reading is not valid: both its lines changed at once, or the frames of a serial encoder are damaged \
                 or carry its error bit",
                "check the encoder's cable, shield and supply, its largest edge rate or its clock, and the encoder; then home again",
            ],
            Self::EncoderSignalLoss => [
                "the encoder showed no motion though the output was high for silent_s",
                "check the encoder's cable and both its lines, the amplifier's enable line, and for a blocked axis",
            ],
            Self::IndexMismatch => [
                "the counts between two index pulses are no multiple of counts_per_index",
                "check the encoder for missing edges: cable, shield, dirt; check counts_per_index; then home again",
            ],
            Self::StaleSample => [
                "a reading of the encoder was not taken in this tick",
                "check the encoder's interface and its timing against the control rate",
            ],
            Self::AmplifierFault => [
                "the amplifier reports a fault, or its cable is broken",
                "read the amplifier's own display; check supply, motor cable and temperature",
            ],
            Self::OutputMismatch => [
                "the converter holds another word than was written to it",
                "check the converter's bus and supply, and the shield of its cable",
            ],
            Self::LinkLost => [
                "the host that started the motion has fallen silent",
                "check the cable and the host; then begin again: what a host moves needs a request of it every half second (operation.host_needed)",
            ],
            Self::StreamUnderrun => [
                "the next set point of the stream did not come in time",
                "send set points further ahead, or at a longer period",
            ],
            Self::WatchdogReset => [
                "the watchdog ended the last run: control, supervision or link made no progress",
                "read the log of the last run; report it with the firmware's version",
            ],
            Self::Panic => [
                "a panic ended the last run",
                "read the text that it left; report it with the firmware's version",
            ],
            Self::HardFault => [
                "a hard fault of the processor ended the last run",
                "read the registers that it left; check the supply; report it with the firmware's version",
            ],
            Self::SettingsInvalid => [
                "the stored settings are damaged or were refused; the defaults are in force",
                "connect and check the draft, which may hold an older set, or load a settings file; apply, store, then reset",
            ],
            Self::HomeSwitchMissing => [
                "homing went homing.travel_mm without meeting its switch",
                "check the switch and its cable, homing.direction and homing.switch; or raise homing.travel_mm",
            ],
            Self::HomeSwitchStuck => [
                "homing went homing.travel_mm away from its switch, and it stayed pressed",
                "check the switch, its cable and its polarity, and homing.direction",
            ],
            Self::IndexMissing => [
                "no index pulse came within a revolution after the home switch",
                "check the encoder's index line and encoder.counts_per_index; or home without the index",
            ],
            Self::IndexNearSwitch => [
                "the home switch lets go within an eighth of a revolution of an index pulse",
                "move the switch, or turn the encoder on its shaft, by a quarter of a revolution",
            ],
            Self::InjectionUnderrun => [
                "the next value of the injected voltage did not come in time",
                "check the cable and the host's load; the line must carry 20 kB/s to the machine at 10 kHz",
            ],
            Self::InjectionBounds => [
                "the axis left the travel, or exceeded the velocity, that was given with its injected voltage",
                "lower the voltage or its duration, or raise its lowest frequency; or allow more travel",
            ],
            Self::EncoderImplausible => [
                "the encoder does not show the motion that the output must have caused",
                "check the encoder's cable and both its lines, the signs of encoder and amplifier, the plant's model, \
                 and for a blocked axis; then home again",
            ],
            Self::Overload => [
                "the output was above amplifier.continuous_v for longer than amplifier.overload_s allows",
                "let the motor cool; check for a tight guide, a blocked axis and a brake that holds; lower accelerations or \
                 the share of motion; check amplifier.continuous_v",
            ],
            Self::Oscillation => [
                "the axis swung evenly for a second by more than following_error_mm",
                "lower the gains of the feedback, or identify the plant and design them again; check for a loose coupling and a \
                 spring between motor and encoder",
            ],
            Self::PulseOverspeed => [
                "the control's pulses were faster than limits.max_velocity_mm_s",
                "lower the control's largest feed; check pulses.step_mm and the gear against the control's steps per mm",
            ],
            Self::PulseJump => [
                "the control's pulses changed in speed or sense faster than the axis can: pulses were added or lost",
                "check cable, shield and ground of step and direction, the pulse's length and the set-up time of direction; lower the \
                 control's acceleration; then find the position again",
            ],
            Self::StopOverrun => [
                "a controlled stop lasted longer than braking_mm_s2 and braking_jerk_mm_s3 allow",
                "report it with the firmware's version and the settings",
            ],
        }
    }
}

/// A latched fault: what, where, when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The cause of the fault.
    pub code: FaultCode,
    /// The axis, if it is about one.
    pub axis: Option<AxisName>,
    /// The control tick that found it.
    pub tick: u32,
}

/// A bad input that keeps the outputs from being enabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EnableInterlock {
    /// The fault that the input would be, were the outputs enabled.
    pub code: FaultCode,
    /// The axis, if it is about one.
    pub axis: Option<AxisName>,
}
