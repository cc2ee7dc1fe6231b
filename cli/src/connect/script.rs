//! Commands from standard input: a script, or a person at a prompt.

use std::io::{self, BufRead, IsTerminal};
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use quadrant_cli::{say, terminal};
use quadrant_host::client::{Client, ClientError, settle};
use quadrant_link::message::Body;
use rustyline::config::Configurer;
use rustyline::error::ReadlineError;
use rustyline::history::DefaultHistory;
use rustyline::{CompletionType, Editor};

use super::command::Command;
use super::completion::Completion;
use super::dispatch;
use super::line::{Said, parse};
use super::session::Session;

/// Time of waiting for input after which a request reports to the machine that its host is there.
const ATTENTION: Duration = Duration::from_millis(100);

/// Takes commands until the input ends; says whether all succeeded.
pub(super) fn run(session: &mut Session, echo: bool, keep_going: bool) -> anyhow::Result<bool> {
    if io::stdin().is_terminal() {
        prompt(session)?;
        return Ok(true);
    }
    let mut all = true;
    let (lines, read) = mpsc::sync_channel(0);
    thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            // Nobody reads on after an error.
            if lines.send(line).is_err() {
                return;
            }
        }
    });
    for index in 0.. {
        let Some(line) = attended(session, &read, Client::keep_alive, Client::is_interrupted)
        else {
            break;
        };
        let line = line.context("cannot read standard input")?;
        if echo {
            say!("> {line}");
        }
        if ends(&line) {
            break;
        }
        let succeeded = one(session, &line, &format!("line {}", index + 1));
        all &= succeeded;
        if session.client.is_interrupted() || !(succeeded || keep_going) {
            break;
        }
    }
    Ok(all && !session.client.is_interrupted())
}

/// True for a line that ends the session.
fn ends(line: &str) -> bool {
    matches!(line.trim(), "quit" | "exit")
}

fn one(session: &mut Session, line: &str, source: &str) -> bool {
    match parse(line) {
        Ok(Said::Nothing) => true,
        Ok(Said::Show(text)) => {
            say!("{text}");
            true
        }
        Ok(Said::Ask(command)) => dispatch::run(session, &command, source),
        Err(error) => {
            session.printer.error(line.trim(), source, &error);
            false
        }
    }
}

/// The next of what another thread reads, or nothing when that or the session has ended; `meanwhile` lets the machine know that its
/// host is there.
fn attended<T>(
    session: &mut Session,
    read: &Receiver<T>,
    meanwhile: fn(&mut Client) -> Result<(), ClientError>,
    has_ended: fn(&Client) -> bool,
) -> Option<T> {
    loop {
        match read.recv_timeout(ATTENTION) {
            Ok(line) => return Some(line),
            Err(RecvTimeoutError::Disconnected) => return None,
            // A connection that is broken shows with the next command.
            Err(RecvTimeoutError::Timeout) => {
                let _ = meanwhile(&mut session.client);
                if has_ended(&session.client) {
                    return None;
                }
            }
        }
    }
}

/// Lets a machine know that its host is there; the time of a simulated one passes as the clock's.
fn let_time_pass(client: &mut Client) -> Result<(), ClientError> {
    if client.simulated_io().is_some() {
        client.wait(ATTENTION)
    } else {
        client.keep_alive()
    }
}

/// Time in which the axes come to rest when a person leaves.
const LEAVING: Duration = Duration::from_secs(10);

/// Leaves no outputs on.
fn leave(session: &mut Session) -> anyhow::Result<()> {
    let client = &mut session.client;
    if !client.interrupt().ends() {
        // What was interrupted before has been said.
        client.resume();
    }
    // The axes of a machine that another program holds are that program's.
    if client.is_view() || !client.status()?.state.drives() {
        return Ok(());
    }
    say!("the outputs are on: the axes stop, and the outputs go off");
    client.order(Body::Stop)?;
    // What does not come to rest is switched off all the same.
    let _ = settle::rest(client, LEAVING);
    client.order(Body::Disable)?;
    Ok(())
}

/// Gives the terminal its modes back, however the prompt ends: the editor may be in the middle of a line.
struct Modes;

impl Drop for Modes {
    fn drop(&mut self) {
        terminal::restore_modes();
    }
}

/// The file of the lines that a person has typed, in `quadrant` below `XDG_STATE_HOME`, without that below `~/.local/state`; none where
/// it cannot be made.
fn history_file() -> Option<PathBuf> {
    let given = |name| std::env::var_os(name).map(PathBuf::from);
    let state = given("XDG_STATE_HOME")
        .filter(|folder| folder.is_absolute())
        .or_else(|| Some(given("HOME")?.join(".local/state")))?;
    let folder = state.join("quadrant");
    std::fs::create_dir_all(&folder).ok()?;
    Some(folder.join("history"))
}

/// A person: errors end nothing, Ctrl-C stops the axes and what is under way, Ctrl-D ends.
fn prompt(session: &mut Session) -> anyhow::Result<()> {
    let _modes = Modes;
    let mut editor =
        Editor::<Completion, DefaultHistory>::new().context("cannot use the terminal")?;
    editor.set_helper(Some(Completion::new()));
    // What all have in common first, then the list of them.
    editor.set_completion_type(CompletionType::List);
    let history = history_file();
    if let Some(file) = &history {
        // The first session finds none.
        let _ = editor.load_history(file);
    }
    let (requests, wants) = mpsc::channel();
    let (lines, read) = mpsc::channel();
    thread::spawn(move || {
        while wants.recv().is_ok() {
            let line = editor.readline("quadrant> ");
            if let Ok(line) = &line {
                let _ = editor.add_history_entry(line.as_str());
                if let Some(file) = &history {
                    // A disk that is full ends no session.
                    let _ = editor.append_history(file);
                }
            }
            if lines.send(line).is_err() {
                return;
            }
        }
    });
    say!(
        "{}; `help` lists the commands, Tab completes, Ctrl-C stops the axes, Ctrl-D ends",
        session.greeting()
    );
    let mut interrupts = 0;
    loop {
        let line = match requests.send(()) {
            Ok(()) => attended(session, &read, let_time_pass, |client| {
                client.interrupt().ends()
            }),
            Err(_) => None,
        };
        match line {
            Some(Ok(line)) => {
                interrupts = 0;
                if ends(&line) {
                    return leave(session);
                }
                one(session, &line, "");
            }
            Some(Err(ReadlineError::Interrupted)) => {
                interrupts += 1;
                let (said, command) = if interrupts == 1 {
                    (
                        "stop; once more disables the outputs, Ctrl-D ends",
                        Command::Stop,
                    )
                } else {
                    ("disable", Command::Disable)
                };
                say!("{said}");
                dispatch::run(session, &command, "");
            }
            Some(Err(ReadlineError::Eof)) | None => return leave(session),
            Some(Err(error)) => return Err(error).context("cannot read the terminal"),
        }
    }
}
