//! The law imports nothing from above it, and no two of its files import each other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::{env, fs};

type Module = Vec<String>;

/// Reads the files below a folder: the path of each module in the law, and its code without comments and unit tests.
fn read(folder: &Path, module: &Module, files: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path
            .file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let mut here = module.clone();
        if name != "mod" {
            here.push(name);
        }
        if path.is_dir() {
            read(&path, &here, files);
        } else {
            let text = fs::read_to_string(&path).expect("text");
            let text = text.split("#[cfg(test)]").next().unwrap_or_default();
            let code = text
                .lines()
                .map(|line| line.split("//").next().unwrap_or_default());
            files.insert(here, code.collect());
        }
    }
}

/// The paths of a `use` tree, without spaces.
fn expand(tree: &str) -> Vec<String> {
    let Some((before, list)) = tree.split_once('{') else {
        return vec![tree.to_owned()];
    };
    let list = list.strip_suffix('}').unwrap_or(list);
    let (mut depth, mut parts) = (0, vec![String::new()]);
    for letter in list.chars() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if letter == ',' && depth == 0 {
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            part.push(letter);
        }
    }
    let parts = parts.iter().filter(|part| !part.is_empty());
    parts
        .flat_map(|part| expand(part))
        .map(|path| format!("{before}{path}"))
        .collect()
}

/// Every path in the code of a module that starts with `crate`, `self` or `super`, or that re-exports a child.
fn paths(code: &str) -> Vec<String> {
    code.split(';')
        .filter_map(|item| item.rsplit_once("use ").map(|(_, tree)| tree))
        .flat_map(|tree| expand(&tree.replace(char::is_whitespace, "")))
        .collect()
}

fn law() -> BTreeMap<Module, String> {
    let mut files = BTreeMap::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/law");
    read(&folder, &Vec::new(), &mut files);
    assert!(files.len() > 50, "{} files", files.len());
    files
}

#[test]
fn the_law_imports_nothing_from_above_it() {
    for (module, code) in law() {
        for above in code.split("crate::").skip(1) {
            assert!(above.starts_with("law::"), "{module:?}: crate::{above:.40}");
        }
    }
}

#[test]
fn no_file_of_the_law_is_in_an_import_circle() {
    let files = law();
    let mut imports: BTreeMap<&Module, BTreeSet<Module>> = BTreeMap::new();
    for (module, code) in &files {
        for path in paths(code) {
            let mut parts: Vec<&str> = path.split("::").collect();
            let mut target = match parts[0] {
                "crate" => {
                    parts.drain(..2);
                    Vec::new()
                }
                "super" => {
                    let ups = parts.iter().take_while(|part| **part == "super").count();
                    parts.drain(..ups);
                    module[..module.len() - ups].to_vec()
                }
                "self" => {
                    parts.remove(0);
                    module.clone()
                }
                child => {
                    let mut below = module.clone();
                    below.push(child.to_owned());
                    if !files.contains_key(&below) {
                        continue;
                    }
                    module.clone()
                }
            };
            target.extend(parts.iter().map(|part| (*part).to_owned()));
            while !files.contains_key(&target) {
                target.pop();
            }
            if target != *module {
                imports.entry(module).or_default().insert(target);
            }
        }
    }
    // Whatever imports nothing that is left is not in a circle.
    while let Some(free) = imports
        .iter()
        .find(|(_, targets)| !targets.iter().any(|target| imports.contains_key(target)))
        .map(|(module, _)| *module)
    {
        imports.remove(free);
    }
    assert!(imports.is_empty(), "in circles: {imports:?}");
}
