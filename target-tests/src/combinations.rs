//! `cargo xtask combinations`: every feedback law with every feedforward, and the N-PID with what adapts itself, on the emulated
//! target, bit for bit, and what each law and each feedforward costs.

use anyhow::{Result, ensure};
use quadrant_law::cancelling::CancellingSettings;
use quadrant_law::control::feedback::LawKind;
use quadrant_law::feedforward::FeedforwardKind;
use quadrant_law::learning::LearningSettings;
use quadrant_settings::AxisSettings;
use quadrant_settings::Job;

use crate::reference_model::{self, ReferenceModel};
use crate::{count, lockstep};
use xtask::image::{self, Board, Scalar, Target};
use xtask::toolchain::Toolchain;

/// A law and a feedforward, with what adapts itself.
#[derive(Clone, Copy, Debug)]
struct Combination {
    law: LawKind,
    kind: FeedforwardKind,
    learns: bool,
    cancels: bool,
}

impl Combination {
    fn of(law: LawKind, kind: FeedforwardKind) -> Self {
        Self {
            law,
            kind,
            learns: false,
            cancels: false,
        }
    }

    fn put_into(self, axis: &mut AxisSettings) {
        axis.feedback.law = self.law;
        axis.feedforward.kind = self.kind;
        axis.feedforward.learning = self.learns.then(LearningSettings::default);
        axis.feedforward.cancelling = self.cancels.then(|| CancellingSettings {
            spindle_rpm: SPINDLE_RPM,
            ..CancellingSettings::default()
        });
    }

    fn name(self) -> String {
        let Self {
            law,
            kind,
            learns,
            cancels,
        } = self;
        let learning = if learns { ", learning" } else { "" };
        let cancelling = if cancels { ", cancelling" } else { "" };
        format!("{law:?}, {kind:?}{learning}{cancelling}")
    }
}

/// Speed of the spindle whose vibration is cancelled, rpm.
const SPINDLE_RPM: f64 = 3000.0;

/// Control ticks of each comparison.
const TICKS: u32 = 4_000;

/// All of them.
fn all() -> Vec<Combination> {
    let kinds = |law| FeedforwardKind::ALL.map(|kind| Combination::of(law, kind));
    let fixed = LawKind::ALL.into_iter().flat_map(kinds);
    fixed.chain(adaptive()).collect()
}

/// The N-PID with combined feedforward that learns, cancels, or both.
fn adaptive() -> [Combination; 3] {
    [(true, false), (false, true), (true, true)].map(|(learns, cancels)| Combination {
        learns,
        cancels,
        ..Combination::of(LawKind::NPid, FeedforwardKind::Combined)
    })
}

/// The job of an emulated run, each axis with a combination of its own.
fn job(axes: [Combination; 3]) -> Job {
    let mut job = reference_model::job();
    for (axis, combination) in job.stage.axes.iter_mut().zip(axes) {
        combination.put_into(axis);
    }
    job
}

/// Runs every combination in lockstep, one on each axis and three at a time, and fails on any difference.
pub(crate) fn lockstep(toolchain: Toolchain, scalar: Scalar) -> Result<()> {
    let image = image::build(toolchain, Target::new(Board::Mps2, scalar))?;
    let combinations = all();
    let (mut words, mut moving) = (0, 0);
    for three in combinations.chunks(3) {
        // A short chunk runs its last combination again.
        let axes = [0, 1, 2].map(|index: usize| three[index.min(three.len() - 1)]);
        let tally =
            lockstep::lockstep(&image, ReferenceModel::of(scalar, job(axes))?, TICKS, None)?.tally;
        if let Some((tick, model, firmware)) = &tally.first {
            println!(
                "{axes:?}: first difference at tick {tick}: {model:?} here, {firmware:?} in the firmware"
            );
        }
        ensure!(tally.differ == 0, "{axes:?}: {} words differ", tally.differ);
        ensure!(
            2 * tally.moving > tally.words,
            "{axes:?}: they did not move"
        );
        words += tally.words;
        moving += tally.moving;
    }
    println!(
        "{} combinations of law and feedforward, {words} words compared, 0 differ, {moving} of them not zero",
        combinations.len()
    );
    Ok(())
}

/// Counts the instructions of every law with combined feedforward, of every feedforward with the PID, and of what adapts itself, on
/// all axes.
pub(crate) fn count(
    toolchain: Toolchain,
    scalar: Scalar,
    ticks: u32,
    overwrite: bool,
) -> Result<()> {
    let laws = LawKind::ALL.map(|law| Combination::of(law, FeedforwardKind::Combined));
    let kinds = FeedforwardKind::ALL
        .into_iter()
        .filter(|kind| *kind != FeedforwardKind::Combined)
        .map(|kind| Combination::of(LawKind::Pid, kind));
    let jobs: Vec<(String, Job)> = laws
        .into_iter()
        .chain(kinds)
        .chain(adaptive())
        .map(|combination| (combination.name(), job([combination; 3])))
        .collect();
    count::run_all(toolchain, scalar, jobs, ticks, overwrite)
}
