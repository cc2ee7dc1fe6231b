//! `quadrant man`.

use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Command};
use quadrant_cli::terminal;

/// Options of `quadrant man`.
#[derive(Clone, Debug, Args)]
pub(super) struct Arguments {
    /// The folder; it is made if it is missing.
    folder: PathBuf,
}

/// Writes a manual page of each command.
pub(super) fn run(arguments: &Arguments, command: Command) -> anyhow::Result<()> {
    let folder = &arguments.folder;
    let cannot = || format!("cannot write manual pages to {}", folder.display());
    std::fs::create_dir_all(folder).with_context(cannot)?;
    clap_mangen::generate_to(command, folder).with_context(cannot)?;
    terminal::print(format_args!("{}\n", folder.display()));
    Ok(())
}
