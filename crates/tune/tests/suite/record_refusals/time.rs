//! Refusals for the time column.

use quadrant_tune::record::{RecordError, TimeFault};

use super::{HEADER, good, read, record, refusal};

fn with_time(at: usize, time: f64) -> String {
    record(HEADER, |row, cells| {
        if row == at {
            cells[0] = format!("{time:.4}");
        }
    })
}

#[test]
fn time_must_run_evenly() {
    let error = refusal(
        &with_time(100, 0.099),
        &["line 102", "0.099 s", "repeats the row before"],
    );
    assert!(matches!(
        error,
        RecordError::Time {
            fault: TimeFault::Repeated,
            ..
        }
    ));
    refusal(
        &with_time(100, 0.05),
        &["line 102", "0.05 s", "comes after 0.099 s"],
    );
    refusal(
        &with_time(100, 0.1003),
        &["line 102", "0.0013 s after", "0.001 s", "1 %"],
    );
}

#[test]
fn rows_that_are_missing_are_found() {
    let lines: Vec<String> = good()
        .lines()
        .enumerate()
        .filter(|(i, _)| !(1000..1010).contains(i))
        .map(|(_, l)| l.to_owned())
        .collect();
    let error = refusal(
        &lines.join("\n"),
        &["line 1001", "0.011 s after", "rows are missing"],
    );
    assert!(matches!(
        error,
        RecordError::Time {
            fault: TimeFault::Step { .. },
            ..
        }
    ));
}

#[test]
fn times_rounded_by_the_recorder_are_accepted() {
    let record = read(&record(HEADER, |row, cells| {
        cells[0] = format!("{:.6}", row as f64 / 3000.0)
    }))
    .unwrap();
    assert!((record.sample_time_s - 1.0 / 3000.0).abs() < 1e-9);
}

#[test]
fn milliseconds_labelled_seconds_are_recognised() {
    let spoilt = record(HEADER, |row, cells| cells[0] = format!("{row}"));
    let error = refusal(
        &spoilt,
        &[
            "sample time is 1 s",
            "1 Hz",
            "100 Hz to 100 kHz",
            "looks like milliseconds",
        ],
    );
    assert!(matches!(error, RecordError::SampleRate { .. }));
}

#[test]
fn sample_rates_that_no_unit_explains_get_no_guess() {
    let slow = record(HEADER, |row, cells| cells[0] = format!("{}", row * 1000));
    assert!(
        !refusal(&slow, &["1000 s"])
            .to_string()
            .contains("looks like")
    );
    refusal(
        &record(HEADER, |row, cells| {
            cells[0] = format!("{:.9}", row as f64 * 1e-6)
        }),
        &["1000000 Hz"],
    );
}
