//! `quadrant connect`.

mod command;
mod commission;
mod drive;
mod flash;
mod hands;
mod identify;
mod machine;
mod observe;
mod printer;
mod program;
mod scope;
mod script;
mod settings;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use quadrant_sim::console::{Client, SerialTransport, SimulatedLink, TcpTransport};

use command::Command;
use drive::Session;
use printer::Printer;

/// Where `cargo xtask build --board mps2` leaves the image, from the workspace's folder.
const DEFAULT_IMAGE: &str = "target/images/mps2-f32.elf";

/// Options of `quadrant connect`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: Place,
    /// Seed of the simulated stage's noise; the same seed gives the same results.
    #[arg(long, default_value_t = 1, conflicts_with_all = ["port", "tcp"])]
    seed: u64,
    /// Keep the flash of the simulated or emulated machine in a file, so that what is stored survives this command.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "tcp"])]
    flash: Option<PathBuf>,
    /// Print one JSON object a line: {"command": ..., "result": ...} or {"command": ..., "error": ...}.
    #[arg(long)]
    json: bool,
    /// Print each command of a script before what comes of it.
    #[arg(long, conflicts_with = "json")]
    echo: bool,
    /// Go on after a command that failed; the exit code is 1 all the same.
    #[arg(long)]
    keep_going: bool,
    #[command(subcommand)]
    command: Option<Command>,
}

/// What is at the other end.
#[derive(Clone, Debug, Args)]
#[group(required = false, multiple = false)]
struct Place {
    /// A board at a serial port, such as /dev/ttyACM0 or COM3; 921600 baud.
    #[arg(long, value_name = "PATH")]
    port: Option<String>,
    /// A machine behind a socket: a port that is shared over a network, or an emulator's.
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// The firmware's own code on the simulated stage, in this process. Its time passes as fast as it can, only while it is
    /// waited for.
    #[arg(long)]
    simulated: bool,
    /// The firmware's image in QEMU on the simulated stage, the same way; without a path, the one that `cargo xtask build
    /// --board mps2` has left below this folder.
    #[arg(long, value_name = "ELF", num_args = 0..=1, require_equals = true, default_missing_value = DEFAULT_IMAGE)]
    emulated: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if let Some(Command::Flash(flash)) = &arguments.command {
        return flash::run(flash);
    }
    if let Some(Command::Log(log)) = &arguments.command
        && let Some(elf) = &log.elf
    {
        return flash::log(elf, log);
    }
    let printer = Printer {
        json: arguments.json,
    };
    let mut session = Session::new(connect(arguments)?, printer);
    let succeeded = match &arguments.command {
        None | Some(Command::Script) => {
            script::run(&mut session, arguments.echo, arguments.keep_going)?
        }
        Some(command) => session.run(command, ""),
    };
    if succeeded {
        Ok(())
    } else {
        // What failed has been said. The emulator ends with the session.
        drop(session);
        std::process::exit(1)
    }
}

fn connect(arguments: &Arguments) -> anyhow::Result<Client> {
    let place = &arguments.place;
    let flash = arguments.flash.as_deref();
    let client = match (&place.port, &place.tcp, &place.emulated, place.simulated) {
        (Some(path), ..) => {
            let port = SerialTransport::open(path).with_context(|| {
                format!(
                    "serial port {path} cannot be opened; check the cable, the name (on Linux `ls /dev/ttyACM* \
                     /dev/ttyUSB*`), that no other program has it, and that you may use it (group dialout)"
                )
            })?;
            Client::open(port)
        }
        (_, Some(address), ..) => {
            let socket = TcpTransport::connect(address).with_context(|| {
                format!(
                    "tcp:{address} does not answer; check the address and that the machine runs"
                )
            })?;
            Client::open(socket)
        }
        (_, _, Some(image), _) => return emulated(image, arguments.seed, flash),
        (.., true) => Client::open(SimulatedLink::start(arguments.seed, flash)?),
        _ => anyhow::bail!(
            "no machine is named: give --port PATH for a board, --tcp HOST:PORT, or --simulated or --emulated to try \
             without one"
        ),
    };
    Ok(client?)
}

#[cfg(unix)]
fn emulated(image: &Path, seed: u64, flash: Option<&Path>) -> anyhow::Result<Client> {
    let link = quadrant_sim::console::EmulatedLink::start(image, seed, flash)?;
    Ok(Client::open(link)?)
}

#[cfg(not(unix))]
fn emulated(_: &Path, _: u64, _: Option<&Path>) -> anyhow::Result<Client> {
    anyhow::bail!(
        "--emulated: QEMU shares memory through a file on Unix systems alone; --simulated works here"
    )
}
