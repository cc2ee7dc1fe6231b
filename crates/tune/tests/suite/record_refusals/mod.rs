//! Every kind of wrong file is refused, with the place and the remedy.

mod form;
mod time;
mod units;

use std::fmt::Write as _;

use quadrant_tune::record::{AxisLimits, Record, RecordError};
use tempfile::TempDir;

const LIMITS: AxisLimits = AxisLimits {
    travel_mm: 200.0,
    max_velocity_mm_s: 100.0,
    max_acceleration_mm_s2: 2000.0,
    resolution_mm: 5e-4,
};
const RATE_HZ: f64 = 1000.0;
const ROWS: usize = 4000;

/// A sine of 30 mm and 15 mm/s, tracked with a lag of 5 ms: the reference and the position at `row`, mm.
fn motion(row: usize) -> (f64, f64) {
    let sine = |t: f64| 30.0 * (0.5 * t).sin();
    let t = row as f64 / RATE_HZ;
    (sine(t), sine(t - 0.005))
}

/// A good record; `edit` may spoil the cells (time, reference in metres, position in metres) of each row.
fn record(header: &str, edit: impl Fn(usize, &mut [String; 3])) -> String {
    let mut text = format!("{header}\n");
    for row in 0..ROWS {
        let (reference, position) = motion(row);
        let time = row as f64 / RATE_HZ;
        let mut cells = [
            format!("{time:.4}"),
            format!("{:.8}", reference * 1e-3),
            format!("{:.8}", position * 1e-3),
        ];
        edit(row, &mut cells);
        writeln!(text, "{}", cells.join(",")).unwrap();
    }
    text
}

const HEADER: &str = "t_s,reference_m,position_m";

fn good() -> String {
    record(HEADER, |_, _| ())
}

fn read_with(text: &str, limits: &AxisLimits) -> Result<Record, RecordError> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("motion.csv");
    std::fs::write(&path, text).unwrap();
    Record::read(&path, limits)
}

fn read(text: &str) -> Result<Record, RecordError> {
    read_with(text, &LIMITS)
}

/// The refusal, whose message must hold all of `words`, the file's name among them.
fn refusal(text: &str, words: &[&str]) -> RecordError {
    let error = read(text).expect_err("the file is wrong");
    let message = error.to_string();
    for word in words.iter().chain(&["motion.csv"]) {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
    error
}
