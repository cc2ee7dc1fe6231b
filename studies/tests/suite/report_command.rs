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

#[test]
fn a_part_is_the_same_to_the_byte_on_another_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let pages = |threads| {
        let formats = ["html", "json", "csv"].map(|format| ["--format", format]);
        let arguments = [
            &["--only", "chapter-4", "--out", "a"],
            formats.as_flattened(),
        ]
        .concat();
        let made = report(folder.path(), threads, &arguments);
        assert!(made.status.success(), "{made:?}");
        let shown = String::from_utf8_lossy(&made.stdout);
        assert!(shown.contains("Simulated, not measured"), "{shown}");
        ["html", "json"].map(|format| {
            std::fs::read_to_string(folder.path().join(format!("a/report.{format}"))).unwrap()
        })
    };
    let made = pages("2");
    assert!(pages("1") == made, "a page on one thread differs");
    let [text, data] = made;
    assert!(data.contains("quadrant-studies report --only chapter-4 --seed 1 --seeds 10"));
    for label in [
        "Table 4.1",
        "Table 4.2",
        "Table 4.3",
        "Table 4.4",
        "Figure 4.9",
    ] {
        assert!(text.contains(label), "{label}");
    }
    assert!(folder.path().join("a/table-4-1.csv").exists());
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
