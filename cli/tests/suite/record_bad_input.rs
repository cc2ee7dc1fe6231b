//! Recordings that are spoilt, through the commands: each is refused with its place and a remedy, none is identified from.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::LazyLock;

use proptest::prelude::*;
use quadrant_tune::record::Recording;
use tempfile::TempDir;

use crate::command;

/// Runs `quadrant identify`; what it said, and whether it succeeded.
fn identify(folder: &Path, arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_quadrant"))
        .arg("identify")
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.success(), message)
}

/// A good recording of a frequency response, its header and rows.
struct Good {
    folder: TempDir,
    header: String,
    rows: Vec<String>,
}

static GOOD: LazyLock<Good> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let (done, message) = identify(
        folder.path(),
        &["frf", "--axis", "x", "--averages", "4", "--out", "m"],
    );
    assert!(done, "{message}");
    let text = std::fs::read_to_string(folder.path().join("m/frf-recording-1.csv")).unwrap();
    let mut lines = text.lines().map(str::to_owned);
    Good {
        folder,
        header: lines.next().unwrap(),
        rows: lines.collect(),
    }
});

/// The good recording as text, each row's cells edited.
fn spoilt(header: &str, edit: impl Fn(usize, &mut Vec<String>)) -> String {
    let mut text = format!("{header}\n");
    for (row, line) in GOOD.rows.iter().enumerate() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        edit(row, &mut cells);
        if !cells.is_empty() {
            writeln!(text, "{}", cells.join(",")).unwrap();
        }
    }
    text
}

/// Returns the error of `identify frf --record` for a text that it must refuse.
fn refusal(text: &str, options: &[&str]) -> String {
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("bad.csv"), text).unwrap();
    let mut arguments = vec!["frf", "--record", "bad.csv"];
    arguments.extend(options);
    let (done, message) = identify(folder.path(), &arguments);
    assert!(!done, "the recording was accepted");
    assert!(!message.contains("panicked"), "{message}");
    assert!(!folder.path().join("quadrant-out/frf.csv").exists());
    message
}

fn assert_refused(text: &str, words: &[&str]) {
    let message = refusal(text, &[]);
    for word in words.iter().chain(&["bad.csv"]) {
        assert!(message.contains(word), "{word:?} is not in: {message}");
    }
}

/// Columns: time, reference, position, voltage, injection.
const HEADER: &str = "t_s,reference_mm,position_mm,voltage_v,injection_v";

#[test]
fn the_recording_that_is_spoilt_here_is_good() {
    assert_eq!(GOOD.header, HEADER);
    let (done, message) = identify(
        GOOD.folder.path(),
        &["frf", "--record", "m/frf-recording-1.csv", "--out", "again"],
    );
    assert!(done, "{message}");
}

#[test]
fn a_signal_that_never_changes_is_refused() {
    for (column, name) in [(2, "position"), (3, "voltage_v")] {
        let dead = spoilt(HEADER, |_, cells| cells[column] = "0.25".to_owned());
        assert_refused(&dead, &[&format!("column {name}"), "0.25 in every row"]);
    }
}

#[test]
fn positions_and_voltages_in_other_units_are_refused() {
    let scaled = |columns: &'static [usize], factor: f64| {
        spoilt(HEADER, |_, cells| {
            for &column in columns {
                let value: f64 = cells[column].parse().unwrap();
                cells[column] = (factor * value).to_string();
            }
        })
    };
    assert_refused(&scaled(&[1, 2], 1e3), &["column position", "10000 mm"]);
    assert_refused(
        &scaled(&[3, 4], 1e-3),
        &["column voltage_v", "another unit"],
    );
}

#[test]
fn without_an_injection_there_is_no_response() {
    let silent = spoilt(HEADER, |_, cells| cells[4] = "0".to_owned());
    let message = refusal(&silent, &[]);
    assert!(message.contains("needs an excitation"), "{message}");
    let absent = spoilt("t_s,reference_mm,position_mm,voltage_v,note", |_, _| ());
    let message = refusal(&absent, &[]);
    assert!(message.contains("needs an excitation"), "{message}");
}

#[test]
fn a_gap_is_refused_with_its_line() {
    let gap = spoilt(HEADER, |row, cells| {
        if (1000..1400).contains(&row) {
            cells.clear();
        }
    });
    assert_refused(&gap, &["line 1002", "rows are missing here"]);
}

#[test]
fn a_clock_that_stumbles_is_refused_with_its_line() {
    let twice = spoilt(HEADER, |row, cells| {
        if row == 700 {
            cells[0] = (699.0 * 1e-4).to_string();
        }
    });
    assert_refused(&twice, &["line 702", "column t_s"]);
    let back = spoilt(HEADER, |row, cells| {
        if row >= 700 {
            cells[0] = (1e-4 * (row as f64 - 300.0)).to_string();
        }
    });
    assert_refused(&back, &["line 702", "comes after"]);
}

