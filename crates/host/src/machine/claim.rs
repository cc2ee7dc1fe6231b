//! One program at a time holds a machine.

use std::collections::BTreeSet;
use std::env;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::path::{Path, PathBuf};
use std::process;

/// A machine that this program holds, until it ends: other programs of this user on this computer do not get it meanwhile.
///
/// Locks on files in a folder that is the user's alone, which the system gives back however the program ends. The port
/// itself is opened exclusively too, but not for a privileged user, and a socket never is.
#[derive(Debug)]
pub(super) struct Claim {
    _files: Vec<File>,
}

impl Claim {
    /// Takes a serial port by its path: every path to one device is one port.
    ///
    /// # Errors
    /// [`io::ErrorKind::ResourceBusy`], with the process that holds it; or a lock file that cannot be made.
    pub(super) fn port(path: &str) -> io::Result<Self> {
        Self::take(&folder()?, &BTreeSet::from([device(path)]))
    }

    /// Takes the machine at `host:port`: every name of a computer is one.
    ///
    /// # Errors
    /// As [`port`](Self::port); or a host that is none.
    pub(super) fn socket(address: &str) -> io::Result<Self> {
        let names: BTreeSet<String> = address.to_socket_addrs()?.map(socket).collect();
        Self::take(&folder()?, &names)
    }

    /// Takes all of these names, in order.
    fn take(folder: &Path, names: &BTreeSet<String>) -> io::Result<Self> {
        let files = names.iter().map(|name| lock(folder, name));
        Ok(Self {
            _files: files.collect::<io::Result<_>>()?,
        })
    }
}

/// Locks the file of a name, and writes this process into it for others to read.
fn lock(folder: &Path, name: &str) -> io::Result<File> {
    let path = folder.join(format!("{name}.lock"));
    let with_path = |error: io::Error| {
        let remedy = "remove it if it is no lock of a program that runs";
        io::Error::new(
            error.kind(),
            format!("{}: {error}; {remedy}", path.display()),
        )
    };
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options
            .mode(0o600)
            .custom_flags(rustix::fs::OFlags::NOFOLLOW.bits() as i32);
    }
    let mut file = options.open(&path).map_err(with_path)?;
    match file.try_lock() {
        Ok(()) => {
            file.set_len(0)?;
            write!(file, "{}", process::id())?;
            Ok(file)
        }
        Err(TryLockError::WouldBlock) => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            format!(
                "{} holds it; one program at a time talks to a machine",
                holder(&mut file)
            ),
        )),
        Err(TryLockError::Error(error)) => Err(with_path(error)),
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

/// Name of the computer and port behind an address. All addresses of this computer have one.
fn socket(address: SocketAddr) -> String {
    let ip = address.ip().to_canonical();
    let host = if ip.is_loopback() || ip.is_unspecified() || is_own(address) {
        "this-computer".to_owned()
    } else {
        plain(&ip.to_string())
    };
    format!("tcp-{host}-{}", address.port())
}

/// True if the system would send to itself; nothing is sent.
fn is_own(address: SocketAddr) -> bool {
    let any: SocketAddr = match address {
        SocketAddr::V4(_) => ([0; 4], 0).into(),
        SocketAddr::V6(_) => ([0_u16; 8], 0).into(),
    };
    let from = UdpSocket::bind(any).and_then(|socket| {
        socket.connect(address)?;
        socket.local_addr()
    });
    from.is_ok_and(|from| from.ip() == address.ip())
}

/// Name of the device behind a path: its number, where it is a device of Unix.
fn device(path: &str) -> String {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{FileTypeExt, MetadataExt};
        if let Ok(seen) = fs::metadata(path)
            && seen.file_type().is_char_device()
        {
            return format!("serial-device-{}", seen.rdev());
        }
    }
    let path = fs::canonicalize(path).unwrap_or_else(|_| PathBuf::from(path));
    let name = path.to_string_lossy();
    // A port of Windows is the same in any case.
    let name = match cfg!(windows) {
        true => name.to_lowercase(),
        false => name.into_owned(),
    };
    format!("serial-{}", plain(&name))
}

/// A text as part of a file's name.
fn plain(text: &str) -> String {
    text.chars()
        .map(|sign| match sign.is_ascii_alphanumeric() {
            true => sign,
            false => '-',
        })
        .collect()
}

