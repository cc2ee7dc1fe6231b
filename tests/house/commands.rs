//! Commands in documentation exist, and their options do; the pages that list commands list all of them.

use std::collections::{BTreeMap, BTreeSet};

use crate::assert_none;
use crate::names::words_of_code;
use crate::pages::texts;
use crate::source::{code, variants};
use crate::tree::{root, sources};

/// The names of all subcommands in a source: variants of enums that derive `Subcommand`.
fn subcommands(source: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut lines = code(source);
    while let Some(line) = lines.next() {
        if line.starts_with("#[derive(") && line.contains("Subcommand") {
            found.extend(variants(&mut lines));
        }
    }
    found
}

/// The commands of the project's programs.
struct Programs {
    sources: BTreeMap<String, String>,
    options: BTreeSet<String>,
}

impl Programs {
    fn read() -> Self {
        let sources = sources();
        let options = words_of_code(&sources);
        Self { sources, options }
    }

    /// Subcommands of the files that `which` takes.
    fn of(&self, which: impl Fn(&str) -> bool) -> BTreeSet<String> {
        self.sources
            .iter()
            .filter(|(file, _)| which(file))
            .flat_map(|(_, source)| subcommands(source))
            .collect()
    }

    fn quadrant(&self) -> BTreeSet<String> {
        let mut found = self.of(|file| file == "cli/src/main.rs");
        found.insert("help".to_owned());
        found
    }

    /// Subcommands of a command of `quadrant`; empty if it has none.
    fn below(&self, verb: &str) -> BTreeSet<String> {
        let folder = format!("cli/src/{verb}/");
        let file = format!("cli/src/{verb}.rs");
        self.of(|path| path.starts_with(&folder) || path == file)
    }

    fn studies(&self) -> BTreeSet<String> {
        self.of(|file| file == "studies/src/main.rs")
    }

    fn xtask(&self) -> BTreeSet<String> {
        self.of(|file| file == "xtask/src/main.rs")
    }

    /// Complaints about one command line.
    fn check(&self, line: &str) -> Vec<String> {
        let line = line.split(" # ").next().unwrap_or("");
        line.split("&&")
            .flat_map(|command| self.check_one(command.trim()))
            .collect()
    }

    fn check_one(&self, command: &str) -> Vec<String> {
        let words: Vec<&str> = command
            .trim_start_matches("$ ")
            .split_whitespace()
            // A pipe, or a placeholder behind which a synopsis explains.
            .take_while(|word| !["|", "<", ">", "COMMAND"].contains(word))
            .collect();
        let (known, arguments) = match words.as_slice() {
            ["quadrant", rest @ ..] | ["target/release/quadrant", rest @ ..] => {
                (self.quadrant(), rest)
            }
            ["quadrant>", rest @ ..] => (self.below("connect"), rest),
            ["quadrant-studies", rest @ ..] => (self.studies(), rest),
            ["cargo", "xtask", rest @ ..] => (self.xtask(), rest),
            ["cargo", "run", rest @ ..] => {
                let Some(end) = rest.iter().position(|word| *word == "--") else {
                    return Vec::new();
                };
                let studies = rest[..end].contains(&"quadrant-studies");
                let known = match studies {
                    true => self.studies(),
                    false => self.quadrant(),
                };
                (known, &rest[end + 1..])
            }
            _ => return Vec::new(),
        };
        let mut found = self.check_verbs(&known, arguments);
        for option in arguments.iter().take_while(|word| **word != "--") {
            let name = option
                .strip_prefix("--")
                .map(|name| name.split('=').next().unwrap_or(name));
            if let Some(name) = name.filter(|name| is_name(name))
                && !["help", "version", "all-targets"].contains(&name)
                && !self.options.contains(&name.replace('-', "_"))
                && !self.options.contains(name)
            {
                found.push(format!("no option `--{name}`: {command}"));
            }
        }
        found
    }

