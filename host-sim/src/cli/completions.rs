//! `quadrant completions`.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

/// Options of `quadrant completions`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The shell.
    shell: Shell,
}

/// Prints the completions.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let mut command = super::Arguments::command();
    clap_complete::generate(
        arguments.shell,
        &mut command,
        "quadrant",
        &mut std::io::stdout(),
    );
    Ok(())
}
