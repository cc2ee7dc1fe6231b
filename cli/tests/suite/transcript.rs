//! A session from an empty flash to a fault and back, end to end, driven through the console alone, and what a person sees of it, to the last character: on the
//! simulated machine, and with the firmware's image in QEMU (`cargo xtask transcript`, which also rewrites what is expected).

use crate::command;
use std::fs;
use std::path::{Path, PathBuf};

const SCRIPT: &str = include_str!("../transcript/script.txt");
const SETTINGS: &str = include_str!("../../../host-sim/data/identified-stage.toml");
/// Before the firmware's log, in the transcript of the emulated board.
const LOG: &str = "> log\n";

/// Transcript of a machine, and the folder with its files.
struct Told {
    transcript: String,
    folder: tempfile::TempDir,
}

/// Plays a script at one of the console's places.
fn play(place: &[&str], script: &str) -> Told {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("stage.toml"), SETTINGS).unwrap();
    let output = command::play(
        folder.path(),
        &[&["connect", "--echo"], place].concat(),
        script,
    );
    let transcript = String::from_utf8(output.stdout).unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}\n{transcript}");
    Told { transcript, folder }
}

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/transcript")
        .join(name)
}

/// Compares with what is committed, or writes it if that is asked for.
fn compare(name: &str, transcript: &str) {
    let path = golden(name);
    if std::env::var_os("QUADRANT_OVERWRITE_EXPECTED").is_some() {
        fs::write(&path, transcript).unwrap();
        return;
    }
    let expected = fs::read_to_string(&path).unwrap();
    let mut lines = transcript.lines();
    for (number, expected) in (1..).zip(expected.lines()) {
        let told = lines.next().unwrap_or("(nothing more)");
        assert_eq!(
            told,
            expected,
            "{} line {number}; `cargo xtask transcript --overwrite-expected` takes the new one",
            path.display()
        );
    }
    assert_eq!(lines.next(), None, "more than {} says", path.display());
}

/// A column of a file that the session has left.
fn column(told: &Told, file: &str, column: usize) -> Vec<f64> {
    let text = fs::read_to_string(told.folder.path().join(file)).unwrap();
    let values = text.lines().skip(1).map(|line| line.split(',').nth(column));
    values
        .map(|value| value.unwrap().parse().unwrap())
        .collect()
}

fn largest_step(values: &[f64]) -> f64 {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    steps.fold(0.0, f64::max)
}

/// The number behind `before` in the first line with `words`.
fn number(lines: &[&str], words: &str, before: &str) -> f64 {
    let line = lines.iter().find(|line| line.contains(words));
    let line = line.unwrap_or_else(|| panic!("nothing says {words:?}"));
    let (_, rest) = line.split_once(before).unwrap();
    let word = rest.split_whitespace().next().unwrap();
    word.trim_end_matches(',').parse().unwrap()
}

/// Checks what is true of a story whatever its numbers are.
fn check(told: &Told) {
    let lines: Vec<&str> = told.transcript.lines().collect();
    // Bumpless: from tick to tick, the output steps no further than it did before the change.
    let steps = ["before.csv", "change.csv"].map(|file| largest_step(&column(told, file, 2)));
    assert!(steps[1] <= 1.2 * steps[0], "{steps:?} V");
    // And the change is in what was captured.
    let from = number(&lines, "change.csv:", "at tick ");
    let length = column(told, "change.csv", 0).len() as f64;
    let applied = lines.iter().filter(|line| line.contains("settings act"));
    let ticks: Vec<f64> = applied
        .map(|line| {
            1e4 * line
                .split_whitespace()
                .next()
                .unwrap()
                .parse::<f64>()
                .unwrap()
        })
        .collect();
    assert!(
        ticks
            .iter()
            .any(|&tick| tick > from && tick < from + length),
        "{ticks:?} {from} {length}"
    );
    // The trace of the fault begins with an axis that is driven, and ends with the outputs off.
    let volts = column(told, "stop.csv", 3);
    assert!(volts[0] != 0.0 && volts.last() == Some(&0.0), "{volts:?}");
}

#[test]
fn the_simulated_machine_prints_the_committed_transcript() {
    let told = play(&["--simulated"], SCRIPT);
    check(&told);
    compare("simulated.txt", &told.transcript);
}

/// The option that names the emulated board.
fn emulated() -> String {
    let image = std::env::var("QUADRANT_EMULATED_IMAGE").expect("the image's path");
    format!("--emulated={image}")
}

#[test]
#[ignore = "needs QEMU and the firmware's image: `cargo xtask transcript`"]
fn a_restart_and_a_flash_file_are_the_same_on_the_emulated_board() {
    const STORE: &str =
        "set x/feedback/pid/kp_v_per_mm 0.8\napply\nstore 'a test'\nreboot\nwait 0.1\nstatus\n";
    const ASK: &str = "provenance\nget x/feedback/pid/kp_v_per_mm\n";
    let folder = tempfile::tempdir().unwrap();
    let [simulated, emulated] = ["--simulated".to_owned(), emulated()].map(|place| {
        let flash = format!("--flash={}", folder.path().join("flash").display());
        let told = [STORE, ASK].map(|script| play(&[&place, &flash], script).transcript);
        fs::remove_file(folder.path().join("flash")).unwrap();
        told
    });
    assert_eq!(simulated, emulated);
    assert!(
        emulated[1].contains("a test\n") && emulated[1].contains("0.8\n"),
        "{emulated:?}"
    );
}

#[test]
#[ignore = "needs QEMU and the firmware's image: `cargo xtask transcript`"]
fn the_emulated_board_prints_the_committed_transcript() {
    let told = play(&[&emulated()], &format!("{SCRIPT}log\n"));
    check(&told);
    compare("emulated.txt", &told.transcript);
}

#[test]
fn both_machines_tell_the_same_but_for_their_names_and_the_log() {
    let [simulated, emulated] =
        ["simulated.txt", "emulated.txt"].map(|name| fs::read_to_string(golden(name)).unwrap());
    let (console, log) = emulated.split_once(LOG).unwrap();
    assert_eq!(simulated.replacen("simulated,", "mps2,", 1), console);
    for words in [
        "outputs enabled",
        "motion started",
        "fault 4",
        "settings number 1 from flash",
    ] {
        assert!(log.contains(words), "the log does not say {words:?}");
    }
}
