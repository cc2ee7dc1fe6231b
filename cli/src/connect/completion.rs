//! Completion at the prompt: commands, options, settings, channels, files.

use std::collections::BTreeSet;

use clap::{Command as Grammar, Subcommand};
use quadrant::link::message::{AxisName, Channel};
use quadrant::settings::leaves;
use rustyline::completion::{Completer, FilenameCompleter, Pair};
use rustyline::highlight::Highlighter;
use rustyline::hint::Hinter;
use rustyline::validate::Validator;
use rustyline::{Context, Helper};

use super::command::Command;

/// Completes the word that the cursor stands behind.
pub(super) struct Completion {
    grammar: Grammar,
    settings: Vec<String>,
    channels: Vec<String>,
    files: FilenameCompleter,
}

impl Completion {
    pub(super) fn new() -> Self {
        Self {
            grammar: Command::augment_subcommands(Grammar::new("")),
            settings: settings(),
            channels: Channel::all().map(|channel| channel.to_string()).collect(),
            files: FilenameCompleter::new(),
        }
    }

    /// The words that may stand where `start` is typed, behind `before`; `None` if a file may.
    fn words(&self, before: &[&str], start: &str) -> Option<BTreeSet<String>> {
        let mut grammar = &self.grammar;
        let mut depth = 0;
        for word in before {
            match grammar.find_subcommand(word) {
                Some(deeper) => (grammar, depth) = (deeper, depth + 1),
                None => break,
            }
        }
        let mut words = BTreeSet::new();
        if depth == before.len() {
            let verbs = grammar.get_subcommands().filter(|verb| !verb.is_hide_set());
            words.extend(verbs.map(|verb| verb.get_name().to_owned()));
        }
        if depth == 0 {
            words.extend(["help", "quit"].map(str::to_owned));
            return Some(words);
        }
        let option = before.last().and_then(|word| word.strip_prefix("--"));
        let asked = grammar
            .get_arguments()
            .find(|argument| argument.get_long().is_some() && argument.get_long() == option);
        let places: Vec<_> = match asked {
            Some(argument) => vec![argument],
            None => grammar.get_positionals().collect(),
        };
        if start.starts_with('-') {
            let longs = grammar
                .get_arguments()
                .filter_map(|argument| argument.get_long());
            words.extend(longs.map(|long| format!("--{long}")));
        }
        let mut takes_file = false;
        for place in places {
            words.extend(
                place
                    .get_possible_values()
                    .iter()
                    .map(|value| value.get_name().to_owned()),
            );
            match place.get_id().as_str() {
                "path" | "prefix" | "gain" => words.extend(self.settings.iter().cloned()),
                "channels" | "channel" => words.extend(self.channels.iter().cloned()),
                "file" | "out" | "csv" | "svg" | "png" | "elf" => takes_file = true,
                _ => {}
            }
        }
        (!takes_file || start.starts_with('-')).then_some(words)
    }
}

/// The settings as a person writes them, `x/feedback/pid/kp_v_per_mm`.
fn settings() -> Vec<String> {
    let mut all = Vec::new();
    for leaf in leaves::all() {
        let path = leaf.path();
        match path.strip_prefix("/axes/*/") {
            // A list is written as a whole.
            _ if path.ends_with("/*") || path.contains("/*/") && !path.starts_with("/axes/*/") => {}
            Some(rest) if !rest.contains('*') => {
                all.extend(AxisName::ALL.map(|axis| format!("{axis}/{rest}")));
            }
            Some(_) => {}
            None => all.push(path.trim_start_matches('/').to_owned()),
        }
    }
    all
}

impl Completer for Completion {
    type Candidate = Pair;

    fn complete(
        &self,
        line: &str,
        cursor: usize,
        context: &Context<'_>,
    ) -> rustyline::Result<(usize, Vec<Pair>)> {
        let typed = line.get(..cursor).unwrap_or(line);
        let begin = typed.rfind([' ', ',']).map_or(0, |place| place + 1);
        let word = typed.rfind(' ').map_or(0, |place| place + 1);
        let before: Vec<&str> = typed[..word].split_whitespace().collect();
        let start = &typed[begin..];
        let Some(words) = self.words(&before, start) else {
            return self.files.complete(line, cursor, context);
        };
        let pairs = words
            .into_iter()
            .filter(|word| word.starts_with(start))
            .map(|word| Pair {
                display: word.clone(),
                replacement: word,
            })
            .collect();
        Ok((begin, pairs))
    }
}

impl Hinter for Completion {
    type Hint = String;
}

impl Highlighter for Completion {}

impl Validator for Completion {}

impl Helper for Completion {}

#[cfg(test)]
mod tests {
    use rustyline::history::DefaultHistory;

    use super::*;

    fn complete(line: &str) -> (usize, Vec<String>) {
        let history = DefaultHistory::new();
        let (begin, pairs) = Completion::new()
            .complete(line, line.len(), &Context::new(&history))
            .expect("completes");
        (
            begin,
            pairs.into_iter().map(|pair| pair.replacement).collect(),
        )
    }

    #[test]
    fn commands_are_completed_and_so_are_theirs() {
        assert_eq!(complete("en").1, ["enable"]);
        assert_eq!(
            complete("re").1,
            ["reboot", "record", "release", "reset", "revert"]
        );
        assert_eq!(complete("capture r"), (8, vec!["read".to_owned()]));
        assert!(complete("").1.contains(&"quit".to_owned()));
    }

    #[test]
    fn settings_are_completed_as_a_person_writes_them() {
        assert_eq!(
            complete("set x/feedback/pid/kp").1,
            ["x/feedback/pid/kp_v_per_mm"]
        );
        assert_eq!(complete("get operation/en").1, ["operation/enabled_by"]);
        assert!(complete("get z/friction/gms/").1.len() > 1);
    }

    #[test]
    fn axes_channels_and_options_are_completed() {
        assert_eq!(complete("home ").1, ["x", "y", "z"]);
        assert_eq!(complete("record --channels x.refe").1, ["x.reference"]);
        // Behind a comma the next of a list begins.
        assert_eq!(
            complete("scope x.error,y.refe"),
            (14, vec!["y.reference".to_owned()])
        );
        assert_eq!(complete("move x 1 --v").1, ["--velocity"]);
    }

    #[test]
    fn files_are_completed_where_a_file_is_asked_for() {
        let (begin, files) = complete("load Cargo.t");
        assert_eq!((begin, files), (5, vec!["Cargo.toml".to_owned()]));
    }
}
