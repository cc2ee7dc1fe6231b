//! Settings files that commands write in part: what a command is not for stays, and what it changes is said.

use std::path::Path;

use anyhow::{Context, bail};
use quadrant_law::axes::AxisName;
use quadrant_settings::StageSettings;
use quadrant_sim::setting_value::{Change, changes, lost};
use quadrant_sim::settings_file::{SettingsFile, without_law};
use quadrant_written::whole;

/// Settings to start from where there are none: those of the simulated stage, no axis of which anybody has commissioned.
pub(super) fn built_in() -> SettingsFile {
    let mut stage = StageSettings::simulated();
    for axis in &mut stage.axes {
        axis.commissioned = false;
    }
    SettingsFile::new(stage)
}

/// The same for a record of `axis`, of a machine that is not known: the other axes have no law.
pub(super) fn built_in_for(axis: AxisName) -> SettingsFile {
    let mut file = built_in();
    for other in AxisName::ALL.into_iter().filter(|other| *other != axis) {
        without_law(&mut file.stage.axes[other as usize], file.stage.rate_hz);
    }
    file
}

/// The same without the law of `axis`, but with its friction, for which a part that is identified stands in: what is identified is no law.
pub(super) fn without_laws(axis: AxisName) -> SettingsFile {
    let mut file = built_in_for(axis);
    let rate_hz = file.stage.rate_hz;
    let own = &mut file.stage.axes[axis as usize];
    let friction = own.friction.clone();
    without_law(own, rate_hz);
    own.friction = friction;
    file
}

/// Writes settings that have come of `start`, and returns a line for each setting that differs from those that the file held, or
/// from `start` where there was none.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(
    file: &SettingsFile,
    start: &StageSettings,
    path: &Path,
) -> anyhow::Result<Vec<String>> {
    let before = SettingsFile::read(path).map(|there| there.stage);
    make_folder(path)?;
    file.write(path, whole::write)?;
    let changed = changes(before.as_ref().unwrap_or(start), &file.stage);
    Ok(changed.iter().map(Change::to_string).collect())
}

/// Makes the folder of a file that is about to be written.
///
/// # Errors
/// A folder that cannot be made.
pub(super) fn make_folder(path: &Path) -> anyhow::Result<()> {
    let Some(folder) = path.parent() else {
        return Ok(());
    };
    std::fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))
}

/// Refuses to write `after`, which has come of `start`, over other settings.
///
/// # Errors
/// Settings in the file at `path` that neither are those of `start` nor differ from it in `after`; a file that holds no settings.
pub(super) fn refuse_loss(
    path: &Path,
    start: &StageSettings,
    after: &StageSettings,
) -> anyhow::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let there = SettingsFile::read(path)?.stage;
    refuse(path, &lost(&there, start, after))
}

/// Refuses to write settings of one axis, which come of `start`, over a file in which anything else differs from `start`.
///
/// # Errors
/// As [`refuse_loss`].
pub(super) fn refuse_loss_beside(
    path: &Path,
    start: &StageSettings,
    axis: AxisName,
) -> anyhow::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let mut there = SettingsFile::read(path)?.stage;
    there.axes[axis as usize].clone_from(&start.axes[axis as usize]);
    refuse(path, &lost(&there, start, start))
}

/// Refuses to write a machine's settings over a file that holds others.
///
/// # Errors
/// The first setting that differs; a file that holds no settings.
pub(super) fn refuse_other(path: &Path, machine: &StageSettings) -> anyhow::Result<()> {
    if !path.exists() {
        return Ok(());
    }
    let there = SettingsFile::read(path)?.stage;
    let differing = changes(&there, machine);
    let Some(first) = differing.first() else {
        return Ok(());
    };
    bail!(
        "{}: {} settings there would be lost, {first} for one: write elsewhere, or say --overwrite",
        path.display(),
        differing.len()
    )
}

/// Refuses to lose settings of a file.
///
/// # Errors
/// The first of them, and their number.
fn refuse(path: &Path, lost: &[Change]) -> anyhow::Result<()> {
    let Some(Change {
        path: first,
        old,
        new,
    }) = lost.first()
    else {
        return Ok(());
    };
    bail!(
        "{path}: {} settings there would be lost, {first} = {old} for one (it would be {new}): start from it with --settings {path}, or \
         write elsewhere",
        lost.len(),
        path = path.display()
    )
}
