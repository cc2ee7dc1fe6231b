//! `cargo xtask lines`: the lines of Rust in each package, against the committed ones.
//!
//! Committed are hundreds, rounded up. A package that passes into another hundred is committed with its new figure, and the commit's
//! message says what a larger one is for.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

use xtask::command::{self, root};
use xtask::golden::{self, Golden};

/// Step of the committed figures, lines.
const STEP: u32 = 100;

/// File of the committed figures.
const GOLDEN: Golden = Golden {
    path: golden::LINES,
    head: "Lines of Rust by package, in hundreds rounded up. Written by `cargo xtask lines --overwrite-expected`.",
};

/// Lines of a package.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
struct Lines {
    /// Lines that are not tests, comments among them.
    code: u32,
    /// Files below a folder `tests`, and modules of that name.
    tests: u32,
}

impl Lines {
    fn of(path: &Path, text: &str) -> Self {
        let all = text.lines().count() as u32;
        let is_test = path.components().any(|part| part.as_os_str() == "tests")
            || path.file_stem().is_some_and(|stem| stem == "tests");
        let code = if is_test {
            0
        } else {
            let within = text
                .lines()
                .position(|line| line.starts_with("mod tests {"));
            within.map_or(all, |line| line as u32)
        };
        Self {
            code,
            tests: all - code,
        }
    }

    fn add(&mut self, other: Self) {
        self.code += other.code;
        self.tests += other.tests;
    }

    /// Rounded up to what is committed.
    fn stepped(self) -> Self {
        let up = |lines: u32| lines.next_multiple_of(STEP);
        Self {
            code: up(self.code),
            tests: up(self.tests),
        }
    }
}

/// Counts, prints, and compares with the committed figures, or commits them.
pub(crate) fn run(overwrite: bool) -> Result<()> {
    let packages = count()?;
    let mut total = Lines::default();
    println!("{:<28} {:>7} {:>7}", "package", "code", "tests");
    for (package, lines) in &packages {
        println!("{package:<28} {:>7} {:>7}", lines.code, lines.tests);
        total.add(*lines);
    }
    println!("{:<28} {:>7} {:>7}", "all", total.code, total.tests);
    let stepped = packages
        .into_iter()
        .map(|(package, lines)| (package, lines.stepped()));
    if overwrite {
        // Whole: a package that is gone goes here, too.
        let path = root().join(GOLDEN.path);
        if path.exists() {
            fs::remove_file(&path).with_context(|| path.display().to_string())?;
        }
        return GOLDEN.store(None, stepped);
    }
    let committed = GOLDEN.read::<Lines>()?.tables;
    let found: BTreeMap<String, Lines> = stepped.collect();
    let differing = differing(&committed, &found);
    ensure!(
        differing.is_empty(),
        "{} has other figures:\n{}\n`cargo xtask lines --overwrite-expected` writes these; say in the commit what a larger one is for",
        GOLDEN.path,
        differing.join("\n")
    );
    Ok(())
}

/// What differs from the committed figures, a line each.
fn differing(committed: &BTreeMap<String, Lines>, found: &BTreeMap<String, Lines>) -> Vec<String> {
    let names = committed
        .keys()
        .chain(found.keys().filter(|name| !committed.contains_key(*name)));
    let of =
        |all: &BTreeMap<String, Lines>, name: &String| all.get(name).copied().unwrap_or_default();
    names
        .map(|name| (name, of(committed, name), of(found, name)))
        .filter(|(_, before, now)| before != now)
        .map(|(name, before, now)| {
            format!(
                "  {name}: {} code and {} tests, committed {} and {}",
                now.code, now.tests, before.code, before.tests
            )
        })
        .collect()
}

/// The lines of every package's files that git knows.
fn count() -> Result<BTreeMap<String, Lines>> {
    let files = command::output(command::command("git").args(["ls-files", "*.rs"]))?;
    let mut packages = BTreeMap::<String, Lines>::new();
    for file in files.lines() {
        let path = Path::new(file);
        let text = fs::read_to_string(root().join(path)).with_context(|| file.to_owned())?;
        let lines = Lines::of(path, &text);
        packages.entry(package_of(path)).or_default().add(lines);
    }
    Ok(packages)
}

/// The folder of the package that a file belongs to; `.` for the firmware's.
fn package_of(file: &Path) -> String {
    let folders = file.ancestors().skip(1);
    let package = folders
        .filter(|folder| *folder != Path::new(""))
        .find(|folder| root().join(folder).join("Cargo.toml").exists());
    package.map_or_else(|| ".".to_owned(), |folder| folder.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_differ_from_code_by_folder_file_and_module() {
        let text = "fn f() {}\n#[cfg(test)]\nmod tests {\n    fn t() {}\n}\n";
        let lines = |path: &str| Lines::of(Path::new(path), text);
        assert_eq!(lines("crates/law/src/lib.rs"), Lines { code: 2, tests: 3 });
        assert_eq!(
            lines("crates/law/tests/suite/main.rs"),
            Lines { code: 0, tests: 5 }
        );
        assert_eq!(lines("bench/src/tests.rs"), Lines { code: 0, tests: 5 });
    }

    #[test]
    fn a_package_that_grows_or_goes_is_named() {
        let of = |code| Lines { code, tests: 100 };
        let committed = BTreeMap::from([("a".to_owned(), of(100)), ("b".to_owned(), of(100))]);
        assert_eq!(differing(&committed, &committed), Vec::<String>::new());
        let found = BTreeMap::from([("a".to_owned(), of(200)), ("c".to_owned(), of(100))]);
        let said = differing(&committed, &found).join("\n");
        for part in ["a: 200 code", "b: 0 code", "c: 100 code"] {
            assert!(said.contains(part), "{said}");
        }
    }

    #[test]
    fn a_file_belongs_to_the_package_around_it() {
        assert_eq!(package_of(Path::new("xtask/src/lines.rs")), "xtask");
        assert_eq!(package_of(Path::new("src/app/mod.rs")), ".");
    }
}
