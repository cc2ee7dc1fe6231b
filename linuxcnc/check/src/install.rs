//! Building the components against the installed LinuxCNC, and putting them there or taking them away.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use xtask::command;

use crate::prove;

/// The components, by the names of their sources and modules.
const COMPONENTS: [&str; 2] = ["quadrant", "quadrant_plant"];
/// Folder of LinuxCNC's realtime modules.
const MODULES: &str = "/usr/lib/linuxcnc/modules";
/// Its headers.
const HEADERS: &str = "/usr/include/linuxcnc";
/// Folder of manual pages of this computer's own.
const MANUALS: &str = "/usr/local/share/man/man9";
/// The manual page.
const MANUAL: &str = "quadrant.9";
/// Debian's packages, by a file of each.
const PACKAGES: [(&str, &str); 5] = [
    ("/usr/bin/linuxcnc", "linuxcnc-uspace"),
    ("/usr/include/linuxcnc/hal.h", "linuxcnc-uspace-dev"),
    ("/usr/bin/gcc", "gcc"),
    ("/usr/bin/objcopy", "binutils"),
    ("/bin/ip", "iproute2"),
];

/// Folder of this package's sources.
pub(crate) fn sources() -> PathBuf {
    command::root().join("linuxcnc")
}

/// Installs LinuxCNC where it is missing; `with_apt`: by Debian's packages.
pub(crate) fn require_linuxcnc(with_apt: bool) -> Result<()> {
    let missing: Vec<&str> = PACKAGES
        .iter()
        .filter(|(file, _)| !Path::new(file).exists())
        .map(|(_, package)| *package)
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    if !with_apt {
        bail!(
            "LinuxCNC 2.9 is not installed: sudo apt-get install {}",
            missing.join(" ")
        );
    }
    command::run(command::command("apt-get").arg("update"))?;
    command::run(
        command::command("apt-get")
            .args(["install", "--yes", "--no-install-recommends"])
            .args(missing),
    )
}

/// Builds both modules into `folder`.
pub(crate) fn build(folder: &Path) -> Result<()> {
    command::run(command::command("cargo").args([
        "build",
        "--release",
        "--package",
        "quadrant-linuxcnc",
        "--lib",
    ]))?;
    let library = command::root().join("target/release/libquadrant_linuxcnc.a");
    for component in COMPONENTS {
        let file = |ending: &str| folder.join(format!("{component}.{ending}"));
        command::run(
            command::command("gcc")
                .args([
                    "-O2",
                    "-fPIC",
                    "-Wall",
                    "-Werror",
                    // LinuxCNC's master marks the interface for pins that 2.9 has.
                    "-Wno-error=deprecated-declarations",
                    "-DRTAPI",
                    "-D_GNU_SOURCE",
                ])
                .args(["-DUSPACE", "-D__MODULE__", "-I", HEADERS])
                .arg("-c")
                .arg(sources().join("c").join(format!("{component}.c")))
                .arg("-o")
                .arg(file("o")),
        )?;
        // LinuxCNC's own makefile exports the same names: those in this section, and nothing of the library.
        command::run(
            command::command("objcopy")
                .args(["-j", ".rtapi_export", "-O", "binary"])
                .args([file("o"), file("sym")]),
        )?;
        let names = fs::read(file("sym"))?;
        let names = names
            .split(|byte| *byte == 0)
            .filter(|name| !name.is_empty());
        let names: String = names
            .map(|name| format!("{}; ", String::from_utf8_lossy(name)))
            .collect();
        fs::write(file("ver"), format!("{{ global: {names}local: *; }};\n"))?;
        command::run(
            command::command("gcc")
                .args(["-shared", "-Wl,-Bsymbolic", "-Wl,--gc-sections"])
                .arg(format!("-Wl,--version-script={}", file("ver").display()))
                .arg("-o")
                .args([file("so"), file("o")])
                .arg(&library)
                .args(["-lm", "-lpthread", "-ldl", "-lgcc_s"]),
        )?;
    }
    Ok(())
}

/// Builds both modules and puts them among LinuxCNC's, with the manual page.
pub(crate) fn install() -> Result<()> {
    for module in build_proven(Path::new(MODULES))? {
        println!("{}", module.display());
    }
    fs::create_dir_all(MANUALS)?;
    fs::copy(sources().join(MANUAL), Path::new(MANUALS).join(MANUAL))?;
    Ok(())
}

/// Builds both modules into a folder, with manual page and configurations.
pub(crate) fn pack(folder: &Path) -> Result<()> {
    build_proven(folder)?;
    fs::copy(sources().join(MANUAL), folder.join(MANUAL))?;
    command::run_quietly(
        command::command("cp")
            .arg("--recursive")
            .arg(sources().join("configs"))
            .arg(folder),
    )
}

/// Builds both modules, proves of one that its tick does not panic, and puts them into a folder; returns their paths.
fn build_proven(place: &Path) -> Result<Vec<PathBuf>> {
    let folder = tempfile::tempdir()?;
    build(folder.path())?;
    prove::prove(&folder.path().join("quadrant.so"))?;
    let mut modules = Vec::new();
    for component in COMPONENTS {
        let module = format!("{component}.so");
        let path = place.join(&module);
        // A module that is loaded keeps its old content.
        let _ = fs::remove_file(&path);
        command::run_quietly(
            command::command("strip")
                .arg("-o")
                .arg(&path)
                .arg(folder.path().join(&module)),
        )
        .with_context(|| {
            format!(
                "cannot write {}: LinuxCNC's folder needs root",
                path.display()
            )
        })?;
        modules.push(path);
    }
    Ok(modules)
}

/// Takes away what [`install`] has put there.
pub(crate) fn uninstall() -> Result<()> {
    let modules = COMPONENTS.map(|component| Path::new(MODULES).join(format!("{component}.so")));
    for file in modules.into_iter().chain([Path::new(MANUALS).join(MANUAL)]) {
        if file.exists() {
            fs::remove_file(&file)
                .with_context(|| format!("{}: run it as root", file.display()))?;
            println!("removed {}", file.display());
        }
    }
    Ok(())
}
