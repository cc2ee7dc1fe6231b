//! The header is what the library exports.

use std::path::Path;

/// Set: the header is written again.
const RENEW: &str = "QUADRANT_RENEW_HEADER";

#[test]
fn the_header_says_what_the_library_exports() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = package.join("c/quadrant_linuxcnc.h");
    let config = cbindgen::Config::from_file(package.join("cbindgen.toml")).expect("a config");
    let mut made = Vec::new();
    cbindgen::generate_with_config(package, config)
        .expect("exports")
        .write(&mut made);
    let made = String::from_utf8(made).expect("text");
    if std::env::var_os(RENEW).is_some() {
        std::fs::write(&path, &made).expect("writes");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        made == kept,
        "c/quadrant_linuxcnc.h is not of src; {RENEW}=1 cargo test -p quadrant-linuxcnc writes it"
    );
}
