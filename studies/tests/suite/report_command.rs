//! `quadrant-studies report`, from its command line.

use std::path::Path;
use std::process::{Command, Output};

fn report(folder: &Path, threads: &str, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_quadrant-studies"))
        .arg("report")
        .args(arguments)
        .env("RAYON_NUM_THREADS", threads)
        .current_dir(folder)
        .output()
        .unwrap()
}

/// Returns the progress lines of a report that must succeed.
fn progress_lines(output: &Output) -> String {
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{errors}");
    errors
}

fn shown(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_part_is_the_same_to_the_byte_from_its_file_and_computed_again_on_another_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let first = report(at, "2", &["--only", "chapter-4", "--out", "a"]);
    assert!(!progress_lines(&first).contains("kept from"));
    assert!(
        shown(&first).contains("Simulated, not measured"),
        "{}",
        shown(&first)
    );
    let page = || std::fs::read(at.join("a/report.html")).unwrap();
    let computed = page();

    let kept = report(at, "2", &["--only", "chapter-4", "--out", "a"]);
    assert!(progress_lines(&kept).contains("chapter-4: kept from a/parts/chapter-4.json"));
    assert!(page() == computed, "a page from files differs");

    let fresh = report(at, "1", &["--only", "chapter-4", "--out", "a", "--fresh"]);
    assert!(!progress_lines(&fresh).contains("kept from"));
    assert!(page() == computed, "a page on one thread differs");

    let text = String::from_utf8(computed).unwrap();
    let part = std::fs::read_to_string(at.join("a/parts/chapter-4.json")).unwrap();
    assert!(part.contains("\"quadrant-studies report --only chapter-4 --seed 1 --seeds 10\""));
    for label in [
        "Table 4.1",
        "Table 4.2",
        "Table 4.3",
        "Table 4.4",
        "Figure 4.9",
    ] {
        assert!(text.contains(label), "{label}");
    }
    assert!(at.join("a/table-4-1.csv").exists());
}

#[test]
fn parts_are_listed_with_their_times() {
    let folder = tempfile::tempdir().unwrap();
    let listed = report(folder.path(), "1", &["--list"]);
    progress_lines(&listed);
    for part in quadrant_studies::report::PARTS {
        let line = shown(&listed);
        let line = line.lines().find(|line| line.starts_with(part.id)).unwrap();
        assert!(line.contains(part.title) && line.contains(" s "), "{line}");
    }
}

#[test]
fn a_part_that_does_not_exist_is_refused_with_those_that_do() {
    let folder = tempfile::tempdir().unwrap();
    let refused = report(folder.path(), "1", &["--only", "chapter-6"]);
    assert!(!refused.status.success());
    let errors = String::from_utf8_lossy(&refused.stderr);
    assert!(
        errors.contains("chapter-6") && errors.contains("chapter-5"),
        "{errors}"
    );
    let none = report(folder.path(), "1", &["--seeds", "0"]);
    assert!(!none.status.success());
}
