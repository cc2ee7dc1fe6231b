//! Saved recordings as the source of an identification.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use indicatif::ProgressDrawTarget;
use quadrant_cli::output::share;
use quadrant_cli::warn;
use quadrant_tune::record::{MotionOptions, Recording};

/// Reading that is done sooner needs no bar.
const PATIENCE: Duration = Duration::from_secs(2);

/// Reads a recording, with a bar if that takes long.
pub(super) fn read(path: &Path) -> anyhow::Result<Recording> {
    with_bar(|progress| Ok(Recording::read_csv_with(path, progress)?))
}

/// Reads a recorded motion in the same way; says what was guessed, and how it was resampled.
pub(super) fn read_motion(path: &Path, options: &MotionOptions) -> anyhow::Result<Recording> {
    let (recording, notes) =
        with_bar(|progress| Ok(Recording::read_motion(path, options, progress)?))?;
    for note in notes {
        warn!("note: {}: {note}", path.display());
    }
    Ok(recording)
}

fn with_bar<T>(read: impl FnOnce(&mut dyn FnMut(f64)) -> anyhow::Result<T>) -> anyhow::Result<T> {
    let begin = Instant::now();
    let bar = share("reading the recording");
    bar.set_draw_target(ProgressDrawTarget::hidden());
    let found = read(&mut |done| {
        if bar.is_hidden() && begin.elapsed() > PATIENCE {
            bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        bar.set_position((1000.0 * done) as u64);
    })?;
    bar.finish_and_clear();
    Ok(found)
}

/// Returns the title of a page on saved recordings.
pub(super) fn title(paths: &[PathBuf]) -> String {
    format!("recorded: {}", names(paths).join(", "))
}

fn names(paths: &[PathBuf]) -> Vec<String> {
    paths
        .iter()
        .map(|path| path.file_name().unwrap_or(path.as_os_str()))
        .map(|name| name.display().to_string())
        .collect()
}
