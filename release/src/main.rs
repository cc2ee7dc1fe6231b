//! `cargo xtask release`: checks that a commit can be released, makes what a release consists of, and lists it with checksums.
#![forbid(unsafe_code)]

mod bill;
mod changelog;
mod parts;
mod state;
mod table;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::{Parser, ValueEnum};
use xtask::command;

use crate::parts::{Part, Release};
use crate::table::{SUMS, Table};

/// The files of a release
#[derive(Parser)]
#[command(name = "cargo xtask release", bin_name = "cargo xtask release")]
struct Options {
    /// Release nothing: any commit will do, with changes too, and the notes are those of the changelog's section Unreleased
    #[arg(long)]
    dry_run: bool,
    /// Folder of the files
    #[arg(long, default_value = "target/release-files")]
    out: PathBuf,
    /// Make this part only; may be given several times
    #[arg(long, value_enum)]
    only: Vec<Part>,
}

/// Makes a folder, or empties one that an earlier release was made in.
fn empty(folder: &Path) -> Result<()> {
    let is_in_use = fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some());
    if is_in_use {
        ensure!(
            folder.join(SUMS).is_file(),
            "{} has files, and no {SUMS}: choose another folder",
            folder.display()
        );
        fs::remove_dir_all(folder)
            .with_context(|| format!("cannot remove {}", folder.display()))?;
    }
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    // Also where this run is interrupted.
    fs::write(folder.join(SUMS), "").with_context(|| format!("cannot write {SUMS}"))
}

/// Makes the files and returns whether all of them could be made.
fn run(options: &Options) -> Result<bool> {
    let root = command::root();
    let state = state::read(&root)?;
    let notes = state.check(options.dry_run)?;
    println!("{state}");
    let out = root.join(&options.out);
    empty(&out)?;
    let release = Release {
        version: state.version,
        notes,
        root,
        out,
    };
    let mut table = Table::default();
    let chosen = if options.only.is_empty() {
        Part::value_variants()
    } else {
        &options.only
    };
    for part in chosen {
        let started = Instant::now();
        println!("\n== {part}");
        let made = release.make(*part);
        println!("== {part}: {:.0} s", started.elapsed().as_secs_f64());
        table.add(*part, made)?;
    }
    table.write_sums(&release.out)?;
    println!("\n{}\n{table}", release.out.display());
    Ok(table.is_complete())
}

fn main() -> ExitCode {
    match run(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        // The table says what is missing.
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_with_files_of_others_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let (mine, others) = (folder.path().join("mine"), folder.path().join("others"));
        empty(&mine).unwrap();
        fs::write(mine.join("old.whl"), "").unwrap();
        empty(&mine).unwrap();
        assert!(!mine.join("old.whl").exists());
        fs::create_dir(&others).unwrap();
        fs::write(others.join("thesis.pdf"), "").unwrap();
        assert!(empty(&others).is_err());
        assert!(others.join("thesis.pdf").exists());
    }
}
