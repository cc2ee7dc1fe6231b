//! Recorded motion: read from CSV, checked, in millimetres; and the traces of our own runs, written as CSV.
//!
//! A record that is not what it claims to be drives an axis into its stop, or makes a comparison worthless without anyone
//! noticing. So [`Record::read`] refuses every file it has reason to doubt, and says which line, which column, which value,
//! and what would be accepted.
//!
//! | column | unit | |
//! |---|---|---|
//! | `t_s` | s | uniform, 100 Hz to 100 kHz |
//! | `reference_m` or `reference_mm` | m or mm | the motion asked for |
//! | `position_m` or `position_mm` | m or mm | optional: the motion measured |
//! | `voltage_v` | V | optional: the controller's output |
//! | `injection_v` | V | optional, of an experiment: the part of the voltage that was injected |
//! | `part` | 1 | optional, of an experiment: another number from where the recording was stopped and begun again |
//!
//! Other columns are passed over, and the order is free. A recorded force ([`ForceRecord`]) has `t_s` and at least one of
//! `force_x_n`, `force_y_n`, `force_z_n`, in N.

mod columns;
mod error;
mod force;
mod foreign;
mod jump;
mod limits;
mod lines;
mod motion;
mod plausible;
mod recording;
mod time;
mod trace;

pub use error::{RecordError, RecordWarning, TimeFault, UnitFault, UnusableSignal};
pub use force::ForceRecord;
pub use foreign::{ColumnNames, NumberTable};
pub use limits::AxisLimits;
pub use motion::Record;
pub use recording::{MotionOptions, Recording};
pub use trace::{TraceError, write_trace};
