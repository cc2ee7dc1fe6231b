//! Columns, cells and rows.

use std::fmt::Write as _;

use quadrant_tune::record::{Record, RecordError};

use super::{HEADER, LIMITS, RATE_HZ, ROWS, good, motion, read, record, refusal};

#[test]
fn a_good_record_is_read_in_millimetres() {
    let record = read(&good()).unwrap();
    assert!((record.sample_time_s - 1e-3).abs() < 1e-12);
    assert_eq!(
        (record.time_s.len(), record.reference_mm.len()),
        (ROWS, ROWS)
    );
    let position = record.position_mm.unwrap();
    for row in [0, 1234, ROWS - 1] {
        assert!((record.reference_mm[row] - motion(row).0).abs() < 1e-5);
        assert!((position[row] - motion(row).1).abs() < 1e-5);
    }
    assert_eq!((record.voltage_v, record.doubts), (None, vec![]));
}

#[test]
fn columns_in_millimetres_other_columns_and_any_order_are_accepted() {
    let mut text = "note,reference_mm, t_s ,voltage_v\r\n".to_owned();
    for row in 0..ROWS {
        write!(
            text,
            "\"a, b\",{},{},0.5\r\n",
            motion(row).0,
            row as f64 / RATE_HZ
        )
        .unwrap();
    }
    let record = read(&text).unwrap();
    assert_eq!(record.reference_mm[100], motion(100).0);
    assert_eq!(
        (record.position_mm, record.voltage_v.unwrap().len()),
        (None, ROWS)
    );
}

#[test]
fn a_byte_order_mark_is_no_part_of_the_first_name() {
    assert!(read(&format!("\u{feff}{}", good())).is_ok());
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = Record::read("no/such/file.csv".as_ref(), &LIMITS).unwrap_err();
    assert!(error.to_string().contains("no/such/file.csv"), "{error}");
}

#[test]
fn missing_columns_are_listed_beside_those_found() {
    refusal(
        &record("t_s,target,position_m", |_, _| ()),
        &["reference_m (or reference_mm)", "t_s, target, position_m"],
    );
    refusal(
        &record("time,reference_m,position_m", |_, _| ()),
        &["no column t_s", "time, reference_m"],
    );
    // What would colour a terminal is shown, and does not.
    let text = good().replacen("t_s", "\u{1b}[31mt_s\u{1b}[0m", 1);
    let error = refusal(&text, &["t_s", "\\u{1b}[31m"]);
    assert!(!error.to_string().contains('\u{1b}'), "{error}");
    refusal("", &["no header"]);
}

#[test]
fn other_separators_and_missing_headers_are_recognised() {
    refusal(&good().replace(',', ";"), &["separated by commas"]);
    refusal(
        good().split_once('\n').unwrap().1,
        &["first line must name the columns"],
    );
}

#[test]
fn two_columns_for_one_quantity_are_refused() {
    let error = refusal(
        &record("t_s,reference_m,reference_mm", |_, _| ()),
        &["reference_m and reference_mm"],
    );
    assert!(matches!(error, RecordError::AmbiguousColumn { .. }));
    refusal(
        &record("t_s,reference_m,reference_m", |_, _| ()),
        &["keep one"],
    );
}

#[test]
fn a_cell_that_is_no_number_is_named_with_line_and_column() {
    let spoilt = record(HEADER, |row, cells| {
        if row == 41 {
            cells[2] = "12,5 mm".replace(',', ".");
        }
    });
    let error = refusal(
        &spoilt,
        &[
            "line 43",
            "column position_m",
            "\"12.5 mm\"",
            "a number such as",
        ],
    );
    assert!(matches!(error, RecordError::Cell { line: 43, .. }));
    let empty = record(HEADER, |row, cells| {
        if row == 0 {
            cells[1].clear();
        }
    });
    refusal(&empty, &["line 2", "column reference_m", "\"\""]);
}

#[test]
fn nan_and_infinities_are_refused_in_every_column() {
    for (column, name) in ["t_s", "reference_m", "position_m"].into_iter().enumerate() {
        for value in ["NaN", "inf", "-Infinity"] {
            let spoilt = record(HEADER, |row, cells| {
                if row == 7 {
                    cells[column] = value.to_owned();
                }
            });
            refusal(
                &spoilt,
                &["line 9", &format!("column {name}"), value, "finite"],
            );
        }
    }
}

#[test]
fn lines_are_those_of_an_editor_even_after_blank_ones() {
    let mut lines: Vec<String> = good().lines().map(str::to_owned).collect();
    lines[500].push('x');
    lines.insert(200, String::new());
    refusal(&lines.join("\n"), &["line 502", "position_m"]);
}

#[test]
fn rows_of_another_length_are_refused() {
    refusal(
        &good().replacen("\n0.0030,", "\n0.0030,1,", 1),
        &["line 5 has 4 cells", "header has 3"],
    );
}

#[test]
fn too_few_rows_are_counted() {
    let short: String = good()
        .lines()
        .take(11)
        .map(|line| format!("{line}\n"))
        .collect();
    let error = refusal(&short, &["10 rows", "at least 16"]);
    assert!(matches!(error, RecordError::TooFewRows { rows: 10, .. }));
    refusal(HEADER, &["0 rows"]);
}
