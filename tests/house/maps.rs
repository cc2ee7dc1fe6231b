//! A module's page that lists its modules lists all of them.

use std::collections::BTreeSet;

use crate::assert_none;
use crate::source::{code, doc_comments};
use crate::tree::sources;

/// Public modules that a source declares in files of their own.
fn public_modules(source: &str) -> BTreeSet<String> {
    code(source)
        .filter_map(|line| line.trim().strip_prefix("pub mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

/// The names that a source's own page links to, and the first segments of their paths.
fn linked(source: &str) -> BTreeSet<String> {
    doc_comments(source)
        .iter()
        .filter(|(_, _, inner)| *inner)
        .flat_map(|(_, text, _)| text.split("[`").skip(1))
        .filter_map(|rest| rest.split('`').next())
        .map(|name| name.trim_start_matches("mod@"))
        .filter_map(|name| Some(name.split("::").next()?.to_owned()))
        .collect()
}

/// Public modules that a map of modules leaves out; a page that names no more than half of them is no map.
fn left_out(source: &str) -> Vec<String> {
    let modules = public_modules(source);
    let linked = linked(source);
    if modules.intersection(&linked).count() * 2 <= modules.len() {
        return Vec::new();
    }
    modules.difference(&linked).cloned().collect()
}

#[test]
fn a_map_of_modules_is_complete() {
    let mut found = Vec::new();
    for (file, source) in sources() {
        found.extend(
            left_out(&source)
                .into_iter()
                .map(|name| format!("{file}: {name}")),
        );
    }
    assert_none("modules that their map leaves out", &found);
}

#[test]
fn a_module_that_is_left_out_is_found() {
    let map = "//! [`a`]: one; [`mod@b`]: two.\npub mod a;\npub mod b;\npub mod c;\nmod d;\n";
    assert_eq!(left_out(map), ["c"]);
    assert!(left_out("//! See [`a`].\npub mod a;\npub mod b;\n").is_empty());
}
