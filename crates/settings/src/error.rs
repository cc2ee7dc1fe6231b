//! Refused settings, in words that say what to change.

use core::fmt;

use quadrant_law::axes::AxisName;
use quadrant_law::decimal::Decimal;

/// Reason why a value is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// It is not a finite number.
    NotFinite,
    /// It lies outside the allowed range.
    OutOfRange {
        /// Smallest allowed value.
        least: f64,
        /// Largest allowed value.
        most: f64,
    },
    /// The weights of the GMS elements do not sum to one.
    WeightsSum,
    /// More elements than the firmware has room for.
    TooManyElements {
        /// Elements that there is room for.
        room: usize,
    },
    /// The nonlinear gain's largest value exceeds what the Popov criterion allows for the plant and the PID.
    BeyondPopov {
        /// Largest allowed value of cosh(rate * range).
        bound: f64,
    },
    /// It is not there, and what is chosen needs it.
    Missing,
    /// Homing by the index pulse needs to know the counts between two of them.
    IndexUnknown,
    /// Only a serial encoder knows its position from the start.
    NeedsSerial,
    /// The axis is homed from the start, and homing by a switch would contradict it.
    HomedTwice,
    /// A serial encoder's count comes again within the travel.
    BeyondRange {
        /// Longest travel, mm.
        most: f64,
    },
    /// The loop that the law closes at small errors is not shown to be stable on the plant.
    Unstable,
    /// The axis counts as commissioned, and its law has no gain.
    NoGain,
    /// It is not above the point before it.
    NotRising,
    /// The table made from the curve errs by more than 0.1 % of the breakaway level.
    TableError,
    /// The pre-sliding spring on the plant's inertia swings too fast for the control rate.
    TooStiffForRate {
        /// Largest stiffness, V/mm.
        most: f64,
    },
    /// The sliding friction follows the Stribeck curve faster than the control rate resolves.
    TooFastForRate {
        /// Largest value, V/s.
        most: f64,
    },
    /// It works only with a PD, PID or N-PID.
    NeedsPid,
    /// A serial encoder has none.
    SerialHasNone,
    /// It makes a spring stiffer than the control rate resolves.
    TooShortForRate {
        /// Least value.
        least: f64,
    },
}

/// A refused value: which field of which axis, what it holds, and why that cannot be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettingsError {
    /// The axis, unless the field belongs to the stage.
    pub axis: Option<AxisName>,
    /// Path of the field below the axis or the stage.
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// Reason.
    pub reason: Reason,
}

/// A field of an axis or of the stage as the path by which it is set: `x/feedback/law`.
pub(crate) struct PathOf(pub(crate) Option<AxisName>, pub(crate) &'static str);

impl fmt::Display for PathOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(axis, field) = *self;
        if let Some(axis) = axis {
            write!(f, "{axis}/")?;
        }
        for (place, part) in field.split('.').enumerate() {
            if place > 0 {
                f.write_str("/")?;
            }
            f.write_str(part)?;
        }
        Ok(())
    }
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        PathOf(self.axis, self.field).fmt(f)?;
        if !matches!(self.reason, Reason::Missing | Reason::NeedsPid) {
            write!(f, " = {}", Decimal(self.value))?;
        }
        match self.reason {
            Reason::Missing => f.write_str(" is missing, which the chosen law or kind of feedforward needs: `quadrant commission` fills it in"),
            Reason::NeedsPid => f.write_str(" needs feedback/law = \"pd\", \"pid\" or \"n-pid\"; choose one, or leave it out"),
            Reason::SerialHasNone => f.write_str(
                ": a serial encoder has no index; set it to null, and home by encoder/offset_mm or without the index",
            ),
            Reason::TooShortForRate { least } => write!(
                f,
                ": below {} friction's springs are stiffer than the control rate resolves; raise it",
                Decimal(least)
            ),
            Reason::NeedsSerial => f.write_str(
                ": only a serial encoder shows its position from the start; give encoder/serial, or leave this out",
            ),
            Reason::HomedTwice => f.write_str(
                ": the axis is homed from the start by it; leave this or homing out",
            ),
            Reason::BeyondRange { most } => write!(
                f,
                ": the travel is longer than the {} mm after which the serial encoder's count comes again; leave \
                 encoder/offset_mm out, and home the axis by a switch",
                Decimal(most)
            ),
            Reason::IndexUnknown => f.write_str(
                ": homing by the index pulse needs encoder/counts_per_index; give it, or home without the index",
            ),
            Reason::Unstable => f.write_str(
                ": the loop that the law closes at small errors is not shown to be stable on the axis' plant; \
                 lower its gains",
            ),
            Reason::NoGain => f.write_str(
                ": the axis is commissioned, and its law has no gain; design one (`quadrant design pid`), or commission it \
                 (`quadrant commission`)",
            ),
            Reason::NotRising => f.write_str(" must lie above the point before it"),
            Reason::NotFinite => f.write_str(" is not a finite number; give one within the limits of docs/settings.md"),
            Reason::OutOfRange { least, most } => {
                write!(f, " is outside {} to {}", Decimal(least), Decimal(most))
            }
            Reason::WeightsSum => f.write_str(": the weights of all elements must sum to 1 within 1e-6"),
            Reason::TooManyElements { room } => {
                write!(f, " elements do not fit: this build has room for {room}")
            }
            Reason::BeyondPopov { bound } => write!(
                f,
                ": cosh(rate * range) exceeds {:.3}, the Popov bound of this PID on this plant; \
                 lower the rate, the range or the PID's gains",
                Decimal(bound)
            ),
            Reason::TableError => f.write_str(
                ": the curve bends too sharply near zero for its table (error above 0.1 % of the breakaway level); \
                 raise the exponent or bring coulomb_v and breakaway_v closer",
            ),
            Reason::TooStiffForRate { most } => write!(
                f,
                ": the stiffness (of GMS elements their sum) exceeds {:.4} V/mm, beyond which the pre-sliding resonance \
                 on this plant is not resolved at the control rate",
                Decimal(most)
            ),
            Reason::TooFastForRate { most } => write!(
                f,
                " exceeds {:.4} V/s, beyond which sliding friction changes within one control period",
                Decimal(most)
            ),
        }
    }
}

impl core::error::Error for SettingsError {}
