//! `cargo xtask python`: the Python package, built as a wheel and tested in a clean environment.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

use xtask::command;

/// The package.
const SOURCES: &str = "python";
/// Folder of the environment, the wheel, and what examples and notebooks leave.
const FOLDER: &str = "target/python";
/// Programs and libraries of the tests, and what the package can make use of.
const PACKAGES: [&str; 9] = [
    "pytest",
    "mypy",
    "pandas-stubs",
    "scipy-stubs",
    "jupytext",
    "nbconvert",
    "ipykernel",
    "dask[distributed]",
    MATURIN,
];
/// Program that builds the wheel.
const MATURIN: &str = "maturin>=1.9,<2";

/// Builds the wheel, installs it, and runs tests, types, examples and notebooks.
pub(crate) fn run() -> Result<()> {
    let root = command::root();
    let (sources, folder) = (root.join(SOURCES), root.join(FOLDER));
    let python = environment(&folder, &PACKAGES)?;
    let wheel = wheel(&sources, &folder, &python)?;
    pip(&python, &[&format!("{}[all]", wheel.display())])?;
    let left = folder.join("left");
    fs::create_dir_all(&left)?;
    // Not in the sources: there the package would be found without its library.
    let in_left = || {
        let mut python = command::command(&python);
        python.current_dir(&left).env("MPLBACKEND", "Agg");
        python
    };
    command::run(
        in_left()
            .args(["-m", "pytest", "--quiet", "--rootdir"])
            .arg(&sources)
            .arg(sources.join("tests")),
    )?;
    command::run(
        command::command(&python)
            .current_dir(&sources)
            .args(["-m", "mypy", "--strict", "quadrant", "tests", "examples"]),
    )?;
    for example in scripts(&sources.join("examples"))? {
        println!("{}", example.display());
        command::run_quietly(in_left().arg(&example))?;
    }
    for notebook in scripts(&sources.join("notebooks"))? {
        println!("{}", notebook.display());
        let made = left
            .join(notebook.file_name().unwrap_or_default())
            .with_extension("ipynb");
        command::run_quietly(
            in_left()
                .args(["-m", "jupytext", "--to", "ipynb", "--set-kernel", "python3"])
                .args(["--execute", "--run-path"])
                .arg(sources.join("notebooks"))
                .arg("--output")
                .args([&made, &notebook]),
        )?;
    }
    Ok(())
}

/// Builds the wheel into a folder, in an environment that has no more than what builds it.
pub(crate) fn build_wheel(folder: &Path) -> Result<()> {
    let root = command::root();
    let python = environment(&root.join(FOLDER), &[MATURIN])?;
    let wheel = wheel(&root.join(SOURCES), &root.join(FOLDER), &python)?;
    let name = wheel.file_name().context("a wheel has a name")?;
    let path = root.join(folder).join(name);
    fs::copy(&wheel, &path).with_context(|| format!("cannot write {}", path.display()))?;
    println!("{}", path.display());
    Ok(())
}

/// Makes a clean environment with packages; returns its Python.
fn environment(folder: &Path, packages: &[&str]) -> Result<PathBuf> {
    let place = folder.join("environment");
    if place.exists() {
        fs::remove_dir_all(&place).with_context(|| format!("cannot remove {}", place.display()))?;
    }
    command::run(command::command("python3").args(["-m", "venv"]).arg(&place))?;
    let python = place.join("bin/python");
    pip(&python, packages)?;
    Ok(python)
}

fn pip(python: &Path, packages: &[&str]) -> Result<()> {
    command::run_quietly(
        command::command(python)
            .args(["-m", "pip", "install", "--quiet"])
            .args(packages),
    )
}

/// Builds the wheel and returns its path. Cargo's own folder stays from one run to the next.
fn wheel(sources: &Path, folder: &Path, python: &Path) -> Result<PathBuf> {
    let wheels = folder.join("wheels");
    if wheels.exists() {
        fs::remove_dir_all(&wheels)?;
    }
    command::run_quietly(
        command::command(python)
            .current_dir(sources)
            .args(["-m", "maturin", "build", "--release", "--quiet", "--out"])
            .arg(&wheels),
    )?;
    let made = fs::read_dir(&wheels)?
        .flatten()
        .map(|entry| entry.path())
        .next();
    made.context("no wheel was built")
}

/// The Python files of a folder, in order.
fn scripts(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries =
        fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "py"))
        .collect();
    found.sort();
    Ok(found)
}
