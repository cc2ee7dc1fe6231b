//! The project's chores: `cargo xtask setup`, `build`, `emulate`, `faults`, `story`, `board-smoke`, `count`,
//! `prove-no-panic`, `sizes`, `test`.
#![forbid(unsafe_code)]

mod attribution;
mod board_smoke;
mod call_graph;
mod combinations;
mod command;
mod count;
mod emulate;
mod faults;
mod frames;
mod gdb;
mod golden;
mod image;
mod layout;
mod listing;
mod modules;
mod prove;
mod setup;
mod stack;
mod stages;
mod story;
mod test;
mod toolchain;
mod trace;
mod twin;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand};

use crate::image::{Board, Scalar, Target};
use crate::toolchain::{Choice, Toolchain};

/// The project's chores.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    /// How the firmware is compiled [default: what `setup` chose last]
    #[arg(long, global = true, env = "QUADRANT_TOOLCHAIN", value_enum)]
    toolchain: Option<Choice>,

    #[command(subcommand)]
    verb: Verb,
}

/// What to do.
#[derive(Subcommand)]
enum Verb {
    /// Find or install what building and emulating the firmware take
    Setup,
    /// Build a release image and print how much flash and RAM it uses
    Build(TargetArgs),
    /// Run the image in QEMU, in lockstep with a simulated stage
    Emulate(EmulateArgs),
    /// Start the reference board's image in QEMU's model of a near relative of its chip
    BoardSmoke,
    /// Provoke every fault in the emulated firmware, and tell how it was found
    Faults(FaultArgs),
    /// Count the instructions of a control tick while link, queues and log are overloaded
    Saturation {
        /// The firmware's number type
        #[arg(long, value_enum, default_value_t = Scalar::F32)]
        scalar: Scalar,
    },
    /// Count the instructions of one control tick, stage by stage
    Count(CountArgs),
    /// Run every feedback law with every feedforward in lockstep, and count what each costs
    Combinations(CombinationArgs),
    /// Prove from the linked image that the control tick cannot panic
    ProveNoPanic(TargetArgs),
    /// Check where an image lies in the memories, and its sizes against the committed ones
    Sizes(SizeArgs),
    /// Play a machine's whole story through the console, on the simulated machine and on the emulated image
    Story {
        /// Write what is printed to the files that later runs are held against
        #[arg(long)]
        overwrite_expected: bool,
    },
    /// Set up, then run every check there is
    Test,
}

/// Which image.
#[derive(Args, Clone, Copy)]
struct TargetArgs {
    /// The machine
    #[arg(long, value_enum, default_value_t = Board::Mps2)]
    board: Board,
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
}

impl From<TargetArgs> for Target {
    fn from(args: TargetArgs) -> Self {
        Self {
            board: args.board,
            scalar: args.scalar,
        }
    }
}

/// Whose sizes.
#[derive(Args)]
struct SizeArgs {
    #[command(flatten)]
    target: TargetArgs,
    /// Write the sizes to the file that later runs are held against
    #[arg(long)]
    overwrite_expected: bool,
    /// Print what takes how much of the flash, by module
    #[arg(long)]
    by_module: bool,
}

/// How to emulate.
#[derive(Args)]
struct EmulateArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// How long, in seconds of the firmware's time
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Let the hardware timer fire the control interrupt, on recorded inputs
    #[arg(long)]
    paced: bool,
    /// Run on the settings of a file, as `quadrant commission` leaves it, instead of the default ones
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,
}

/// Which faults.
#[derive(Args)]
struct FaultArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Only this one, by its name
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Write the table to the file that later runs are held against
    #[arg(long)]
    overwrite_expected: bool,
}

/// What to count.
#[derive(Args)]
struct CountArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Control ticks to run
    #[arg(long, default_value_t = 250)]
    ticks: u32,
    /// Write the figures to the file that later runs are held against
    #[arg(long)]
    overwrite_expected: bool,
}

/// Which combinations.
#[derive(Args)]
struct CombinationArgs {
    /// The firmware's number type
    #[arg(long, value_enum, default_value_t = Scalar::F32)]
    scalar: Scalar,
    /// Control ticks to count in each run; 0 leaves counting out
    #[arg(long, default_value_t = 60)]
    ticks: u32,
    /// Write the figures to the file that later runs are held against
    #[arg(long)]
    overwrite_expected: bool,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    match run(cli) {
        Ok(true) => ExitCode::SUCCESS,
        // What failed was said when it did.
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

/// Does what was asked for and returns whether it went well.
fn run(cli: Cli) -> Result<bool> {
    // Setup looks at what is there; everything else takes what setup chose.
    let toolchain = || Toolchain::chosen(cli.toolchain);
    match cli.verb {
        Verb::Setup => {
            setup::run(cli.toolchain.unwrap_or(Choice::Auto))?;
        }
        Verb::Build(args) => {
            let image = image::build(toolchain()?, args.into())?;
            println!("{}", image.path.display());
            println!("{}", image.footprint()?);
        }
        Verb::Emulate(args) => {
            let job = match &args.settings {
                Some(path) => twin::job_with(path)?,
                None => twin::job(),
            };
            emulate::run(toolchain()?, args.scalar, job, args.seconds, args.paced)?;
        }
        Verb::BoardSmoke => board_smoke::run(toolchain()?)?,
        Verb::Faults(args) => {
            let only = args.only.as_deref();
            faults::run(toolchain()?, args.scalar, only, args.overwrite_expected)?;
        }
        Verb::Saturation { scalar } => faults::saturation::run(toolchain()?, scalar)?,
        Verb::Count(args) => {
            count::run(
                toolchain()?,
                args.scalar,
                args.ticks,
                args.overwrite_expected,
            )?;
        }
        Verb::Combinations(args) => {
            let toolchain = toolchain()?;
            combinations::lockstep(toolchain, args.scalar)?;
            if args.ticks > 0 {
                combinations::count(toolchain, args.scalar, args.ticks, args.overwrite_expected)?;
            }
        }
        Verb::ProveNoPanic(args) => prove::run(toolchain()?, args.into())?,
        Verb::Sizes(args) => {
            let image = image::build(toolchain()?, args.target.into())?;
            if args.by_module {
                modules::print(&image)?;
            }
            layout::check(&image, args.overwrite_expected)?;
        }
        Verb::Story { overwrite_expected } => story::run(toolchain()?, overwrite_expected)?,
        Verb::Test => return test::run(cli.toolchain.unwrap_or(Choice::Auto)),
    }
    Ok(true)
}
