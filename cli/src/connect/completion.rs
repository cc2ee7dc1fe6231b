//! Completion at the prompt: commands, options, settings, channels, files.

use std::collections::BTreeSet;

use clap::{Arg, ArgAction, Command as Grammar, Subcommand};
use quadrant_host::client::settings::whole_path;
use quadrant_link::message::{AxisName, Channel};
use quadrant_settings::leaves::{self, Range};
use quadrant_settings::tree::is_part;
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
        // `help` is followed by what is asked about.
        let before = match before {
            ["help", asked @ ..] => asked,
            all => all,
        };
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
        if start.starts_with('-') {
            let longs = grammar
                .get_arguments()
                .filter_map(|argument| argument.get_long());
            words.extend(longs.map(|long| format!("--{long}")));
            return Some(words);
        }
        let given = &before[depth..];
        let Some(place) = place(grammar, given) else {
            return Some(words);
        };
        let possible = place.get_possible_values();
        words.extend(possible.iter().map(|value| value.get_name().to_owned()));
        match place.get_id().as_str() {
            "path" | "prefix" | "gain" => words.extend(self.settings.iter().cloned()),
            "channels" | "channel" => words.extend(self.channels.iter().cloned()),
            "value" => words.extend(given.last().into_iter().flat_map(|path| values(path))),
            "what" => words.extend(["homed", "rest"].map(str::to_owned)),
            "file" | "out" | "csv" | "svg" | "elf" => return None,
            _ => {}
        }
        Some(words)
    }
}

/// The argument that stands behind the words that a command has already: the value of an option, or the next of those without a name.
fn place<'a>(grammar: &'a Grammar, given: &[&str]) -> Option<&'a Arg> {
    let option = |word: &str| {
        let long = word.strip_prefix("--")?;
        let all = grammar.get_arguments();
        let mut same = all.filter(|argument| argument.get_long() == Some(long));
        same.find(|argument| argument.get_action().takes_values())
    };
    if let Some(argument) = given.last().and_then(|word| option(word)) {
        return Some(argument);
    }
    let mut count = 0;
    let mut is_value = false;
    for word in given {
        if !is_value && !word.starts_with("--") {
            count += 1;
        }
        is_value = option(word).is_some();
    }
    let positionals: Vec<&Arg> = grammar.get_positionals().collect();
    let several = |argument: &&Arg| matches!(argument.get_action(), ArgAction::Append);
    positionals
        .get(count)
        .or_else(|| positionals.last().filter(|last| several(last)))
        .copied()
}

/// The values that a setting takes, if they are names; what a part that may be left out takes.
fn values(path: &str) -> Vec<String> {
    let path = whole_path(path);
    if is_part(&path) {
        return ["null", "present"].map(str::to_owned).to_vec();
    }
    match leaves::find(&path).map(|leaf| leaf.range) {
        Some(Range::Name(names)) => names.iter().map(|name| (*name).to_owned()).collect(),
        Some(Range::Flag) => ["false", "true"].map(str::to_owned).to_vec(),
        _ => Vec::new(),
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
    fn values_are_completed_where_a_value_belongs() {
        assert_eq!(
            complete("set operation/enabled_by ").1,
            ["any", "host", "operator"]
        );
        assert_eq!(complete("set x/feedback/law n-").1, ["n-pid"]);
        assert_eq!(complete("set y/commissioned ").1, ["false", "true"]);
        assert_eq!(
            complete("set z/feedforward/learning ").1,
            ["null", "present"]
        );
        // A number may be any.
        assert!(complete("set x/feedback/pid/kp_v_per_mm ").1.is_empty());
        // What an argument is not for is not offered for it.
        assert!(complete("move x ").1.is_empty());
        assert_eq!(complete("move --velocity 5 ").1, ["x", "y", "z"]);
        assert_eq!(complete("capture arm --edge r").1, ["rising"]);
        assert_eq!(complete("wait ho").1, ["homed"]);
        assert_eq!(complete("wait homed ").1, ["x", "y", "z"]);
        assert_eq!(complete("help capt").1, ["capture"]);
    }

    #[test]
    fn files_are_completed_where_a_file_is_asked_for() {
        let (begin, files) = complete("load Cargo.t");
        assert_eq!((begin, files), (5, vec!["Cargo.toml".to_owned()]));
    }
}
