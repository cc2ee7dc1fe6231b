//! `quadrant completions`.

use clap::{Args, Command};
use clap_complete::Shell;

/// Options of `quadrant completions`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints the completions of a command line.
pub(super) fn run(arguments: &Arguments, mut command: Command) -> anyhow::Result<()> {
    clap_complete::generate(
        arguments.shell,
        &mut command,
        "quadrant",
        &mut std::io::stdout(),
    );
    Ok(())
}
