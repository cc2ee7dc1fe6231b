//! The command `quadrant-studies`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use quadrant_cli::{explained, terminal, warn};
use quadrant_studies::{
    cuts, friction_models, identification, laws, learning, numerics, outputs, random_axes,
    random_faults, report, robustness,
};

/// The thesis' tables and figures, and the comparative studies, on the simulated stage.
#[derive(Debug, Parser)]
#[command(name = "quadrant-studies", version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Commission random axes that are not the simulated stage's, and judge the settings on motions that the commissioning did
    /// not see.
    Axes(random_axes::command::Arguments),
    /// Run learning under random cuts while friction changes, and compare it with no feedforward, 2 s by 2 s.
    Cuts(cuts::command::Arguments),
    /// Run the firmware's tasks through random faults at random activities, and check what must hold in every
    /// case.
    Faults(random_faults::command::Arguments),
    /// Compare the friction models on the same motions: loops, memory, drift, lag.
    Friction(friction_models::command::Arguments),
    /// Compare identification with the plant's parameters, which it does not know: errors, and whether the stated
    /// uncertainties hold.
    Identification(identification::command::Arguments),
    /// Compare all feedback laws, tuned with equal effort at equal robustness, and feedforward whose model is wrong.
    Laws(laws::command::Arguments),
    /// Run the feedforward that learns from other starts, on part programs, after changes of the axis.
    Learning(learning::command::Arguments),
    /// Compare f32 and fixed point with f64 over the whole comparison.
    Numerics(numerics::command::Arguments),
    /// Compare amplifier outputs of 16 bits with 12 bits, plain and with the error shaped.
    Outputs(outputs::command::Arguments),
    /// Make every table and figure of the thesis' chapters 3 to 5 and the studies in one page: under five minutes on two
    /// cores. An interrupted report goes on where it stopped.
    Report(report::command::Arguments),
    /// Run the laws with a changed mass, friction, delay, amplifier, encoder or drive, and while a tool cuts.
    Robustness(robustness::command::Arguments),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Axes(arguments) => random_axes::command::run(&arguments),
        Command::Cuts(arguments) => cuts::command::run(&arguments),
        Command::Faults(arguments) => random_faults::command::run(&arguments),
        Command::Friction(arguments) => friction_models::command::run(&arguments),
        Command::Identification(arguments) => identification::command::run(&arguments),
        Command::Laws(arguments) => laws::command::run(&arguments),
        Command::Learning(arguments) => learning::command::run(&arguments),
        Command::Numerics(arguments) => numerics::command::run(&arguments),
        Command::Outputs(arguments) => outputs::command::run(&arguments),
        Command::Report(arguments) => report::command::run(&arguments),
        Command::Robustness(arguments) => robustness::command::run(&arguments),
    };
    match done.and_then(|()| terminal::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            warn!("error: {}", explained(&error));
            ExitCode::FAILURE
        }
    }
}
