//! A measured frequency response: what `identify frf` leaves, and what fits and designs read.

use std::path::Path;

use num_complex::Complex64;

use super::measured_table::{Columns, TableError};

/// One line of a measured frequency response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResponsePoint {
    /// Frequency, Hz; above zero.
    pub frequency_hz: f64,
    /// Position over voltage, mm/V.
    pub response: Complex64,
    /// Magnitude-squared coherence, 0..=1: the share of the position's power that the voltage explains linearly.
    pub coherence: f64,
    /// Standard deviation of the response over its magnitude, in each of its two components.
    pub relative_deviation: f64,
}

/// A measured frequency response of an axis, position over amplifier voltage, at ascending frequencies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrequencyResponse {
    pub points: Vec<ResponsePoint>,
}

const COLUMNS: Columns<5> = Columns {
    what: "a frequency response",
    names: &[
        "frequency_hz",
        "gain_mm_per_v",
        "phase_deg",
        "coherence",
        "relative_deviation",
    ],
    expected: [
        "a frequency above that of the row before",
        "a number above zero",
        "a finite number",
        "a number from 0 to 1",
        "a number of zero or more",
    ],
};

/// Fewest lines of a response.
const MIN_POINTS: usize = 8;

impl FrequencyResponse {
    /// Writes it as CSV: `frequency_hz`, `gain_mm_per_v`, `phase_deg` (unwrapped from the lowest frequency on),
    /// `coherence`, `relative_deviation`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), TableError> {
        let points = self.points.iter().zip(self.phase_deg());
        let row = |(point, phase_deg): (&ResponsePoint, f64)| {
            [
                point.frequency_hz,
                point.response.norm(),
                phase_deg,
                point.coherence,
                point.relative_deviation,
            ]
        };
        COLUMNS.write(path, points.map(row))
    }

    /// Reads what [`write_csv`](Self::write_csv) writes; the order of the columns is free, others are passed over.
    ///
    /// # Errors
    /// A file that cannot be read or is not a frequency response; names the row and the column.
    pub fn read_csv(path: &Path) -> Result<Self, TableError> {
        let rows = COLUMNS.read(path, |column, value, before| match column {
            0 => value > before.map_or(0.0, |row| row[0]),
            1 => value > 0.0,
            3 => (0.0..=1.0).contains(&value),
            4 => value >= 0.0,
            _ => true,
        })?;
        if rows.len() < MIN_POINTS {
            return Err(TableError::TooShort {
                path: path.to_owned(),
                rows: rows.len(),
                what: COLUMNS.what,
                least: MIN_POINTS,
            });
        }
        let point = |[frequency_hz, gain, phase_deg, coherence, relative_deviation]: [f64; 5]| {
            ResponsePoint {
                frequency_hz,
                response: Complex64::from_polar(gain, phase_deg.to_radians()),
                coherence,
                relative_deviation,
            }
        };
        Ok(Self {
            points: rows.into_iter().map(point).collect(),
        })
    }

    /// The phase of each line, deg, without jumps of a whole turn; the first within -360..=0.
    pub fn phase_deg(&self) -> Vec<f64> {
        let mut last: Option<f64> = None;
        self.points
            .iter()
            .map(|point| {
                let wrapped = point.response.arg().to_degrees();
                let near = last.unwrap_or(-180.0);
                let phase = wrapped + 360.0 * ((near - wrapped) / 360.0).round();
                last = Some(phase);
                phase
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn double_integrator_with_delay() -> FrequencyResponse {
        let point = |index: u32| {
            let frequency_hz = 1.0 + f64::from(index) * 10.0;
            let omega = std::f64::consts::TAU * frequency_hz;
            ResponsePoint {
                frequency_hz,
                response: -Complex64::from_polar(7e4 / (omega * omega), -omega * 5e-3),
                coherence: 0.97,
                relative_deviation: 0.01,
            }
        };
        FrequencyResponse {
            points: (0..40).map(point).collect(),
        }
    }

    #[test]
    fn what_is_written_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frf.csv");
        let written = double_integrator_with_delay();
        written.write_csv(&path).unwrap();
        let read = FrequencyResponse::read_csv(&path).unwrap();
        for (a, b) in written.points.iter().zip(&read.points) {
            assert_eq!(a.frequency_hz, b.frequency_hz);
            assert!((a.response - b.response).norm() < 1e-12 * a.response.norm());
        }
    }

    #[test]
    fn the_phase_has_no_jumps() {
        let phase = double_integrator_with_delay().phase_deg();
        assert!((phase[0] + 180.0 + 360.0 * 5e-3).abs() < 1e-6);
        assert!(
            phase
                .windows(2)
                .all(|pair| pair[1] < pair[0] && pair[1] > pair[0] - 20.0)
        );
    }

    #[test]
    fn a_wrong_value_is_named_with_its_row_and_column() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("frf.csv");
        std::fs::write(
            &path,
            "frequency_hz,gain_mm_per_v,phase_deg,coherence,relative_deviation\n1,2,-90,0.9,0.1\n2,2,-90,1.5,0.1\n",
        )
        .unwrap();
        let message = FrequencyResponse::read_csv(&path).unwrap_err().to_string();
        assert!(message.ends_with("row 2, column coherence: \"1.5\" is not a number from 0 to 1"));
    }
}
