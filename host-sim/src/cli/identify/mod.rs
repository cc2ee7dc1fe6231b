//! `quadrant identify`.

use clap::Subcommand;

/// The steps from measurements to parameters.
#[derive(Debug, Subcommand)]
pub(super) enum Command {}

pub(super) fn run(command: &Command) -> anyhow::Result<()> {
    match *command {}
}
