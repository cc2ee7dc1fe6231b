//! The ticks whose cost is looked at, by kind: those of homed axes on recorded inputs, and those of a machine with a host.

use std::collections::BTreeSet;
use std::ops::Range;

use anyhow::{Context, Result, ensure};
use quadrant_host::machine::emulator::Memory;
use quadrant_law::safety::Switches;
use quadrant_lockstep::{BASE, InputRecord, Mode, OutputRecord, RECORDED_OUTPUTS};
use quadrant_settings::Job;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

use crate::near_home::{ENABLE_TICK, HOME_TICK, RUN_TICK};
use crate::reference_model::{self, ReferenceModel, SETTLING_TICKS};
use crate::trace::{Tick, Trace};
use crate::{hosted, lockstep};

/// The image that is emulated.
pub(crate) fn emulated(toolchain: Toolchain, scalar: Scalar) -> Result<Image> {
    let target = Target::new(Board::Mps2, scalar);
    image::build(toolchain, target)
}

/// Traced ticks, by kind.
pub(crate) struct Kinds {
    /// All, in the order of execution.
    ticks: Vec<Tick>,
    /// The indices of each kind's, the usual kind first.
    kinds: Vec<(&'static str, Vec<usize>)>,
    /// Functions that were executed in a tick on recorded inputs, inlined ones too.
    functions: BTreeSet<String>,
}

impl Kinds {
    /// Runs the image on the default job, with as many usual ticks, and with a host.
    pub(crate) fn traced(image: &Image, ticks: u32) -> Result<Self> {
        let recorded = Recorded::with_usual(ticks);
        let mut rehearsal = rehearse(image, reference_model::job(), recorded.fault + 1)?;
        recorded.mark(&mut rehearsal.inputs);
        let (mut all, functions) = trace(image, &rehearsal, 0)?;
        let mut kinds = recorded.kinds();
        for (name, hosted) in hosted::traced(image)? {
            kinds.push((name, (all.len()..all.len() + hosted.len()).collect()));
            all.extend(hosted);
        }
        Ok(Self {
            ticks: all,
            kinds,
            functions,
        })
    }

    /// All ticks, in the order of execution.
    pub(crate) fn all(&self) -> &[Tick] {
        &self.ticks
    }

    /// The functions that were executed on recorded inputs, inlined ones too.
    pub(crate) fn functions(&self) -> &BTreeSet<String> {
        &self.functions
    }

    /// Each kind with its name, the usual one first.
    pub(crate) fn each(&self) -> impl Iterator<Item = (&'static str, Vec<&Tick>)> {
        self.kinds.iter().map(|(name, indices)| {
            let ticks = indices.iter().map(|index| &self.ticks[*index]);
            (*name, ticks.collect())
        })
    }
}

/// Name of the kind that a machine spends its time with.
pub(crate) const USUAL: &str = "usual";

/// Control ticks from one snapshot for the supervising task to the next.
const SNAPSHOT_TICKS: usize = 10;

/// Ticks around a request that are of its kind.
const AROUND_REQUEST: Range<u32> = 0..50;

/// Ticks of a lead-in that are counted, from the request of the plan on: it takes 500.
const LEAD_IN: Range<u32> = 50..450;

/// Tick in which the motions of the plan have reached their speed.
const SETTLED: u32 = RUN_TICK + SETTLING_TICKS;

/// Ticks in which all axes meet an index pulse.
const INDEX_TICKS: u32 = 10;

/// The ticks of a run on recorded inputs.
struct Recorded {
    /// The first with an index pulse: the usual ones have ended.
    index: u32,
    /// The one in which the emergency stop is pressed: a fault, which triggers the capture.
    fault: u32,
}

impl Recorded {
    /// A run with as many usual ticks.
    fn with_usual(ticks: u32) -> Self {
        let index = SETTLED + ticks;
        Self {
            index,
            fault: index + INDEX_TICKS,
        }
    }

    /// Writes into the inputs what happens after the usual ticks.
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

    /// The indices of each kind's ticks.
    fn kinds(&self) -> Vec<(&'static str, Vec<usize>)> {
        let indices = |ticks: Range<u32>| (ticks.start as usize..ticks.end as usize).collect();
        let after = |tick: u32, ticks: Range<u32>| tick + ticks.start..tick + ticks.end;
        let snapshots = (SETTLED as usize..self.index as usize)
            .filter(|index| (index + 1).is_multiple_of(SNAPSHOT_TICKS))
            .collect();
        vec![
            (USUAL, indices(SETTLED..self.index)),
            ("snapshot", snapshots),
            ("enable", indices(after(ENABLE_TICK, AROUND_REQUEST))),
            ("homing", indices(HOME_TICK..RUN_TICK)),
            ("motions start", indices(after(RUN_TICK, AROUND_REQUEST))),
            ("lead-in", indices(after(RUN_TICK, LEAD_IN))),
            ("index pulse", indices(self.index..self.fault)),
            ("fault", indices(self.fault..self.fault + 1)),
        ]
    }
}

/// A job and the inputs that the reference model has read while it ran it in closed loop.
pub(crate) struct Rehearsal {
    job: Job,
    inputs: Vec<InputRecord>,
}

/// Runs the plan of a job on homed axes, for ticks from [`SETTLED`] on at least.
fn rehearse(image: &Image, job: Job, ticks: u32) -> Result<Rehearsal> {
    let mut model = ReferenceModel::homed(image.target.scalar, job)?;
    let (inputs, _) = model.run_alone(ticks);
    ensure!(
        model.runs_homed(),
        "tick {ticks}: the axes are not homed, or do not follow the plan"
    );
    Ok(Rehearsal {
        job: model.job().clone(),
        inputs,
    })
}

/// Runs the image on a job with homed axes; as many usual ticks.
pub(crate) fn usual(image: &Image, job: Job, ticks: u32) -> Result<Vec<Tick>> {
    let rehearsal = rehearse(image, job, SETTLED + ticks)?;
    Ok(trace(image, &rehearsal, SETTLED)?.0)
}

/// Runs the image on recorded inputs; the ticks from one on, and their functions.
fn trace(image: &Image, rehearsal: &Rehearsal, from: u32) -> Result<(Vec<Tick>, BTreeSet<String>)> {
    let Rehearsal { job, inputs } = rehearsal;
    let trace = Trace::of(image)?;
    let memory = Memory::create()?;
    lockstep::load(&memory, Mode::Unpaced, job, inputs)?;
    let (mut emulator, mut tracer) = trace.start(image, &memory)?;
    let lines = emulator.take_stderr().context("QEMU's trace is a pipe")?;
    match from.checked_sub(1) {
        None => tracer.trace_from(trace.root())?,
        Some(before) => {
            let output = RECORDED_OUTPUTS + OutputRecord::BYTES * before as usize;
            tracer.trace_from_write(u32::try_from(BASE + output)?)?;
        }
    }
    let (closed, functions) = trace.read_with_functions(image, lines)?;
    emulator.wait()?;
    ensure!(
        closed.len() + from as usize == inputs.len(),
        "{} control ticks seen in the trace instead of {}",
        closed.len(),
        inputs.len() - from as usize
    );
    closed.iter().try_for_each(|tick| tick.whole().map(drop))?;
    Ok((closed, functions))
}
