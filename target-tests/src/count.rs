//! `cargo xtask count`: the instructions of a control tick, from the interrupt's entry to its return, by stage.
//!
//! QEMU logs every run of instructions executed. These are instructions, not cycles.

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::{Context, Result, bail, ensure};
use quadrant::lockstep::{InputRecord, Job, Mode};
use quadrant::safety::Switches;
use quadrant_sim::machine::emulator::Memory;
use serde::{Deserialize, Serialize};

use crate::lockstep;
use crate::reference_model::{self, ReferenceModel, SETTLING_TICKS};
use crate::trace::{Tick, Trace};
use xtask::golden::Golden;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

/// Tolerance above the expected count, %.
const TOLERANCE_PERCENT: f64 = 5.0;

/// Instructions per tick of one stage or of all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Figure {
    mean: f64,
    min: u32,
    max: u32,
}

/// Counts of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Count {
    ticks: u32,
    total: Figure,
    /// Empty where only the whole is held.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    stages: BTreeMap<String, Figure>,
}

/// File of the expected counts.
const GOLDEN: Golden = Golden {
    path: "target-tests/golden/instructions.toml",
    head: "Written by `cargo xtask count --overwrite-expected`; `cargo xtask count` holds its figures against these.",
};

/// Counts the default job stage by stage, and the kinds of ticks that cost more than the usual ones; prints, and holds the
/// figures against the committed ones.
pub(crate) fn run(toolchain: Toolchain, scalar: Scalar, ticks: u32, overwrite: bool) -> Result<()> {
    let image = emulated(toolchain, scalar)?;
    let seldom = Seldom::after(ticks);
    let job = reference_model::job();
    let mut inputs = rehearse(&image, &job, seldom.fault + 1)?;
    seldom.mark(&mut inputs);
    let closed = trace(&image, &job, &inputs)?;
    let usual = SETTLING_TICKS as usize..(SETTLING_TICKS + ticks) as usize;
    let count = summary(&closed[usual]);
    println!(
        "{}: instructions per control tick over {ticks} ticks",
        image.target
    );
    println!("  {:<20} {:>9} {:>6} {:>6}", "stage", "mean", "min", "max");
    let rows = count
        .stages
        .iter()
        .map(|(stage, figure)| (stage.as_str(), figure));
    for (stage, figure) in rows.chain([("total", &count.total)]) {
        println!(
            "  {stage:<20} {:>9.1} {:>6} {:>6}",
            figure.mean, figure.min, figure.max
        );
    }
    let scalar = image.target.scalar_name();
    let mut counts = vec![(scalar.clone(), count)];
    for (name, kind) in seldom.kinds(&closed, ticks) {
        let Figure { mean, min, max } = kind.total;
        println!("  {name:<20} {mean:>9.1} {min:>6} {max:>6}");
        counts.push((format!("{scalar}, {name}"), kind));
    }
    if overwrite {
        return GOLDEN.store(Some(&image.compiler), counts);
    }
    counts
        .iter()
        .try_for_each(|(key, count)| compare(key, count, &image.compiler))
}

/// Control ticks from one snapshot for the supervising task to the next.
const SNAPSHOT_TICKS: usize = 10;

/// Ticks of a lead-in that are counted: it begins in tick 210 or so, and takes 500.
const LEAD_IN: Range<usize> = 250..650;

/// Ticks in which all axes meet an index pulse.
const INDEX_TICKS: u32 = 10;

/// Ticks that cost more than the usual ones and come after them.
struct Seldom {
    /// The first with an index pulse.
    index: u32,
    /// The one in which the emergency stop is pressed: a fault, which triggers the capture.
    fault: u32,
}

impl Seldom {
    /// After the usual ticks.
    fn after(ticks: u32) -> Self {
        let index = SETTLING_TICKS + ticks;
        Self {
            index,
            fault: index + INDEX_TICKS,
        }
    }

    /// Writes what happens in them into the inputs.
    fn mark(&self, inputs: &mut [InputRecord]) {
        for (tick, input) in (0..).zip(inputs) {
            if (self.index..self.fault).contains(&tick) {
                for reading in &mut input.readings {
                    reading.index = Some(reading.count);
                }
            }
            if tick == self.fault {
                input.switches = Switches::EMERGENCY_STOP;
            }
        }
    }

