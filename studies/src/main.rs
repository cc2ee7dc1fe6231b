//! The command `quadrant-studies`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use quadrant_cli::{explained, terminal, warn};
use quadrant_studies::cuts::Cuts;
use quadrant_studies::identification::Identification;
use quadrant_studies::learning::Learning;
use quadrant_studies::numerics::NumberTypes;
use quadrant_studies::outputs::Outputs;
use quadrant_studies::random_axes::{Axes, cases};
use quadrant_studies::random_faults::Faults;
use quadrant_studies::robustness::Robustness;
use quadrant_studies::step_direction::StepDirection;
use quadrant_studies::thesis::Report;
use quadrant_studies::wrong_model::WrongModel;
use quadrant_studies::{campaign, study};

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
    Axes(AxesArguments),
    /// Run learning under random cuts while friction changes, and compare it with no feedforward, 2 s by 2 s.
    Cuts(campaign::Arguments<Cuts>),
    /// Run the firmware's tasks through random faults at random activities, and check what must hold in every
    /// case.
    Faults(campaign::Arguments<Faults>),
    /// Compare identification with the plant's parameters, which it does not know: errors, and whether the stated
    /// uncertainties hold.
    Identification(study::Arguments<Identification>),
    /// Run the feedforward that learns from other starts, after a step of friction, and in a cut that is cancelled.
    Learning(study::Arguments<Learning>),
    /// Compare f32 and fixed point with f64 over the whole comparison.
    Numerics(study::Arguments<NumberTypes>),
    /// Compare amplifier outputs of 16 bits with 12 bits, plain and with the error shaped.
    Outputs(study::Arguments<Outputs>),
    /// Make every table and figure of the thesis' chapters 3 to 5 in one page: under five minutes on two cores.
    Report(study::Arguments<Report>),
    /// Run the laws with a changed mass, friction, delay, amplifier or encoder, and while a tool cuts.
    Robustness(study::Arguments<Robustness>),
    /// Let axes follow another control's pulses, and compare the reversals with those of the plan itself.
    StepDirection(study::Arguments<StepDirection>),
    /// Run feedforward whose model is wrong behind the best PID.
    WrongModel(study::Arguments<WrongModel>),
}

#[derive(Debug, Args)]
struct AxesArguments {
    /// Named axes instead, each with one thing that a commissioning may stumble over: a table of them, in Markdown.
    #[arg(long, conflicts_with_all = ["seeds", "shard", "merge", "rigid", "pages"])]
    cases: bool,
    #[command(flatten)]
    random: campaign::Arguments<Axes>,
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Axes(AxesArguments { cases: true, .. }) => {
            cases::print_table();
            Ok(())
        }
        Command::Axes(AxesArguments { random, .. }) => random.run(),
        Command::Cuts(arguments) => arguments.run(),
        Command::Faults(arguments) => arguments.run(),
        Command::Identification(arguments) => arguments.run(),
        Command::Learning(arguments) => arguments.run(),
        Command::Numerics(arguments) => arguments.run(),
        Command::Outputs(arguments) => arguments.run(),
        Command::Report(arguments) => arguments.run(),
        Command::Robustness(arguments) => arguments.run(),
        Command::StepDirection(arguments) => arguments.run(),
        Command::WrongModel(arguments) => arguments.run(),
    };
    match done.and_then(|()| terminal::finish()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            warn!("error: {}", explained(&error));
            ExitCode::FAILURE
        }
    }
}
