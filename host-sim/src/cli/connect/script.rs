//! Commands from standard input: a script, or a person at a prompt.

use std::io::{self, BufRead, IsTerminal};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use clap::Parser;
use clap::error::ErrorKind;
use rustyline::DefaultEditor;
use rustyline::error::ReadlineError;

use super::command::Command;
use super::drive::Session;

/// How long input is waited for before the machine is told that its host is there.
const ATTENTION: Duration = Duration::from_millis(100);

/// One line.
#[derive(Debug, Parser)]
#[command(name = "", no_binary_name = true, disable_version_flag = true)]
struct Line {
    #[command(subcommand)]
    command: Command,
}

/// What a line says.
pub(super) enum Said {
    /// Nothing: it is empty or a comment.
    Nothing,
    /// Ask the machine.
    Ask(Box<Command>),
    /// A text for a person: help.
    Show(String),
}

/// Reads a line: words as a shell reads them, `#` begins a comment.
///
/// # Errors
/// A command that there is not, or one that lacks something.
pub(super) fn parse(line: &str) -> Result<Said, String> {
    let Some(words) = shlex::split(line) else {
        return Err("a quotation mark is not closed".to_owned());
    };
    if words.is_empty() {
        return Ok(Said::Nothing);
    }
    match Line::try_parse_from(words) {
        Ok(Line {
            command: Command::Script | Command::Flash(_),
        }) => Err("this command is for the shell, not for a script".to_owned()),
        Ok(line) => Ok(Said::Ask(Box::new(line.command))),
        Err(error) => match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
                Ok(Said::Show(error.to_string()))
            }
            _ => {
                let text = error.to_string();
                let text = text.strip_prefix("error: ").unwrap_or(&text);
                // The first paragraph; a script's reader wants no usage.
                Err(text.split("\n\n").next().unwrap_or(text).trim().to_owned())
            }
        },
    }
}

/// Takes commands until the input ends; says whether all succeeded.
pub(super) fn run(session: &mut Session, echo: bool, keep_going: bool) -> anyhow::Result<bool> {
    if io::stdin().is_terminal() {
        prompt(session)?;
        return Ok(true);
    }
    let mut all = true;
    let (lines, read) = mpsc::sync_channel(0);
    thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            // Nobody reads on after an error.
            if lines.send(line).is_err() {
                return;
            }
        }
    });
    for index in 0.. {
        let Some(line) = attended(session, &read) else {
            break;
        };
        let line = line.context("cannot read standard input")?;
        if echo {
            println!("> {line}");
        }
        let succeeded = one(session, &line, &format!("line {}", index + 1));
        all &= succeeded;
        if !(succeeded || keep_going) {
            break;
        }
    }
    Ok(all)
}

fn one(session: &mut Session, line: &str, place: &str) -> bool {
    match parse(line) {
        Ok(Said::Nothing) => true,
        Ok(Said::Show(text)) => {
            println!("{text}");
            true
        }
        Ok(Said::Ask(command)) => session.run(&command, place),
        Err(error) => {
            session.printer.error(line.trim(), place, &error);
            false
        }
    }
}

/// The next of what another thread reads, or nothing when that has ended; meanwhile the machine knows that its host is there.
fn attended<T>(session: &mut Session, read: &Receiver<T>) -> Option<T> {
    loop {
        match read.recv_timeout(ATTENTION) {
            Ok(line) => return Some(line),
            Err(RecvTimeoutError::Disconnected) => return None,
            // A connection that is broken shows with the next command.
            Err(RecvTimeoutError::Timeout) => {
                let _ = session.client.keep_alive();
            }
        }
    }
}

/// A person: errors end nothing, Ctrl-C stops the axes, Ctrl-D ends.
fn prompt(session: &mut Session) -> anyhow::Result<()> {
    let mut editor = DefaultEditor::new().context("cannot use the terminal")?;
    let (wanted, wants) = mpsc::channel();
    let (lines, read) = mpsc::channel();
    thread::spawn(move || {
        while wants.recv().is_ok() {
            let line = editor.readline("quadrant> ");
            if let Ok(line) = &line {
                let _ = editor.add_history_entry(line.as_str());
            }
            if lines.send(line).is_err() {
                return;
            }
        }
    });
    println!(
        "{}; `help` lists the commands, Ctrl-C stops the axes, Ctrl-D ends",
        session.greeting()
    );
    loop {
        let line = match wanted.send(()) {
            Ok(()) => attended(session, &read),
            Err(_) => None,
        };
        match line {
            Some(Ok(line)) => {
                one(session, &line, "");
            }
            Some(Err(ReadlineError::Interrupted)) => {
                session.run(&Command::Stop, "");
            }
            Some(Err(ReadlineError::Eof)) | None => return Ok(()),
            Some(Err(error)) => return Err(error).context("cannot read the terminal"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Command, Said, parse};

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
        assert!(matches!(
            parse("set x/limits/travel_mm/negative -3"),
            Ok(Said::Ask(_))
        ));
    }

    #[test]
    fn what_is_not_understood_is_named_in_a_line() {
        for (line, part) in [
            ("fly", "fly"),
            ("move q 1", "q"),
            ("move x", "TARGET_MM"),
            ("get 'x", "quotation"),
            ("record --channels w.error --out a.csv", "w.error"),
        ] {
            let Err(error) = parse(line) else {
                panic!("{line} was understood");
            };
            assert!(error.contains(part), "{line}: {error}");
        }
    }

    #[test]
    fn help_is_text_and_no_error() {
        assert!(matches!(parse("help"), Ok(Said::Show(text)) if text.contains("record")));
        assert!(matches!(parse("move --help"), Ok(Said::Show(text)) if text.contains("mm/s")));
    }
}