    /// The counts of all kinds, of a run of the marked inputs.
    fn kinds(&self, closed: &[Tick], ticks: u32) -> [(&'static str, Count); 4] {
        let settled = SETTLING_TICKS as usize;
        let snapshots: Vec<Tick> = closed[..settled + ticks as usize]
            .iter()
            .skip(settled.next_multiple_of(SNAPSHOT_TICKS) + SNAPSHOT_TICKS - 1)
            .step_by(SNAPSHOT_TICKS)
            .cloned()
            .collect();
        let (index, fault) = (self.index as usize, self.fault as usize);
        [
            ("lead-in", &closed[LEAD_IN]),
            ("snapshot", &snapshots[..]),
            ("index pulse", &closed[index..fault]),
            ("fault", &closed[fault..]),
        ]
        .map(|(name, ticks)| {
            let whole = Count {
                stages: BTreeMap::new(),
                ..summary(ticks)
            };
            (name, whole)
        })
    }
}

/// Counts some jobs, prints a line for each, and holds the figures against the committed ones.
pub(crate) fn run_all(
    toolchain: Toolchain,
    scalar: Scalar,
    jobs: Vec<(String, Job)>,
    ticks: u32,
    overwrite: bool,
) -> Result<()> {
    let image = emulated(toolchain, scalar)?;
    println!(
        "{}: instructions per control tick, three axes, over {ticks} ticks",
        image.target
    );
    println!(
        "  {:<28} {:>9} {:>6} {:>6}",
        "law, feedforward", "mean", "min", "max"
    );
    let mut counts = Vec::new();
    for (name, job) in jobs {
        let count = count(&image, job, ticks)?;
        let Figure { mean, min, max } = count.total;
        println!("  {name:<28} {mean:>9.1} {min:>6} {max:>6}");
        let whole = Count {
            stages: BTreeMap::new(),
            ..count
        };
        counts.push((format!("{}, {name}", image.target.scalar_name()), whole));
    }
    if overwrite {
        return GOLDEN.store(Some(&image.compiler), counts);
    }
    counts
        .iter()
        .try_for_each(|(key, count)| compare(key, count, &image.compiler))
}

/// The image that is emulated.
fn emulated(toolchain: Toolchain, scalar: Scalar) -> Result<Image> {
    let target = Target {
        board: Board::Mps2,
        scalar,
    };
    image::build(toolchain, target)
}

/// Runs the image and counts.
fn count(image: &Image, job: Job, ticks: u32) -> Result<Count> {
    // The beginning is spent at rest and is not counted.
    let inputs = rehearse(image, &job, SETTLING_TICKS + ticks)?;
    let closed = trace(image, &job, &inputs)?;
    Ok(summary(&closed[SETTLING_TICKS as usize..]))
}

/// The inputs that the reference model reads in closed loop.
fn rehearse(image: &Image, job: &Job, ticks: u32) -> Result<Vec<InputRecord>> {
    let model = ReferenceModel::of(image.target.scalar, job.clone())?;
    Ok(model.run_alone(ticks).0)
}

/// Runs the image on recorded inputs; one count of each tick.
fn trace(image: &Image, job: &Job, inputs: &[InputRecord]) -> Result<Vec<Tick>> {
    let trace = Trace::of(image)?;
    let memory = Memory::create()?;
    lockstep::load(&memory, Mode::Unpaced, job, inputs)?;
    let (mut emulator, mut tracer) = trace.start(image, &memory)?;
    let lines = emulator.take_stderr().context("QEMU's trace is a pipe")?;
    tracer.trace_from(trace.root())?;
    let closed = trace.read(image, lines)?;
    emulator.wait()?;
    ensure!(
        closed.len() == inputs.len(),
        "{} control ticks seen in the trace instead of {}",
        closed.len(),
        inputs.len()
    );
    Ok(closed)
}

fn summary(closed: &[Tick]) -> Count {
    let ticks = closed.len() as u32;
    let figure = |of: &dyn Fn(&Tick) -> u32| {
        let values = closed.iter().map(of);
        let sum: u64 = values.clone().map(u64::from).sum();
        Figure {
            // To a tenth, so that the file stays readable.
            mean: (sum as f64 * 10.0 / f64::from(ticks)).round() / 10.0,
            min: values.clone().min().unwrap_or(0),
            max: values.max().unwrap_or(0),
        }
    };
    let names: std::collections::BTreeSet<&'static str> = closed
        .iter()
        .flat_map(|tick| tick.keys().copied())
        .collect();
    Count {
        ticks,
        total: figure(&|tick| tick.values().sum()),
        stages: names
            .into_iter()
            .map(|name| {
                (
                    name.to_owned(),
                    figure(&|tick| tick.get(name).copied().unwrap_or(0)),
                )
            })
            .collect(),
    }
}

fn compare(key: &str, count: &Count, compiler: &str) -> Result<()> {
    let Some((expected, difference)) = GOLDEN.read::<Count>()?.table(key, compiler) else {
        bail!(
            "no figure is committed for {key}: `cargo xtask count --overwrite-expected` makes one"
        );
    };
    let pairs = [
        ("mean", count.total.mean, expected.total.mean),
        ("max", count.total.max.into(), expected.total.max.into()),
    ];
    for (name, counted, expected) in pairs {
        let growth = 100.0 * (counted / expected - 1.0);
        println!("  {key}: {name} {counted} against {expected} expected, {growth:+.1} %");
        difference.ensure(growth <= TOLERANCE_PERCENT, || {
            format!(
                "{key}: the {name} has grown by {growth:.1} %, more than {TOLERANCE_PERCENT} %; if that is wanted, \
                 `cargo xtask count --overwrite-expected` accepts it"
            )
        })?;
    }
    Ok(())
}
