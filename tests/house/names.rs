//! Paths, settings, laws, channels, faults and other names in documentation exist.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use crate::assert_none;
use crate::pages::{Text, texts};
use crate::source::{code, literals, variants, words};
use crate::tree::{files, kebab_case, root, sources};

/// Folders at the root whose contents documentation names.
const FOLDERS: [&str; 15] = [
    "src",
    "cli",
    "crates",
    "host-sim",
    "python",
    "studies",
    "target-tests",
    "xtask",
    "tests",
    "examples",
    "fuzz",
    "docs",
    ".cargo",
    ".ci",
    ".vscode",
];

/// Folders that commands of the documentation make.
const MADE: [&str; 1] = ["fuzz/found"];

/// Names of other projects and formats.
const FOREIGN: [&str; 13] = [
    "cargo-fuzz",
    "defmt-print",
    "flip-link",
    "no-OS",
    "nonlinear-benchmarks",
    "probe-rs",
    "probe-rs-tools",
    "r4-r7",
    "rust-lld",
    "sequential-storage",
    "serde_with",
    "text-anchor",
    "_defmt_acquire",
];

/// Every word in code and in its literals, parts of kebab-case names included whole; and every identifier in kebab case.
pub(crate) fn words_of_code(sources: &BTreeMap<String, String>) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for word in sources
        .values()
        .flat_map(|source| code(source))
        .flat_map(words)
    {
        if word.starts_with(char::is_uppercase) {
            found.insert(kebab_case(&word));
        }
        found.insert(word);
    }
    found
}

/// Words of code and of manifests.
fn known_words() -> BTreeSet<String> {
    let mut known = words_of_code(&sources());
    let others = files(&["toml", "x", "json", "csv", "ngc", "txt", "py"]);
    // Of recordings the head is enough.
    for text in others.values() {
        known.extend(text.lines().take(2000).flat_map(words));
    }
    known.extend(FOREIGN.map(str::to_owned));
    known
}

fn report(rule: &str, wrong: impl Fn(&Text, &str) -> bool) {
    let mut found = Vec::new();
    for text in texts() {
        for (line, span) in &text.pieces.spans {
            if wrong(&text, span) {
                found.push(format!("{}:{line}: {span}", text.file));
            }
        }
    }
    assert_none(rule, &found);
}

#[test]
fn every_file_named_in_documentation_exists() {
    let names: BTreeSet<String> = sources()
        .into_keys()
        .filter_map(|file| file.rsplit('/').next().map(str::to_owned))
        .collect();
    let missing = |text: &Text, path: &str| {
        let path = path.split("::").next().unwrap_or(path);
        let plain = path
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "-_./".contains(c));
        let first = path.split('/').next().unwrap_or("");
        if !plain || path.is_empty() {
            return false;
        }
        if !path.contains('/') {
            return path.ends_with(".rs") && !names.contains(path);
        }
        // From the root, from the page, or from the package of the doc comment.
        let beside = text.file.rsplit_once('/').map_or("", |(folder, _)| folder);
        let package = text.file.split("/src/").next().unwrap_or("");
        let made = MADE.iter().any(|made| path.starts_with(made)) || path.contains("NAME");
        FOLDERS.contains(&first)
            && !made
            && ![String::new(), format!("{beside}/"), format!("{package}/")]
                .iter()
                .any(|prefix| root().join(format!("{prefix}{path}")).exists())
    };
    let mut found = Vec::new();
    for text in texts() {
        for (line, piece) in text.pieces.spans.iter().chain(&text.pieces.code) {
            for word in piece.split_whitespace().filter(|word| missing(&text, word)) {
                found.push(format!("{}:{line}: {word}", text.file));
            }
        }
    }
    assert_none("files that do not exist", &found);
}

/// The paths of all settings, from the reference page, which the host command's tests hold to the table in the code.
fn settings_paths() -> Vec<Vec<String>> {
    let page = fs::read_to_string(root().join("docs/settings.md")).expect("the page");
    page.lines()
        .filter_map(|line| line.strip_prefix("| `/")?.split('`').next())
        .map(|path| path.split('/').map(str::to_owned).collect())
        .collect()
}

