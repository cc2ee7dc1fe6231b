//! Finding, or else installing, what building and emulating the firmware, and building and testing pages take.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use xtask::command;
use xtask::image::{LAW_TRIPLES, LIBRARY_TRIPLES, TRIPLES};
use xtask::toolchain::{Choice, Toolchain, WEB_TRIPLE};

/// Something that must be there, how to see it, and the Debian package it comes in.
struct Tool {
    program: &'static str,
    package: &'static str,
}

/// Tools that are needed whichever compiler is used.
const TOOLS: [Tool; 4] = [
    Tool {
        program: "qemu-system-arm",
        package: "qemu-system-arm",
    },
    Tool {
        program: "arm-none-eabi-objdump",
        package: "binutils-arm-none-eabi",
    },
    // It fetches what the page of the bench is drawn with.
    Tool {
        program: "npm",
        package: "npm",
    },
    // The tests open reports and bench in it.
    Tool {
        program: "chromium",
        package: "chromium",
    },
];

/// What `cargo xtask count --peer` takes besides.
const PEER_TOOL: Tool = Tool {
    program: "arm-none-eabi-gcc",
    package: "gcc-arm-none-eabi",
};

/// Packages of Debian's compiler, by a file of each.
const COMPILER: [(&str, &str); 4] = [
    ("/usr/bin/rustc", "rustc-web"),
    ("/usr/bin/cargo", "cargo-web"),
    ("/usr/bin/clippy-driver", "rust-web-clippy"),
    (
        "/usr/lib/rustlib/src/rust/library/core/src/lib.rs",
        "rust-web-src",
    ),
];

/// Makes sure of everything and remembers the toolchain; `with_peer`: also of the compiler of the law in C.
pub(crate) fn run(choice: Choice, with_peer: bool) -> Result<Toolchain> {
    let toolchain = match choice {
        Choice::Rustup => {
            add_targets()?;
            Toolchain::Rustup
        }
        Choice::Debian => Toolchain::Debian,
        Choice::Auto => choose()?,
    };
    let mut missing = missing(toolchain);
    if with_peer && !command::exists(PEER_TOOL.program) {
        missing.push(PEER_TOOL.package);
    }
    if missing.is_empty() {
        println!("setup: QEMU, binutils, npm and Chromium are installed");
    } else {
        install(&missing)?;
    }
    match toolchain {
        Toolchain::Rustup => println!("setup: rustup's compiler builds the firmware"),
        Toolchain::Debian => {
            link_debian()?;
            println!("setup: Debian's compiler builds the firmware");
        }
    }
    toolchain.remember()?;
    Ok(toolchain)
}

/// Lists the packages that are to be installed.
pub(crate) fn missing(toolchain: Toolchain) -> Vec<&'static str> {
    let tools = TOOLS
        .iter()
        .filter(|tool| !command::exists(tool.program))
        .map(|tool| tool.package);
    let compiler = COMPILER
        .iter()
        .filter(|(file, _)| toolchain == Toolchain::Debian && !Path::new(file).exists())
        .map(|(_, package)| *package);
    tools.chain(compiler).collect()
}

/// Rustup if it has the targets or can get them, else Debian.
fn choose() -> Result<Toolchain> {
    if let Some(toolchain) = Toolchain::remembered() {
        return Ok(toolchain);
    }
    match add_targets() {
        Ok(()) => Ok(Toolchain::Rustup),
        Err(error) => {
            println!("setup: rustup cannot add the targets: {error:#}");
            println!("setup: trying Debian's compiler instead, which builds `core` from source");
            Ok(Toolchain::Debian)
        }
    }
}

/// Adds the firmware's targets to the active rustup toolchain, unless it has them.
fn add_targets() -> Result<()> {
    let installed =
        command::output(command::command("rustup").args(["target", "list", "--installed"]))?;
    let missing: Vec<&str> = TRIPLES
        .into_iter()
        .chain(LIBRARY_TRIPLES)
        .chain(LAW_TRIPLES)
        .chain([WEB_TRIPLE])
        .filter(|triple| !installed.lines().any(|line| line == *triple))
        .collect();
    if missing.is_empty() {
        println!("setup: rustup has the targets");
        return Ok(());
    }
    command::run(
        command::command("rustup")
            .args(["target", "add"])
            .args(missing),
    )
}

/// Gives Debian's compiler a name by which `cargo +debian` finds it.
fn link_debian() -> Result<()> {
    let list = command::output(command::command("rustup").args(["toolchain", "list"]))
        .context("rustup is needed to call Debian's compiler as `cargo +debian`")?;
    if list
        .lines()
        .any(|line| line.split_whitespace().next() == Some("debian"))
    {
        return Ok(());
    }
    command::run(command::command("rustup").args(["toolchain", "link", "debian", "/usr"]))
}

/// Installs Debian packages.
pub(crate) fn install(packages: &[&str]) -> Result<()> {
    println!("setup: missing {}", packages.join(", "));
    if !command::exists("apt-get") {
        bail!(
            "there is no apt-get here to install it with: please install QEMU for Arm (qemu-system-arm), the \
             GNU binutils for arm-none-eabi (arm-none-eabi-objdump), npm and Chromium (chromium), for a law in C the \
             GNU compiler for arm-none-eabi (arm-none-eabi-gcc), by your system's own means, then try again"
        );
    }
    command::run(apt().arg("update"))?;
    command::run(
        apt()
            .args(["install", "--yes", "--no-install-recommends"])
            .args(packages),
    )
}

/// `apt-get`, as root, patient with another one that is at work.
fn apt() -> Command {
    let is_root =
        command::output(command::command("id").arg("-u")).is_ok_and(|id| id.trim() == "0");
    let mut apt = if is_root {
        command::command("apt-get")
    } else {
        let mut sudo = command::command("sudo");
        // Sudo may ask for a password.
        sudo.stdin(std::process::Stdio::inherit()).arg("apt-get");
        sudo
    };
    apt.args(["--quiet", "-o", "DPkg::Lock::Timeout=300"])
        .env("DEBIAN_FRONTEND", "noninteractive");
    apt
}
