//! The list of what a release consists of: names, sizes, checksums, and what could not be made.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sha2::{Digest, Sha256};

use crate::parts::Part;

/// File of the checksums, as `sha256sum --check` reads it.
pub(crate) const SUMS: &str = "SHA256SUMS";

/// A file that was made.
struct Made {
    name: String,
    bytes: usize,
    sha256: String,
}

/// Table of the files that were made, and of the parts that could not be.
#[derive(Default)]
pub(crate) struct Table {
    made: Vec<Made>,
    missing: Vec<(Part, String)>,
}

impl Table {
    /// Adds the files of a part, or the reason why it has none.
    pub(crate) fn add(&mut self, part: Part, files: Result<Vec<PathBuf>>) -> Result<()> {
        match files {
            Ok(files) => {
                for file in &files {
                    self.made.push(measure(file)?);
                }
            }
            Err(error) => self.missing.push((part, format!("{error:#}"))),
        }
        Ok(())
    }

    /// True if nothing is missing.
    pub(crate) fn is_complete(&self) -> bool {
        self.missing.is_empty()
    }

    /// Writes the checksums of all files.
    pub(crate) fn write_sums(&self, folder: &Path) -> Result<()> {
        let lines = self.made.iter();
        let text: String = lines
            .map(|made| format!("{}  {}\n", made.sha256, made.name))
            .collect();
        let path = folder.join(SUMS);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.made.iter().map(|made| made.name.len()).max();
        let width = width.unwrap_or(0);
        for made in &self.made {
            writeln!(
                f,
                "{:width$} {:>10} bytes  {}",
                made.name, made.bytes, made.sha256
            )?;
        }
        for (part, why) in &self.missing {
            writeln!(f, "MISSING {part}: {why}")?;
        }
        write!(
            f,
            "{} files, {} parts missing",
            self.made.len(),
            self.missing.len()
        )
    }
}

/// Reads a file and returns its name, size and checksum.
fn measure(path: &Path) -> Result<Made> {
    let content = fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let name = path.file_name().context("the file has a name")?;
    Ok(Made {
        name: name.to_string_lossy().into_owned(),
        bytes: content.len(),
        sha256: Sha256::digest(&content)
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    /// FIPS 180-4's example.
    const SHA256_ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn checksums_are_those_of_the_standard_in_the_form_of_sha256sum() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("abc");
        fs::write(&file, "abc").unwrap();
        let mut table = Table::default();
        table.add(Part::Notes, Ok(vec![file])).unwrap();
        table.write_sums(folder.path()).unwrap();
        let sums = fs::read_to_string(folder.path().join(SUMS)).unwrap();
        assert_eq!(sums, format!("{SHA256_ABC}  abc\n"));
        assert!(table.is_complete());
        assert_eq!(
            table.to_string(),
            format!("abc          3 bytes  {SHA256_ABC}\n1 files, 0 parts missing")
        );
    }

    #[test]
    fn a_part_that_fails_is_listed_with_its_reason() {
        let mut table = Table::default();
        table.add(Part::Wheel, Err(anyhow!("no Python"))).unwrap();
        assert!(!table.is_complete());
        assert_eq!(
            table.to_string(),
            "MISSING wheel: no Python\n0 files, 1 parts missing"
        );
    }
}
