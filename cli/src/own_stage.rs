//! The option that names a simulated stage of one's own.

use std::path::PathBuf;

use clap::Args;
use quadrant_sim::stage_file::{StageFile, StageFileError};

/// Option that names a simulated stage of one's own.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct OwnStage {
    /// A simulated stage of your own in place of the built-in one: mass, friction, delay, resonance, backlash, encoder and travel of
    /// its axes, in a TOML file (examples/stage.toml has every number).
    #[arg(long, value_name = "FILE")]
    pub(super) stage: Option<PathBuf>,
}

impl OwnStage {
    /// Reads the file, if there is one.
    ///
    /// # Errors
    /// A file that cannot be read, or describes no stage.
    pub(super) fn read(&self) -> Result<Option<StageFile>, StageFileError> {
        self.stage.as_deref().map(StageFile::read).transpose()
    }
}
