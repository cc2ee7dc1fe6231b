//! `quadrant completions`.

use clap::{Args, Command};
use clap_complete::Shell;
use quadrant_cli::terminal;

/// Options of `quadrant completions`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints the completions of a command line.
pub(super) fn run(arguments: &Arguments, mut command: Command) -> anyhow::Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "quadrant", &mut text);
    terminal::print(format_args!("{}", String::from_utf8_lossy(&text)));
    Ok(())
}
