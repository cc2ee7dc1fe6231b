//! `quadrant design`.

use clap::Subcommand;

/// The steps from a model, or a measured response, to controller gains.
#[derive(Debug, Subcommand)]
pub(super) enum Command {}

pub(super) fn run(command: &Command) -> anyhow::Result<()> {
    match *command {}
}