/// The folder of locks, which is made: the user's own, so that nobody else puts anything into it.
fn folder() -> io::Result<PathBuf> {
    let folder = match env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from) {
        Some(own) if own.is_absolute() && own.is_dir() => own.join("quadrant"),
        _ => env::temp_dir().join(user_folder()),
    };
    own_folder(&folder).map_err(|error| {
        io::Error::new(
            error.kind(),
            format!(
                "{} is to hold the lock of the machine: {error}; set XDG_RUNTIME_DIR to a folder of your own",
                folder.display()
            ),
        )
    })?;
    Ok(folder)
}

#[cfg(unix)]
fn user_folder() -> String {
    format!("quadrant-{}", rustix::process::getuid().as_raw())
}

/// The system gives each user a folder for temporary files.
#[cfg(not(unix))]
fn user_folder() -> &'static str {
    "quadrant"
}

/// Makes a folder that nobody else may use, or checks that it is one.
#[cfg(unix)]
fn own_folder(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::{DirBuilderExt, MetadataExt};
    match fs::DirBuilder::new().mode(0o700).create(folder) {
        Err(error) if error.kind() != io::ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    // Of the path itself: a symbolic link is no folder.
    let seen = fs::symlink_metadata(folder)?;
    let is_own = seen.is_dir()
        && seen.uid() == rustix::process::getuid().as_raw()
        && seen.mode() & 0o077 == 0;
    if is_own {
        Ok(())
    } else {
        Err(io::Error::new(
            io::ErrorKind::PermissionDenied,
            "it is no folder that this user alone may use (mode 0700)",
        ))
    }
}

#[cfg(not(unix))]
fn own_folder(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;
    use crate::machine::TcpTransport;

    #[test]
    fn every_name_of_a_computer_is_one_machine() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let held = TcpTransport::connect(&format!("127.0.0.1:{port}")).unwrap();
        for name in ["localhost", "127.0.0.1", "127.0.0.2", "0.0.0.0"] {
            let refused = TcpTransport::connect(&format!("{name}:{port}")).err();
            let refused = refused.unwrap_or_else(|| panic!("{name} got it as well"));
            assert_eq!(refused.kind(), io::ErrorKind::ResourceBusy, "{name}");
            let holder = format!("process {}", process::id());
            assert!(refused.to_string().contains(&holder), "{refused}");
        }
        drop(held);
        TcpTransport::connect(&format!("localhost:{port}")).unwrap();
    }

    #[cfg(unix)]
    mod unix {
        use std::os::unix::fs::{PermissionsExt, symlink};

        use super::*;
        use crate::machine::SerialTransport;

        #[test]
        fn every_path_to_a_device_is_one_port() {
            use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
            let controller = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
            grantpt(&controller).unwrap();
            unlockpt(&controller).unwrap();
            let path = ptsname(&controller, Vec::new())
                .unwrap()
                .into_string()
                .unwrap();
            let folder = tempfile::tempdir().unwrap();
            let by_id = folder.path().join("usb-board-if02");
            symlink(&path, &by_id).unwrap();
            let held = SerialTransport::open(&path).unwrap();
            let refused = SerialTransport::open(by_id.to_str().unwrap()).err();
            let refused = refused.expect("the port was got twice");
            assert_eq!(refused.kind(), io::ErrorKind::ResourceBusy, "{refused}");
            drop(held);
        }

        #[test]
        fn a_lock_that_is_a_link_is_refused_and_what_it_points_to_stays() {
            let folder = tempfile::tempdir().unwrap();
            let precious = folder.path().join("precious");
            fs::write(&precious, "a thesis").unwrap();
            symlink(&precious, folder.path().join("machine.lock")).unwrap();
            let names = BTreeSet::from(["machine".to_owned()]);
            let refused = Claim::take(folder.path(), &names).unwrap_err();
            assert!(refused.to_string().contains("machine.lock"), "{refused}");
            assert_eq!(fs::read_to_string(&precious).unwrap(), "a thesis");
        }

        #[test]
        fn a_folder_that_others_may_use_is_refused() {
            let folder = tempfile::tempdir().unwrap();
            let own = folder.path().join("own");
            own_folder(&own).unwrap();
            own_folder(&own).unwrap();
            let link = folder.path().join("link");
            symlink(&own, &link).unwrap();
            assert!(own_folder(&link).is_err());
            fs::set_permissions(&own, fs::Permissions::from_mode(0o755)).unwrap();
            assert!(own_folder(&own).is_err());
        }
    }
}
