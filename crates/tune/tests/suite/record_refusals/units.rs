//! Units, and what an axis can do.

use quadrant_tune::record::{AxisLimits, RecordError, RecordWarning, UnitFault};

use super::{HEADER, LIMITS, RATE_HZ, good, motion, read, read_with, record, refusal};

#[test]
fn millimetres_labelled_metres_are_recognised() {
    let spoilt = record(HEADER, |row, cells| {
        let (reference, position) = motion(row);
        cells[1] = reference.to_string();
        cells[2] = position.to_string();
    });
    let error = refusal(
        &spoilt,
        &[
            "column reference_m",
            "travel",
            "200 mm",
            "looks like millimetres in a column named _m",
        ],
    );
    assert!(matches!(
        error,
        RecordError::Unit {
            fault: UnitFault::Exceeds {
                looks_like_mm: true,
                ..
            },
            ..
        }
    ));
}

#[test]
fn metres_labelled_millimetres_are_recognised() {
    let error = refusal(
        &record("t_s,reference_mm,position_mm", |_, _| ()),
        &["reference_mm", "looks like metres"],
    );
    assert!(matches!(
        error,
        RecordError::Unit {
            fault: UnitFault::LooksLikeMetres { .. },
            ..
        }
    ));
}

#[test]
fn one_column_of_two_in_another_unit_is_recognised() {
    let spoilt = record(HEADER, |row, cells| cells[2] = motion(row).1.to_string());
    refusal(
        &spoilt,
        &["column position_m", "not in the unit of its name"],
    );
    refusal(
        &record("t_s,reference_m,position_mm", |_, _| ()),
        &["column position_mm", "not in the unit of its name"],
    );
}

#[test]
fn a_presliding_motion_in_metres_is_accepted() {
    let text = record("t_s,reference_m,voltage_v", |row, cells| {
        cells[1] = format!("{:.9}", 1e-5 * (0.6 * row as f64 / RATE_HZ).sin());
    });
    let record = read(&text).unwrap();
    assert!(record.reference_mm.iter().all(|mm| mm.abs() <= 0.010_001));
}

#[test]
fn a_reference_that_stands_still_is_refused() {
    let error = refusal(
        &record(HEADER, |_, cells| cells[1] = "0.1".into()),
        &["reference_m", "0 counts", "at least 10"],
    );
    assert!(matches!(
        error,
        RecordError::Unit {
            fault: UnitFault::Still { .. },
            ..
        }
    ));
}

#[test]
fn what_the_axis_cannot_do_is_refused_without_a_guess_at_units() {
    let far = AxisLimits {
        travel_mm: 50.0,
        ..LIMITS
    };
    let fast = AxisLimits {
        max_velocity_mm_s: 14.0,
        ..LIMITS
    };
    let message = read_with(&good(), &fast).unwrap_err().to_string();
    assert!(
        message.contains("speed is 15 mm/s, the axis allows 14 mm/s"),
        "{message}"
    );
    // 1 mm at 10 Hz: 63 mm/s and 3948 mm/s^2, of which a window of 5 ms sees nearly all.
    let hard = record("t_s,reference_mm,voltage_v", |row, cells| {
        cells[1] = (std::f64::consts::TAU * 10.0 * row as f64 / RATE_HZ)
            .sin()
            .to_string();
    });
    refusal(&hard, &["acceleration is 3", "allows 2000 mm/s²"]);
    // In millimetres no factor of a thousand is to be suspected.
    let text = record("t_s,reference_mm,voltage_v", |row, cells| {
        cells[1] = (2.0 * motion(row).0).to_string();
    });
    let message = read_with(&text, &far).unwrap_err().to_string();
    assert!(
        message.contains("travel is 60 mm") && !message.contains("looks like"),
        "{message}"
    );
}

#[test]
fn a_reference_in_whole_counts_is_not_taken_for_a_hard_one() {
    let text = record("t_s,reference_mm,voltage_v", |row, cells| {
        cells[0] = format!("{:.4}", row as f64 * 1e-4);
        cells[1] = ((30.0 * (0.5 * row as f64 * 1e-4).sin() / 5e-4).round() * 5e-4).to_string();
    });
    let limits = AxisLimits {
        max_velocity_mm_s: 16.0,
        max_acceleration_mm_s2: 50.0,
        ..LIMITS
    };
    read_with(&text, &limits).unwrap();
}

#[test]
fn swapped_columns_raise_a_doubt() {
    let record = read(&record("t_s,position_m,reference_m", |_, _| ())).unwrap();
    let [RecordWarning::PositionLeads { lead_s }] = record.doubts[..] else {
        panic!("{:?}", record.doubts)
    };
    assert!((lead_s - 0.005).abs() < 1e-4, "{lead_s}");
}
