//! The command line.

mod axis;
mod circle;
mod commission;
mod compare;
mod completions;
mod connect;
mod design;
mod endpoint;
pub(crate) mod explain;
mod friction;
mod identify;
mod laws;
mod numerics;
mod output;
mod outputs;
mod replay;
mod replay_program;
mod report;
mod robustness;
mod settings;
mod subject;

use clap::{Parser, Subcommand};

/// Servo control that removes friction's quadrant glitches: the simulated stage and the experiments on it.
///
/// Without a command, `compare` runs.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
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
    /// Show what each friction model can do, on the same motions: loops, memory, drift, lag.
    Friction(friction::Arguments),
    /// Identify an axis: its linear model, its friction, from experiments or from recordings.
    #[command(subcommand)]
    Identify(identify::Command),
    /// Compare all feedback laws, tuned with equal effort at equal robustness, and see what feedforward is worth when its
    /// model is wrong.
    Laws(laws::Arguments),
    /// Say what the number type costs: f32 and fixed point against f64 over the whole comparison.
    Numerics(numerics::Arguments),
    /// Say what the amplifiers' outputs cost: 16 bits against 12 bits, plain and with the error shaped.
    Outputs(outputs::Arguments),
    /// Run our controllers over a recorded reference, beside what the recorded machine did, or along a part program in
    /// G-code.
    Replay(replay::Arguments),
    /// Every table and figure of the thesis' chapters 3 to 5 on the simulated stage, in one page: under five minutes on two
    /// cores. An interrupted report goes on where it stopped.
    Report(report::Arguments),
    /// Say what becomes of tracking when mass, friction, delay, amplifier, encoder or drive change, or a tool cuts: named
    /// scenarios on the simulated stage.
    Robustness(robustness::Arguments),
    /// Say what every setting of the firmware means: its path, unit, range and default.
    Settings(settings::Arguments),
}

/// Does what the command line asks for.
pub(crate) fn run() -> anyhow::Result<()> {
    match Arguments::parse().command {
        None => compare::run(&compare::Arguments::default()),
        Some(Command::Circle(arguments)) => circle::run(&arguments),
        Some(Command::Commission(arguments)) => commission::run(&arguments),
        Some(Command::Compare(arguments)) => compare::run(&arguments),
        Some(Command::Completions(arguments)) => completions::run(&arguments),
        Some(Command::Connect(arguments)) => connect::run(&arguments),
        Some(Command::Design(command)) => design::run(&command),
        Some(Command::Friction(arguments)) => friction::run(&arguments),
        Some(Command::Identify(command)) => identify::run(&command),
        Some(Command::Laws(arguments)) => laws::run(&arguments),
        Some(Command::Numerics(arguments)) => numerics::run(&arguments),
        Some(Command::Outputs(arguments)) => outputs::run(&arguments),
        Some(Command::Replay(arguments)) => replay::run(&arguments),
        Some(Command::Report(arguments)) => report::run(&arguments),
        Some(Command::Robustness(arguments)) => robustness::run(&arguments),
        Some(Command::Settings(arguments)) => settings::run(&arguments),
    }
}
