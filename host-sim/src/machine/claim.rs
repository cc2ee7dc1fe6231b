//! One program at a time holds a machine.

use std::env;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::PathBuf;
use std::process;

/// A machine that this program holds, until it ends: other programs on this computer do not get it meanwhile.
///
/// A lock on a file in the folder for temporary files, which the system gives back however the program ends. The port
/// itself is opened exclusively too, but not for a privileged user, and a socket never is.
#[derive(Debug)]
pub(super) struct Claim {
    _file: File,
}

impl Claim {
    /// Takes a machine by the name of its port or address.
    ///
    /// # Errors
    /// [`io::ErrorKind::ResourceBusy`], with the process that holds it; or a file that cannot be made.
    pub(super) fn take(machine: &str) -> io::Result<Self> {
        let path = lock_path(machine);
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path)
            .map_err(|error| {
                io::Error::new(error.kind(), format!("{}: {error}", path.display()))
            })?;
        match file.try_lock() {
            Ok(()) => {
                // For whoever asks meanwhile.
                file.set_len(0)?;
                write!(file, "{}", process::id())?;
                Ok(Self { _file: file })
            }
            Err(TryLockError::WouldBlock) => Err(io::Error::new(
                io::ErrorKind::ResourceBusy,
                format!(
                    "{} holds it; one program at a time talks to a machine",
                    holder(&mut file)
                ),
            )),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }
}

/// The process that has locked the file.
fn holder(file: &mut File) -> String {
    let mut text = String::new();
    let read = file
        .rewind()
        .and_then(|()| file.read_to_string(&mut text))
        .is_ok();
    match text.trim().parse::<u32>() {
        Ok(process) if read => format!("process {process}"),
        _ => "another process".to_owned(),
    }
}

fn lock_path(machine: &str) -> PathBuf {
    let name: String = machine
        .chars()
        .map(|sign| {
            if sign.is_ascii_alphanumeric() {
                sign
            } else {
                '-'
            }
        })
        .collect();
    env::temp_dir().join(format!("quadrant{name}.lock"))
}
