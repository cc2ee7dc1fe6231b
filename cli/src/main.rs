//! The command `quadrant`.
#![forbid(unsafe_code)]

mod circle;
mod commission;
mod compare;
mod completions;
mod connect;
mod design;
mod endpoint;
mod identify;
mod kept;
mod own_stage;
mod plane;
mod replay;
mod replay_program;
mod settings;
mod subject;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use quadrant_cli::{explained, terminal, warn};

/// Servo control that removes friction's quadrant glitches: identify, design, commission, test and talk to a machine.
///
/// Without a command, `compare` runs, and takes its options.
#[derive(Debug, Parser)]
#[command(
    name = "quadrant",
    version,
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
    /// Run the thesis' comparison on the simulated stage: PID and N-PID with every feedforward, three velocities, and a
    /// circle.
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
    /// Run our controllers over a recorded reference, beside what the recorded machine did, or along a part program in
    /// G-code.
    Replay(replay::Arguments),
    /// Say what every setting of the firmware means: its path, unit, range and default.
    Settings(settings::Arguments),
}

/// Does what the command line asks for.
fn run() -> anyhow::Result<()> {
    let Arguments { command, compare } = Arguments::parse();
    match command {
        None => compare::run(&compare),
        Some(Command::Circle(arguments)) => circle::run(&arguments),
        Some(Command::Commission(arguments)) => commission::run(&arguments),
        Some(Command::Compare(arguments)) => compare::run(&arguments),
        Some(Command::Completions(arguments)) => completions::run(&arguments, Arguments::command()),
        Some(Command::Connect(arguments)) => connect::run(&arguments),
        Some(Command::Design(command)) => design::run(&command),
        Some(Command::Identify(command)) => identify::run(&command),
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
