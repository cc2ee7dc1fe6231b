//! Layers: the imports that each part of the tree may have.

use std::collections::BTreeSet;
use std::fs;

use crate::assert_none;
use crate::lexer::{Kind, Token, tokens};
use crate::tree::{root, sources};

/// Words of a source, each with the ones that follow it as `::` paths do.
fn paths<'a>(all: &'a [Token<'a>]) -> impl Iterator<Item = (usize, Vec<&'a str>)> {
    all.iter().enumerate().filter_map(|(at, token)| {
        if token.kind != Kind::Word {
            return None;
        }
        let mut path = vec![token.text];
        let mut rest = &all[at + 1..];
        while let [sign, word, others @ ..] = rest
            && sign.is_sign("::")
            && word.kind == Kind::Word
        {
            path.push(word.text);
            rest = others;
        }
        Some((token.line, path))
    })
}

/// Findings of a rule over the words of all sources below `folder`.
fn offences(folder: &str, breaks: impl Fn(&str, &[&str]) -> bool) -> Vec<String> {
    let mut found = Vec::new();
    for (file, source) in sources() {
        if !file.starts_with(folder) {
            continue;
        }
        for (line, path) in paths(&tokens(&source)) {
            if breaks(&file, &path) {
                found.push(format!("{file}:{line}: {}", path.join("::")));
            }
        }
    }
    found
}

fn manifest(path: &str) -> String {
    fs::read_to_string(root().join(path)).expect("a manifest")
}

/// The dependencies that a manifest names, in any table: each with its table's heading and its line.
fn dependencies(manifest: &str) -> Vec<(String, String, String)> {
    let mut table = String::new();
    let mut found = Vec::new();
    for line in manifest.lines().map(str::trim) {
        if line.starts_with('[') {
            table = line.to_owned();
        } else if table.contains("dependencies")
            && let Some((name, _)) = line.split_once(['=', '.'])
        {
            let name = name.trim().to_owned();
            found.push((table.clone(), name, line.to_owned()));
        }
    }
    found
}

#[test]
fn the_law_knows_neither_settings_nor_link_nor_application() {
    let foreign = [
        "settings", "link", "app", "store", "drivers", "board", "hal",
    ];
    let found = offences("src/law/", |_, path| match path {
        ["crate", first, ..] => foreign.contains(first),
        ["quadrant_link", ..] => true,
        _ => false,
    });
    assert_none("the law imports what stands above it", &found);
}

#[test]
fn the_host_library_knows_neither_studies_nor_command_line() {
    let mut found = offences("host-sim/", |_, path| {
        ["quadrant_studies", "quadrant_cli"].contains(&path[0])
    });
    let foreign = ["quadrant-studies", "quadrant-cli", "indicatif", "rustyline"];
    for (_, name, line) in dependencies(&manifest("host-sim/Cargo.toml")) {
        if foreign.contains(&name.as_str()) || name == "clap" && !line.contains("optional = true") {
            found.push(format!("host-sim/Cargo.toml: {line}"));
        }
    }
    assert_none("host-sim names what stands above it", &found);
}

#[test]
fn the_simulation_stands_on_the_library_alone() {
    let manifest = manifest("crates/simulation/Cargo.toml");
    let found: Vec<_> = dependencies(&manifest)
        .into_iter()
        .filter(|(_, name, _)| name.starts_with("quadrant-") || name == "rayon")
        .map(|(table, _, line)| format!("{table} {line}"))
        .collect();
    assert_none("crates/simulation knows more than the law", &found);
}

#[test]
fn the_command_does_not_know_the_studies() {
    let mut found = offences("cli/", |_, path| path[0] == "quadrant_studies");
    if dependencies(&manifest("cli/Cargo.toml"))
        .iter()
        .any(|(_, name, _)| name == "quadrant-studies")
    {
        found.push("cli/Cargo.toml".to_owned());
    }
    assert_none("cli names the studies", &found);
}

#[test]
fn the_chores_do_not_depend_on_the_host_command() {
    let named: Vec<_> = dependencies(&manifest("xtask/Cargo.toml"))
        .into_iter()
        .filter(|(_, name, _)| ["quadrant-sim", "quadrant-cli"].contains(&name.as_str()))
        .map(|(table, _, line)| format!("{table} {line}"))
        .collect();
    assert_none("xtask depends on the host command", &named);
}

#[test]
fn the_library_brings_no_runtime_and_no_log_to_a_target() {
    let runtime = ["rtic", "cortex-m", "cortex-m-rt", "defmt"];
    let found: Vec<_> = dependencies(&manifest("Cargo.toml"))
        .into_iter()
        .filter(|(table, name, line)| {
            !table.starts_with("[workspace")
                && runtime.contains(&name.as_str())
                && !line.contains("optional = true")
        })
        .map(|(table, _, line)| format!("{table} {line}"))
        .collect();
    assert_none("always in the library's dependencies", &found);
}

#[test]
fn unsafe_code_is_in_the_boards_only() {
    let found = offences("", |file, path| {
        path.contains(&"unsafe")
            && !file.starts_with("src/board/")
            && ![EXPORTS, C_LAW].contains(&file)
    });
    assert_none("unsafe outside src/board", &found);
}

/// The functions that WebAssembly gives to a page: their names must not be mangled, and that attribute is unsafe.
const EXPORTS: &str = "bench/src/exports.rs";

/// The declaration of the functions in C that `cargo xtask count --peer` calls.
const C_LAW: &str = "target-tests/peer/src/c.rs";

#[test]
fn the_exports_of_the_page_take_nothing_unsafe_but_their_names() {
    let source = &sources()[EXPORTS];
    let all = tokens(source);
    let found: Vec<_> = (0..all.len())
        .filter(|&at| all[at].is_word("unsafe"))
        .filter(|&at| {
            let after: Vec<_> = all[at + 1..].iter().take(4).map(|of| of.text).collect();
            after != ["(", "no_mangle", ")", "]"]
        })
        .map(|at| format!("{EXPORTS}:{}", all[at].line))
        .collect();
    assert_none("unsafe that is not a name", &found);
}

#[test]
fn registers_are_in_the_boards_only() {
    let registers = [
        "stm32f4xx_hal",
        "pac",
        "steal",
        "read_volatile",
        "write_volatile",
    ];
    let found = offences("src/", |file, path| {
        path.iter().any(|word| registers.contains(word)) && !file.starts_with("src/board/")
    });
    assert_none("registers outside src/board", &found);
}

#[test]
fn a_module_with_a_folder_is_a_file_in_that_folder() {
    let files: BTreeSet<String> = sources().into_keys().collect();
    let found: Vec<_> = files
        .iter()
        .filter_map(|file| {
            let folder = file.strip_suffix(".rs").map(|stem| format!("{stem}/"))?;
            let twice = files.range(folder.clone()..).next()?.starts_with(&folder);
            twice.then(|| format!("{file} beside {folder}"))
        })
        .collect();
    assert_none("`foo.rs` beside `foo/`; here it is `foo/mod.rs`", &found);
}
