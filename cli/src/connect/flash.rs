//! A board's debug probe: `quadrant connect flash` and `log --elf`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, bail};

use super::command::{FlashOptions, LogOptions};

/// Shows the log of a board that runs, until Ctrl-C.
pub(super) fn log(elf: &PathBuf, arguments: &LogOptions) -> anyhow::Result<()> {
    exists(elf)?;
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
    command.args(words).args(file);
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => bail!("probe-rs {}: ended with {status}", words.join(" ")),
        Err(error) if error.kind() == ErrorKind::NotFound => bail!(
            "probe-rs is not installed; `cargo install probe-rs-tools --locked`, or see https://probe.rs"
        ),
        Err(error) => Err(error).context("cannot run probe-rs"),
    }
}
