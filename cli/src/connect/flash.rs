//! A board's debug probe: `quadrant connect flash` and `log --elf`.

use std::io::{self, BufRead, BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};

use anyhow::{Context, bail};
use quadrant_cli::say;

use super::command::{FlashOptions, LogOptions};

/// Shows the log of a board that runs, until Ctrl-C.
pub(super) fn log(elf: &PathBuf, arguments: &LogOptions) -> anyhow::Result<()> {
    exists(elf)?;
    if arguments.chooses() {
        bail!(
            "log: --level, --axis, --from and --to choose lines of the link (--port) or of a file (--file), not of a debug probe"
        );
    }
    probe_rs(&["attach", "--chip", &arguments.chip], Some(elf))
}

fn exists(elf: &Path) -> anyhow::Result<()> {
    if !elf.is_file() {
        bail!(
            "{}: no such file; build the firmware first (docs/board-nucleo-f446re.md)",
            elf.display()
        );
    }
    Ok(())
}

/// Flashes the firmware and lets it start.
pub(super) fn run(arguments: &FlashOptions) -> anyhow::Result<()> {
    exists(&arguments.elf)?;
    if arguments.run {
        return probe_rs(&["run", "--chip", &arguments.chip], Some(&arguments.elf));
    }
    probe_rs(
        &["download", "--chip", &arguments.chip],
        Some(&arguments.elf),
    )?;
    probe_rs(&["reset", "--chip", &arguments.chip], None)
}

fn probe_rs(words: &[&str], file: Option<&PathBuf>) -> anyhow::Result<()> {
    let mut command = Command::new("probe-rs");
    command.args(words).args(file).stdout(Stdio::piped());
    match command.spawn().and_then(shown) {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => bail!("probe-rs {}: ended with {status}", words.join(" ")),
        Err(error) if error.kind() == ErrorKind::NotFound => bail!(
            "probe-rs is not installed; `cargo install probe-rs-tools --locked`, or see https://probe.rs"
        ),
        Err(error) => Err(error).context("cannot run probe-rs"),
    }
}

/// Prints what a program prints, the board's log, until it ends.
fn shown(mut program: Child) -> io::Result<ExitStatus> {
    if let Some(output) = program.stdout.take() {
        for line in BufReader::new(output).split(b'\n') {
            say!("{}", String::from_utf8_lossy(&line?));
        }
    }
    program.wait()
}
