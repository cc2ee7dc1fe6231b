//! Tests of the firmware's image in an emulator: bit for bit beside the reference model, every fault, instruction counts.
//! `cargo xtask` has the same verbs.
#![forbid(unsafe_code)]

mod ahead;
mod attribution;
mod board_smoke;
mod combinations;
mod commission;
mod converter;
mod cortex_m;
mod count;
mod cycles;
mod faults;
mod gdb;
mod hosted;
mod interrupt_latency;
mod jitter;
mod kinds;
mod load;
mod lockstep;
mod longest_path;
mod near_home;
mod nucleo_h743zi2;
mod peer;
mod reference_model;
mod saturation;
mod stages;
mod trace;
mod traced_run;
mod walk;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};

use xtask::image::Scalar;
use xtask::toolchain::{Choice, Toolchain};

/// Tests of the firmware's image in an emulator.
#[derive(Parser)]
#[command(name = "target-tests")]
struct Cli {
    /// Compiler of the firmware [default: the one that `cargo xtask setup` chose last]
    #[arg(long, global = true, value_enum)]
    toolchain: Option<Choice>,

    #[command(subcommand)]
    verb: Verb,
}

/// A test.
#[derive(Subcommand)]
enum Verb {
    /// Run the image in QEMU, in lockstep with a simulated stage
    Emulate(EmulateArgs),
    /// Start the reference board's image in QEMU's model of a near relative of its chip
    BoardSmoke,
    /// Inject every fault into the emulated firmware, and report how it was found
    Faults(FaultArgs),
    /// Count the instructions of one control tick, by stage and by kind of tick
    Count {
        /// Instead, those of the control law alone beside the same law in C
        #[arg(long, exclusive = true)]
        peer: bool,
        #[command(flatten)]
        args: CountArgs,
    },
    /// Calculate the cycles of one control tick, and a bound of them
    Cycles(CountArgs),
    /// Run every feedback law with every feedforward in lockstep, and count what each costs
    Combinations(CombinationArgs),
    /// Commission an axis of the emulated firmware through its link
    Commission,
    /// Count the instructions of a control tick while link, queues and log are overloaded
    Saturation {
        /// The firmware's number type
        #[arg(long, value_enum, default_value_t = Scalar::F32)]
        scalar: Scalar,
        /// Write the jitter to the file with which later runs are compared
        #[arg(long)]
        overwrite_expected: bool,
    },
}

/// Options of an emulation.
#[derive(Args)]
struct EmulateArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Duration, in seconds of the firmware's time
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Let the hardware timer fire the control interrupt, on recorded inputs
    #[arg(long)]
    paced: bool,
    /// Run on the settings of a file, as `quadrant commission` leaves it, instead of the default ones
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
    /// Write what the firmware reads and answers of x to a file: counts, word and enable line of each tick
    #[arg(long, value_name = "FILE", conflicts_with = "paced")]
    words: Option<PathBuf>,
}

/// Options that choose faults.
#[derive(Args)]
struct FaultArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Only this one, by its name
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Write the table to the file with which later runs are compared
    #[arg(long)]
    overwrite_expected: bool,
}

/// Options of a count or a calculation of cycles.
#[derive(Args)]
struct CountArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Control ticks to run
    #[arg(long, default_value_t = 250)]
    ticks: u32,
    /// Write the figures to the file with which later runs are compared
    #[arg(long)]
    overwrite_expected: bool,
}

/// Options that choose combinations.
#[derive(Args)]
struct CombinationArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Control ticks to count in each run; 0 leaves counting out
    #[arg(long, default_value_t = 60)]
    ticks: u32,
    /// Write the figures to the file with which later runs are compared
    #[arg(long)]
    overwrite_expected: bool,
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: Cli) -> Result<()> {
    let toolchain = Toolchain::chosen(cli.toolchain)?;
    match cli.verb {
        Verb::Emulate(args) => {
            let job = match &args.settings {
                Some(path) => reference_model::job_with(path)?,
                None => reference_model::job(),
            };
            let words = args.words.as_deref();
            lockstep::run(toolchain, args.scalar, job, args.seconds, args.paced, words)
        }
        Verb::BoardSmoke => board_smoke::run(toolchain),
        Verb::Faults(args) => {
            let only = args.only.as_deref();
            faults::run(toolchain, args.scalar, only, args.overwrite_expected)
        }
        Verb::Commission => commission::run(toolchain),
        Verb::Saturation {
            scalar,
            overwrite_expected,
        } => saturation::run(toolchain, scalar, overwrite_expected),
        Verb::Count { peer: true, .. } => peer::run(toolchain),
        Verb::Count { args, .. } => {
            count::run(toolchain, args.scalar, args.ticks, args.overwrite_expected)
        }
        Verb::Cycles(args) => {
            cycles::run(toolchain, args.scalar, args.ticks, args.overwrite_expected)
        }
        Verb::Combinations(args) => {
            combinations::lockstep(toolchain, args.scalar)?;
            if args.ticks > 0 {
                combinations::count(toolchain, args.scalar, args.ticks, args.overwrite_expected)?;
            }
            Ok(())
        }
    }
}
