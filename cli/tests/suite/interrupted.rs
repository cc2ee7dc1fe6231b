//! Signals, closed pipes, full devices and folders that cannot be: nothing panics, nothing goes on moving, nothing is lost.
#![cfg(target_os = "linux")]

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

fn quadrant(words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_quadrant"));
    command.args(words);
    command
}

fn error_text(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!text.contains("panicked"), "{text}");
    text
}

#[test]
fn a_signal_in_the_middle_of_a_command_stops_the_axes_and_ends_the_script() {
    let mut child = quadrant(&[
        "connect",
        "--simulated=commissioned",
        "--echo",
        "--keep-going",
    ])
    .stdin(Stdio::piped())
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    let mut input = child.stdin.take().unwrap();
    input
        .write_all(b"enable\njog x 0.001\nwait rest --timeout 100000\nenable\n")
        .unwrap();
    let mut said = BufReader::new(child.stdout.take().unwrap());
    let mut line = String::new();
    while !line.contains("wait") {
        line.clear();
        assert_ne!(said.read_line(&mut line).unwrap(), 0);
    }
    // The command is under way.
    std::thread::sleep(Duration::from_millis(200));
    let number = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &number]).status();
    assert!(sent.unwrap().success());
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    assert!(!rest.contains("> enable"), "{rest}");
    let output = child.wait_with_output().unwrap();
    let errors = error_text(&output);
    assert!(errors.contains("stopping the axes"), "{errors}");
    assert!(
        errors.contains("interrupted: the axes have stopped"),
        "{errors}"
    );
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_commissioning_that_a_person_ends_says_so_and_blames_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = quadrant(&["commission", "--axis", "x", "--machine", "simulated"])
        .args(["--travel", "15", "--quick"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Until something was measured, and the next experiment is under way.
    let experiments = folder.path().join("quadrant-out/x/experiments");
    let measured = || std::fs::read_dir(&experiments).map_or(0, Iterator::count);
    while measured() < 4 {
        std::thread::sleep(Duration::from_millis(20));
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
    }
    let number = child.id().to_string();
    let sent = Command::new("kill").args(["-INT", &number]).status();
    assert!(sent.unwrap().success());
    let output = child.wait_with_output().unwrap();
    let errors = error_text(&output);
    assert_eq!(output.status.code(), Some(1));
    assert!(errors.contains("interrupted"), "{errors}");
    for blamed in ["oscillated", "stiffened", "resonat"] {
        assert!(!errors.contains(blamed), "{errors}");
    }
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    for words in [
        &["settings"][..],
        &["settings", "--markdown"],
        &["completions", "bash"],
        &["--help"],
    ] {
        let mut child = quadrant(words)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(error_text(&output), "");
        assert!(output.status.success(), "{words:?}");
    }
}

#[test]
fn results_are_in_their_files_though_nobody_reads_the_tables() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut child = quadrant(&["design", "pid", "--axis", "x", "--out"])
        .arg(&out)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let errors = error_text(&output);
    assert!(output.status.success(), "{errors}");
    assert!(out.read_dir().unwrap().count() > 1);
}

#[test]
fn a_device_that_is_full_is_an_error_and_no_panic() {
    for words in [&["settings"][..], &["completions", "bash"]] {
        let output = quadrant(words)
            .stdout(File::options().write(true).open("/dev/full").unwrap())
            .stderr(Stdio::piped())
            .output()
            .unwrap();
        let errors = error_text(&output);
        assert!(
            errors.contains("cannot write to standard output"),
            "{errors}"
        );
        assert_eq!(output.status.code(), Some(1), "{words:?}");
    }
}

#[test]
fn a_folder_that_cannot_be_is_refused_before_anything_is_computed() {
    for words in [
        &["compare"][..],
        &["circle"],
        &["commission", "--axis", "x"],
    ] {
        let output = quadrant(words)
            .args(["--out", "/dev/null/results"])
            .output()
            .unwrap();
        let errors = error_text(&output);
        assert!(errors.contains("/dev/null/results"), "{errors}");
        assert_eq!(output.status.code(), Some(1), "{words:?}");
        assert!(output.stdout.is_empty(), "{words:?}");
    }
}

/// Runs a command that may write `blocks` of 512 bytes into a file; beyond that the write fails, or ends the program.
fn with_little_room(folder: &std::path::Path, blocks: u32, ends: bool, words: &[&str]) -> Output {
    let trap = if ends { "" } else { "trap '' XFSZ; " };
    let limited = format!("{trap}ulimit -f {blocks}; exec \"$0\" \"$@\"");
    Command::new("sh")
        .args(["-c", &limited, env!("CARGO_BIN_EXE_quadrant")])
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn a_file_that_cannot_be_written_to_its_end_is_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    for (words, name) in [
        (
            &["connect", "--simulated", "dump", "stage.toml"][..],
            "stage.toml",
        ),
        (&["design", "pid", "--axis", "x", "--out", "."], "pid.html"),
        (
            &[
                "connect",
                "--simulated",
                "record",
                "--seconds",
                "0.5",
                "--out",
                "run.csv",
            ],
            "run.csv",
        ),
    ] {
        let whole = with_little_room(folder.path(), 1_000_000, false, words);
        assert!(whole.status.success(), "{}", error_text(&whole));
        let before = std::fs::read(at(name)).unwrap();
        for ends in [false, true] {
            let failed = with_little_room(folder.path(), 8, ends, words);
            assert!(!failed.status.success(), "{words:?}");
            assert_eq!(failed.status.code().is_none(), ends, "{words:?}");
            assert!(std::fs::read(at(name)).unwrap() == before, "{words:?}");
            if !ends {
                assert!(
                    error_text(&failed).contains(name),
                    "{}",
                    error_text(&failed)
                );
            }
        }
    }
}
