//! Recordings of experiments: in memory, and as CSV files, which are checked when they are read.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::columns::{self, Columns, Purpose};
use super::error::{RecordError, UnusableSignal};
use super::foreign::{self, ColumnNames};
use super::time::Grid;
use super::trace::{TraceError, write_trace};
use super::{jump, plausible, time};

/// Largest voltage of an amplifier's input, V.
const MOST_VOLTS: f64 = 20.0;
/// Smallest voltage that moves an axis with friction, V: some 30 steps of a 16-bit converter.
const LEAST_VOLTS: f64 = 0.01;
/// Longest travel of a machine's axis, mm.
const MOST_TRAVEL_MM: f64 = 1e4;
/// Usual limit of an amplifier's input, V.
const LIMIT_V: f64 = 10.0;
/// Largest share of rows that may lie there.
const MOST_SATURATED: f64 = 0.01;

/// The signals of one experiment on one axis, sampled evenly. All columns have one length.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Recording {
    /// Time from one sample to the next, s.
    pub sample_time_s: f64,
    /// Position asked for, mm; the measured position in open loop.
    pub reference_mm: Vec<f64>,
    /// Position measured at the beginning of the sample's period, mm.
    pub position_mm: Vec<f64>,
    /// Voltage commanded at the amplifier's input, held over the sample's period, V; injection included.
    pub voltage_v: Vec<f64>,
    /// The part of it that was injected, V.
    pub injection_v: Vec<f64>,
    /// First sample of each part after the first, in order: between parts nothing was recorded, and the axis may have moved.
    #[serde(default)]
    pub parts: Vec<usize>,
}

/// Ways of reading a recorded motion.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionOptions {
    /// The columns, where they do not have the names of ours.
    pub columns: ColumnNames,
    /// Uneven steps of time are interpolated.
    pub resample: bool,
}

/// The units that columns are in, as far as their ranges show.
#[derive(Clone, Copy)]
struct Believed {
    /// Positions are lengths.
    length: bool,
    /// Voltages are those of an amplifier's input.
    voltage: bool,
}

impl Believed {
    const ALL: Self = Self {
        length: true,
        voltage: true,
    };
}

