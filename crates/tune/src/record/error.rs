//! Reasons why a record is refused, in words that lead to the fault.

use std::fmt;
use std::path::PathBuf;

use quadrant_written::Brief;

use super::limits::MIN_ROWS;

/// A record that cannot be used. Lines are those of an editor: the header is line 1.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be opened or read.
    #[error("cannot read {}", path.display())]
    Read {
        path: PathBuf,
        source: std::io::Error,
    },
    /// The file is no CSV: rows of different length, or bytes that are no text.
    #[error("{}: {message}", path.display())]
    Malformed {
        path: PathBuf,
        /// Description of the fault and its place.
        message: String,
    },
    /// A column is not there.
    #[error(
        "{}: no column {needed}; found {found}. A motion needs t_s and reference_m or reference_mm; an experiment t_s, position_m or \
         position_mm, and voltage_v{hint}", path.display()
    )]
    MissingColumn {
        path: PathBuf,
        /// The column, or its alternatives.
        needed: &'static str,
        /// Names in the header. of the file.
        found: String,
        /// A guess at the reason, or nothing.
        hint: &'static str,
    },
    /// Two columns claim to be the same quantity.
    #[error("{}: columns {first} and {second} both hold the {quantity}; keep one", path.display())]
    AmbiguousColumn {
        path: PathBuf,
        /// Quantity that they hold.
        quantity: &'static str,
        /// The first of them.
        first: String,
        /// The second of them.
        second: String,
    },
    /// A cell is not a finite number.
    #[error("{}, line {line}, column {column}: {value:?} is not {expected}", path.display())]
    Cell {
        path: PathBuf,
        /// Line number; the header is 1.
        line: u64,
        column: String,
        /// The cell as it stands.
        value: String,
        /// Description of allowed values.
        expected: &'static str,
    },
    /// A column holds nothing that could be identified from.
    #[error("{}, column {column}: {fault}", path.display())]
    Useless {
        path: PathBuf,
        column: &'static str,
        /// Description of the fault.
        fault: UnusableSignal,
    },
    /// A column is longer or shorter than the positions are.
    #[error(
        "{}, column {column}: {found} values, and {expected} positions; every sample has one of each", path.display()
    )]
    Lengths {
        path: PathBuf,
        column: &'static str,
        /// Number of its values.
        found: usize,
        /// Number of positions.
        expected: usize,
    },
    /// There is no motion in so little.
    #[error("{}: {rows} rows of data; at least {MIN_ROWS} are needed", path.display())]
    TooFewRows {
        path: PathBuf,
        /// Rows after the header.
        rows: usize,
    },
    /// More than the memory that may be used.
    #[error("{}: more than {most_rows} rows of data; split the recording, or keep every tenth row of a slow one", path.display())]
    TooManyRows {
        path: PathBuf,
        /// Rows that are allowed.
        most_rows: usize,
    },
    /// Time does not run as a clock does.
    #[error("{}, line {line}, column t_s: {value} s {fault}", path.display())]
    Time {
        path: PathBuf,
        /// Line number; the header is 1.
        line: u64,
        /// Time in that line, s.
        value: f64,
        /// Description of the fault.
        fault: TimeFault,
    },
    /// The position jumps.
    #[error(
        "{}, line {line}: the position jumps from {from_mm} mm to {to_mm} mm, and neither the rows before nor those after move so fast{}; \
         are counts lost, or is the row wrong? Correct it, or keep the part before or after it",
        path.display(), Others(*others)
    )]
    Jump {
        path: PathBuf,
        /// Line number; the header is 1.
        line: u64,
        /// Position in the row before, mm.
        from_mm: f64,
        /// Position in that row, mm.
        to_mm: f64,
        /// Further jumps of the record.
        others: usize,
    },
    /// The sample rate is not one that anything is controlled at.
    #[error(
        "{}, column t_s: the sample time is {} s ({} Hz); {} Hz to 100 kHz are allowed{hint}",
        path.display(), Brief(*sample_time_s), Brief(*rate_hz), Brief(*least_hz)
    )]
    SampleRate {
        path: PathBuf,
        /// Median time from row to row.
        sample_time_s: f64,
        /// Sampling rate of the record, Hz.
        rate_hz: f64,
        /// Lowest rate that is allowed, Hz.
        least_hz: f64,
        /// A guess at the reason, or nothing.
        hint: &'static str,
    },
    /// Numbers that the axis cannot have made, or not in this unit.
    #[error("{}, column {column}: {fault}", path.display())]
    Unit {
        path: PathBuf,
        column: String,
        /// Contradiction that was found.
        fault: UnitFault,
    },
}

/// Reason why a column cannot be identified from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UnusableSignal {
    /// The value never changes.
    Constant {
        /// The only value of the column.
        value: f64,
    },
    /// It is at the amplifier's limit too often.
    Saturated {
        /// Share of the rows, %.
        percent: f64,
        /// Limit of the amplifier, V.
        limit_v: f64,
        /// Line of the first of them.
        line: u64,
    },
    /// It is no voltage.
    NotVoltage {
        /// Largest magnitude in the column.
        largest: f64,
    },
    /// It is less than friction takes.
    FaintVoltage {
        /// Largest magnitude in the column, V.
        largest: f64,
        /// The smallest that is believed, V.
        least_v: f64,
    },
    /// It goes further than any machine's axis.
    FarTravel {
        /// Travel of the column, mm.
        travel_mm: f64,
        /// The largest that is believed, mm.
        most_mm: f64,
    },
    /// It is no force in newtons.
    NotForce {
        /// Largest magnitude in the column.
        largest: f64,
        /// The largest that is believed, N.
        most_n: f64,
    },
}

