//! The recording of a real machine, which is not part of the project, is read as its authors describe it.

use std::path::{Path, PathBuf};

use quadrant_tune::record::{AxisLimits, Record, RecordError};

const LIMITS: AxisLimits = AxisLimits {
    travel_mm: 400.0,
    max_velocity_mm_s: 250.0,
    max_acceleration_mm_s2: 5000.0,
    resolution_mm: 5e-5,
};

/// The recording, or `None`, with a word on it, where it was not laid beside the project.
fn recording() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/emps/emps.csv");
    if path.exists() {
        return Some(path);
    }
    println!(
        "SKIPPED: the EMPS recording is not at ../shared/data/emps/emps.csv beside the project"
    );
    None
}

#[test]
fn the_emps_recording_is_read_whole() {
    let Some(path) = recording() else { return };
    let record = Record::read(&path, &LIMITS).unwrap();
    assert_eq!(record.reference_mm.len(), 24_841);
    assert!((record.sample_time_s - 1e-3).abs() < 1e-9);
    assert!((record.reference_mm[0] - 0.107_822_08).abs() < 1e-12);
    assert_eq!(record.doubts, []);
    let (position, voltage) = (record.position_mm.unwrap(), record.voltage_v.unwrap());
    assert_eq!((position.len(), voltage.len()), (24_841, 24_841));
    assert!(voltage.iter().all(|v| v.abs() <= 10.0));
    // The loop's position gain is 160.18 1/s: the error is the velocity over it.
    let largest = record
        .reference_mm
        .iter()
        .zip(&position)
        .fold(0.0_f64, |max, (r, p)| max.max((r - p).abs()));
    assert!((0.7..0.9).contains(&largest), "largest error {largest} mm");
}

#[test]
fn the_emps_recording_is_refused_under_other_names() {
    let Some(path) = recording() else { return };
    let text = std::fs::read_to_string(path).unwrap();
    let folder = tempfile::TempDir::new().unwrap();
    let renamed = |old: &str, new: &str| -> Result<Record, RecordError> {
        let path = folder.path().join("renamed.csv");
        std::fs::write(&path, text.replacen(old, new, 1)).unwrap();
        Record::read(&path, &LIMITS)
    };
    let message = renamed("position_m,reference_m", "position_mm,reference_mm")
        .unwrap_err()
        .to_string();
    assert!(message.contains("looks like metres"), "{message}");
    let swapped = renamed("position_m,reference_m", "reference_m,position_m").unwrap();
    assert_eq!(swapped.doubts.len(), 1);
}