/// A settings path in one of its written forms, from its first segment; none if the text is no such path.
fn as_settings_path(span: &str) -> Option<Vec<String>> {
    const PARTS: [&str; 11] = [
        "commissioned",
        "encoder",
        "amplifier",
        "limits",
        "plant",
        "feedback",
        "friction",
        "feedforward",
        "homing",
        "pulses",
        "streaming",
    ];
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || "_*/.[]".contains(c);
    let path = span.split(['=', ' ']).next().unwrap_or("");
    let blank = path.trim_matches('/').is_empty();
    if blank || !path.chars().all(plain) || path.ends_with(".rs") || path.contains("..") {
        return None;
    }
    let path = path.replace("[]", "");
    let mut parts: Vec<String> = path
        .trim_start_matches('/')
        .split(['/', '.'])
        .map(str::to_owned)
        .collect();
    let axis = |part: &str| ["x", "y", "z", "*", "0", "1", "2"].contains(&part);
    if path.starts_with("/axes/") {
        parts.drain(..1);
    }
    if parts.len() > 1 && axis(&parts[0]) && PARTS.contains(&parts[1].as_str()) {
        parts.remove(0);
    }
    let absolute = path.starts_with('/');
    let known = PARTS.contains(&parts[0].as_str()) && parts.len() > 1;
    (absolute || known).then_some(parts)
}

/// True if a written path is a setting, or the beginning of some.
fn is_setting(path: &[String], all: &[Vec<String>]) -> bool {
    all.iter().any(|full| {
        let full = match full.first().is_some_and(|first| first == "axes") {
            true => &full[2..],
            false => &full[..],
        };
        // A point's `*` may be left out, and a written `*` stands for anything.
        let mut rest = full.iter().peekable();
        path.iter().all(|part| {
            if rest.peek().is_some_and(|next| *next == "*" && part != "*") {
                rest.next();
            }
            rest.next().is_some_and(|next| part == "*" || part == next)
        })
    })
}

#[test]
fn every_settings_path_in_documentation_exists() {
    let all = settings_paths();
    assert!(
        all.len() > 60,
        "docs/settings.md lists {} settings",
        all.len()
    );
    report("settings that do not exist", |_, span| {
        as_settings_path(span).is_some_and(|path| !is_setting(&path, &all))
    });
}

#[test]
fn settings_paths_are_recognised() {
    let all = settings_paths();
    let known = |span| as_settings_path(span).map(|path| is_setting(&path, &all));
    assert_eq!(known("/axes/x/feedback/pid/kp_v_per_mm"), Some(true));
    assert_eq!(known("x/feedback/pid/kp_v_per_mm"), Some(true));
    assert_eq!(known("feedback.schedule.speed_mm_s"), Some(true));
    assert_eq!(known("friction.sliding.*.viscous_v_s_per_mm"), Some(true));
    assert_eq!(known("streaming.underrun = \"hold\""), Some(true));
    assert_eq!(known("/rate_hz"), Some(true));
    assert_eq!(known("x/feedback/pid/kp"), Some(false));
    assert_eq!(known("feedback.gain"), Some(false));
    assert_eq!(known("friction.rs"), None);
    assert_eq!(known("/"), None);
    assert_eq!(known("x.error"), None);
}

/// The names of an enum: its variants in kebab case, and the words that its file gives as literals.
fn names_of(name: &str) -> (Vec<String>, BTreeSet<String>) {
    let head = format!("enum {name} {{");
    let sources = sources();
    let source = sources.values().find(|source| source.contains(&head));
    let source = source.unwrap_or_else(|| panic!("no enum {name}"));
    let lines = code(source).skip_while(|line| !line.contains(&head));
    (variants(lines), literals(source))
}