impl fmt::Display for UnusableSignal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant { value } => write!(
                f,
                "it is {} in every row; an experiment needs a signal that moves",
                Brief(*value)
            ),
            Self::Saturated {
                percent,
                limit_v,
                line,
            } => write!(
                f,
                "{} % of the rows, from line {line} on, are at the amplifier's limit of {} V, where voltage and motion have nothing to do with each other; at \
                 most 1 % may be: lower the amplitude",
                Brief(*percent),
                Brief(*limit_v)
            ),
            Self::FaintVoltage { largest, least_v } => write!(
                f,
                "it reaches {} V, and an axis with friction needs more than {} V to move; is it in another unit?",
                Brief(*largest),
                Brief(*least_v)
            ),
            Self::FarTravel { travel_mm, most_mm } => write!(
                f,
                "it moves {} mm in all, and no axis has more than {} mm; is it in another unit?",
                Brief(*travel_mm),
                Brief(*most_mm)
            ),
            Self::NotVoltage { largest } => write!(
                f,
                "it reaches {}, and an amplifier's input takes at most 20 V; is it swapped with the position?",
                Brief(*largest)
            ),
            Self::NotForce { largest, most_n } => write!(
                f,
                "it reaches {} N, and no force above {} N is believed; is the column in newtons?",
                Brief(*largest),
                Brief(*most_n)
            ),
        }
    }
}

/// Fault of a time column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimeFault {
    /// The same time twice.
    Repeated,
    /// Earlier than the row before.
    Backwards {
        /// Time in the row before, s.
        previous: f64,
    },
    /// A pause that is too long to be interpolated.
    Pause {
        /// Time since the row before, s.
        step: f64,
        /// The longest that is allowed, s.
        most: f64,
    },
    /// A step unlike the others.
    Step {
        /// Time since the row before, s.
        step: f64,
        /// Median of the steps, s.
        median: f64,
    },
}

impl fmt::Display for TimeFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Repeated => write!(
                f,
                "repeats the row before; time must increase by the sample time in every row"
            ),
            Self::Backwards { previous } => {
                write!(
                    f,
                    "comes after {previous} s; time must increase by the sample time in every row"
                )
            }
            Self::Pause { step, most } => write!(
                f,
                "is {} s after the row before; resampling bridges {} s at most: keep the part before or after it",
                Brief(*step),
                Brief(*most)
            ),
            Self::Step { step, median } => write!(
                f,
                "is {} s after the row before, the sample time is {} s; steps must be equal within 1 %{}. `identify motion --resample` \
                 takes uneven steps",
                Brief(*step),
                Brief(*median),
                if *step > 1.5 * median {
                    " (rows are missing here)"
                } else {
                    ""
                }
            ),
        }
    }
}

/// Contradiction between a column's numbers and its unit or the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum UnitFault {
    /// Further, faster or harder than the axis can.
    Exceeds {
        /// "travel", "speed" or "acceleration".
        what: &'static str,
        /// Value of the record.
        value: f64,
        /// Value of the axis.
        limit: f64,
        /// Unit of both values.
        unit: &'static str,
        /// A thousandth of the record would fit in every respect.
        looks_like_mm: bool,
    },
    /// So little motion in a column of millimetres that it must be metres.
    LooksLikeMetres {
        /// Travel as labelled, mm.
        travel_mm: f64,
        /// The axis' travel, mm.
        limit_mm: f64,
    },
    /// The motion is lost in the encoder's resolution.
    Still {
        /// Travel in the record, mm.
        travel_mm: f64,
        /// Travel in the record, counts.
        counts: f64,
    },
    /// The measured motion is nothing like the one asked for.
    Disagrees {
        /// Travel of the measured position, mm.
        travel_mm: f64,
        /// Travel asked for, mm.
        reference_mm: f64,
    },
}

impl fmt::Display for UnitFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exceeds {
                what,
                value,
                limit,
                unit,
                looks_like_mm,
            } => write!(
                f,
                "its {what} is {} {unit}, the axis allows {} {unit}{}",
                Brief(*value),
                Brief(*limit),
                if *looks_like_mm {
                    "; a thousandth of it would fit: this looks like millimetres in a column named _m"
                } else {
                    ""
                }
            ),
            Self::LooksLikeMetres {
                travel_mm,
                limit_mm,
            } => write!(
                f,
                "it moves {} mm in all, less than a thousandth of the axis' travel of {} mm: this looks like metres in a \
                 column named _mm. A motion that is so small must be given in metres",
                Brief(*travel_mm),
                Brief(*limit_mm)
            ),
            Self::Still { travel_mm, counts } => write!(
                f,
                "it moves {} mm in all, {} counts of the encoder; a motion takes at least 10 counts",
                Brief(*travel_mm),
                Brief(*counts)
            ),
            Self::Disagrees {
                travel_mm,
                reference_mm,
            } => write!(
                f,
                "it moves {} mm, the reference {} mm; one of the two columns is not in the unit of its name",
                Brief(*travel_mm),
                Brief(*reference_mm)
            ),
        }
    }
}

/// Oddity of a record that can be true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RecordWarning {
    /// The measured position runs ahead of the reference: the two columns may be swapped.
    PositionLeads {
        /// Lead of the position, s.
        lead_s: f64,
    },
}

impl fmt::Display for RecordWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PositionLeads { lead_s } => write!(
                f,
                "the position runs {} ms ahead of the reference; are the two columns swapped?",
                Brief(lead_s * 1e3)
            ),
        }
    }
}

/// The number of further faults of a kind, where there are any.
struct Others(usize);

impl fmt::Display for Others {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => Ok(()),
            others => write!(f, " (and {others} more)"),
        }
    }
}
