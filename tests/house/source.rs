//! Rust source as the checks read it, line by line: it is formatted, so an enum's variants are indented by one step, and a
//! comment begins its line or follows a space.

use std::collections::BTreeSet;

use crate::tree::kebab_case;

/// The lines of a source that are no comments, without comments at their ends.
pub(crate) fn code(source: &str) -> impl Iterator<Item = &str> {
    source
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"))
        .map(|line| line.split_once(" // ").map_or(line, |(code, _)| code))
}

/// The doc comments of a source: line, text, and whether it is on what encloses it.
pub(crate) fn doc_comments(source: &str) -> Vec<(usize, String, bool)> {
    let mut found: Vec<(usize, String, bool)> = Vec::new();
    let mut last = None;
    for (line, text) in (1..).zip(source.lines()) {
        let text = text.trim_start();
        let outer = text
            .strip_prefix("///")
            .filter(|rest| !rest.starts_with('/'));
        let inner = text.strip_prefix("//!");
        let Some(text) = outer.or(inner).map(str::trim) else {
            continue;
        };
        match found.last_mut() {
            Some((_, whole, _)) if last == Some((line - 1, inner.is_some())) => {
                whole.push('\n');
                whole.push_str(text);
            }
            _ => found.push((line, text.to_owned(), inner.is_some())),
        }
        last = Some((line, inner.is_some()));
    }
    found
}

/// The names of the variants of the first enum in some lines: in kebab case, or as their attributes say.
pub(crate) fn variants<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut found = Vec::new();
    let mut renamed = None;
    let body = lines
        .skip_while(|line| !line.contains("enum "))
        .skip(1)
        .take_while(|line| *line != "}");
    for line in body.filter_map(|line| line.strip_prefix("    ")) {
        if let Some((_, name)) = line
            .strip_prefix("#[")
            .and_then(|of| of.split_once("(name = \""))
        {
            renamed = name.split('"').next().map(str::to_owned);
        } else if line.starts_with(char::is_uppercase) {
            let end = line.find(|c: char| !c.is_alphanumeric());
            let name = kebab_case(&line[..end.unwrap_or(line.len())]);
            found.push(renamed.take().unwrap_or(name));
        }
    }
    found
}

/// The words of the text literals of a source's lines.
pub(crate) fn literals(source: &str) -> BTreeSet<String> {
    code(source)
        .flat_map(|line| line.split('"').skip(1).step_by(2))
        .flat_map(words)
        .collect()
}

/// Words of a text, in which `-` and `_` join.
pub(crate) fn words(text: &str) -> impl Iterator<Item = String> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_' && c != '-')
        .filter(|word| !word.is_empty())
        .map(str::to_owned)
}

#[test]
fn comments_and_code_are_distinguished() {
    let source = "//! Top\n//! two.\n/// One.\nlet a = \"b-c\"; // unsafe\n//// no\n";
    assert_eq!(
        doc_comments(source),
        [
            (1, "Top\ntwo.".to_owned(), true),
            (3, "One.".to_owned(), false)
        ]
    );
    assert_eq!(code(source).collect::<Vec<_>>(), ["let a = \"b-c\";"]);
    assert_eq!(literals(source), BTreeSet::from(["b-c".to_owned()]));
}

#[test]
fn variants_are_read_from_the_source() {
    let source = "enum Verb {\n    /// Does.\n    First(a::B),\n    #[command(name = \"-\")]\n    Script,\n    \
                  LastOne {\n        All: bool,\n    },\n}\n    Other,\n";
    assert_eq!(variants(source.lines()), ["first", "-", "last-one"]);
}
