//! `cargo xtask story`: a machine's whole story, told by the emulated image through the console alone.

use anyhow::Result;

use crate::command;
use crate::image::{self, Board, Scalar, Target};
use crate::toolchain::Toolchain;

/// Builds the image and runs the test that plays the story on it (`host-sim/tests/story.rs`).
pub(crate) fn run(toolchain: Toolchain, overwrite_expected: bool) -> Result<()> {
    let target = Target {
        board: Board::Mps2,
        scalar: Scalar::F32,
    };
    let image = image::build(toolchain, target)?;
    let mut test = command::command("cargo");
    // Of the whole workspace, so that nothing is built with other features than the other tests.
    test.args([
        "test",
        "--workspace",
        "--test",
        "story",
        "--",
        "--include-ignored",
    ])
    .env("QUADRANT_EMULATED_IMAGE", &image.path);
    if overwrite_expected {
        test.env("QUADRANT_OVERWRITE_EXPECTED", "1");
    }
    command::run(&mut test)
}
