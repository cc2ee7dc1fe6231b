//! Which compiler builds the firmware.

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};
use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::command;

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Choice {
    /// rustup if it can add the targets, else Debian
    Auto,
    /// The active Rust toolchain, with targets that rustup adds
    Rustup,
    /// Debian's compiler, which builds `core` from Debian's source package
    Debian,
}

/// What it comes down to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Toolchain {
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
    pub(crate) fn chosen(choice: Option<Choice>) -> Result<Self> {
        match choice {
            Some(Choice::Rustup) => Ok(Self::Rustup),
            Some(Choice::Debian) => Ok(Self::Debian),
            Some(Choice::Auto) | None => Self::remembered()
                .context("no toolchain has been chosen yet: run `cargo xtask setup` first"),
        }
    }

    /// What setup chose last.
    pub(crate) fn remembered() -> Option<Self> {
        // A file that is missing or spoilt only costs another setup.
        let text = fs::read_to_string(memory()).ok()?;
        toml::from_str::<Memory>(&text)
            .ok()
            .map(|memory| memory.toolchain)
    }

    /// Leaves the choice for later runs.
    pub(crate) fn remember(self) -> Result<()> {
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

    /// Cargo, for the firmware: with this toolchain, and in a target folder of its own, so that neither compiler
    /// rebuilds what the other built.
    pub(crate) fn cargo(self, verb: &str) -> Command {
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

fn memory() -> PathBuf {
    command::root().join("target/xtask/toolchain.toml")
}