/// First cells of the rows of a page's table that are code.
fn coded_cells(page: &str, column: usize) -> BTreeSet<String> {
    let text = fs::read_to_string(root().join(page)).expect("the page");
    text.lines()
        .filter_map(|line| line.strip_prefix('|')?.split('|').nth(column))
        .flat_map(|cell| {
            let odd = cell.split('`').skip(1).step_by(2);
            odd.map(str::to_owned).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn every_law_has_its_row_on_the_page_of_the_laws() {
    let (laws, _) = names_of("LawKind");
    let listed = coded_cells("docs/control-laws/README.md", 0);
    let wrong: Vec<_> = listed
        .iter()
        .filter(|cell| *cell != "feedback.law" && !laws.contains(cell))
        .chain(laws.iter().filter(|law| !listed.contains(*law)))
        .cloned()
        .collect();
    assert!(laws.len() > 5, "{laws:?}");
    assert_none("laws in the table or in `LawKind` only", &wrong);
}

#[test]
fn every_fault_has_its_number_and_row_on_the_page_of_safety() {
    let (faults, names) = names_of("FaultCode");
    let mut wrong = Vec::new();
    for page in ["docs/safety.md", "docs/motion.md"] {
        let text = fs::read_to_string(root().join(page)).expect("the page");
        for line in text.lines() {
            let cells: Vec<_> = line.split('|').map(str::trim).collect();
            let [_, number, name, ..] = cells[..] else {
                continue;
            };
            let Ok(number) = number.parse::<usize>() else {
                continue;
            };
            let right = names.contains(name) || faults.iter().any(|fault| fault == name);
            let ours = faults.get(number.wrapping_sub(1));
            if !right
                || (faults.iter().any(|fault| fault == name) && ours.is_none_or(|is| is != name))
            {
                wrong.push(format!("{page}: {number} {name}"));
            }
        }
    }
    let safety = fs::read_to_string(root().join("docs/safety.md")).expect("the page");
    for number in 1..=faults.len() {
        if !safety.contains(&format!("\n| {number} | ")) {
            wrong.push(format!("docs/safety.md: no row of fault {number}"));
        }
    }
    assert!(faults.len() > 20, "{faults:?}");
    assert_none("faults", &wrong);
}

#[test]
fn every_channel_in_documentation_exists() {
    let (axis, literals) = names_of("AxisSignal");
    let (stage, _) = names_of("StageSignal");
    report("channels that do not exist", |_, span| {
        span.split(',').any(|name| {
            let Some((source, signal)) = name.split_once('.') else {
                return false;
            };
            let signal = signal.to_owned();
            let spelt = !signal.is_empty()
                && signal
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c == '-' || c.is_ascii_digit());
            let known = match source {
                "x" | "y" | "z" => &axis,
                "stage" => &stage,
                _ => return false,
            };
            // A switch of an axis is written in the same way.
            let switch = signal.ends_with("limit") || signal == "home" || signal.ends_with("fault");
            spelt && !switch && !known.contains(&signal) && !literals.contains(&signal)
        })
    });
}

#[test]
fn every_channel_has_its_row_on_the_page_of_the_link() {
    let page = fs::read_to_string(root().join("docs/link.md")).expect("the page");
    let (_, channels) = page.split_once("## Channels").expect("the section");
    let mut wrong = Vec::new();
    for (table, name) in channels
        .split("| number |")
        .skip(1)
        .zip(["AxisSignal", "StageSignal"])
    {
        let rows = table
            .lines()
            .skip(2)
            .take_while(|line| line.starts_with('|'));
        let listed: Vec<usize> = rows
            .filter_map(|row| row.split('|').nth(1))
            .flat_map(|cell| cell.split(','))
            .filter_map(|number| number.trim().parse().ok())
            .collect();
        let (signals, _) = names_of(name);
        for (number, signal) in signals.iter().enumerate() {
            if !listed.contains(&number) {
                wrong.push(format!("{name} {number}, {signal}"));
            }
        }
    }
    assert_none("channels without a row in docs/link.md", &wrong);
}

#[test]
fn every_name_in_documentation_exists() {
    let known = known_words();
    report("names that do not exist", |text, span| {
        // The change log describes the past.
        if span.contains(['<', '>']) {
            return false;
        }
        if text.file == "CHANGELOG.md"
            || span.contains(['/', '.', '<', '*']) && !span.contains("::")
        {
            return false;
        }
        let path = span.trim_end_matches("()");
        let name = path.rsplit("::").next().unwrap_or("");
        let letters = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(letters) || name.starts_with('-') {
            return false;
        }
        let joined = name.contains('_') || name.trim_matches('-').contains('-');
        let camel = name.starts_with(char::is_uppercase)
            && name.chars().skip(1).any(char::is_uppercase)
            && name.chars().any(char::is_lowercase);
        let letter = name.chars().next().is_some_and(char::is_alphabetic) || name.starts_with('_');
        // Symbols of the compiler's runtime, and quantities such as k_i.
        let other = name.starts_with("__") || name.find('_') == Some(1);
        let ours = (span.contains("::") || joined || camel) && !other;
        // Of a path every part, but not of one into the standard library or another crate.
        let foreign = ["std", "core", "alloc", "libm", "clap"]
            .iter()
            .any(|root| path.starts_with(root));
        let exists = known.contains(name)
            && (foreign
                || path
                    .split("::")
                    .all(|part| part.is_empty() || known.contains(part)));
        ours && letter && !name.ends_with('-') && !exists
    });
}