    fn check_verbs(&self, known: &BTreeSet<String>, arguments: &[&str]) -> Vec<String> {
        let mut found = Vec::new();
        let mut verbs = arguments.iter().filter(|word| is_list(word));
        let Some(first) = verbs.next() else {
            return found;
        };
        // An option's value is no command.
        let at = arguments.iter().position(|word| word == first).unwrap_or(0);
        let value =
            at > 0 && arguments[at - 1].starts_with("--") && !arguments[at - 1].contains('=');
        let flag = [
            "--simulated",
            "--emulated",
            "--echo",
            "--json",
            "--keep-going",
        ];
        if value && !flag.contains(&arguments[at - 1]) {
            return found;
        }
        for verb in first.split(['|', '/']) {
            if !known.contains(verb) {
                found.push(format!("no command `{verb}`: {}", arguments.join(" ")));
            }
        }
        let below = match ["identify", "design", "connect", "capture"].contains(first) {
            true => self.below(first),
            false => BTreeSet::new(),
        };
        if !below.is_empty()
            && !arguments[..at]
                .iter()
                .any(|word| word.starts_with("--port"))
        {
            found.extend(self.check_verbs(&below, &arguments[at + 1..]));
        }
        found
    }
}

/// True for one name, or several between `|` or `/`.
fn is_list(word: &str) -> bool {
    !word.starts_with('-') && word.split(['|', '/']).all(is_name)
}

fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_lowercase())
        && word
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

#[test]
fn every_command_in_documentation_exists() {
    let programs = Programs::read();
    let mut found = Vec::new();
    for text in texts() {
        for (line, command) in text.pieces.spans.iter().chain(&text.pieces.code) {
            for complaint in programs.check(command) {
                found.push(format!("{}:{line}: {complaint}", text.file));
            }
        }
    }
    assert_none("commands that do not exist", &found);
}

#[test]
fn every_command_of_the_console_is_on_its_page() {
    let programs = Programs::read();
    let page = std::fs::read_to_string(root().join("docs/console.md")).expect("the page");
    let found: Vec<_> = programs
        .of(|file| file.starts_with("cli/src/connect/") && file.ends_with("command.rs"))
        .into_iter()
        .filter(|verb| verb != "-" && !page.contains(verb.as_str()))
        .collect();
    assert_none("commands that docs/console.md leaves out", &found);
}

#[test]
fn every_command_is_in_the_documentation() {
    let programs = Programs::read();
    let all: String = texts()
        .iter()
        .filter(|text| text.file.ends_with(".md"))
        .flat_map(|text| text.pieces.spans.iter().chain(&text.pieces.code))
        .map(|(_, piece)| format!(" {piece} "))
        .collect();
    let mut found = Vec::new();
    for verb in programs.quadrant() {
        let said = all.contains(&format!("quadrant {verb}")) || all.contains(&format!("-- {verb}"));
        if !said && verb != "help" {
            found.push(format!("quadrant {verb}"));
        }
    }
    for verb in programs.xtask() {
        if !all.contains(&format!("xtask {verb}")) {
            found.push(format!("cargo xtask {verb}"));
        }
    }
    for verb in programs.studies() {
        if !all.contains(&format!("quadrant-studies -- {verb}")) {
            found.push(format!("quadrant-studies {verb}"));
        }
    }
    assert_none("commands that no page names", &found);
}

#[test]
fn a_command_or_an_option_that_does_not_exist_is_found() {
    let programs = Programs::read();
    let complaints = |line| programs.check(line).len();
    assert_eq!(complaints("quadrant compare --out results"), 0);
    assert_eq!(complaints("quadrant compar"), 1);
    assert_eq!(complaints("cargo run --release -- identify plannt"), 1);
    assert_eq!(complaints("quadrant connect --simulated statuss"), 1);
    assert_eq!(complaints("cargo xtask setup && cargo xtask biuld"), 1);
    assert_eq!(complaints("quadrant design pid --crossing-hz 60"), 1);
}
