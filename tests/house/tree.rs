//! The files of the repository.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The repository's folder.
pub(crate) fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// All files with one of these extensions, by path from the root, with `/` between folders.
pub(crate) fn files(extensions: &[&str]) -> BTreeMap<String, String> {
    let mut found = BTreeMap::new();
    collect(&root(), "", extensions, &mut found);
    found
}

/// All Rust sources.
pub(crate) fn sources() -> BTreeMap<String, String> {
    files(&["rs"])
}

fn collect(folder: &Path, prefix: &str, extensions: &[&str], found: &mut BTreeMap<String, String>) {
    for entry in fs::read_dir(folder).expect("a readable folder").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        if path.is_dir() {
            // Build products, and what is no part of the project.
            let skipped = name == "target" || name == "quadrant-out" || name == ".git";
            if !skipped {
                collect(&path, &format!("{prefix}{name}/"), extensions, found);
            }
        } else if extensions
            .iter()
            .any(|extension| path.extension().is_some_and(|is| is == *extension))
        {
            let text = fs::read_to_string(&path).expect("text in UTF-8");
            found.insert(format!("{prefix}{name}"), text);
        }
    }
}

/// `CamelCase` as `kebab-case`, as serde, strum and clap write it.
pub(crate) fn kebab_case(name: &str) -> String {
    let mut kebab = String::new();
    for character in name.chars() {
        if character.is_uppercase() && !kebab.is_empty() {
            kebab.push('-');
        }
        kebab.extend(character.to_lowercase());
    }
    kebab
}
