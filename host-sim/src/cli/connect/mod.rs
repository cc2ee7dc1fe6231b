//! `quadrant connect`.

mod command;
mod commission;
mod drive;
mod flash;
mod identify;
mod machine;
mod observe;
mod printer;
mod program;
mod scope;
mod script;
mod settings;

use anyhow::Context;
use clap::Args;
use quadrant_sim::console::{Client, SerialTransport, SimulatedLink, TcpTransport};

use command::Command;
use drive::Session;
use printer::Printer;

/// Options of `quadrant connect`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    place: Place,
    /// Seed of the simulated machine's noise; the same seed gives the same results.
    #[arg(long, default_value_t = 1, requires = "simulated")]
    seed: u64,
    /// Print one JSON object a line: {"command": ..., "result": ...} or {"command": ..., "error": ...}.
    #[arg(long)]
    json: bool,
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
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if let Some(Command::Flash(flash)) = &arguments.command {
        return flash::run(flash);
    }
    let printer = Printer {
        json: arguments.json,
    };
    let mut session = Session::new(connect(arguments)?, printer);
    let succeeded = match &arguments.command {
        None | Some(Command::Script) => script::run(&mut session, arguments.keep_going)?,
        Some(command) => session.run(command, ""),
    };
    if succeeded {
        Ok(())
    } else {
        // What failed has been said.
        std::process::exit(1)
    }
}

fn connect(arguments: &Arguments) -> anyhow::Result<Client> {
    let place = &arguments.place;
    let client = match (&place.port, &place.tcp, place.simulated) {
        (Some(path), _, _) => {
            let port = SerialTransport::open(path).with_context(|| {
                format!(
                    "serial port {path} cannot be opened; check the cable, the name (on Linux `ls /dev/ttyACM* \
                     /dev/ttyUSB*`), that no other program has it, and that you may use it (group dialout)"
                )
            })?;
            Client::open(port)
        }
        (_, Some(address), _) => {
            let socket = TcpTransport::connect(address).with_context(|| {
                format!(
                    "tcp:{address} does not answer; check the address and that the machine runs"
                )
            })?;
            Client::open(socket)
        }
        (_, _, true) => Client::open(SimulatedLink::start(arguments.seed)?),
        _ => anyhow::bail!(
            "no machine is named: give --port PATH for a board, --tcp HOST:PORT, or --simulated to try without one"
        ),
    };
    Ok(client?)
}
