//! Recorded experiments from CSV files.

use std::path::Path;

use super::columns::{self, Columns, Purpose};
use super::{RecordError, UselessFault, plausible, time};
use crate::rig::Recording;

/// Largest voltage of an amplifier's input, V.
const MOST_VOLTS: f64 = 20.0;
/// The usual limit of an amplifier's input, V, and the share of rows that may lie there.
const LIMIT_V: f64 = 10.0;
const MOST_SATURATED: f64 = 0.01;

impl Recording {
    /// Reads and checks a recorded experiment: `t_s`, `position_m` or `position_mm`, `voltage_v`; optional `reference_m` or
    /// `reference_mm` (else the position stands for it) and `injection_v` (else nothing was injected).
    ///
    /// # Errors
    /// A file that cannot be read, with gaps or uneven time, or whose position or voltage cannot be identified from; names
    /// line or column, the value, and what is allowed.
    pub fn read_csv(path: impl AsRef<Path>) -> Result<Self, RecordError> {
        Self::read_csv_with(path, &mut |_| {})
    }

    /// As [`read_csv`](Self::read_csv), for long files: `progress` is told the share that is read, 0 to 1.
    ///
    /// # Errors
    /// As [`read_csv`](Self::read_csv).
    pub fn read_csv_with(
        path: impl AsRef<Path>,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Self, RecordError> {
        let path = path.as_ref();
        let columns = columns::read(path, Purpose::Experiment, progress)?;
        let sample_time_s = time::check(path, &columns.time)?;
        check(path, &columns)?;
        plausible::check_experiment(path, &columns)?;
        // A long recording need not hold its time as well.
        drop(columns.time);
        let position_mm = columns
            .position
            .map_or_else(Vec::new, columns::Column::into_mm);
        let voltage_v = columns
            .voltage
            .map_or_else(Vec::new, |column| column.values);
        let rows = position_mm.len();
        Ok(Self {
            sample_time_s,
            reference_mm: columns
                .reference
                .map_or_else(|| position_mm.clone(), columns::Column::into_mm),
            injection_v: columns
                .injection
                .map_or_else(|| vec![0.0; rows], |column| column.values),
            position_mm,
            voltage_v,
        })
    }
}

fn check(path: &Path, columns: &Columns) -> Result<(), RecordError> {
    let refuse = |column, fault| {
        Err(RecordError::Useless {
            path: path.to_owned(),
            column,
            fault,
        })
    };
    for (name, column) in [
        ("position", &columns.position),
        ("voltage_v", &columns.voltage),
    ] {
        if let Some(values) = column.as_ref().map(|column| &column.values)
            && let Some(first) = values.first()
            && values.iter().all(|value| value == first)
        {
            return refuse(name, UselessFault::Constant { value: *first });
        }
    }
    let Some(voltage) = &columns.voltage else {
        return Ok(());
    };
    let largest = voltage
        .values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    if largest > MOST_VOLTS {
        return refuse("voltage_v", UselessFault::NotVoltage { largest });
    }
    let at_limit = |value: &f64| value.abs() >= 0.9999 * LIMIT_V;
    let saturated = voltage
        .values
        .iter()
        .filter(|value| at_limit(value))
        .count();
    let share = saturated as f64 / voltage.values.len() as f64;
    match voltage.values.iter().position(at_limit) {
        Some(first) if share > MOST_SATURATED => refuse(
            "voltage_v",
            UselessFault::Saturated {
                percent: 100.0 * share,
                limit_v: LIMIT_V,
                line: voltage.line(first),
            },
        ),
        _ => Ok(()),
    }
}
