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
struct Played {
    transcript: String,
    folder: tempfile::TempDir,
}

/// Plays a script at one of the console's places.
fn play(place: &[&str], script: &str) -> Played {
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
    Played { transcript, folder }
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
        let played_line = lines.next().unwrap_or("(nothing more)");
        assert_eq!(
            played_line,
            expected,
            "{} line {number}; `cargo xtask transcript --overwrite-expected` takes the new one",
            path.display()
        );
    }
    assert_eq!(lines.next(), None, "more than {} says", path.display());
}

/// A column of a file that the session has left.
fn column(played: &Played, file: &str, column: usize) -> Vec<f64> {
    let text = fs::read_to_string(played.folder.path().join(file)).unwrap();
    let values = text.lines().skip(1).map(|line| line.split(',').nth(column));
    values
        .map(|value| value.unwrap().parse().unwrap())
        .collect()
}

/// The number behind `before` in the first line with `words`.
fn number(lines: &[&str], words: &str, before: &str) -> f64 {
    let line = lines.iter().find(|line| line.contains(words));
    let line = line.unwrap_or_else(|| panic!("nothing says {words:?}"));
    let (_, rest) = line.split_once(before).unwrap();
    let word = rest.split_whitespace().next().unwrap();
    word.trim_end_matches(',').parse().unwrap()
}

/// Ticks on either side of a change over which the output is averaged. A count of the encoder moves the output by 27 mV from one tick to
/// the next, so that its largest step is two, three or four counts by chance; the mean moves by a few millivolts.
const MEAN_TICKS: usize = 20;

/// Largest step of the mean at a change over the largest without one: both are of some thirty ticks of noise.
const MORE_BY_CHANCE: f64 = 1.5;

/// Step of the output at a tick, and of its mean from the ticks before it to those from it on.
fn steps_at(output_v: &[f64], tick: usize) -> Option<[f64; 2]> {
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let before = output_v.get(tick.checked_sub(MEAN_TICKS)?..tick)?;
    let after = output_v.get(tick..tick + MEAN_TICKS)?;
    Some(
        [
            after[0] - before[MEAN_TICKS - 1],
            mean(after) - mean(before),
        ]
        .map(f64::abs),
    )
}

/// The larger of two pairs, each of its numbers by itself.
fn larger([one, two]: [f64; 2], [other, another]: [f64; 2]) -> [f64; 2] {
    [one.max(other), two.max(another)]
}

/// Checks what must hold in every run of the script, apart from its numbers.
fn check(played: &Played) {
    let lines: Vec<&str> = played.transcript.lines().collect();
    // The change is in what was captured.
    let change = column(played, "change.csv", 2);
    let from = number(&lines, "change.csv:", "at tick ");
    let applied = lines.iter().filter(|line| line.contains("settings act"));
    let at = applied
        .map(|line| 1e4 * number(&[line], "settings act", "") - from)
        .find(|at| (0.0..change.len() as f64).contains(at));
    let at = at.expect("a change within the capture").round() as usize;
    // Bumpless: the change moves the output no further than encoder and motion do in the same jog without one.
    let before = column(played, "before.csv", 2);
    let usual = (0..before.len()).filter_map(|tick| steps_at(&before, tick));
    let usual = usual.fold([0.0; 2], larger);
    let moved = (at - 1..=at + 1).filter_map(|tick| steps_at(&change, tick));
    let moved = moved.fold([0.0; 2], larger);
    assert!(
        moved[0] <= usual[0] && moved[1] <= MORE_BY_CHANCE * usual[1],
        "at the change {moved:?} V, otherwise {usual:?} V"
    );
    assert!(usual[1] < 0.02, "{usual:?}: a lost integral term is 0.13 V");
    // The trace of the fault begins with an axis that is driven, and ends with the outputs off.
    let volts = column(played, "stop.csv", 3);
    assert!(volts[0] != 0.0 && volts.last() == Some(&0.0), "{volts:?}");
}

#[test]
fn the_simulated_machine_prints_the_committed_transcript() {
    let played = play(&["--simulated"], SCRIPT);
    check(&played);
    compare("simulated.txt", &played.transcript);
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
        let played = [STORE, ASK].map(|script| play(&[&place, &flash], script).transcript);
        fs::remove_file(folder.path().join("flash")).unwrap();
        played
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
    let played = play(&[&emulated()], &format!("{SCRIPT}log\n"));
    check(&played);
    compare("emulated.txt", &played.transcript);
}

#[test]
fn both_machines_report_the_same_but_for_their_names_and_the_log() {
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
