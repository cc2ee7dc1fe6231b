//! Gives the linker the board's files: its memory map and its interrupt vectors.

use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let board = if env::var_os("CARGO_FEATURE_BOARD_MPS2").is_some() {
        let board = Path::new("src/board/mps2");
        install(board, "device.x", &out);
        board
    } else if env::var_os("CARGO_FEATURE_BOARD_NUCLEO_F446RE").is_some() {
        let board = Path::new("src/board/nucleo_f446re");
        // The chip's own crate names vectors by peripheral; this script maps them to our roles.
        install(board, "roles.x", &out);
        link_argument("-Troles.x");
        board
    } else if env::var_os("CARGO_FEATURE_BOARD_NUCLEO_H743ZI2").is_some() {
        let board = Path::new("src/board/nucleo_h743zi2");
        install(board, "roles.x", &out);
        link_argument("-Troles.x");
        board
    } else {
        return;
    };
    // The linker finds memory.x at the root of the package, and that asks for the board's.
    println!("cargo:rerun-if-changed=memory.x");
    install(board, "board_memory.x", &out);
    println!("cargo:rustc-link-search={}", out.display());
    // Sections need not start at page boundaries of a machine that has no pages.
    link_argument("--nmagic");
    link_argument("-Tlink.x");
    link_argument("-Tdefmt.x");
}

/// Copies a linker script to where the linker looks for it.
fn install(folder: &Path, name: &str, out: &Path) {
    let source = folder.join(name);
    println!("cargo:rerun-if-changed={}", source.display());
    fs::copy(&source, out.join(name))
        .unwrap_or_else(|error| panic!("cannot copy {}: {error}", source.display()));
}

/// Adds an argument to the firmware's link, and only to that.
fn link_argument(argument: &str) {
    println!("cargo:rustc-link-arg-bin=quadrant-firmware={argument}");
}