#[test]
fn a_saturated_stretch_is_refused_with_its_line() {
    let clipped = spoilt(HEADER, |row, cells| {
        if (4000..5500).contains(&row) {
            cells[3] = "-10".to_owned();
        }
    });
    assert_refused(
        &clipped,
        &["from line 4002 on", "limit of 10 V", "lower the amplitude"],
    );
}

#[test]
fn swapped_columns_are_noticed() {
    let voltage_first = "t_s,reference_mm,voltage_v,position_mm,injection_v";
    assert_refused(&spoilt(voltage_first, |_, _| ()), &["is it swapped"]);
    let injection_first = "t_s,reference_mm,injection_v,voltage_v,position_mm";
    assert_refused(
        &spoilt(injection_first, |_, _| ()),
        &["column position_mm", "not in the unit of its name"],
    );
    let voltage_as_time = "voltage_v,reference_mm,position_mm,t_s,injection_v";
    assert_refused(&spoilt(voltage_as_time, |_, _| ()), &["column t_s"]);
}

#[test]
fn metres_and_millimetres_that_are_confused_are_noticed() {
    let confused = "t_s,reference_mm,position_m,voltage_v,injection_v";
    assert_refused(
        &spoilt(confused, |_, _| ()),
        &["column position_m", "not in the unit of its name"],
    );
}

#[test]
fn a_wrong_sample_rate_is_refused() {
    let timed = |step_s: f64| {
        spoilt(HEADER, |row, cells| {
            cells[0] = (step_s * row as f64).to_string();
        })
    };
    assert_refused(&timed(0.1), &["column t_s", "milliseconds"]);
    assert_refused(&timed(0.05), &["column t_s", "100 Hz to 100 kHz"]);
    assert_refused(&timed(1e-7), &["column t_s", "100 Hz to 100 kHz"]);

    // Each is good by itself, and together they are not.
    let folder = TempDir::new().unwrap();
    for (name, step_s) in [("fast.csv", 1e-4), ("slow.csv", 1e-3)] {
        std::fs::write(folder.path().join(name), timed(step_s)).unwrap();
    }
    let (done, message) = identify(folder.path(), &["frf", "--record", "fast.csv", "slow.csv"]);
    assert!(
        !done && message.contains("recording 2 has a sample time of 0.001"),
        "{message}"
    );
}

#[test]
fn a_cell_that_is_no_number_is_refused_with_its_place() {
    for cell in [
        "NaN", "inf", "-inf", "", " ", "1e999", "0x10", "--", "1.2.3", "n/a",
    ] {
        for (column, name) in [
            (0, "t_s"),
            (2, "position_mm"),
            (3, "voltage_v"),
            (4, "injection_v"),
        ] {
            let text = spoilt(HEADER, |row, cells| {
                if row == 40 {
                    cells[column] = cell.to_owned();
                }
                // Enough rows for a cell.
                if row > 60 {
                    cells.clear();
                }
            });
            assert_refused(
                &text,
                &["line 42", &format!("column {name}"), &format!("{cell:?}")],
            );
        }
    }
}

#[test]
fn a_file_that_is_no_table_is_refused() {
    assert_refused("", &["no column t_s"]);
    assert_refused(HEADER, &["0 rows"]);
    assert_refused(
        &spoilt(HEADER, |row, cells| {
            if row > 8 {
                cells.clear()
            }
        }),
        &["9 rows"],
    );
    let ragged = spoilt(HEADER, |row, cells| {
        if row == 500 {
            cells.pop();
        }
    });
    assert_refused(&ragged, &["line 502", "4 cells"]);
    // A decimal comma makes two cells of one.
    let comma = spoilt(HEADER, |_, cells| cells[3] = cells[3].replace('.', ","));
    assert_refused(&comma, &["line 2", "cells"]);
    let semicolons = spoilt(HEADER, |_, _| ()).replace(',', ";");
    assert_refused(&semicolons, &["separated by commas"]);
    assert_refused(
        &spoilt(&GOOD.rows[0], |_, _| ()),
        &["must name the columns"],
    );

    let folder = TempDir::new().unwrap();
    for missing in ["none.csv", "."] {
        let (done, message) = identify(folder.path(), &["frf", "--record", missing]);
        assert!(!done && message.contains(missing), "{message}");
    }
}

#[test]
fn too_short_a_recording_is_refused_with_what_it_takes() {
    let short = spoilt(HEADER, |row, cells| {
        if row > 9000 {
            cells.clear();
        }
    });
    let message = refusal(&short, &[]);
    assert!(
        message.contains("a response takes at least 2: record longer"),
        "{message}"
    );
}

