//! `cargo xtask release`: checks that a commit can be released, makes what a release consists of, and lists it with checksums.
#![forbid(unsafe_code)]

mod bill;
mod changelog;
mod parts;
mod state;
mod table;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Parser, ValueEnum};
use xtask::command;

use crate::parts::{Part, Release};
use crate::table::Table;

/// The files of a release
#[derive(Parser)]
#[command(name = "cargo xtask release")]
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

/// Makes the files and returns whether all of them could be made.
fn run(options: &Options) -> Result<bool> {
    let root = command::root();
    let state = state::read(&root)?;
    let notes = state.check(options.dry_run)?;
    println!("{state}");
    let out = root.join(&options.out);
    if out.exists() {
        fs::remove_dir_all(&out).with_context(|| format!("cannot remove {}", out.display()))?;
    }
    fs::create_dir_all(&out).with_context(|| format!("cannot create {}", out.display()))?;
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
