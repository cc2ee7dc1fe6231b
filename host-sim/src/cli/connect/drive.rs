//! A session and what it does with each command.

use std::fmt::Display;
use std::time::Duration;

use quadrant::safety::Switches;
use quadrant_sim::console::{Client, ClientError};
use serde_json::{Value, json};

use super::command::Command;
use super::printer::Printer;
use super::{commission, hands, identify, machine, observe, program, scope, settings};

/// A session with a machine, and where its results go.
pub(super) struct Session {
    pub(super) client: Client,
    pub(super) printer: Printer,
    /// Inputs that `press` holds.
    pub(super) pressed: Switches,
}

/// What a command leaves: for a person, and as data.
pub(super) struct Answer {
    pub(super) text: String,
    pub(super) data: Value,
}

impl Answer {
    pub(super) fn new(text: impl Display, data: Value) -> Self {
        Self {
            text: text.to_string(),
            data,
        }
    }

    /// That it was done; a person needs to be told nothing.
    pub(super) fn done() -> Self {
        Self::new("", json!("done"))
    }
}

impl Session {
    pub(super) const fn new(client: Client, printer: Printer) -> Self {
        Self {
            client,
            printer,
            pressed: Switches::NONE,
        }
    }

    /// Who is at the other end, in a line.
    pub(super) fn greeting(&self) -> String {
        let identity = self.client.identity();
        format!(
            "{}: {} with firmware {}",
            self.client.endpoint(),
            identity.board,
            identity.firmware
        )
    }

    /// Gives a command, and prints what comes of it; says whether it succeeded. `place` is where it stands.
    pub(super) fn run(&mut self, command: &Command, place: &str) -> bool {
        match self.answer(command) {
            Ok(answer) => {
                let Answer { text, data } = answer;
                self.printer.result(command.name(), &text, &data);
                true
            }
            Err(error) => {
                self.printer
                    .error(command.name(), place, &explained(&error));
                false
            }
        }
    }

    fn answer(&mut self, command: &Command) -> anyhow::Result<Answer> {
        let client = &mut self.client;
        match command {
            Command::Hello => machine::hello(client),
            Command::Status => machine::status(client),
            Command::Fault => machine::fault(client),
            Command::Reset
            | Command::Enable
            | Command::Disable
            | Command::Stop
            | Command::Home { .. }
            | Command::Move { .. }
            | Command::Jog { .. }
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
            Command::Get { path } => settings::get(client, path),
            Command::Set { path, value } => settings::set(client, path, value),
            Command::List { prefix } => settings::list(client, prefix),
            Command::Dump { file } => settings::dump(client, file),
            Command::Load { file } => settings::load(client, file),
            Command::Apply => settings::apply(client),
            Command::Revert | Command::Defaults => settings::draft(client, command),
            Command::Store { provenance } => settings::store(client, provenance.as_deref()),
            Command::Provenance => settings::provenance(client),
            Command::Record(options) => observe::record(self, options),
            Command::Capture(command) => observe::capture(client, command),
            Command::Scope(options) => scope::run(self, options),
            Command::Events { seconds } => observe::events(self, *seconds),
            Command::Log(options) => hands::log(self, options),
            Command::Press { inputs } => hands::press(self, inputs),
            Command::Release { inputs } => hands::release(self, inputs),
            Command::PowerCycle => hands::power_cycle(client),
            Command::Identify(command) => identify::run(client, command),
            Command::Commission(options) => commission::run(client, options),
            Command::Flash(_) | Command::Script => {
                anyhow::bail!("this command is for the shell, not for a session")
            }
        }
    }
}

/// Seconds that a person gives, as a time.
pub(super) fn seconds(what: &str, seconds: f64) -> anyhow::Result<Duration> {
    const MOST_S: f64 = 1e6;
    if (0.0..=MOST_S).contains(&seconds) {
        Ok(Duration::from_secs_f64(seconds))
    } else {
        anyhow::bail!("{what} = {seconds} s is outside 0 to {MOST_S}")
    }
}

/// An error and its causes; most messages contain their cause's already.
fn explained(error: &anyhow::Error) -> String {
    match error.downcast_ref::<ClientError>() {
        Some(error) => error.to_string(),
        None => crate::explained(error),
    }
}
