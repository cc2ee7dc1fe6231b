//! `cargo xtask transcript`: a session through the console, end to end, on the emulated image.

use anyhow::Result;

use xtask::command;
use xtask::image::{self, Board, Scalar, Target};
use xtask::toolchain::Toolchain;

/// Builds the image and runs the tests that play the session on it (`cli/tests/suite/transcript.rs`).
pub(crate) fn run(toolchain: Toolchain, overwrite_expected: bool) -> Result<()> {
    let target = Target::new(Board::Mps2, Scalar::F32);
    let image = image::build(toolchain, target)?;
    let mut test = command::command("cargo");
    // Of the whole workspace, so that nothing is built with other features than the other tests.
    test.args(["test", "--workspace", "--test", "suite"])
        .args(["--", "--include-ignored", "transcript::"])
        .env("QUADRANT_EMULATED_IMAGE", &image.path);
    command::ensure_tests(&test)?;
    if overwrite_expected {
        test.env("QUADRANT_OVERWRITE_EXPECTED", "1");
    }
    command::run(&mut test)
}
