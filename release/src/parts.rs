//! The parts of a release, each made by the step that makes it elsewhere.

use std::ffi::OsStr;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use xtask::command;
use xtask::image::Target;

use crate::bill;

/// Packages that are published, in the order in which they need each other.
const PUBLISHED: [&str; 2] = ["quadrant-law", "quadrant-link"];
/// Shells with completions, and the files that they look for.
const SHELLS: [(&str, &str); 4] = [
    ("bash", "quadrant.bash"),
    ("zsh", "_quadrant"),
    ("fish", "quadrant.fish"),
    ("powershell", "quadrant.ps1"),
];
/// The command's target if its standard library is installed.
const MUSL: &str = "x86_64-unknown-linux-musl";
/// The command's target otherwise.
const GLIBC: &str = "x86_64-unknown-linux-gnu";
/// Features of a release's command beyond those of a usual build: it flashes a board with nothing else installed.
pub(crate) const COMMAND_FEATURES: &str = "flash";
/// Licences of the project.
const LICENCES: [&str; 2] = ["LICENSE-APACHE", "LICENSE-MIT"];

/// A part of a release.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Part {
    /// The changelog's section
    Notes,
    /// The command, its manual pages and completions
    Command,
    /// Images of each board in each number type, with the tables of their logs
    Images,
    /// The Python wheel
    Wheel,
    /// LinuxCNC's components
    Linuxcnc,
    /// The bench as one HTML file
    Bench,
    /// Bills of materials (CycloneDX), and the licences of all dependencies
    Bill,
    /// Packages for crates.io, which are not uploaded
    Packages,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.to_possible_value().expect("no variant is hidden");
        f.pad(value.get_name())
    }
}

/// A release in the making.
pub(crate) struct Release {
    /// The project's version.
    pub version: String,
    /// The release notes.
    pub notes: String,
    /// The workspace's folder.
    pub root: PathBuf,
    /// Folder of the files.
    pub out: PathBuf,
}

impl Release {
    /// Makes a part and returns its files.
    pub(crate) fn make(&self, part: Part) -> Result<Vec<PathBuf>> {
        match part {
            Part::Notes => {
                let path = self.file("notes.md");
                fs::write(&path, format!("{}\n", self.notes))?;
                Ok(vec![path])
            }
            Part::Command => self.command(),
            Part::Images => self.images(),
            Part::Wheel => self.wheel(),
            Part::Linuxcnc => self.linuxcnc(),
            Part::Bench => self.bench(),
            Part::Bill => bill::write(&self.root, |ending| self.file(ending)),
            Part::Packages => self.packages(),
        }
    }

    /// Path of a file whose name begins with project and version.
    fn file(&self, ending: &str) -> PathBuf {
        self.out.join(format!("quadrant-{}-{ending}", self.version))
    }

    /// Builds the command and packs it with manual pages and completions.
    fn command(&self) -> Result<Vec<PathBuf>> {
        let triple = if has_standard_library(MUSL)? {
            MUSL
        } else {
            GLIBC
        };
        let mut cargo = command::command("cargo");
        cargo
            .args(["build", "--release", "--package", "quadrant-cli"])
            .args(["--features", COMMAND_FEATURES])
            .args(["--target", triple, "--target-dir", "target/release-command"])
            .env("RUSTFLAGS", self.flags());
        command::run(&mut cargo)?;
        let program = self.root.join("target/release-command");
        let program = program.join(triple).join("release/quadrant");
        ensure_static(&program)?;

        let packed = format!("quadrant-{}-{triple}", self.version);
        let folder = self.out.join(&packed);
        fs::create_dir_all(&folder)?;
        command::run_quietly(
            command::command("strip")
                .arg("-o")
                .arg(folder.join("quadrant"))
                .arg(&program),
        )?;
        for name in LICENCES {
            fs::copy(self.root.join(name), folder.join(name))?;
        }
        command::output(
            command::command(&program)
                .arg("man")
                .arg(folder.join("man/man1")),
        )?;
        let completions = folder.join("completions");
        fs::create_dir_all(&completions)?;
        for (shell, name) in SHELLS {
            let text = command::output(command::command(&program).args(["completions", shell]))?;
            fs::write(completions.join(name), text)?;
        }
        println!(
            "{}",
            command::output(command::command(&program).arg("--version"))?.trim_end()
        );
        Ok(vec![self.pack(&packed)?])
    }

    /// Flags of the command's compiler: nothing is linked dynamically, and no path of this machine is in it.
    fn flags(&self) -> String {
        let mut flags = "-C target-feature=+crt-static".to_owned();
        let cargo_home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
        let home = || std::env::home_dir().map(|home| home.join(".cargo"));
        if let Some(folder) = cargo_home.or_else(home) {
            flags += &format!(" --remap-path-prefix={}=/cargo", folder.display());
        }
        flags + &format!(" --remap-path-prefix={}=/quadrant", self.root.display())
    }

    /// Packs a folder of the release's, and removes it. The same content gives the same bytes.
    fn pack(&self, name: &str) -> Result<PathBuf> {
        let path = self.out.join(format!("{name}.tar.gz"));
        command::run_quietly(
            command::command("tar")
                .current_dir(&self.out)
                .args(["--create", "--sort=name", "--owner=0", "--group=0"])
                .args(["--numeric-owner", "--use-compress-program=gzip -n"])
                .arg(format!("--mtime=@{}", committed_s()?))
                .arg("--file")
                .arg(&path)
                .arg(name),
        )?;
        fs::remove_dir_all(self.out.join(name))?;
        Ok(path)
    }

