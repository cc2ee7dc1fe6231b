//! The project's chores: `cargo xtask setup`, `build`, `sizes`, `prove-no-panic`, `transcript`, `web`, `test`, and by way of the
//! package `target-tests` what runs an image.
#![forbid(unsafe_code)]

mod board_run;
mod book;
mod documented;
mod figures;
mod frames;
mod layout;
mod lines;
mod modules;
mod msrv;
mod peers;
mod python;
mod setup;
mod stack;
mod test;
mod transcript;
mod web;

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Parser, Subcommand, ValueEnum as _};

use xtask::image::{self, Board, Scalar, Target};
use xtask::toolchain::{Choice, Toolchain};
use xtask::{command, prove};

/// The project's chores.
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    /// Compiler of the firmware [default: the one that `setup` chose last]
    #[arg(long, global = true, env = "QUADRANT_TOOLCHAIN", value_enum)]
    toolchain: Option<Choice>,

    #[command(subcommand)]
    verb: Verb,
}

/// A chore.
#[derive(Subcommand)]
enum Verb {
    /// Find or install what building and emulating the firmware take
    Setup {
        /// Also the C compiler of `count --peer`
        #[arg(long)]
        peer: bool,
    },
    /// Build an image and print how much flash and RAM it uses
    Build(TargetArgs),
    /// Check where an image lies in the memories, and its sizes against the committed ones
    Sizes(SizeArgs),
    /// Count the lines of Rust in each package, against the committed figures
    Lines {
        /// Write the figures to the file with which later runs are compared
        #[arg(long)]
        overwrite_expected: bool,
    },
    /// Check that the oldest compiler that each package states is one that its dependencies allow, and compile with it if rustup has it
    Msrv,
    /// Prove from the linked image that the control tick cannot panic
    ProveNoPanic(TargetArgs),
    /// Play a session through the console, on the simulated machine and on the emulated image
    Transcript {
        /// Write what is printed to the files with which later runs are compared
        #[arg(long)]
        overwrite_expected: bool,
    },
    /// Run the image in QEMU, in lockstep with a simulated stage
    Emulate(Forwarded),
    /// Start the reference board's image in QEMU's model of a near relative of its chip
    BoardSmoke(Forwarded),
    /// Run a board's image on a model of its chip that others wrote (the first time builds it, 4 to 10 min)
    BoardRun(Forwarded),
    /// Inject every fault into the emulated firmware, and report how it was found
    Faults(Forwarded),
    /// Count the instructions of one control tick, by stage and by kind of tick
    Count(Forwarded),
    /// Calculate the cycles of one control tick on the reference board, and a bound of them
    Cycles(Forwarded),
    /// Run every feedback law with every feedforward in lockstep, and count what each costs
    Combinations(Forwarded),
    /// Commission an axis of the emulated firmware through its link
    Commission(Forwarded),
    /// Count the instructions of a control tick while link, queues and log are overloaded
    Saturation(Forwarded),
    /// Build and install the components of LinuxCNC, start it on the simulated stage, and judge its loops and ours
    Linuxcnc(Forwarded),
    /// Time the host simulation beside the same job in C++, Numba and NumPy
    Peers,
    /// Build the Python package, and run its tests, types, examples and notebooks in a clean environment
    Python {
        /// Only build the wheel, into this folder
        #[arg(long, value_name = "FOLDER")]
        wheel: Option<PathBuf>,
    },
    /// Check that the commit can be released, and make the files of a release with their checksums
    Release(Forwarded),
    /// Build the page of the bench, which a browser opens
    Web(WebArgs),
    /// Build the documentation as a searchable book, below target/book
    Book,
    /// Run the commands that README and docs show, in folders below target/documented
    Documented(documented::Options),
    /// Hold what the pages say of instructions, cycles and sizes against the committed figures
    Figures {
        /// Write the figures into the pages
        #[arg(long)]
        overwrite: bool,
    },
    /// Set up, then run every check there is
    Test {
        /// Only the firmware's own: lints, images, proofs
        #[arg(long)]
        firmware_only: bool,
    },
}

/// Options of the packages `target-tests`, `linuxcnc/check` and `release`.
#[derive(Args)]
#[command(disable_help_flag = true)]
struct Forwarded {
    /// Its options; `--help` lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    options: Vec<OsString>,
}

/// Options of the page.
#[derive(Args)]
struct WebArgs {
    /// Serve it on this machine until interrupted
    #[arg(long)]
    serve: bool,
    /// Port to serve it on
    #[arg(long, default_value_t = 8080, requires = "serve")]
    port: u16,
    /// Compare its converter words with the host's in a headless Chromium
    #[arg(long)]
    check: bool,
}

