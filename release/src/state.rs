//! State of the sources that are released: versions, commit, tag, changelog.

use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use xtask::command;

use crate::changelog;

/// Manifests whose version is the project's; the Python package is a workspace of its own.
const MANIFESTS: [&str; 2] = ["Cargo.toml", "python/Cargo.toml"];

/// State of the sources.
pub(crate) struct State {
    /// The project's version.
    pub version: String,
    /// Commit, in full.
    commit: String,
    /// Tags of the commit.
    tags: Vec<String>,
    /// Files that differ from the commit, and those that git does not know, as `git status` lists them.
    changes: Vec<String>,
    /// The changelog.
    changelog: String,
}

/// Reads the state of a repository.
pub(crate) fn read(root: &Path) -> Result<State> {
    let read = |name: &str| {
        fs::read_to_string(root.join(name)).with_context(|| format!("cannot read {name}"))
    };
    let mut versions = Vec::new();
    for name in MANIFESTS {
        let text = read(name)?;
        let version = version(&text).with_context(|| format!("{name} has no version"))?;
        versions.push(version.to_owned());
    }
    ensure!(
        versions.iter().all(|version| *version == versions[0]),
        "versions differ: {}",
        MANIFESTS
            .map(String::from)
            .iter()
            .zip(&versions)
            .map(|(name, version)| format!("{name} {version}"))
            .collect::<Vec<_>>()
            .join(", ")
    );
    let git = |arguments: &[&str]| -> Result<Vec<String>> {
        let text = command::output(command::command("git").args(arguments))?;
        Ok(text.lines().map(str::to_owned).collect())
    };
    Ok(State {
        version: versions.swap_remove(0),
        commit: git(&["rev-parse", "HEAD"])?.concat(),
        tags: git(&["tag", "--points-at", "HEAD"])?,
        changes: git(&["status", "--porcelain"])?,
        changelog: read("CHANGELOG.md")?,
    })
}

/// Returns the first version that a manifest states, its own or its workspace's.
fn version(manifest: &str) -> Option<&str> {
    let line = manifest
        .lines()
        .find_map(|line| line.strip_prefix("version = \""))?;
    line.strip_suffix('"')
}

impl State {
    /// Returns the release notes.
    ///
    /// # Errors
    /// The changelog has no section for the version, or an empty one; without `dry_run`, the commit has no tag of the version, or files differ
    /// from it.
    pub(crate) fn check(&self, dry_run: bool) -> Result<String> {
        let section = if dry_run { "Unreleased" } else { &self.version };
        let notes = changelog::section(&self.changelog, section)
            .with_context(|| format!("CHANGELOG.md has no text below `## [{section}]`"))?;
        if dry_run {
            return Ok(notes.to_owned());
        }
        let tag = format!("v{}", self.version);
        ensure!(
            self.tags.contains(&tag),
            "the commit has no tag {tag}: `git tag {tag}`, or --dry-run"
        );
        ensure!(
            self.changes.is_empty(),
            "these files are not as committed:\n{}",
            self.changes.join("\n")
        );
        Ok(notes.to_owned())
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "version {}, commit {}", self.version, self.commit)?;
        if self.changes.is_empty() {
            Ok(())
        } else {
            write!(f, ", {} files not as committed", self.changes.len())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(tag: &str, changes: &[&str]) -> State {
        State {
            version: "0.2.0".into(),
            commit: "0".repeat(40),
            tags: vec![tag.into()],
            changes: changes.iter().map(ToString::to_string).collect(),
            changelog: "## [Unreleased]\n\n- next\n\n## [0.2.0] - 2026-11-01\n\n- this\n".into(),
        }
    }

    #[test]
    fn a_release_needs_its_tag_and_no_changes() {
        assert_eq!(state("v0.2.0", &[]).check(false).unwrap(), "- this");
        let untagged = state("v0.1.0", &[]).check(false).unwrap_err();
        assert!(untagged.to_string().contains("no tag v0.2.0"));
        let changed = state("v0.2.0", &[" M a.rs"]).check(false).unwrap_err();
        assert!(changed.to_string().contains(" M a.rs"));
    }

    #[test]
    fn a_dry_run_takes_any_commit_and_the_unreleased_notes() {
        assert_eq!(state("", &[" M a.rs"]).check(true).unwrap(), "- next");
    }

    #[test]
    fn a_version_without_a_section_is_refused() {
        let mut state = state("v0.3.0", &[]);
        state.version = "0.3.0".into();
        let error = state.check(false).unwrap_err();
        assert_eq!(
            error.to_string(),
            "CHANGELOG.md has no text below `## [0.3.0]`"
        );
    }

    #[test]
    fn the_version_of_a_workspace_is_not_that_of_a_dependency() {
        let manifest =
            "[workspace.package]\nversion = \"1.2.3\"\n\n[dependencies]\nversion = \"9\"\n";
        assert_eq!(version(manifest), Some("1.2.3"));
        assert_eq!(version("version.workspace = true\n"), None);
    }
}
