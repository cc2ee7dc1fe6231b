//! Compilers of the firmware.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::command;

/// Releases whose warnings are errors: those that the tree was last checked with. Newer ones warn of more.
const LINTED_WITH: [&str; 2] = ["1.95.0", "1.96.0"];

/// True if the warnings of a compiler are errors, by what `compiler` says.
pub fn denies_warnings(compiler: &str) -> bool {
    let release = compiler.split(' ').next();
    release.is_some_and(|release| LINTED_WITH.contains(&release))
}

/// The target of the page of the bench.
pub const WEB_TRIPLE: &str = "wasm32-unknown-unknown";

/// Compiler that the user asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Choice {
    /// rustup if it can add the targets, else Debian
    Auto,
    /// The active Rust toolchain, with targets that rustup adds
    Rustup,
    /// Debian's compiler, which builds `core` from Debian's source package
    Debian,
}

/// Compiler in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Toolchain {
    /// The active Rust toolchain.
    Rustup,
    /// Debian's.
    Debian,
}

/// The file in which setup leaves its choice.
#[derive(Serialize, Deserialize)]
struct Memory {
    toolchain: Toolchain,
}

impl Toolchain {
    /// The toolchain asked for, or the one setup chose last.
    ///
    /// Installing is for `setup` and `test`: no other verb changes the machine it runs on.
    pub fn chosen(choice: Option<Choice>) -> Result<Self> {
        match choice {
            Some(Choice::Rustup) => Ok(Self::Rustup),
            Some(Choice::Debian) => Ok(Self::Debian),
            Some(Choice::Auto) | None => Self::remembered()
                .context("no toolchain has been chosen yet: run `cargo xtask setup` first"),
        }
    }

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rustup => "rustup",
            Self::Debian => "debian",
        }
    }

    /// Returns the compiler that setup chose last.
    pub fn remembered() -> Option<Self> {
        // A file that is missing or spoilt only costs another setup.
        let text = fs::read_to_string(memory()).ok()?;
        toml::from_str::<Memory>(&text)
            .ok()
            .map(|memory| memory.toolchain)
    }

    /// Leaves the choice for later runs.
    pub fn remember(self) -> Result<()> {
        if Self::remembered() == Some(self) {
            return Ok(());
        }
        let path = memory();
        let folder = path.parent().context("the file has a folder")?;
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot create {}", folder.display()))?;
        let text = toml::to_string(&Memory { toolchain: self })?;
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Returns the compiler that builds the firmware.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn compiler(self) -> Result<String> {
        match self {
            Self::Rustup => host_compiler(),
            Self::Debian => version("/usr/bin/rustc"),
        }
    }

    /// Cargo, for the page of the bench, in a target folder of its own; the triple is [`WEB_TRIPLE`].
    ///
    /// # Errors
    /// Debian's compiler, and no linker for WebAssembly.
    pub fn web_cargo(self, verb: &str) -> Result<Command> {
        let mut cargo = command::command("cargo");
        if self == Self::Debian {
            cargo.arg("+debian");
        }
        cargo.args([verb, "--target", WEB_TRIPLE, "--target-dir", "target/web"]);
        if self == Self::Debian {
            cargo.args(["--config", "xtask/toolchain/debian-web.toml", "--config"]);
            cargo.arg(format!("target.{WEB_TRIPLE}.linker = {:?}", web_linker()?));
        }
        Ok(cargo)
    }

    /// Cargo, for the firmware: with this toolchain, and in a target folder of its own, so that neither compiler
    /// rebuilds what the other built.
    pub fn cargo(self, verb: &str) -> Command {
        let mut cargo = command::command("cargo");
        if self == Self::Debian {
            cargo.arg("+debian");
        }
        cargo.args([verb, "--target-dir", "target/firmware"]);
        if self == Self::Debian {
            // After the verb: before it, clippy would not see it.
            cargo.args(["--config", "xtask/toolchain/debian.toml"]);
        }
        cargo
    }
}

/// Returns a linker for WebAssembly: LLVM's own, or the one that rustup's compiler brings.
fn web_linker() -> Result<PathBuf> {
    if command::exists("wasm-ld") {
        return Ok(PathBuf::from("wasm-ld"));
    }
    let ask = |what: &[&str]| command::output(command::command("rustc").args(what));
    let verbose = ask(&["-vV"])?;
    let host = verbose.lines().find_map(|line| line.strip_prefix("host: "));
    let linker = PathBuf::from(ask(&["--print", "sysroot"])?.trim())
        .join("lib/rustlib")
        .join(host.context("rustc names no host")?)
        .join("bin/rust-lld");
    ensure!(
        linker.is_file(),
        "no linker for WebAssembly: neither wasm-ld (Debian's package lld) nor {}",
        linker.display()
    );
    Ok(linker)
}

/// Returns the compiler that builds for the host.
///
/// # Errors
/// It cannot be started.
pub fn host_compiler() -> Result<String> {
    version("rustc")
}

fn version(rustc: &str) -> Result<String> {
    let mut rustc = command::command(rustc);
    Ok(compiler(&command::output(rustc.arg("-vV"))?))
}

/// A compiler in a few words, from what `rustc -vV` says: release, commit, LLVM.
fn compiler(verbose: &str) -> String {
    let field = |name: &str| {
        let line = verbose.lines().find_map(|line| line.strip_prefix(name));
        line.map_or("?", str::trim)
    };
    let commit = field("commit-hash:");
    format!(
        "{} {}, LLVM {}",
        field("release:"),
        commit.get(..9).unwrap_or(commit),
        field("LLVM version:")
    )
}

fn memory() -> PathBuf {
    command::root().join("target/xtask/toolchain.toml")
}
