//! Gives the program the commit that it was built from.

use std::process::Command;

/// Folders and files of the sources, as seen from this package.
const SOURCES: [&str; 7] = [
    "src",
    "Cargo.toml",
    "../src",
    "../crates",
    "../host-sim",
    "../Cargo.toml",
    "../Cargo.lock",
];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let commit = commit().unwrap_or_else(|| "unknown: built without git".to_owned());
    println!("cargo:rustc-env=QUADRANT_COMMIT={commit}");
}

/// Returns the commit and whether the sources differ from it; `None` outside this project's repository.
fn commit() -> Option<String> {
    // Sources that were unpacked within another repository have no commit.
    let is_own = git(&["rev-parse", "--show-prefix"])? == "cli/"
        && git(&["ls-files", "--error-unmatch", "build.rs"]).is_some();
    if !is_own {
        return None;
    }
    // A new commit writes its log; an edit, one of the sources.
    let log = git(&["rev-parse", "--git-path", "logs/HEAD"])?;
    for path in SOURCES.iter().copied().chain([log.as_str()]) {
        println!("cargo:rerun-if-changed={path}");
    }
    let commit = git(&["rev-parse", "HEAD"])?;
    let mut status = vec!["status", "--porcelain", "--"];
    status.extend(SOURCES);
    let changed = if git(&status)?.is_empty() {
        ""
    } else {
        " with changes"
    };
    Some(format!("{commit}{changed}"))
}

/// Output of git in this package's folder; `None` if it fails or is missing.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