impl Recording {
    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.position_mm.len()
    }

    /// True if nothing was recorded.
    pub fn is_empty(&self) -> bool {
        self.position_mm.is_empty()
    }

    /// Returns its duration, s.
    pub fn duration_s(&self) -> f64 {
        self.len() as f64 * self.sample_time_s
    }

    /// The samples of a range.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let cut = |signal: &[f64]| signal[range.clone()].to_vec();
        Self {
            sample_time_s: self.sample_time_s,
            reference_mm: cut(&self.reference_mm),
            position_mm: cut(&self.position_mm),
            voltage_v: cut(&self.voltage_v),
            injection_v: cut(&self.injection_v),
            parts: (self.parts.iter())
                .filter(|first| range.start < **first && **first < range.end)
                .map(|first| first - range.start)
                .collect(),
        }
    }

    /// Adds a recording that was begun after this one had ended, of the same sample time.
    pub fn append(&mut self, next: Self) {
        let first = self.len();
        if first > 0 {
            self.parts.push(first);
        }
        self.parts
            .extend(next.parts.iter().map(|part| first + part));
        self.sample_time_s = next.sample_time_s;
        self.reference_mm.extend(next.reference_mm);
        self.position_mm.extend(next.position_mm);
        self.voltage_v.extend(next.voltage_v);
        self.injection_v.extend(next.injection_v);
    }

    /// Checks a recording of which the file is no table, as far as one of any experiment can be checked: columns of one length, a
    /// sample rate of which a machine controls `decimation` times as often at most, positions of an axis and voltages of an
    /// amplifier. `path` is what messages call it.
    ///
    /// # Errors
    /// The first column that is refused, with its value and what is allowed.
    pub fn check(&self, path: &Path, decimation: usize) -> Result<(), RecordError> {
        time::check_rate(path, self.sample_time_s, decimation)?;
        let columns = [
            ("reference_mm", &self.reference_mm),
            ("position_mm", &self.position_mm),
            ("voltage_v", &self.voltage_v),
            ("injection_v", &self.injection_v),
        ];
        for (column, values) in columns {
            let (found, expected) = (values.len(), self.len());
            if found != expected {
                return Err(RecordError::Lengths {
                    path: path.to_owned(),
                    column,
                    found,
                    expected,
                });
            }
            match column {
                "voltage_v" | "injection_v" => {
                    check_voltage(path, column, values)?;
                }
                _ => check_travel(path, column, plausible::range(values))?,
            }
        }
        Ok(())
    }

    /// Writes it as CSV: `t_s`, `reference_mm`, `position_mm`, `voltage_v`, `injection_v`, and `part` where it has several.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), TraceError> {
        let time: Vec<f64> = (0..self.len())
            .map(|index| index as f64 * self.sample_time_s)
            .collect();
        let part: Vec<f64> = (0..self.len())
            .map(|index| self.parts.partition_point(|first| *first <= index) as f64)
            .collect();
        let mut columns: Vec<(&str, &[f64])> = vec![
            ("t_s", &time),
            ("reference_mm", &self.reference_mm),
            ("position_mm", &self.position_mm),
            ("voltage_v", &self.voltage_v),
            ("injection_v", &self.injection_v),
        ];
        if !self.parts.is_empty() {
            columns.push(("part", &part));
        }
        write_trace(path, &columns)
    }

    /// Reads and checks a recorded experiment: `t_s`, `position_m` or `position_mm`, `voltage_v`; optional `reference_m` or
    /// `reference_mm` (else the position stands for it) and `injection_v` (else nothing was injected).
    ///
    /// # Errors
    /// A file that cannot be read, with gaps or uneven time, or whose position or voltage cannot be identified from; names
    /// line or column, the value, and what is allowed.
    pub fn read_csv(path: &Path) -> Result<Self, RecordError> {
        Self::read_csv_with(path, &mut |_| {})
    }

    /// As [`read_csv`](Self::read_csv), for long files: `progress` receives the share that is read, 0 to 1.
    ///
    /// # Errors
    /// As [`read_csv`](Self::read_csv).
    pub fn read_csv_with(path: &Path, progress: &mut dyn FnMut(f64)) -> Result<Self, RecordError> {
        let columns = columns::read(path, Purpose::Experiment, progress)?;
        let sample_time_s = time::check(path, &columns.time, &columns.lines)?;
        Self::checked(path, columns, sample_time_s, Believed::ALL)
    }

    /// Reads and checks a recorded motion as [`read_csv_with`](Self::read_csv_with), and that its position does not jump. Files of
    /// other programs are translated. Uneven steps of time are refused, or interpolated on request. Notes say what was guessed and
    /// done.
    ///
    /// # Errors
    /// As [`read_csv`](Self::read_csv), a column that is not there, and a position that jumps.
    pub fn read_motion(
        path: &Path,
        options: &MotionOptions,
        progress: &mut dyn FnMut(f64),
    ) -> Result<(Self, Vec<String>), RecordError> {
        let unreadable = |source| RecordError::Read {
            path: path.to_owned(),
            source,
        };
        let bytes = std::fs::read(path).map_err(unreadable)?;
        let translated = foreign::translate(path, &bytes, &options.columns)?;
        let (mut columns, mut notes, believed) = match translated {
            None => (
                columns::read_text(path, bytes, 0, Purpose::Experiment, progress)?,
                Vec::new(),
                Believed::ALL,
            ),
            Some(translated) => {
                let believed = Believed {
                    length: !translated.other_length,
                    voltage: !translated.other_voltage,
                };
                let columns = columns::read_text(
                    path,
                    translated.text,
                    translated.added_lines,
                    Purpose::Experiment,
                    progress,
                )?;
                (columns, translated.notes, believed)
            }
        };
        let (sample_time_s, note) = if options.resample {
            let grid = Grid::of(path, &columns.time, &columns.lines)?;
            refuse_jumps(path, &columns)?;
            resample_by(&grid, &mut columns);
            let (shortest_s, longest_s) = grid.steps_s;
            let note = format!(
                "resampled: {} rows in steps of {:.3} to {:.3} ms stand for as many in steps of {:.3} ms ({:.1} Hz), on straight lines \
                 between the rows",
                columns.lines.rows(),
                1e3 * shortest_s,
                1e3 * longest_s,
                1e3 * grid.sample_time_s,
                1.0 / grid.sample_time_s
            );
            (grid.sample_time_s, Some(note))
        } else {
            let sample_time_s = time::check(path, &columns.time, &columns.lines)?;
            refuse_jumps(path, &columns)?;
            (sample_time_s, None)
        };
        notes.extend(note);
        Ok((
            Self::checked(path, columns, sample_time_s, believed)?,
            notes,
        ))
    }

    /// The columns of an even time, if they can be identified from.
    fn checked(
        path: &Path,
        columns: Columns,
        sample_time_s: f64,
        believed: Believed,
    ) -> Result<Self, RecordError> {
        check_changes(path, &columns)?;
        if believed.voltage {
            check_amplifier(path, &columns)?;
        }
        plausible::check_experiment(path, &columns)?;
        if believed.length {
            let travel_mm = columns.position.as_ref().map_or(0.0, plausible::travel_mm);
            check_travel(path, "position", travel_mm)?;
        }
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
            parts: columns
                .part
                .map_or_else(Vec::new, |part| beginnings(&part.values)),
        })
    }
}

