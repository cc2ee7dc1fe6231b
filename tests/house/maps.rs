//! A module's page that lists its modules lists all of them.

use std::collections::BTreeSet;

use crate::assert_none;
use crate::lexer::{Kind, tokens};
use crate::tree::sources;

/// Public modules that a source declares in files of their own.
fn public_modules(source: &str) -> BTreeSet<String> {
    let all: Vec<_> = tokens(source)
        .into_iter()
        .filter(|token| !matches!(token.kind, Kind::OuterDoc | Kind::InnerDoc))
        .collect();
    all.windows(4)
        .filter(|now| now[0].is_word("pub") && now[1].is_word("mod") && now[3].is_sign(";"))
        .map(|now| now[2].text.to_owned())
        .collect()
}

/// The names that a source's own page links to, and the first segments of their paths.
fn linked(source: &str) -> BTreeSet<String> {
    tokens(source)
        .iter()
        .filter(|token| token.kind == Kind::InnerDoc)
        .flat_map(|token| token.text.split("[`").skip(1))
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
