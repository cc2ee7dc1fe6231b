//! Output of the command when it is run for the first time.

use crate::command;

#[test]
fn the_result_is_a_sentence_a_small_table_and_a_reversal_on_one_screen_of_80_by_24() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = command::succeed(at, &[]);
    for line in shown.lines() {
        assert!(line.chars().count() <= 80, "{line}\n{shown}");
    }
    // The prompt needs the last line.
    assert!(shown.lines().count() <= 23, "{shown}");
    let mut parts = shown.split("\n\n");
    let sentence: Vec<&str> = parts.next().unwrap().split_whitespace().collect();
    let sentence = sentence.join(" ");
    for part in ["% off", "best PID", "Simulated, not measured"] {
        assert!(sentence.contains(part), "{sentence}");
    }
    let table = parts.next().unwrap();
    assert!(table.trim().lines().count() <= 10, "{table}");
    for part in [
        "best PID",
        "best PID + static + GMS",
        "thesis' PID",
        "friction identified from experiments",
    ] {
        assert!(table.contains(part), "{part}:\n{table}");
    }
    let is_drawn = |sign: char| ('\u{2801}'..='\u{28ff}').contains(&sign);
    assert!(
        shown.chars().filter(|sign| is_drawn(*sign)).count() > 40,
        "{shown}"
    );
    assert!(shown.contains("quadrant-out/comparison.html"), "{shown}");
    assert!(shown.contains("--tables"), "{shown}");
    // No word of ours that only a page explains.
    for word in ["exact model", "identified model", "exact 5"] {
        assert!(!shown.contains(word), "{word}:\n{shown}");
    }
    assert!(at.join("quadrant-out/tracking-error-rms.csv").exists());
}

#[test]
fn every_table_is_there_when_asked_for_and_fits_eighty_columns() {
    let folder = tempfile::tempdir().unwrap();
    let shown = command::succeed(folder.path(), &["compare", "--tables"]);
    for line in shown.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    for part in [
        "RMS tracking error",
        "Quadrant glitch",
        "The thesis' headline changes",
        "Circle of 30 mm radius",
        "N-PID + static + GMS",
    ] {
        assert!(shown.contains(part), "{part}:\n{shown}");
    }
}
