//! The command `quadrant design`.

mod npid;
mod pid;
mod process;

use clap::Subcommand;

/// The steps from a model, or a measured response, to controller gains.
#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Design the nonlinear gain of N-PID: Popov plot, bounds, ko and emax, robustness (thesis, Table 4.3).
    Npid(npid::Arguments),
    /// Design a PID: to margins, to a crossover, or the stiffest under bounds on |S| and |T| (thesis, Tables 4.1 and 4.2).
    Pid(pid::Arguments),
}

pub(super) fn run(command: &Command) -> anyhow::Result<()> {
    match command {
        Command::Npid(arguments) => npid::run(arguments),
        Command::Pid(arguments) => pid::run(arguments),
    }
}
