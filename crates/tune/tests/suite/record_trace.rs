//! Traces are written so that nothing is lost.

use quadrant_tune::record::{AxisLimits, Record, TraceError, write_trace};

#[test]
fn a_trace_is_read_back_bit_for_bit() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("run.csv");
    let time: Vec<f64> = (0..5000).map(|i| f64::from(i) * 1e-4).collect();
    let reference: Vec<f64> = time.iter().map(|t| 30.0 * (0.5 * t).sin()).collect();
    write_trace(&path, &[("t_s", &time), ("reference_mm", &reference)]).unwrap();
    let limits = AxisLimits {
        travel_mm: 100.0,
        max_velocity_mm_s: 100.0,
        max_acceleration_mm_s2: 1000.0,
        resolution_mm: 5e-4,
    };
    let record = Record::read(&path, &limits).unwrap();
    assert_eq!((record.time_s, record.reference_mm), (time, reference));
}

#[test]
fn columns_of_unequal_length_are_refused_before_a_file_is_made() {
    let folder = tempfile::TempDir::new().unwrap();
    let path = folder.path().join("run.csv");
    let error = write_trace(&path, &[("t_s", &[0.0, 1.0]), ("error_um", &[0.0])]).unwrap_err();
    assert!(
        matches!(&error, TraceError::Length { column, found: 1, expected: 2, .. } if column == "error_um")
    );
    assert!(!path.exists());
}

#[test]
fn a_trace_that_cannot_be_written_is_named() {
    let error = write_trace("no/such/folder/run.csv".as_ref(), &[("t_s", &[0.0])]).unwrap_err();
    assert!(
        error.to_string().contains("no/such/folder/run.csv"),
        "{error}"
    );
}
