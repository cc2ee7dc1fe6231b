//! The documentation's texts, their links, and the book's table of contents.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use crate::assert_none;
use crate::markdown::{Pieces, pieces};
use crate::source::doc_comments;
use crate::tree::{files, root, sources};

/// A page, or one doc comment.
pub(crate) struct Text {
    pub(crate) file: String,
    pub(crate) pieces: Pieces,
}

/// All pages, and all doc comments but those of this test.
pub(crate) fn texts() -> Vec<Text> {
    let mut found: Vec<Text> = pages()
        .into_iter()
        .map(|(file, text)| {
            let pieces = pieces(&text, 1);
            Text { file, pieces }
        })
        .collect();
    for (file, source) in sources() {
        if file.starts_with("tests/house/") {
            continue;
        }
        for (line, text, _) in doc_comments(&source) {
            let pieces = pieces(&text, line);
            let file = file.clone();
            found.push(Text { file, pieces });
        }
    }
    found
}

/// All pages.
fn pages() -> BTreeMap<String, String> {
    files(&["md"])
}

/// The path that a link on a page leads to, from the root.
fn target(page: &str, link: &str) -> String {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in link.split('/') {
        match part {
            ".." => drop(parts.pop()),
            "." | "" => {}
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

#[test]
fn every_link_between_pages_leads_somewhere() {
    let pages = pages();
    let anchors: BTreeMap<&str, Vec<String>> = pages
        .iter()
        .map(|(file, text)| (file.as_str(), pieces(text, 1).anchors))
        .collect();
    let mut found = Vec::new();
    for (file, text) in &pages {
        for (line, link) in pieces(text, 1).links {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            let (path, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let to = match path {
                "" => file.clone(),
                _ => target(file, path),
            };
            let known = anchors.get(to.as_str());
            let leads = root().join(&to).exists()
                && (anchor.is_empty()
                    || known.is_some_and(|known| known.iter().any(|is| is == anchor)));
            if !leads {
                found.push(format!("{file}:{line}: {link}"));
            }
        }
    }
    assert_none("links that lead nowhere", &found);
}

#[test]
fn the_book_contains_every_page_of_the_documentation() {
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("docs/SUMMARY.md");
    let listed: BTreeSet<String> = pieces(&summary, 1)
        .links
        .into_iter()
        .map(|(_, link)| target("docs/SUMMARY.md", &link))
        .collect();
    let missing: Vec<_> = pages()
        .into_keys()
        .filter(|file| file.starts_with("docs/") && file != "docs/SUMMARY.md")
        .filter(|file| !listed.contains(file))
        .collect();
    assert_none("pages that docs/SUMMARY.md leaves out", &missing);
}

#[test]
fn the_page_of_the_law_shows_the_code_that_is_built() {
    let read = |path: &str| fs::read_to_string(root().join(path)).expect("a file");
    let page = read("docs/law-in-your-firmware.md");
    let (_, from) = page.split_once("```rust\n").expect("code");
    let (shown, _) = from.split_once("```").expect("its end");
    assert_eq!(shown, read("examples/firmware/src/lib.rs"));
}