/// Places where a column's value differs from the one before.
fn beginnings(part: &[f64]) -> Vec<usize> {
    let differs = |row: &usize| part[row - 1] != part[*row];
    (1..part.len()).filter(differs).collect()
}

fn refuse_jumps(path: &Path, columns: &Columns) -> Result<(), RecordError> {
    match &columns.position {
        Some(position) => jump::refuse(
            path,
            &columns.time.values,
            position,
            columns.part.as_ref(),
            &columns.lines,
        ),
        None => Ok(()),
    }
}

/// Puts every signal on the even times.
fn resample_by(grid: &Grid, columns: &mut Columns) {
    let time_s = &columns.time.values;
    let signals = [
        &mut columns.reference,
        &mut columns.position,
        &mut columns.voltage,
        &mut columns.injection,
    ];
    for column in signals.into_iter().flatten() {
        column.values = grid.resampled(time_s, &column.values);
    }
    if let Some(part) = &mut columns.part {
        part.values = grid.resampled(time_s, &part.values);
        part.values.iter_mut().for_each(|part| *part = part.floor());
    }
}

/// Refuses a position that no axis reaches, even if the reference has it.
fn check_travel(path: &Path, column: &'static str, travel_mm: f64) -> Result<(), RecordError> {
    if travel_mm <= MOST_TRAVEL_MM {
        return Ok(());
    }
    Err(RecordError::Useless {
        path: path.to_owned(),
        column,
        fault: UnusableSignal::FarTravel {
            travel_mm,
            most_mm: MOST_TRAVEL_MM,
        },
    })
}

/// Refuses what no amplifier's input takes; returns the largest magnitude, V.
fn check_voltage(path: &Path, column: &'static str, values: &[f64]) -> Result<f64, RecordError> {
    let largest = values
        .iter()
        .fold(0.0_f64, |most, value| most.max(value.abs()));
    if largest <= MOST_VOLTS {
        return Ok(largest);
    }
    Err(RecordError::Useless {
        path: path.to_owned(),
        column,
        fault: UnusableSignal::NotVoltage { largest },
    })
}

/// Refuses a position or a voltage that never changes.
fn check_changes(path: &Path, columns: &Columns) -> Result<(), RecordError> {
    for (name, column) in [
        ("position", &columns.position),
        ("voltage_v", &columns.voltage),
    ] {
        if let Some(values) = column.as_ref().map(|column| &column.values)
            && let Some(first) = values.first()
            && values.iter().all(|value| value == first)
        {
            return Err(RecordError::Useless {
                path: path.to_owned(),
                column: name,
                fault: UnusableSignal::Constant { value: *first },
            });
        }
    }
    Ok(())
}

/// Refuses a voltage that is none of an amplifier's input, or is at its limit too often.
fn check_amplifier(path: &Path, columns: &Columns) -> Result<(), RecordError> {
    let refuse = |column, fault| {
        Err(RecordError::Useless {
            path: path.to_owned(),
            column,
            fault,
        })
    };
    let Some(voltage) = &columns.voltage else {
        return Ok(());
    };
    let largest = check_voltage(path, "voltage_v", &voltage.values)?;
    if largest < LEAST_VOLTS {
        let least_v = LEAST_VOLTS;
        return refuse(
            "voltage_v",
            UnusableSignal::FaintVoltage { largest, least_v },
        );
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
            UnusableSignal::Saturated {
                percent: 100.0 * share,
                limit_v: LIMIT_V,
                line: columns.lines.line(first),
            },
        ),
        _ => Ok(()),
    }
}
