//! `cargo xtask board-run`: the package `board-model`, which runs a board's image on a model of its chip.
//!
//! The chip model is `rigless` of the crate registry. It lacks some of what the image needs, and a package cannot patch another
//! one's source, so a patched copy of it is made below `target`.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::ValueEnum;
use xtask::command;
use xtask::image::{self, Board, Scalar, Target};
use xtask::toolchain::{Choice, Toolchain};

/// The package.
const MANIFEST: &str = "board-model/Cargo.toml";
/// Changes of the chip model.
const PATCH: &str = "board-model/rigless.patch";
/// Folder of the chip model and of what is built.
const FOLDER: &str = "target/board-model";
/// Name and version of the chip model.
const MODEL: (&str, &str) = ("rigless", "0.4.0");

/// Runs scenarios. The image is built unless the options name one or ask for names or help alone.
///
/// # Errors
/// Chip model, package or image do not build, or a scenario fails.
pub(crate) fn run(toolchain: Option<Choice>, options: Vec<OsString>) -> Result<()> {
    let program = build()?;
    let mut model = command::command(program);
    let given = |names: &[&str]| {
        options
            .iter()
            .any(|option| names.iter().any(|name| option == name))
    };
    if !given(&["--image", "--list", "--help", "-h"]) {
        let target = Target::new(board(&options)?, Scalar::F32);
        let image = image::build(Toolchain::chosen(toolchain)?, target)?;
        model.arg("--image").arg(image.path);
    }
    command::run_quietly(model.args(options))
}

/// The board that the options name; the reference board if they name none. The program itself has the same option.
fn board(options: &[OsString]) -> Result<Board> {
    let mut options = options.iter().map(|option| option.to_string_lossy());
    while let Some(option) = options.next() {
        let name = match option.strip_prefix("--board") {
            Some("") => options.next(),
            Some(rest) => rest.strip_prefix('=').map(|name| name.to_owned().into()),
            None => continue,
        };
        let name = name.unwrap_or_default();
        return Board::from_str(&name, true).map_err(anyhow::Error::msg);
    }
    Ok(Board::NucleoF446re)
}

/// Builds the package and returns its program.
fn build() -> Result<PathBuf> {
    let root = command::root();
    let program = root.join(FOLDER).join("build/release/quadrant-board-model");
    patched_model(&root)?;
    if !program.exists() {
        println!("building the chip model: 4 to 10 min on two cores, the first time only");
    }
    let mut cargo = command::command("cargo");
    cargo
        .args([
            "build",
            "--quiet",
            "--release",
            "--locked",
            "--manifest-path",
            MANIFEST,
        ])
        // The model names a newer compiler than it needs.
        .arg("--ignore-rust-version")
        .args(["--target-dir", &format!("{FOLDER}/build")]);
    command::run_quietly(&mut cargo).context(
        "the chip model does not build: it takes Rust 1.95 or newer; try `rustup update stable`",
    )?;
    Ok(program)
}

/// Makes the patched copy of the chip model, unless it is there.
fn patched_model(root: &Path) -> Result<()> {
    let patch =
        fs::read_to_string(root.join(PATCH)).with_context(|| format!("cannot read {PATCH}"))?;
    let copy = root.join(FOLDER).join(MODEL.0);
    // The copy of the patch that was applied.
    let applied = copy.join("applied.patch");
    if fs::read_to_string(&applied).is_ok_and(|text| text == patch) {
        return Ok(());
    }
    ensure!(
        command::exists("patch"),
        "the program `patch` is missing: install it, on Debian by `apt-get install patch`"
    );
    let source = fetched_model(root)?;
    if copy.exists() {
        fs::remove_dir_all(&copy).with_context(|| format!("cannot remove {}", copy.display()))?;
    }
    copy_folder(&source.join("src"), &copy.join("src"))?;
    for name in [
        "build.rs",
        ".cargo_vcs_info.json",
        "LICENSE-MIT",
        "LICENSE-APACHE",
        "NOTICE",
    ] {
        fs::copy(source.join(name), copy.join(name))
            .with_context(|| format!("cannot copy {name}"))?;
    }
    // Its lints are its authors' business.
    let manifest = fs::read_to_string(source.join("Cargo.toml"))
        .context("cannot read the model's manifest")?;
    let manifest = manifest.split("\n[lints").next().unwrap_or_default();
    fs::write(copy.join("Cargo.toml"), manifest).context("cannot write the model's manifest")?;
    let mut program = command::command("patch");
    program
        .args(["--silent", "-p1", "-d"])
        .arg(&copy)
        .arg("-i")
        .arg(root.join(PATCH));
    command::run_quietly(&mut program)?;
    fs::write(&applied, patch).with_context(|| format!("cannot write {}", applied.display()))
}

/// Fetches the chip model's source and returns its folder.
fn fetched_model(root: &Path) -> Result<PathBuf> {
    let folder = root.join(FOLDER).join("fetch");
    let (name, version) = MODEL;
    let manifest = format!(
        "[package]\nname = \"fetch\"\nedition = \"2024\"\n[workspace]\n[dependencies]\n\
         {name} = {{ version = \"={version}\", default-features = false }}\n"
    );
    fs::create_dir_all(folder.join("src")).context("cannot create a folder below target")?;
    fs::write(folder.join("src/lib.rs"), "").context("cannot write below target")?;
    fs::write(folder.join("Cargo.toml"), manifest).context("cannot write below target")?;
    let mut cargo = command::command("cargo");
    cargo
        .args([
            "metadata",
            "--quiet",
            "--format-version",
            "1",
            "--manifest-path",
        ])
        .arg(folder.join("Cargo.toml"));
    let text = command::output(&mut cargo).context("cannot fetch the chip model")?;
    let metadata: serde_json::Value = serde_json::from_str(&text).context("cargo's metadata")?;
    let packages = metadata["packages"]
        .as_array()
        .context("cargo names no packages")?;
    let model = packages
        .iter()
        .find(|package| package["name"] == name)
        .context("the model was not fetched")?;
    let manifest = model["manifest_path"]
        .as_str()
        .context("the model has no manifest")?;
    Ok(Path::new(manifest)
        .parent()
        .context("a manifest is in a folder")?
        .to_owned())
}

/// Copies a folder with all that is in it. The copies can be written.
fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to).with_context(|| format!("cannot create {}", to.display()))?;
    for entry in fs::read_dir(from).with_context(|| format!("cannot read {}", from.display()))? {
        let entry = entry?;
        let (from, to) = (entry.path(), to.join(entry.file_name()));
        if entry.file_type()?.is_dir() {
            copy_folder(&from, &to)?;
        } else {
            let bytes =
                fs::read(&from).with_context(|| format!("cannot read {}", from.display()))?;
            fs::write(&to, bytes).with_context(|| format!("cannot write {}", to.display()))?;
        }
    }
    Ok(())
}
