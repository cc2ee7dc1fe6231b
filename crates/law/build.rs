//! Looks for what newer compilers have, so that older ones can build the law without it.

use std::env;
use std::process::Command;

/// First minor version of Rust with `core::hint::cold_path`.
const COLD_PATH: u32 = 95;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(has_cold_path)");
    // A compiler that does not name its version is taken for a new one.
    if minor_version().is_none_or(|minor| minor >= COLD_PATH) {
        println!("cargo:rustc-cfg=has_cold_path");
    }
}

/// Minor version of the compiler, from `rustc 1.95.0 (...)`.
fn minor_version() -> Option<u32> {
    let output = Command::new(env::var_os("RUSTC")?)
        .arg("--version")
        .output()
        .ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    text.split('.').nth(1)?.parse().ok()
}
