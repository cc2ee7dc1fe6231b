//! No file is in an import circle: what a file needs can be read without it.

use std::collections::{BTreeMap, BTreeSet};

use crate::assert_none;
use crate::crate_modules::{Crate, Import};
use crate::tree::sources;

/// Each group of files that import each other, with the imports among them.
fn circles(imports: &[Import]) -> Vec<String> {
    let mut edges: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
    for (from, to, line) in imports {
        edges.entry(from).or_default().entry(to).or_insert(*line);
    }
    let reach: BTreeMap<&str, BTreeSet<&str>> = edges
        .keys()
        .map(|&from| {
            let mut seen = BTreeSet::new();
            let mut open = vec![from];
            while let Some(at) = open.pop() {
                for &next in edges.get(at).into_iter().flat_map(BTreeMap::keys) {
                    if seen.insert(next) {
                        open.push(next);
                    }
                }
            }
            (from, seen)
        })
        .collect();
    let mut reported = BTreeSet::new();
    let mut found = Vec::new();
    for (&file, beyond) in &reach {
        if !beyond.contains(file) || reported.contains(file) {
            continue;
        }
        let group: BTreeSet<&str> = beyond
            .iter()
            .copied()
            .filter(|other| reach.get(other).is_some_and(|back| back.contains(file)))
            .collect();
        let mut text = format!("{} files:", group.len());
        for &from in &group {
            for (&to, line) in &edges[from] {
                if group.contains(to) {
                    text.push_str(&format!("\n    {from}:{line} -> {to}"));
                }
            }
        }
        reported.extend(group);
        found.push(text);
    }
    found
}

/// The root files of all crates: libraries, programs, tests, benchmarks, examples.
fn roots(sources: &BTreeMap<String, String>) -> Vec<String> {
    let is_root = |path: &&String| {
        let parts: Vec<_> = path.split('/').collect();
        let folders = ["tests", "benches", "examples", "bin"];
        match parts.as_slice() {
            [.., "src", file] if ["lib.rs", "main.rs"].contains(file) => true,
            [.., folder, _, "main.rs"] if folders.contains(folder) => true,
            [.., folder, _] if folders.contains(folder) || *folder == "fuzz_targets" => true,
            _ => path.ends_with("build.rs"),
        }
    };
    // `tests` is a module's folder, too.
    let in_sources = |path: &&String| path.contains("src/") && path.contains("/tests/");
    sources
        .keys()
        .filter(|path| is_root(path) && !in_sources(path))
        .cloned()
        .collect()
}

#[test]
fn no_file_is_in_an_import_circle() {
    let sources = sources();
    let mut found = BTreeSet::new();
    for root in roots(&sources) {
        found.extend(circles(&Crate::read(&sources, &root).imports()));
    }
    assert_none("import circles", &found.into_iter().collect::<Vec<_>>());
}

fn circles_of(files: &[(&str, &str)]) -> usize {
    let sources: BTreeMap<_, _> = files
        .iter()
        .map(|(path, text)| ((*path).to_owned(), (*text).to_owned()))
        .collect();
    circles(&Crate::read(&sources, "src/lib.rs").imports()).len()
}

#[test]
fn a_circle_of_three_files_is_found() {
    let found = circles_of(&[
        ("src/lib.rs", "mod a; mod b; mod c;"),
        ("src/a/mod.rs", "use crate::b::{self, B}; pub struct A;"),
        ("src/b.rs", "pub struct B; fn f() { super::c::g() }"),
        ("src/c.rs", "use super::a::A; pub fn g() {}"),
    ]);
    assert_eq!(found, 1);
}

#[test]
fn a_circle_through_names_that_others_export_is_found() {
    let found = circles_of(&[
        (
            "src/lib.rs",
            "mod inner; mod user; pub use inner::deep; pub use user::*;",
        ),
        ("src/inner/mod.rs", "pub mod deep;"),
        ("src/inner/deep.rs", "use crate::User; pub struct Deep;"),
        (
            "src/user.rs",
            "use crate::deep::Deep; pub struct User(Deep);",
        ),
    ]);
    assert_eq!(found, 1);
}

#[test]
fn a_parent_and_its_child_that_use_each_other_are_a_circle() {
    let child = ("src/a/child.rs", "use super::Parent; pub struct Child;");
    let root = ("src/lib.rs", "mod a;");
    let uses = "mod child; use child::Child; pub struct Parent(Child);";
    assert_eq!(circles_of(&[root, child, ("src/a/mod.rs", uses)]), 1);
    let exports_and_uses = "mod child; pub use child::Child; pub struct Parent(Child);";
    assert_eq!(
        circles_of(&[root, child, ("src/a/mod.rs", exports_and_uses)]),
        1
    );
    let exports = "mod child; pub use child::Child; pub struct Parent;";
    assert_eq!(circles_of(&[root, child, ("src/a/mod.rs", exports)]), 0);
}

#[test]
fn imports_one_way_and_those_of_tests_are_no_circle() {
    let found = circles_of(&[
        ("src/lib.rs", "mod a; mod b;"),
        (
            "src/a.rs",
            "pub struct A; #[cfg(test)] mod tests { use crate::b::B; }",
        ),
        (
            "src/b.rs",
            "use crate::a::A; // use crate::b::B\npub struct B(A);",
        ),
    ]);
    assert_eq!(found, 0);
}