#[test]
fn a_position_that_does_not_follow_the_voltage_is_pointed_out() {
    // The same numbers in another order.
    let rows = GOOD.rows.len();
    let shuffled = spoilt(HEADER, |row, cells| {
        let other = &GOOD.rows[(row * 7919) % rows];
        cells[2] = other.split(',').nth(2).unwrap().to_owned();
    });
    let folder = TempDir::new().unwrap();
    std::fs::write(folder.path().join("shuffled.csv"), shuffled).unwrap();
    let (done, message) = identify(folder.path(), &["frf", "--record", "shuffled.csv"]);
    assert!(
        done && message.contains("hardly a line is coherent"),
        "{message}"
    );
    let (done, message) = identify(folder.path(), &["plant", "--frf", "quadrant-out/frf.csv"]);
    assert!(
        !done && message.contains("have a coherence of 0.9"),
        "{message}"
    );
}

#[test]
fn an_axis_that_moved_needs_its_reference() {
    let moved = spoilt("t_s,note,position_mm,voltage_v,injection_v", |_, _| ());
    let message = refusal(&moved, &[]);
    assert!(
        message.contains("give the column reference_mm"),
        "{message}"
    );
}

#[test]
fn options_that_cannot_be_are_refused() {
    let good = spoilt(HEADER, |_, _| ());
    for (options, word) in [
        (["--period-s", "0"], "period = 0"),
        (["--period-s", "NaN"], "period = NaN"),
        (["--period-s", "1e9"], "period = 1000000000"),
        (["--to-hz", "2"], "band = 2"),
        (["--from-hz", "NaN"], "band = NaN"),
        (["--settling-s", "1e300"], "settling time = 1"),
    ] {
        let message = refusal(&good, &options);
        assert!(message.contains(word), "{message}");
    }
    let (done, message) = identify(
        GOOD.folder.path(),
        &[
            "frf",
            "--machine",
            "law",
            "--record",
            "m/frf-recording-1.csv",
        ],
    );
    assert!(
        !done && message.contains("cannot be used with"),
        "{message}"
    );
}

#[test]
fn the_other_steps_refuse_spoilt_recordings_too() {
    let folder = TempDir::new().unwrap();
    let dead = spoilt(HEADER, |_, cells| cells[3] = "0".to_owned());
    std::fs::write(folder.path().join("dead.csv"), dead).unwrap();
    std::fs::write(
        folder.path().join("map.csv"),
        "velocity_mm_s,voltage_v\n1,0.1\n",
    )
    .unwrap();
    std::fs::write(folder.path().join("frf.csv"), "frequency_hz\n1\n").unwrap();
    for (arguments, words) in [
        (
            ["motor-constant", "--record", "dead.csv"],
            "column voltage_v",
        ),
        (["virgin-curve", "--record", "dead.csv"], "column voltage_v"),
        (
            ["static-friction", "--record", "map.csv"],
            "no column deviation_v",
        ),
        (["plant", "--frf", "frf.csv"], "no column gain_mm_per_v"),
    ] {
        let (done, message) = identify(folder.path(), &arguments);
        assert!(!done && message.contains(words), "{arguments:?}: {message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_content_of_a_cell_panics_and_only_numbers_pass(
        cell in "\\PC{0,12}",
        row in 0_usize..60,
        column in 0_usize..5,
    ) {
        let mut text = format!("{HEADER}\n");
        for (index, line) in GOOD.rows.iter().take(60).enumerate() {
            let mut cells: Vec<&str> = line.split(',').collect();
            if index == row {
                cells[column] = &cell;
            }
            writeln!(text, "{}", cells.join(",")).unwrap();
        }
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("bad.csv");
        std::fs::write(&path, text).unwrap();
        if let Ok(recording) = Recording::read_csv(&path) {
            prop_assert!(cell.trim().trim_matches('"').parse::<f64>().is_ok(), "{cell:?}");
            prop_assert_eq!(recording.len(), 60);
        }
    }
}

#[test]
fn a_recorded_motion_of_a_tenth_of_a_millimetre_is_replayed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let script = "enable\nhome x\nwait rest\nrecord --seconds 0.6 --out run.csv -- move x 0.1\n";
    command::play(at, &["connect", "--simulated=commissioned"], script);
    let text = fs::read_to_string(at.join("run.csv")).unwrap();
    let shown = command::succeed(at, &["replay", "--reference", "run.csv", "--axis", "x"]);
    assert!(shown.contains("best PID"), "{shown}");
    // The same numbers times a thousandth are metres under the name of millimetres.
    let metres = text
        .lines()
        .enumerate()
        .fold(String::new(), |mut all, (index, line)| {
            let cells = line.split(',').enumerate().map(|(column, cell)| {
                let scaled = (index > 0 && (1..4).contains(&column))
                    .then(|| (1e-3 * cell.parse::<f64>().unwrap()).to_string());
                scaled.unwrap_or_else(|| cell.to_owned())
            });
            let _ = writeln!(all, "{}", cells.collect::<Vec<_>>().join(","));
            all
        });
    fs::write(at.join("metres.csv"), metres).unwrap();
    let said = command::fail(at, &["replay", "--reference", "metres.csv", "--axis", "x"]);
    assert!(said.contains("looks like metres"), "{said}");
}
