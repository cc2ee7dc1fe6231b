//! Errors of a fit to a motion record.

use crate::identify::fit::FitError;
use crate::identify::setting::SettingError;

/// Reasons for which a record yields no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionFitError {
    /// A setting that cannot be.
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(
        "{rows} rows are left of the record, and a fit takes {LEAST_ROWS}: record longer, raise the row rate, or cut less at the edges"
    )]
    TooShort { rows: usize },
    /// The voltage is zero throughout.
    #[error("the voltage is zero throughout: is it the column of the motor's voltage or force?")]
    NoVoltage,
    /// It moves one way only.
    #[error(
        "only {percent:.1} % of the record moves in one of the directions: friction and offset cannot be separated without motion both \
         ways, {LEAST_PERCENT} % at least"
    )]
    OneWay { percent: f64 },
    /// It holds too little of something.
    #[error(
        "the record does not separate the parameters of \"{structure}\": it needs several velocities, accelerations and reversals"
    )]
    Dependent { structure: String },
    /// The fit makes no sense of mass or friction.
    #[error(
        "the fit of \"{structure}\" gives {name} = {value:.3e} {unit}, and so does every other: are position and voltage of the same axis, and the voltage positive \
         towards larger positions?"
    )]
    Unphysical {
        structure: String,
        name: String,
        value: f64,
        unit: &'static str,
    },
    #[error(transparent)]
    Fit(#[from] FitError),
}

pub(super) const LEAST_ROWS: usize = 200;
/// Share of the rows that must move each way, %.
pub(super) const LEAST_PERCENT: f64 = 5.0;
