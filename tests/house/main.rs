//! The rules of the repository that its texts can be held to: doc comments, and that documentation names only what exists. Every check reads the sources as text, so it also sees code of other targets.
//! `ARCHITECTURE.md` gives the reason of each rule.
#![forbid(unsafe_code)]

mod commands;
mod comments;
mod maps;
mod markdown;
mod names;
mod pages;
mod source;
mod tree;

/// Fails with one line for each finding.
#[track_caller]
fn assert_none(rule: &str, findings: &[String]) {
    assert!(
        findings.is_empty(),
        "{rule}: {} found\n  {}\n",
        findings.len(),
        findings.join("\n  ")
    );
}
