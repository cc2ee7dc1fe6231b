//! Compiles the law in C, and gives the linker it and the emulated board's files.

use std::path::PathBuf;
use std::process::Command;
use std::{env, fs};

/// The compiler of the C law.
const GCC: &str = "arm-none-eabi-gcc";

/// Its options: no fused multiply-add, as the law's words are the same on all machines.
const OPTIONS: [&str; 12] = [
    "-std=c11",
    "-O3",
    "-ffp-contract=off",
    "-ffreestanding",
    "-mthumb",
    "-mcpu=cortex-m4",
    "-mfpu=fpv4-sp-d16",
    "-mfloat-abi=hard",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-c",
];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let object = out.join("law.o");
    println!("cargo:rerun-if-changed=law.c");
    let compiled = Command::new(GCC)
        .args(OPTIONS)
        .args(["law.c", "-o"])
        .arg(&object)
        .status()
        .unwrap_or_else(|error| panic!("{GCC}: {error}; `cargo xtask setup --peer` installs it"));
    assert!(compiled.success(), "{GCC} ended with {compiled}");
    println!("cargo:rustc-link-arg={}", object.display());

    // The linker finds memory.x at the root of the workspace, and that asks for the board's map.
    const MAP: &str = "board_memory.x";
    println!("cargo:rerun-if-changed={MAP}");
    fs::copy(MAP, out.join(MAP)).unwrap_or_else(|error| panic!("cannot copy {MAP}: {error}"));
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg={argument}");
    }
}
