//! Running other programs.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail, ensure};

/// The workspace's folder.
pub fn root() -> PathBuf {
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR");
    let here = || std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
    // Cargo sets the variable for what it runs; without cargo, the current folder must be the workspace's.
    manifest.map_or_else(here, |folder| {
        let folder = PathBuf::from(folder);
        let root = folder
            .ancestors()
            .find(|above| above.join("Cargo.lock").exists());
        root.map_or(folder.clone(), Path::to_path_buf)
    })
}

/// Returns true if a program is in the search path.
pub fn exists(program: &str) -> bool {
    std::env::var_os("PATH").is_some_and(|path| {
        std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
    })
}

/// A command in the workspace's folder, free of what the cargo that started us left in the environment.
pub fn command(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root()).stdin(Stdio::null());
    // The libraries and the choice of the outer toolchain would reach into the inner one.
    for name in [
        "LD_LIBRARY_PATH",
        "RUSTUP_TOOLCHAIN",
        "RUSTC",
        "RUSTDOC",
        "CARGO",
    ] {
        command.env_remove(name);
    }
    for (name, _) in std::env::vars_os() {
        let text = name.to_string_lossy();
        if text.starts_with("CARGO_PKG_") || text.starts_with("CARGO_MANIFEST_") {
            command.env_remove(name);
        }
    }
    command
}

/// The command as a person would type it.
pub fn spell(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words
        .map(|word| word.to_string_lossy())
        .collect::<Vec<_>>()
        .join(" ")
}

/// Says what is run, and runs it; anything but success is an error.
pub fn run(command: &mut Command) -> Result<()> {
    println!("$ {}", spell(command));
    run_quietly(command)
}

/// Runs tests, shows what they print, and names those that failed in the error.
pub fn run_tests(command: &mut Command) -> Result<()> {
    println!("$ {}", spell(command));
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| format!("cannot start `{}`", spell(command)))?;
    let mut failed = Vec::new();
    for line in BufReader::new(child.stdout.take().context("the tests' output")?).lines() {
        let line = line?;
        println!("{line}");
        failed.extend(failed_test(&line).map(str::to_owned));
    }
    let status = child.wait()?;
    ensure!(
        status.success(),
        "`{}` failed: {status}; tests that failed: {}",
        spell(command),
        if failed.is_empty() {
            "none".to_owned()
        } else {
            failed.join(", ")
        }
    );
    Ok(())
}

/// The name of a test that failed, from a line of the tests' output.
fn failed_test(line: &str) -> Option<&str> {
    line.strip_prefix("test ")?.strip_suffix(" ... FAILED")
}

/// Runs without saying so; anything but success is an error.
pub fn run_quietly(command: &mut Command) -> Result<()> {
    let status = command
        .status()
        .with_context(|| format!("cannot start `{}`", spell(command)))?;
    ensure!(status.success(), "`{}` failed: {status}", spell(command));
    Ok(())
}

/// Returns an error if `cargo test`, as it would run, has no test to run: a name that matches none would pass.
pub fn ensure_tests(test: &Command) -> Result<()> {
    let mut list = command(test.get_program());
    list.args(test.get_args()).arg("--list");
    let names = output(&mut list)?;
    ensure!(
        names.lines().any(|line| line.ends_with(": test")),
        "`{}` has no test to run",
        spell(test)
    );
    Ok(())
}

/// Runs and returns what was printed.
pub fn output(command: &mut Command) -> Result<String> {
    let output = command
        .output()
        .with_context(|| format!("cannot start `{}`", spell(command)))?;
    if !output.status.success() {
        bail!(
            "`{}` failed: {}\n{}",
            spell(command),
            output.status,
            String::from_utf8_lossy(&output.stderr).trim_end()
        );
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::{command, failed_test, run_tests};

    #[test]
    fn tests_that_failed_are_named_in_the_error() {
        let script = "echo 'test a::b ... ok'; echo 'test a::c ... FAILED'; exit 101";
        let error = run_tests(command("sh").args(["-c", script])).unwrap_err();
        assert!(error.to_string().ends_with("failed: a::c"), "{error}");
        assert_eq!(failed_test("test result: FAILED. 1 passed"), None);
    }
}
