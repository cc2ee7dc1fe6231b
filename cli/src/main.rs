//! The command `quadrant`.
#![forbid(unsafe_code)]

mod circle;
mod commission;
mod compare;
mod completions;
mod connect;
mod design;
mod endpoint;
mod grammar;
mod identify;
mod kept;
mod manual;
mod new;
mod numbers;
mod own_stage;
mod plane;
mod plot;
mod replay;
mod replay_program;
mod settings;
mod subject;

use std::process::ExitCode;
use std::sync::LazyLock;

use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use quadrant_cli::{explained, terminal, warn};

/// Version, commit, and the version of the link's protocol that a board has to speak.
static LONG_VERSION: LazyLock<String> = LazyLock::new(|| {
    format!(
        "{}\ncommit {}\nlink protocol {}",
        env!("CARGO_PKG_VERSION"),
        env!("QUADRANT_COMMIT"),
        quadrant_link::PROTOCOL_VERSION
    )
});

/// Servo control that removes friction's quadrant glitches: identify, design, commission, test and talk to a machine.
///
/// Without a command, `compare` runs, and takes its options.
#[derive(Debug, Parser)]
#[command(
    name = "quadrant",
    version,
    long_version = LONG_VERSION.as_str(),
    about,
    args_conflicts_with_subcommands = true
)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    compare: compare::Arguments,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run circle tests after ISO 230-4 on the simulated stage: every plane, several radii and feeds, both senses.
    Circle(circle::Arguments),
    /// Commission an axis, unattended: from nothing known to settings that the firmware runs, with a report.
    Commission(commission::Arguments),
    /// Compare laws on a simulated stage, the built-in one or your own: the best PID with and without feedforward of friction, and the
    /// thesis' laws, at three velocities, and on a circle.
    Compare(compare::Arguments),
    /// Write what a shell needs to complete this program's commands.
    Completions(completions::Arguments),
    /// Talk to a machine: a board, or a simulated one. Without a command, commands are read from standard input.
    Connect(Box<connect::Arguments>),
    /// Design a controller on a model of the axis or on a measured frequency response.
    #[command(subcommand)]
    Design(design::Command),
    /// Identify an axis: its linear model, its friction, from experiments or from recordings.
    #[command(subcommand)]
    Identify(identify::Command),
    /// Write a manual page of each command to a folder.
    Man(manual::Arguments),
    /// Write a settings file for a machine that nobody has commissioned: encoder, amplifier, limits, rate. Asks on a terminal for what is not
    /// given.
    New(new::Arguments),
    /// Draw columns of CSV files over time, in the terminal or as a page: a capture, a recording, several runs over each other.
    Plot(plot::Arguments),
    /// Run our controllers over a recorded reference, beside what the recorded machine did, or along a part program in
    /// G-code.
    Replay(replay::Arguments),
    /// Say what every setting of the firmware means: its path, unit, range and default.
    Settings(settings::Arguments),
}

/// Reads the command line, or ends with what is wrong with it.
fn arguments() -> Arguments {
    let matches = grammar::with_negative_numbers(Arguments::command()).try_get_matches();
    match matches.and_then(|matches| Arguments::from_arg_matches(&matches)) {
        Ok(arguments) => arguments,
        Err(error) if error.kind() == ErrorKind::ValueValidation => {
            warn!("{}", grammar::message(&error).trim_end());
            std::process::exit(error.exit_code())
        }
        Err(error) => error.exit(),
    }
}

/// Does what the command line asks for.
fn run() -> anyhow::Result<()> {
    let Arguments { command, compare } = arguments();
    match command {
        None => compare::run(&compare),
        Some(Command::Circle(arguments)) => circle::run(&arguments),
        Some(Command::Commission(arguments)) => commission::run(&arguments),
        Some(Command::Compare(arguments)) => compare::run(&arguments),
        Some(Command::Completions(arguments)) => completions::run(&arguments, Arguments::command()),
        Some(Command::Connect(arguments)) => connect::run(&arguments),
        Some(Command::Design(command)) => design::run(&command),
        Some(Command::Identify(command)) => identify::run(&command),
        Some(Command::Man(arguments)) => manual::run(&arguments, Arguments::command()),
        Some(Command::New(arguments)) => new::run(&arguments),
        Some(Command::Plot(arguments)) => plot::run(&arguments),
        Some(Command::Replay(arguments)) => replay::run(&arguments),
        Some(Command::Settings(arguments)) => settings::run(&arguments),
    }
}

fn main() -> ExitCode {
    match run().and_then(|()| terminal::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            warn!("error: {}", explained(&error));
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::{Command, CommandFactory};

    use super::Arguments;

    /// Every help text of a grammar, with the way to it, and every option.
    fn texts(
        grammar: &Command,
        way: &str,
        texts: &mut Vec<(String, String)>,
        options: &mut BTreeSet<String>,
    ) {
        let way = format!("{way} {}", grammar.get_name());
        let mut take = |of: &str, text: Option<&clap::builder::StyledStr>| {
            if let Some(text) = text {
                texts.push((of.to_owned(), text.to_string()));
            }
        };
        take(&way, grammar.get_about());
        take(&way, grammar.get_long_about());
        for argument in grammar.get_arguments() {
            let of = format!("{way} {}", argument.get_id());
            take(&of, argument.get_help());
            take(&of, argument.get_long_help());
            options.extend(argument.get_long().map(|long| format!("--{long}")));
        }
        for command in grammar.get_subcommands() {
            self::texts(command, &way, texts, options);
        }
    }

    #[test]
    fn help_is_whole_sentences_and_names_options_that_there_are() {
        let (mut all, mut options) = (Vec::new(), BTreeSet::new());
        texts(&Arguments::command(), "", &mut all, &mut options);
        assert!(all.len() > 200);
        // Of cargo and of the studies.
        options.extend(["--board".to_owned(), "--release".to_owned()]);
        for (of, text) in &all {
            let mut after = text.split(". ").skip(1);
            assert!(
                after.all(|next| !next.starts_with(|first: char| first.is_ascii_lowercase())),
                "{of}: {text}"
            );
            assert!(!text.ends_with([',', ';', ':']), "{of}: {text}");
            let is_name = |sign: char| sign.is_ascii_alphanumeric() || sign == '-';
            for (at, _) in text.match_indices("--") {
                let name: String = text[at..]
                    .chars()
                    .take_while(|sign| is_name(*sign))
                    .collect();
                let name = name.trim_end_matches('-');
                assert!(
                    name.is_empty() || options.contains(name),
                    "{of}: {name}: {text}"
                );
            }
        }
    }
}
