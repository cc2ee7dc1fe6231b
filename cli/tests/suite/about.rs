//! The command's words about itself: version, commit, manual pages.

use std::fs;
use std::process::Command;

use crate::command;

#[test]
fn the_version_names_the_commit_and_the_protocol_that_a_board_has_to_speak() {
    let folder = tempfile::tempdir().unwrap();
    let said = command::succeed(folder.path(), &["--version"]);
    let git = Command::new("git")
        .args(["rev-parse", "HEAD"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    let head = git.ok().filter(|output| output.status.success());
    let commit = head.map_or("unknown: built without git".to_owned(), |output| {
        String::from_utf8(output.stdout).unwrap().trim().to_owned()
    });
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(
        lines[0],
        format!("quadrant {}", env!("CARGO_PKG_VERSION")),
        "{said}"
    );
    assert!(lines[1].starts_with(&format!("commit {commit}")), "{said}");
    assert_eq!(
        lines[2],
        format!("link protocol {}", quadrant_link::PROTOCOL_VERSION)
    );
}

#[test]
fn commands_have_manual_pages() {
    let folder = tempfile::tempdir().unwrap();
    command::succeed(folder.path(), &["man", "pages"]);
    let page = |name: &str| fs::read_to_string(folder.path().join("pages").join(name)).unwrap();
    assert!(page("quadrant.1").contains(".TH quadrant 1"));
    assert!(page("quadrant-commission.1").contains("\\-\\-axis"));
}