/// Options that choose an image.
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
        Self::new(args.board, args.scalar)
    }
}

/// Whose sizes.
#[derive(Args)]
struct SizeArgs {
    #[command(flatten)]
    target: TargetArgs,
    /// Write the sizes to the file with which later runs are compared
    #[arg(long)]
    overwrite_expected: bool,
    /// Print what takes how much of the flash, by module
    #[arg(long)]
    by_module: bool,
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
    // Setup looks at what is installed; everything else takes what setup chose.
    let toolchain = || Toolchain::chosen(cli.toolchain);
    match cli.verb {
        Verb::Setup { peer } => {
            setup::run(cli.toolchain.unwrap_or(Choice::Auto), peer)?;
        }
        Verb::Build(args) => {
            let image = image::build(toolchain()?, args.into())?;
            println!("{}", image.path.display());
            println!("{}", image.footprint()?);
        }
        Verb::Sizes(args) => {
            let image = image::build(toolchain()?, args.target.into())?;
            if args.by_module {
                modules::print(&image)?;
            }
            layout::check(&image, args.overwrite_expected)?;
        }
        Verb::Lines { overwrite_expected } => lines::run(overwrite_expected)?,
        Verb::Msrv => msrv::run()?,
        Verb::ProveNoPanic(args) => prove::run(toolchain()?, args.into())?,
        Verb::Transcript { overwrite_expected } => {
            transcript::run(toolchain()?, overwrite_expected)?
        }
        Verb::Emulate(args) => forward(toolchain()?, "emulate", args)?,
        Verb::BoardSmoke(args) => forward(toolchain()?, "board-smoke", args)?,
        Verb::BoardRun(args) => board_run::run(cli.toolchain, args.options)?,
        Verb::Faults(args) => forward(toolchain()?, "faults", args)?,
        Verb::Count(args) => forward(toolchain()?, "count", args)?,
        Verb::Cycles(args) => forward(toolchain()?, "cycles", args)?,
        Verb::Combinations(args) => forward(toolchain()?, "combinations", args)?,
        Verb::Commission(args) => forward(toolchain()?, "commission", args)?,
        Verb::Saturation(args) => forward(toolchain()?, "saturation", args)?,
        Verb::Linuxcnc(args) => linuxcnc(args)?,
        Verb::Peers => peers::run()?,
        Verb::Python { wheel: None } => python::run()?,
        Verb::Python {
            wheel: Some(folder),
        } => python::build_wheel(&folder)?,
        Verb::Release(args) => release(cli.toolchain, args)?,
        Verb::Book => book::build()?,
        Verb::Documented(options) => documented::run(&options)?,
        Verb::Figures { overwrite } => figures::run(overwrite)?,
        Verb::Web(args) => {
            let page = web::build(toolchain()?)?;
            if args.check {
                web::check(&page)?;
            }
            if args.serve {
                web::serve(&page, args.port)?;
            }
        }
        Verb::Test {
            firmware_only: false,
        } => return test::run(cli.toolchain.unwrap_or(Choice::Auto)),
        Verb::Test {
            firmware_only: true,
        } => return test::firmware_only(toolchain()?),
    }
    Ok(true)
}

/// Runs the package `linuxcnc/check`.
fn linuxcnc(args: Forwarded) -> Result<()> {
    let mut cargo = command::command("cargo");
    cargo
        .args([
            "run",
            "--quiet",
            "--release",
            "--package",
            "quadrant-linuxcnc-check",
            "--",
        ])
        .args(args.options);
    command::run_quietly(&mut cargo)
}

/// Runs the package `quadrant-release`.
fn release(toolchain: Option<Choice>, args: Forwarded) -> Result<()> {
    let mut cargo = command::command("cargo");
    cargo.args(["run", "--quiet", "--profile", "chores"]);
    cargo.args(["--package", "quadrant-release", "--"]);
    // Its chores read it.
    if let Some(choice) = toolchain.and_then(|choice| choice.to_possible_value()) {
        cargo.env("QUADRANT_TOOLCHAIN", choice.get_name());
    }
    command::run_quietly(cargo.args(args.options))
}

/// Runs a verb of the package `target-tests`.
fn forward(toolchain: Toolchain, verb: &str, args: Forwarded) -> Result<()> {
    let mut cargo = command::command("cargo");
    cargo
        .args(["run", "--quiet", "--package", "quadrant-target-tests", "--"])
        .args(["--toolchain", toolchain.name(), verb])
        .args(args.options);
    command::run_quietly(&mut cargo)
}
