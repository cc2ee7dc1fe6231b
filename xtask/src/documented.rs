//! `cargo xtask documented`: runs the commands that the documentation shows.
//!
//! A command stands on a line of its own in a block that begins with ```` ```sh ````. A word after it says why not to run the
//! block as a check: `long`, it takes more than a minute; `own`, it works on files of the reader.
//!
//! `--release` is left out: what the tests have built does the same, is optimised, and is there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use xtask::command;

/// The folder in which the commands run, one below it for each page.
const FOLDER: &str = "target/documented";
/// Folders of the project that commands name.
const NAMED: [&str; 2] = ["host-sim", "examples"];

/// The reason why a command is not run as a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// None: it is.
    Short,
    /// It takes more than a minute.
    Long,
    /// It works on files of the reader.
    Own,
}

/// A command of a page.
#[derive(Debug, PartialEq, Eq)]
struct Shown {
    kind: Kind,
    words: Vec<String>,
}

/// Options of `documented`.
#[derive(Default, clap::Args)]
pub(crate) struct Options {
    /// Print the commands, and run none
    #[arg(long)]
    list: bool,
    /// Run those that take more than a minute, too
    #[arg(long)]
    all: bool,
    /// Only the pages whose path holds this
    #[arg(long, value_name = "TEXT", default_value = "")]
    page: String,
}

/// Runs or prints the commands of all pages.
pub(crate) fn run(options: &Options) -> Result<()> {
    if !options.list {
        clear()?;
    }
    let mut failed = Vec::new();
    for page in pages()? {
        let name = page.strip_prefix(command::root())?.display().to_string();
        if !name.contains(&options.page) {
            continue;
        }
        let shown = commands(&fs::read_to_string(&page)?)
            .with_context(|| format!("{name}: a command that is not understood"))?;
        for Shown { kind, words } in shown {
            let line = words.join(" ");
            if options.list {
                println!("{name}: {line}{}", note(kind));
                continue;
            }
            let runs = match kind {
                Kind::Short => true,
                Kind::Long => options.all,
                Kind::Own => false,
            };
            // What a chore does is what `cargo xtask test` does.
            if !runs || line.starts_with("cargo xtask") {
                println!("left out   {name}: {line}{}", note(kind));
                continue;
            }
            let started = Instant::now();
            let result = run_in(&folder_of(&name)?, &words);
            let seconds = started.elapsed().as_secs_f64();
            match result {
                Ok(()) => println!("{seconds:>7.1} s  {name}: {line}"),
                Err(error) => {
                    println!("FAILED     {name}: {line}\n{error:#}");
                    failed.push(line);
                }
            }
        }
    }
    ensure!(failed.is_empty(), "{} commands failed", failed.len());
    Ok(())
}

fn note(kind: Kind) -> &'static str {
    match kind {
        Kind::Short => "",
        Kind::Long => " (takes more than a minute)",
        Kind::Own => " (works on files of the reader)",
    }
}

/// README and all pages, in order.
fn pages() -> Result<Vec<PathBuf>> {
    let mut found = vec![command::root().join("README.md")];
    let mut folders = vec![command::root().join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                found.push(path);
            }
        }
    }
    found[1..].sort();
    Ok(found)
}

/// The commands of a page.
fn commands(text: &str) -> Result<Vec<Shown>> {
    let mut found = Vec::new();
    let mut block = None;
    for line in text.lines().map(str::trim) {
        if let Some(fence) = line.strip_prefix("```") {
            block = match (block, fence.split_once(' ').unwrap_or((fence, ""))) {
                (Some(_), _) => None,
                (None, ("sh", "")) => Some(Some(Kind::Short)),
                (None, ("sh", "long")) => Some(Some(Kind::Long)),
                (None, ("sh", "own")) => Some(Some(Kind::Own)),
                (None, ("sh", other)) => bail!("```sh {other}: `long`, `own`, or nothing"),
                _ => Some(None),
            };
        } else if let Some(Some(kind)) = block {
            let words = shlex::split(line).with_context(|| line.to_owned())?;
            if !words.is_empty() {
                found.push(Shown { kind, words });
            }
        }
    }
    Ok(found)
}

/// The folder in which the commands of a page run, empty but for the project's own files.
fn folder_of(page: &str) -> Result<PathBuf> {
    let folder = command::root()
        .join(FOLDER)
        .join(page.replace(['/', '.'], "-"));
    if !folder.exists() {
        fs::create_dir_all(&folder)?;
        for name in NAMED {
            link(&command::root().join(name), &folder.join(name))?;
        }
    }
    Ok(folder)
}

#[cfg(unix)]
fn link(original: &Path, link: &Path) -> Result<()> {
    Ok(std::os::unix::fs::symlink(original, link)?)
}

#[cfg(not(unix))]
fn link(original: &Path, link: &Path) -> Result<()> {
    Ok(std::os::windows::fs::symlink_dir(original, link)?)
}

fn run_in(folder: &Path, words: &[String]) -> Result<()> {
    let (program, arguments) = words.split_first().context("an empty command")?;
    let output = command::command(program)
        .args(arguments.iter().filter(|word| *word != "--release"))
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .output()
        .with_context(|| format!("cannot start {program}"))?;
    ensure!(
        output.status.success(),
        "{}\n{}{}",
        output.status,
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(())
}

/// Begins with empty folders.
fn clear() -> Result<()> {
    let folder = command::root().join(FOLDER);
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Kind, Shown, commands};

    #[test]
    fn commands_are_the_lines_of_blocks_for_the_shell() {
        let page = "text\n```sh\ncargo run -- a 'b c'   # what it does\n\n```\n```text\ncargo run -- d\n```\n\
                    ```sh long\ncargo run -- e\n```\n```sh own\ncargo run -- f.csv\n```\n";
        let found = commands(page).unwrap();
        let expected = [
            (Kind::Short, vec!["cargo", "run", "--", "a", "b c"]),
            (Kind::Long, vec!["cargo", "run", "--", "e"]),
            (Kind::Own, vec!["cargo", "run", "--", "f.csv"]),
        ];
        let expected: Vec<Shown> = expected
            .into_iter()
            .map(|(kind, words)| Shown {
                kind,
                words: words.into_iter().map(str::to_owned).collect(),
            })
            .collect();
        assert_eq!(found, expected);
        assert!(commands("```sh later\ncargo\n```").is_err());
    }
}
