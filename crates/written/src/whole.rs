//! Files that are written whole or not at all: a write that is interrupted, or finds the disk full, leaves the old content.

use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::Builder;

/// Beginning of the name of a file that is being written, beside the one that it becomes.
const PREFIX: &str = ".quadrant-";
/// End of that name.
const SUFFIX: &str = ".unfinished";

/// Writes a file. If it is a link, the file that it points to; its permissions stay.
///
/// # Errors
/// A file that cannot be written: the old one is there as it was.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    write_by(path, |out| out.write_all(content.as_ref()))
}

/// As [`write()`], what `content` writes.
///
/// # Errors
/// As [`write()`], or of `content`.
pub fn write_by(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    // One that is not there yet may be what a link points to.
    let target = match path.canonicalize() {
        Err(error) if error.kind() == io::ErrorKind::NotFound => match fs::read_link(path) {
            Ok(to) => path.parent().unwrap_or(Path::new("")).join(to),
            Err(_) => path.to_owned(),
        },
        resolved => resolved?,
    };
    put(&target, content)
}

/// As [`write()`], but in place of a link: nothing is written elsewhere.
///
/// # Errors
/// As [`write()`].
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
    put(path, |out| out.write_all(content.as_ref()))
}

/// True for the name of a file that was being written when its program ended.
pub fn is_unfinished(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX))
}

fn put(path: &Path, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let before = match fs::symlink_metadata(path) {
        Ok(seen) if seen.is_file() => Some(seen),
        Ok(seen) if seen.is_symlink() => None,
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        // A device or a pipe has no content that could be lost, and a folder says that it is one.
        Ok(_) => return fill(OpenOptions::new().write(true).open(path)?, content).map(drop),
        Err(error) => return Err(error),
    };
    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let mut builder = Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Less the user's mask, as of any new file.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    // The error would name the file that is not there yet, and its folder is what is wrong.
    let unfinished = (builder.tempfile_in(&folder)).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => io::Error::new(
            io::ErrorKind::NotFound,
            format!("there is no folder {}", folder.display()),
        ),
        kind => io::Error::new(kind, format!("{}: {kind}", folder.display())),
    })?;
    let file = fill(unfinished.as_file(), content)?;
    if let Some(before) = &before {
        keep_permissions(file, before)?;
    }
    file.sync_all()?;
    unfinished.persist(path)?;
    // The new name, too; not every system has folders that can be opened.
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

fn fill<F>(file: F, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<F>
where
    F: Write,
{
    let mut out = BufWriter::new(file);
    content(&mut out)?;
    out.into_inner().map_err(|error| error.into_error())
}

/// The permissions of the file before, and its owner where that may be given.
fn keep_permissions(file: &File, before: &Metadata) -> io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, fchown};
        // Before the permissions, some of which a new owner takes away.
        let _ = fchown(file, Some(before.uid()), Some(before.gid()));
    }
    file.set_permissions(before.permissions())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap().flatten();
        let mut names: Vec<_> = entries
            .map(|entry| entry.file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn what_fails_in_the_middle_leaves_the_old_file_and_nothing_beside_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stage.toml");
        write(&path, "old").unwrap();
        let failed = write_by(&path, |out| {
            out.write_all(&[b'n'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failed.unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(names(folder.path()), ["stage.toml"]);
        write(&path, "new").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert!(write(folder.path(), "a folder").is_err());
        assert!(!is_unfinished(&path));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_permissions_do() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("kept"), "old").unwrap();
        fs::set_permissions(at("kept"), fs::Permissions::from_mode(0o640)).unwrap();
        for (link, to) in [("link", "kept"), ("to-nothing", "new")] {
            symlink(to, at(link)).unwrap();
            write(&at(link), "through").unwrap();
            assert!(at(link).is_symlink());
            assert_eq!(fs::read_to_string(at(to)).unwrap(), "through");
        }
        let mode = |name| fs::metadata(at(name)).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode("kept"), 0o640);
        fs::write(at("plain"), "").unwrap();
        assert_eq!(mode("new"), mode("plain"));
        // In place of the link.
        replace(&at("link"), "here").unwrap();
        assert!(!at("link").is_symlink());
        assert_eq!(fs::read_to_string(at("kept")).unwrap(), "through");
        // What has no content is written to as it is.
        write(Path::new("/dev/null"), "nothing").unwrap();
        assert!(!Path::new("/dev/null").is_file());
    }
}
