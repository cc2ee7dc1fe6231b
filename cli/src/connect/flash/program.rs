//! The debug probe by the program probe-rs, which has to be installed.

use std::io::{self, BufRead, BufReader, ErrorKind};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};

use anyhow::{Context, bail};
use quadrant_cli::say;

use super::Job;

/// A probe that catches hard faults would halt the processor before the firmware's handler has switched the outputs off; one that
/// catches resets would keep it from starting again after the watchdog's.
const LET_RUN: [&str; 2] = ["--no-catch-hardfault", "--no-catch-reset"];

/// Flashes an image and lets it start; with `stay`, shows its log until Ctrl-C.
pub(super) fn flash(job: &Job, stay: bool) -> anyhow::Result<()> {
    if stay {
        return probe_rs("run", job, &LET_RUN, Some(job.elf));
    }
    probe_rs("download", job, &["--verify"], Some(job.elf))?;
    probe_rs("reset", job, &[], None)
}

/// Shows the log of a board that runs, until Ctrl-C.
pub(super) fn log(job: &Job) -> anyhow::Result<()> {
    probe_rs("attach", job, &LET_RUN, Some(job.elf))
}

fn probe_rs(verb: &str, job: &Job, options: &[&str], file: Option<&Path>) -> anyhow::Result<()> {
    let mut command = Command::new("probe-rs");
    command.args([verb, "--chip", &job.chip]);
    if let Some(probe) = job.probe {
        command.args(["--probe", probe]);
    }
    command.args(options).args(file).stdout(Stdio::piped());
    match command.spawn().and_then(shown) {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => bail!("probe-rs {verb}: ended with {status}"),
        Err(error) if error.kind() == ErrorKind::NotFound => bail!(
            "this build flashes by the program probe-rs, which is not installed; `cargo install probe-rs-tools --locked`, or see \
             https://probe.rs; a released `quadrant` needs none"
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
