//! Lines of a commissioning that pages of the documentation quote.

use std::fs;
use std::path::Path;

use crate::command::{self, words};

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs");

/// The number before some words, rounded.
fn number_before(text: &str, unit: &str) -> Option<f64> {
    let (before, _) = text.split_once(unit)?;
    let number: f64 = before.split_whitespace().next_back()?.parse().ok()?;
    Some(number.round())
}

/// Does what a page says, up to the first commissioning of which it quotes lines: those, and what the commissioning printed.
fn quoted_and_printed(page: &str, folder: &Path) -> (String, String) {
    let (mut printed, mut prose) = (String::new(), "");
    for (index, part) in page.split("```").enumerate() {
        if index % 2 == 0 {
            prose = part;
            continue;
        }
        let (language, block) = part.split_once('\n').unwrap();
        match language {
            // "... into `name.toml`:"
            "toml" => {
                if let Some(name) = prose.rsplit('`').nth(1) {
                    fs::write(folder.join(name), block).unwrap();
                }
            }
            "text" if block.contains("Chosen: ") => return (block.to_owned(), printed),
            "" => {
                for line in block.lines() {
                    let arguments: Vec<&str> = line.split_whitespace().skip(1).collect();
                    if matches!(arguments.first(), Some(&("new" | "commission"))) {
                        printed = command::succeed(folder, &arguments);
                    }
                }
            }
            _ => {}
        }
    }
    panic!("the page quotes nothing");
}

fn holds(name: &str) {
    let page = fs::read_to_string(Path::new(DOCS).join(name)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (quoted, printed) = quoted_and_printed(&page, folder.path());
    let all = words(&printed);
    for line in quoted.lines() {
        let line = words(line);
        assert!(all.contains(&line), "{name}: {line}\n{printed}");
    }
    let said = number_before(&words(&page), " minutes of axis time");
    if said.is_some() {
        assert_eq!(said, number_before(&all, " minutes of axis time"), "{name}");
    }
}

#[test]
fn the_first_commissioning_on_the_simulated_machine_prints_what_its_page_quotes() {
    holds("start-simulated.md");
}

#[test]
fn the_commissioning_of_ones_own_axis_prints_what_its_page_quotes() {
    holds("task-commission.md");
}

#[test]
fn the_commissioning_of_an_axis_with_a_noisy_encoder_prints_what_its_page_quotes() {
    holds("task-noise.md");
}

#[test]
fn the_commissioning_of_an_axis_with_a_resonance_prints_what_its_page_quotes() {
    holds("task-resonance.md");
}
