//! One line of a script, or what a person types at the prompt.

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser};

use super::command::Command;
use super::help;
use crate::grammar;

/// Grammar of a line.
#[derive(Debug, Parser)]
#[command(name = "", no_binary_name = true, disable_version_flag = true)]
struct Line {
    #[command(subcommand)]
    command: Command,
}

/// Meaning of a line.
pub(super) enum Said {
    /// Nothing: it is empty or a comment.
    Nothing,
    /// A command for the machine.
    Ask(Box<Command>),
    /// A text for a person: help.
    Show(String),
}

/// Reads a line: words as a shell reads them, `#` begins a comment.
///
/// # Errors
/// A command that there is not, or one that lacks something.
pub(super) fn parse(line: &str) -> Result<Said, String> {
    if matches!(line.trim(), "?" | "help") {
        return Ok(Said::Show(help::text(&Line::command())));
    }
    let Some(words) = shlex::split(line) else {
        return Err("a quotation mark is not closed".to_owned());
    };
    if words.is_empty() {
        return Ok(Said::Nothing);
    }
    let name = words[0].clone();
    let matches = grammar::with_negative_numbers(Line::command()).try_get_matches_from(words);
    match matches.and_then(|matches| Line::from_arg_matches(&matches)) {
        Ok(Line {
            command: Command::Script | Command::Flash(_),
        }) => Err("this command is for the shell, not for a script".to_owned()),
        Ok(line) => Ok(Said::Ask(Box::new(line.command))),
        Err(error) => match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
                Ok(Said::Show(error.to_string()))
            }
            _ => {
                let text = grammar::message(&error);
                let text = text.strip_prefix("error: ").unwrap_or(&text);
                // The first paragraph and a tip; a script's reader wants no usage.
                let mut paragraphs = text.split("\n\n").map(str::trim);
                let what = paragraphs.next().unwrap_or(text);
                let tip = paragraphs.find_map(|paragraph| paragraph.strip_prefix("tip: "));
                Err(match tip {
                    // It guesses that an option is meant for a value.
                    Some(guess) if guess.contains("as a value") => {
                        format!("{what}; `help {name}` lists the options")
                    }
                    Some(tip) => format!("{what}; {tip}"),
                    None => what.to_owned(),
                })
            }
        },
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::{Command, Line, Said, help, parse};

    #[test]
    fn comments_and_empty_lines_say_nothing() {
        for line in ["", "   ", "# enable", "  # move x 1"] {
            assert!(matches!(parse(line), Ok(Said::Nothing)), "{line:?}");
        }
        let Ok(Said::Ask(command)) = parse("wait rest # and then") else {
            panic!("not understood");
        };
        assert_eq!(command.name(), "wait");
    }

    #[test]
    fn positions_may_be_negative() {
        let Ok(Said::Ask(command)) = parse("move x -12.5 --velocity 20") else {
            panic!("not understood");
        };
        assert!(
            matches!(*command, Command::Move { target_mm, velocity, .. } if (target_mm, velocity) == (-12.5, 20.0))
        );
        assert!(matches!(parse("jog z -2"), Ok(Said::Ask(_))));
        // A range refuses it, not the grammar.
        for line in [
            "circle --radius-mm -5 --feed-mm-min 100",
            "move x 1 --velocity -2",
            "scope --seconds -1",
            "wait rest --timeout -1",
        ] {
            assert!(matches!(parse(line), Ok(Said::Ask(_))), "{line}");
        }
        assert!(matches!(
            parse("set x/limits/travel_mm/negative -3"),
            Ok(Said::Ask(_))
        ));
    }

    #[test]
    fn what_is_not_understood_is_named_in_a_line() {
        for (line, part) in [
            ("fly", "fly"),
            ("enabel", "'enable'"),
            ("move q 1", "q"),
            ("move x", "TARGET_MM"),
            ("get 'x", "quotation"),
            ("record --channels w.error --out a.csv", "w.error"),
            ("circle --radius-mm 5,5 --feed-mm-min 100", "5.5"),
            ("jog x 5,5", "5.5"),
            ("scope --png a.png", "`help scope`"),
            ("scope --windw 1", "'--window'"),
            ("stream a.ngc --period-ticks -5", "-5 is not in"),
        ] {
            let Err(error) = parse(line) else {
                panic!("{line} was understood");
            };
            assert!(error.contains(part), "{line}: {error}");
        }
    }

    #[test]
    fn help_is_text_and_no_error() {
        assert!(matches!(parse("?"), Ok(Said::Show(_))));
        assert!(matches!(parse("help"), Ok(Said::Show(text)) if text.contains("record")));
        assert!(matches!(parse("move --help"), Ok(Said::Show(text)) if text.contains("mm/s")));
    }

    #[test]
    fn every_command_of_the_prompt_is_in_one_group_of_the_help() {
        let mut grouped: Vec<&str> = help::GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        grouped.sort_unstable();
        let grammar = Line::command();
        let mut known: Vec<&str> = grammar
            .get_subcommands()
            .map(|command| command.get_name())
            // For the shell alone.
            .filter(|name| !["-", "flash"].contains(name))
            .collect();
        known.sort_unstable();
        assert_eq!(grouped, known);
    }

    #[test]
    fn the_help_is_cut_nowhere_but_at_the_end_of_a_clause() {
        let grammar = Line::command();
        let shown: String = help::text(&grammar).split_whitespace().collect();
        for (_, names) in help::GROUPS {
            for name in names {
                let command = grammar.find_subcommand(name).unwrap();
                let about = command.get_about().unwrap().to_string();
                let clause = about.split([';', ':']).next().unwrap();
                let clause = clause.split(". ").next().unwrap().trim_end_matches('.');
                let clause: String = clause.split_whitespace().collect();
                assert!(
                    shown.contains(&format!("{name}{clause}")),
                    "{name}: {about}"
                );
            }
        }
    }

    #[test]
    fn a_terminal_of_eighty_columns_has_room_for_the_help() {
        for line in help::text(&Line::command()).lines() {
            assert!(line.chars().count() <= 80, "{line}");
            assert!(!line.ends_with(' '), "{line:?}: says nothing");
        }
    }
}