    /// Builds all images. An image's file has the table of its log: `defmt-print -e FILE` reads it.
    fn images(&self) -> Result<Vec<PathBuf>> {
        let mut made = Vec::new();
        for target in Target::ALL {
            let name = target.to_string();
            let (board, scalar) = name.split_once(' ').context("board and number type")?;
            command::run(&mut chore(&["build", "--board", board, "--scalar", scalar]))?;
            let name = format!("{board}-{scalar}.elf");
            let path = self.file(&name);
            fs::copy(self.root.join("target/images").join(name), &path)?;
            made.push(path);
        }
        Ok(made)
    }

    /// Builds the wheel.
    fn wheel(&self) -> Result<Vec<PathBuf>> {
        command::run(chore(&["python", "--wheel"]).arg(&self.out))?;
        self.made("whl")
    }

    /// Builds LinuxCNC's components as a Debian package, with the manual page and the configurations.
    fn linuxcnc(&self) -> Result<Vec<PathBuf>> {
        let folder = tempfile::tempdir()?;
        let built = folder.path().join("built");
        fs::create_dir(&built)?;
        command::run(chore(&["linuxcnc", "--build"]).arg(&built))?;
        let root = folder.path().join("root");
        let install = |from: &Path, to: &str| -> Result<()> {
            command::run_quietly(
                command::command("install")
                    .args(["-D", "--mode=644", "--target-directory"])
                    .arg(root.join(to))
                    .arg(from),
            )
        };
        for module in ["quadrant.so", "quadrant_plant.so"] {
            install(&built.join(module), "usr/lib/linuxcnc/modules")?;
        }
        install(&built.join("quadrant.9"), "usr/share/man/man9")?;
        let documentation = "usr/share/doc/quadrant-linuxcnc";
        for name in LICENCES {
            install(&self.root.join(name), documentation)?;
        }
        command::run_quietly(
            command::command("cp")
                .arg("--recursive")
                .arg(built.join("configs"))
                .arg(root.join(documentation)),
        )?;
        fs::create_dir(root.join("DEBIAN"))?;
        fs::write(root.join("DEBIAN/control"), self.control())?;
        let path = self
            .out
            .join(format!("quadrant-linuxcnc_{}_amd64.deb", self.version));
        command::run_quietly(
            command::command("dpkg-deb")
                .args(["--build", "--root-owner-group"])
                .arg(&root)
                .arg(&path)
                // So that the same content gives the same bytes.
                .env("SOURCE_DATE_EPOCH", committed_s()?),
        )?;
        Ok(vec![path])
    }

    /// Debian's description of the package: LinuxCNC 2.9 alone has the interface that the components were built for.
    fn control(&self) -> String {
        format!(
            "Package: quadrant-linuxcnc\nVersion: {}\nArchitecture: amd64\nSection: misc\nPriority: optional\n\
             Maintainer: The Quadrant authors <noreply@quadrant.invalid>\n\
             Depends: linuxcnc-uspace (>= 2.9.0~), linuxcnc-uspace (<< 1:2.10)\n\
             Description: Servo control law with friction feedforward for LinuxCNC\n \
             The realtime components quadrant and quadrant_plant, and configurations.\n",
            self.version
        )
    }

    /// Builds the bench's page.
    fn bench(&self) -> Result<Vec<PathBuf>> {
        command::run(&mut chore(&["web"]))?;
        let path = self.file("bench.html");
        fs::copy(self.root.join("target/web/quadrant-bench.html"), &path)?;
        Ok(vec![path])
    }

    /// Makes the packages for crates.io as `cargo publish` would, and builds each from its package alone.
    fn packages(&self) -> Result<Vec<PathBuf>> {
        let mut cargo = command::command("cargo");
        // A release from a tag has no changes: then git knows every file.
        cargo.args(["publish", "--dry-run", "--allow-dirty"]);
        for package in PUBLISHED {
            cargo.args(["--package", package]);
        }
        command::run(&mut cargo)?;
        let packages = self.root.join("target/package");
        let mut made = Vec::new();
        for package in PUBLISHED {
            let name = format!("{package}-{}.crate", self.version);
            let path = self.out.join(&name);
            let found = [packages.join(&name), packages.join("tmp-crate").join(&name)];
            let found = found.iter().find(|path| path.is_file());
            fs::copy(
                found.with_context(|| format!("cargo left no {name}"))?,
                &path,
            )?;
            made.push(path);
        }
        Ok(made)
    }

    /// Files of the release's folder with an ending, in order.
    fn made(&self, ending: &str) -> Result<Vec<PathBuf>> {
        let mut made: Vec<PathBuf> = fs::read_dir(&self.out)?
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| path.extension() == Some(OsStr::new(ending)))
            .collect();
        made.sort();
        ensure!(!made.is_empty(), "no .{ending} was made");
        Ok(made)
    }
}

/// A chore in a process of its own.
fn chore(arguments: &[&str]) -> Command {
    let mut cargo = command::command("cargo");
    cargo.arg("xtask").args(arguments);
    cargo
}

/// Time of the last commit, seconds since 1970.
fn committed_s() -> Result<String> {
    let seconds = command::output(command::command("git").args(["log", "-1", "--format=%ct"]))?;
    Ok(seconds.trim().to_owned())
}

/// True if the standard library of a target is installed.
fn has_standard_library(triple: &str) -> Result<bool> {
    let rustc = command::output(command::command("rustc").args([
        "--print",
        "target-libdir",
        "--target",
        triple,
    ]))?;
    Ok(Path::new(rustc.trim()).is_dir())
}

/// Returns an error if a program asks for a dynamic linker.
fn ensure_static(program: &Path) -> Result<()> {
    let headers = command::output(command::command("readelf").arg("-lW").arg(program))?;
    ensure!(
        !headers.contains("INTERP"),
        "{} needs a dynamic linker",
        program.display()
    );
    Ok(())
}
