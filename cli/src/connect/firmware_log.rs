//! The firmware's log: over the link, of the emulated board, or out of a file.

use std::fs;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, bail};
use quadrant_cli::say;
use quadrant_host::client::Client;
use quadrant_host::log::{LogDecoder, LogFilter};
use serde_json::json;

use super::answer::Answer;
use super::command::LogOptions;
use super::printer::Printer;
use super::session::Session;

/// Time from one look at the log to the next, while nothing comes.
const LOOK: Duration = Duration::from_millis(50);

/// Prints the lines that have come since the last call; with `follow`, until Ctrl-C.
pub(super) fn run(session: &mut Session, options: &LogOptions) -> anyhow::Result<Answer> {
    if options.file.is_some() {
        bail!("log --file: this is for the shell, and needs no connection");
    }
    let filter = options.filter();
    if let Some(elf) = &options.elf {
        session.log = Some(LogDecoder::of_image(elf).context("log")?);
    }
    let mut count = 0;
    loop {
        let lines = if session.client.simulated_io().is_some() {
            simulated(&mut session.client)?
        } else {
            linked(session)?
        };
        for line in lines.iter().filter(|line| filter.admits(line)) {
            show(&session.printer, line);
            count += 1;
        }
        if !options.follow {
            return Ok(Answer::new("", json!({ "lines": count })));
        }
        session.client.wait(LOOK)?;
    }
}

/// Prints the lines of frames in a file.
pub(super) fn file(elf: &Path, frames: &Path, filter: &LogFilter) -> anyhow::Result<()> {
    let mut decoder = LogDecoder::of_image(elf).context("log")?;
    let frames = fs::read(frames).with_context(|| format!("log: {}", frames.display()))?;
    let lines = decoder.push(&frames);
    for line in lines.iter().filter(|line| filter.admits(line)) {
        say!("{line}");
    }
    Ok(())
}

fn show(printer: &Printer, line: &str) {
    printer.result("log", line, &json!({ "line": line }));
}

/// The lines of the emulated board.
fn simulated(client: &mut Client) -> anyhow::Result<Vec<String>> {
    let endpoint = client.endpoint();
    let lines = client.simulated_io().map(|io| io.log());
    match lines.transpose().context("log")?.flatten() {
        Some(lines) => Ok(lines),
        None => bail!(
            "log: {endpoint} runs without the firmware that logs; `events` shows what the link reports"
        ),
    }
}

/// The lines that the link has.
fn linked(session: &mut Session) -> anyhow::Result<Vec<String>> {
    let Some(decoder) = &mut session.log else {
        bail!(
            "log: give the firmware that is on the board for its strings, --elf FILE, once a session; `events` shows what the link \
             reports without it"
        );
    };
    let mut lines = Vec::new();
    loop {
        let page = session.client.log(decoder.next()).context("log")?;
        lines.extend(decoder.page(&page));
        if page.bytes.is_empty() {
            return Ok(lines);
        }
    }
}
