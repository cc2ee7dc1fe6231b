//! The command `quadrant connect`: the console.

mod answer;
mod command;
mod commission;
mod completion;
mod dispatch;
mod firmware_log;
mod flash;
mod help;
mod identify;
mod inputs;
mod learnt;
mod line;
mod machine;
mod observe;
mod printer;
mod program;
mod scope;
mod script;
mod session;
mod settings;
mod simulated_io;
mod watch;

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use quadrant_cli::warn;
use quadrant_host::client::Client;
use quadrant_link::message::{AxisMode, MachineState};

use self::answer::Answer;
use self::command::Command;
use self::printer::Printer;
use self::session::Session;
use crate::endpoint::{DEFAULT_IMAGE, LinkEndpoint, Preset, Simulation};
use crate::own_stage::OwnStage;

/// Time between two looks at a motion.
const LOOK: Duration = Duration::from_millis(20);

/// Options of `quadrant connect`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    machine: MachineOptions,
    #[command(flatten)]
    stage: OwnStage,
    /// Seed of the simulated stage's noise; the same seed gives the same results.
    #[arg(long, default_value_t = 1, conflicts_with_all = ["port", "tcp", "look"])]
    seed: u64,
    /// Keep the flash of the simulated or emulated machine in a file, so that what is stored survives this command.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["port", "tcp", "look"])]
    flash: Option<PathBuf>,
    /// Let others look at the machine meanwhile, with `quadrant connect --look HOST:PORT`: states, inputs, faults, events. They
    /// may stop the axes and disable the outputs, and nothing else. A port alone is for programs on this computer; with 0.0.0.0
    /// before it, its network reaches it, and others need the token that is shown.
    #[arg(long, value_name = "[HOST:]PORT", conflicts_with = "look")]
    share: Option<String>,
    /// The token that the program shows that shares the machine beyond its computer.
    #[arg(long, requires = "look")]
    token: Option<String>,
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

/// Options that name the machine, one at most.
#[derive(Clone, Debug, Args)]
#[group(required = false, multiple = false)]
struct MachineOptions {
    /// A board at a serial port, such as /dev/ttyACM0 or COM3; 921600 baud.
    #[arg(long, value_name = "PATH")]
    port: Option<String>,
    /// A machine behind a socket: a port that is shared over a network, or an emulator's.
    #[arg(long, value_name = "HOST:PORT")]
    tcp: Option<String>,
    /// A machine that another program holds and shares: look at it, stop it, and no more.
    #[arg(long, value_name = "HOST:PORT")]
    look: Option<String>,
    /// The firmware's own code on the simulated stage, in this process. Its time passes as fast as it can while it is waited for,
    /// as the clock's while the prompt waits for a command, and not at all while a script is read. It is not commissioned, as a
    /// board from the shop; --simulated=commissioned has settings that suit the stage.
    #[arg(long, value_enum, value_name = "STATE", num_args = 0..=1, require_equals = true, default_missing_value = "fresh")]
    simulated: Option<Preset>,
    /// The firmware's image in QEMU on the simulated stage, the same way; without a path, the one that `cargo xtask build
    /// --board mps2` has left below this folder.
    #[arg(long, value_name = "ELF", num_args = 0..=1, require_equals = true, default_missing_value = DEFAULT_IMAGE)]
    emulated: Option<PathBuf>,
}

impl MachineOptions {
    /// True if none is named.
    const fn is_nowhere(&self) -> bool {
        self.port.is_none()
            && self.tcp.is_none()
            && self.look.is_none()
            && self.simulated.is_none()
            && self.emulated.is_none()
    }
}

pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if let Some(Command::Flash(flash)) = &arguments.command {
        anyhow::ensure!(
            arguments.machine.is_nowhere(),
            "flash: it programs a board through its debug probe, not a machine behind an option; leave --port, --tcp, --look, --simulated \
             and --emulated out"
        );
        return flash::run(flash);
    }
    if let Some(Command::Log(log)) = &arguments.command
        && let Some(elf) = &log.elf
    {
        if let Some(frames) = &log.file {
            return firmware_log::file(elf, frames, &log.filter());
        }
        if arguments.machine.is_nowhere() {
            return flash::log(elf, log);
        }
    }
    let printer = Printer {
        json: arguments.json,
    };
    if let Some(command @ Command::Ports) = &arguments.command {
        let Answer { text, data, .. } = machine::ports()?;
        printer.result(command.name(), &text, &data);
        return Ok(());
    }
    let mut session = Session::new(connect(arguments)?, printer);
    let succeeded = match &arguments.command {
        None | Some(Command::Script) => {
            script::run(&mut session, arguments.echo, arguments.keep_going)?
        }
        Some(command) => dispatch::run(&mut session, command, ""),
    };
    if succeeded && stay(&mut session.client)? {
        Ok(())
    } else {
        // What failed has been said. The emulator ends with the session.
        drop(session);
        std::process::exit(1)
    }
}

/// Stays until the motion ends that the session has started: the machine stops it when its host falls silent. A jog has no
/// end, and is left to that. Returns false if somebody interrupted it.
///
/// # Errors
/// A fault that has ended the motion, or a connection that is broken.
fn stay(client: &mut Client) -> anyhow::Result<bool> {
    let mut reported = false;
    while client.moves() && !client.is_interrupted() {
        // First, for what was acknowledged reaches the control law a little later.
        client.wait(LOOK)?;
        let status = client.status()?;
        client.refuse_fault("the motion", &status)?;
        let jogs = status.axes.iter().any(|axis| axis.mode == AxisMode::Jog);
        // Axes that brake for a fault have it latched when they stand.
        let ended = status.is_at_rest() && status.state != MachineState::Stopping;
        if ended || jogs {
            break;
        }
        if !reported {
            warn!("the motion is under way, and this ends with it; Ctrl-C stops the axes");
            reported = true;
        }
    }
    Ok(!client.is_interrupted())
}

fn connect(arguments: &Arguments) -> anyhow::Result<Client> {
    let named = &arguments.machine;
    let endpoint = match (
        &named.port,
        &named.tcp,
        &named.look,
        &named.emulated,
        named.simulated,
    ) {
        (Some(path), ..) => LinkEndpoint::Serial(path.clone()),
        (_, Some(address), ..) => LinkEndpoint::Tcp(address.clone()),
        (_, _, Some(address), ..) => LinkEndpoint::Look(address.clone(), arguments.token.clone()),
        (.., Some(image), _) => LinkEndpoint::Emulated(image.clone()),
        (.., Some(preset)) => LinkEndpoint::Simulated(preset),
        _ => anyhow::bail!(
            "no machine is named: give --port PATH for a board, --tcp HOST:PORT, or --simulated or --emulated to try \
             without one"
        ),
    };
    let simulation = Simulation {
        seed: arguments.seed,
        stage: arguments.stage.read()?,
        ..Simulation::default()
    };
    endpoint.connect(
        &simulation,
        arguments.flash.as_deref(),
        arguments.share.as_deref(),
    )
}
