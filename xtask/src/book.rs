//! `cargo xtask book`: the documentation as a searchable book.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use xtask::command;

/// Version of mdBook.
const VERSION: &str = "0.5.4";
/// Folder of its own.
const FOLDER: &str = "target/mdbook";
/// Folder of the book, which `docs/book.toml` names.
const BOOK: &str = "target/book";

/// Builds the book, with mdBook of [`VERSION`], which is built first if it is not there: about a minute.
///
/// # Errors
/// mdBook or the book does not build, or the book cannot be searched.
pub(crate) fn build() -> Result<()> {
    let root = command::root();
    let program = program()?;
    command::run(command::command(program).args(["build", "docs"]))?;
    let book = root.join(BOOK);
    ensure!(
        book.join("index.html").is_file(),
        "the book has no first page"
    );
    let files = fs::read_dir(&book).with_context(|| format!("cannot read {}", book.display()))?;
    let indexed = files.flatten().any(|file| {
        file.file_name()
            .to_string_lossy()
            .starts_with("searchindex")
    });
    ensure!(indexed, "the book has no index to search");
    println!("{}", book.join("index.html").display());
    Ok(())
}

/// The program, built if it is not there. Neither server nor watch, and unoptimised: that takes a third of the time.
fn program() -> Result<PathBuf> {
    let folder = command::root().join(FOLDER).join(VERSION);
    let program = folder.join("bin/mdbook");
    if !program.is_file() {
        let mut install = command::command("cargo");
        install
            .args(["install", "mdbook", "--version", VERSION, "--locked"])
            .args(["--debug", "--no-default-features", "--features", "search"])
            .arg("--root")
            .arg(&folder);
        command::run(&mut install)?;
    }
    Ok(program)
}
