//! `cargo xtask msrv`: the oldest compiler of each package, `rust-version`, is one that its dependencies allow, and one that compiles it.
//!
//! Clippy finds parts of the standard library that came later, with any compiler (`incompatible_msrv`).

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};
use cargo_metadata::semver::Version;
use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package, PackageId};

use xtask::command;

/// Compares each package of the workspace with what it depends on, and compiles those that allow an older compiler than the rest with that
/// compiler if rustup has it.
pub(crate) fn run() -> Result<()> {
    let metadata = MetadataCommand::new()
        .current_dir(command::root())
        .other_options(vec!["--locked".to_owned()])
        .exec()?;
    let newest = metadata
        .workspace_packages()
        .into_iter()
        .filter_map(|package| package.rust_version.clone())
        .max();
    let newest = newest.context("no package states a rust-version")?;
    let mut older: BTreeMap<&Version, Vec<&str>> = BTreeMap::new();
    let mut complaints = Vec::new();
    for package in metadata.workspace_packages() {
        let Some(own) = &package.rust_version else {
            complaints.push(format!("{}: no rust-version", package.name));
            continue;
        };
        complaints.extend(too_new(package, own, &dependencies(&metadata, package)?));
        if *own < newest {
            older.entry(own).or_default().push(&package.name);
        }
    }
    ensure!(complaints.is_empty(), "{}", complaints.join("\n"));
    for (version, packages) in older {
        compile(version, &packages)?;
    }
    println!("all others: Rust {}.{}", newest.major, newest.minor);
    Ok(())
}

/// Returns all that a package is compiled with, but for its tests and build scripts.
fn dependencies<'a>(metadata: &'a Metadata, package: &'a Package) -> Result<Vec<&'a Package>> {
    let resolve = metadata
        .resolve
        .as_ref()
        .context("cargo resolved nothing")?;
    let mut found: BTreeSet<&PackageId> = BTreeSet::new();
    let mut open = vec![&package.id];
    while let Some(id) = open.pop() {
        let node = resolve.nodes.iter().find(|node| node.id == *id);
        for dependency in &node.context("a package without a node")?.deps {
            let mut kinds = dependency.dep_kinds.iter();
            let is_linked = kinds.any(|kind| kind.kind == DependencyKind::Normal);
            if is_linked && found.insert(&dependency.pkg) {
                open.push(&dependency.pkg);
            }
        }
    }
    Ok(found.into_iter().map(|id| &metadata[id]).collect())
}

/// Dependencies that need a newer compiler than the package allows.
fn too_new(package: &Package, own: &Version, dependencies: &[&Package]) -> Vec<String> {
    let needs_more = |dependency: &&&Package| {
        let version = dependency.rust_version.as_ref();
        version.is_some_and(|version| version > own)
    };
    dependencies
        .iter()
        .filter(needs_more)
        .map(|dependency| {
            format!(
                "{} states Rust {own}, and {} {} needs a newer one",
                package.name, dependency.name, dependency.version
            )
        })
        .collect()
}

/// Compiles packages with a release of the compiler if rustup has it.
fn compile(version: &Version, packages: &[&str]) -> Result<()> {
    let toolchain = format!("{}.{}", version.major, version.minor);
    let names = packages.join(", ");
    // Asked for by name, rustup would fetch it.
    let installed = command::output(command::command("rustup").args(["toolchain", "list"]));
    let installed = installed.unwrap_or_default();
    let Some(found) = installed_release(&installed, &toolchain) else {
        println!(
            "{names}: Rust {toolchain}, which is not installed: `rustup toolchain install {toolchain}` to compile with it"
        );
        return Ok(());
    };
    println!("{names}: Rust {toolchain}");
    let mut cargo = command::command("cargo");
    cargo.arg(format!("+{found}"));
    cargo.args(["check", "--target-dir", "target/msrv"]);
    for package in packages {
        cargo.args(["--package", package]);
    }
    command::run(&mut cargo)
}

/// A toolchain of a release in what `rustup toolchain list` prints.
fn installed_release<'a>(list: &'a str, release: &str) -> Option<&'a str> {
    let starts = [format!("{release}-"), format!("{release}.")];
    list.lines()
        .filter_map(|line| line.split(' ').next())
        .find(|name| starts.iter().any(|start| name.starts_with(start)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_release_is_found_by_its_first_two_numbers() {
        let list = "stable-x86_64-unknown-linux-gnu (active, default)\n1.88.0-x86_64-unknown-linux-gnu\n1.9-x86_64-unknown-linux-gnu\n";
        assert_eq!(
            installed_release(list, "1.88"),
            Some("1.88.0-x86_64-unknown-linux-gnu")
        );
        assert_eq!(
            installed_release(list, "1.9"),
            Some("1.9-x86_64-unknown-linux-gnu")
        );
        assert_eq!(installed_release(list, "1.8"), None);
    }

    #[test]
    fn a_dependency_that_needs_a_newer_compiler_is_named() {
        let of = |name: &str, rust_version: &str| -> Package {
            serde_json::from_value(serde_json::json!({
                "name": name, "version": "1.0.0", "id": name, "dependencies": [], "targets": [], "features": {},
                "manifest_path": "/Cargo.toml", "rust_version": rust_version
            }))
            .unwrap()
        };
        let (law, old, new) = (of("law", "1.88"), of("old", "1.88"), of("new", "1.89"));
        let own = law.rust_version.clone().unwrap();
        assert_eq!(
            too_new(&law, &own, &[&old, &new]),
            ["law states Rust 1.88.0, and new 1.0.0 needs a newer one"]
        );
    }
}
