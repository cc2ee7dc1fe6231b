//! What the firmware is to run: the job a host has left in memory, or the one built in.

use quadrant::link::lockstep::Job;
use quadrant::settings::{PlanSettings, SettingsError, StageSettings};

/// Decodes the job that the board was given; without one, the default settings and no motion.
///
/// # Panics
/// When the bytes are not a job: then there is nothing that could safely be run.
pub(crate) fn take(bytes: Option<&[u8]>) -> Job {
    let Some(bytes) = bytes else {
        return Job {
            stage: StageSettings::default(),
            plan: PlanSettings::default(),
        };
    };
    match postcard::from_bytes(bytes) {
        Ok(job) => job,
        Err(_) => panic!(
            "the job of {} bytes cannot be decoded: host and firmware differ in version",
            bytes.len()
        ),
    }
}

/// What was built, if the settings were accepted.
///
/// # Panics
/// With the refused field, its value and its range.
pub(crate) fn built<T>(result: Result<T, SettingsError>) -> T {
    match result {
        Ok(built) => built,
        Err(error) => panic!("settings refused: {error}"),
    }
}
