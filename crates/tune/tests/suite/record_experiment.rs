//! Recorded experiments: what is read, and what is refused and why.

use std::fs;

use quadrant_tune::record::Recording;

fn read(text: &str) -> Result<Recording, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.csv");
    fs::write(&path, text).unwrap();
    Recording::read_csv(&path).map_err(|error| {
        let message = error.to_string();
        message.split_once("record.csv").unwrap().1.to_owned()
    })
}

/// Forty rows at 1 kHz; `row` gives position and voltage.
fn table(row: impl Fn(f64) -> (f64, f64)) -> String {
    let rows: String = (0..40)
        .map(|index| {
            let (position, voltage) = row(f64::from(index));
            format!("{},{position},{voltage}\n", 1e-3 * f64::from(index))
        })
        .collect();
    format!("t_s,position_mm,voltage_v\n{rows}")
}

fn motion(index: f64) -> (f64, f64) {
    (1e-3 * (0.3 * index).sin(), 0.1 * (0.3 * index).cos())
}

#[test]
fn a_recording_reads_back_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.csv");
    let signal = |scale: f64| {
        (0..50)
            .map(|k| scale * f64::from(k * k))
            .collect::<Vec<_>>()
    };
    let written = Recording {
        sample_time_s: 1e-4,
        reference_mm: signal(0.1),
        position_mm: signal(0.2),
        voltage_v: signal(1e-3),
        injection_v: signal(2e-3),
        parts: vec![20, 21],
    };
    written.write_csv(&path).unwrap();
    let read = Recording::read_csv(&path).unwrap();
    assert!((read.sample_time_s - written.sample_time_s).abs() < 1e-15);
    assert_eq!(
        Recording {
            sample_time_s: written.sample_time_s,
            ..read
        },
        written
    );
}

#[test]
fn without_reference_and_injection_the_position_and_zero_stand_for_them() {
    let recording = read(&table(motion)).unwrap();
    assert_eq!(recording.reference_mm, recording.position_mm);
    assert!(recording.injection_v.iter().all(|v| *v == 0.0));
}

#[test]
fn a_position_or_voltage_that_never_changes_is_refused() {
    let still = read(&table(|index| (0.5, motion(index).1))).unwrap_err();
    assert_eq!(
        still,
        ", column position: it is 0.5 in every row; an experiment needs a signal that moves"
    );
    let dead = read(&table(|index| (motion(index).0, 0.0))).unwrap_err();
    assert!(
        dead.starts_with(", column voltage_v: it is 0 in every row"),
        "{dead}"
    );
}

#[test]
fn a_saturated_voltage_is_refused_with_its_share() {
    let clipped = |index: f64| {
        (
            motion(index).0,
            (30.0 * (0.3 * index).cos()).clamp(-10.0, 10.0),
        )
    };
    let message = read(&table(clipped)).unwrap_err();
    assert!(
        message.contains("% of the rows, from line 2 on, are at the amplifier's limit of 10 V"),
        "{message}"
    );
}

#[test]
fn position_and_voltage_that_were_swapped_are_noticed() {
    let swapped = |index: f64| (motion(index).1, 120.0 * (0.1 * index).sin());
    let message = read(&table(swapped)).unwrap_err();
    assert!(
        message.contains("is it swapped with the position?"),
        "{message}"
    );
}

#[test]
fn a_gap_in_time_is_named_with_its_line() {
    let whole = table(motion);
    let gap: String = whole
        .lines()
        .enumerate()
        .filter(|(line, _)| !(20..25).contains(line))
        .map(|(_, text)| format!("{text}\n"))
        .collect();
    let message = read(&gap).unwrap_err();
    assert!(
        message.contains("line 21") && message.contains("rows are missing"),
        "{message}"
    );
}

#[test]
fn milliseconds_in_the_time_column_are_noticed() {
    let milliseconds: String = std::iter::once("t_s,position_mm,voltage_v\n".to_owned())
        .chain((0..40).map(|index| {
            let (position, voltage) = motion(f64::from(index));
            format!("{index},{position},{voltage}\n")
        }))
        .collect();
    let message = read(&milliseconds).unwrap_err();
    assert!(message.contains("milliseconds"), "{message}");
}

#[test]
fn a_missing_column_is_named() {
    let message = read("t_s,position_mm\n0,1\n").unwrap_err();
    assert!(message.starts_with(": no column voltage_v"), "{message}");
}
