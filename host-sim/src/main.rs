//! The command `quadrant`.
#![forbid(unsafe_code)]

mod cli;

use std::process::ExitCode;

use quadrant_sim::command::explained;

fn main() -> ExitCode {
    match cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", explained(&error));
            ExitCode::FAILURE
        }
    }
}
