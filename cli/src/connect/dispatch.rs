//! Each command, given to its part of the console.

use anyhow::bail;
use quadrant_host::client::ClientError;

use super::answer::Answer;
use super::command::{Command, RecordOptions};
use super::line::{self, Said};
use super::session::Session;
use super::{
    commission, firmware_log, identify, inputs, learnt, machine, observe, program, scope, settings,
    simulated_io, watch,
};

/// Gives a command and prints its result; returns true if it succeeded. `source` is its line, for messages.
pub(super) fn run(session: &mut Session, command: &Command, source: &str) -> bool {
    session.client.resume();
    match answer(session, command) {
        Ok(Answer {
            text,
            data,
            failure,
        }) => {
            session.printer.result(command.name(), &text, &data);
            if let Some(failure) = &failure {
                session.printer.error(command.name(), source, failure);
            }
            failure.is_none()
        }
        Err(error) => {
            let error = explained(command, &error);
            session.printer.error(command.name(), source, &error);
            false
        }
    }
}

fn answer(session: &mut Session, command: &Command) -> anyhow::Result<Answer> {
    let client = &mut session.client;
    match command {
        Command::Hello => machine::hello(client),
        Command::Status => machine::status(client),
        Command::Inputs { seconds } => inputs::run(session, *seconds),
        Command::Fault => machine::fault(client),
        Command::Reset
        | Command::Enable
        | Command::Disable
        | Command::Stop
        | Command::Home { .. }
        | Command::Move { .. }
        | Command::Jog { .. }
        | Command::Spindle { .. }
        | Command::Run
        | Command::Reboot => machine::order(client, command),
        Command::Wait {
            what,
            axes,
            timeout,
        } => machine::wait(client, what, axes, *timeout),
        Command::Plan { file } => program::plan(client, file),
        Command::Circle(options) => program::circle_plan(client, options),
        Command::Stream(options) => program::stream_program(client, options),
        Command::Adopt { axis } => learnt::adopt(client, *axis),
        Command::Get { path } => settings::get(client, path),
        Command::Set { path, value } => settings::set(client, path, value),
        Command::List { prefix } => settings::list(client, prefix),
        Command::Diff { file } => settings::diff(client, file.as_deref()),
        Command::Dump { file, overwrite } => settings::dump(client, file, *overwrite),
        Command::Load { file } => settings::load(session, file),
        Command::Apply => settings::apply(session),
        Command::Undo => settings::undo(session),
        Command::Revert | Command::Defaults => settings::draft(client, command),
        Command::Store { provenance } => settings::store(session, provenance.as_deref()),
        Command::Provenance => settings::provenance(client),
        Command::Channels { prefix } => Ok(observe::channels(prefix)),
        Command::Ports => machine::ports(),
        Command::Record(options) => record(session, options),
        Command::Capture(command) => observe::capture(client, command),
        Command::Scope(options) => scope::run(session, options),
        Command::Watch(options) => watch::run(&mut session.client, options),
        Command::Events { seconds } => observe::events(session, *seconds),
        Command::Log(options) => firmware_log::run(session, options),
        Command::Press { inputs } => simulated_io::press(session, inputs),
        Command::Release { inputs } => simulated_io::release(session, inputs),
        Command::PowerCycle => simulated_io::power_cycle(client),
        Command::Identify(command) => identify::run(client, command),
        Command::Commission(options) => commission::run(client, options),
        Command::Flash(_) | Command::Script => {
            anyhow::bail!("this command is for the shell, not for a session")
        }
    }
}

/// Records channels while the command behind `--` runs, if there is one.
fn record(session: &mut Session, options: &RecordOptions) -> anyhow::Result<Answer> {
    let then = match options.then.as_slice() {
        [] => None,
        words => {
            let line = words.join(" ");
            match line::parse(&line) {
                Ok(Said::Ask(command)) => Some(command),
                Ok(_) => bail!("record: `{line}` is no command of the machine"),
                Err(error) => bail!("record: {error}"),
            }
        }
    };
    observe::record(session, options, |session| {
        then.is_none_or(|command| run(session, &command, "record"))
    })
}

/// An error and its causes; most messages contain their cause's already. A request that failed is named by the command that made it,
/// unless that makes requests of many kinds.
fn explained(command: &Command, error: &anyhow::Error) -> String {
    let Some(error) = error.downcast_ref::<ClientError>() else {
        return quadrant_cli::explained(error);
    };
    let text = error.to_string();
    let makes_many = matches!(command, Command::Identify(_) | Command::Commission(_));
    match error
        .request()
        .and_then(|request| text.strip_prefix(request))
    {
        Some(rest) if !makes_many => format!("{}{rest}", command.name()),
        _ => text,
    }
}
