//! The ticks whose cost is looked at: those of the default job once its motions have reached their speed, and the kinds that cost
//! more than the usual ones.

use std::ops::Range;

use anyhow::{Context, Result, ensure};
use quadrant::lockstep::{InputRecord, Job, Mode};
use quadrant::safety::Switches;
use quadrant_sim::machine::emulator::Memory;

use crate::lockstep;
use crate::reference_model::{self, ReferenceModel, SETTLING_TICKS};
use crate::trace::{Tick, Trace};
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

/// The image that is emulated.
pub(crate) fn emulated(toolchain: Toolchain, scalar: Scalar) -> Result<Image> {
    let target = Target {
        board: Board::Mps2,
        scalar,
    };
    image::build(toolchain, target)
}

/// Traced ticks of the default job.
pub(crate) struct Kinds {
    closed: Vec<Tick>,
    ticks: u32,
    seldom: Seldom,
}

impl Kinds {
    /// Runs the image on the default job, with as many usual ticks.
    pub(crate) fn traced(image: &Image, ticks: u32) -> Result<Self> {
        let seldom = Seldom::after(ticks);
        let job = reference_model::job();
        let mut inputs = rehearse(image, &job, seldom.fault + 1)?;
        seldom.mark(&mut inputs);
        Ok(Self {
            closed: trace(image, &job, &inputs)?,
            ticks,
            seldom,
        })
    }

    /// All ticks, from the first.
    pub(crate) fn all(&self) -> &[Tick] {
        &self.closed
    }

    /// The usual ones.
    pub(crate) fn usual(&self) -> &[Tick] {
        let settled = SETTLING_TICKS as usize;
        &self.closed[settled..settled + self.ticks as usize]
    }

    /// The others, each kind with its name.
    pub(crate) fn others(&self) -> [(&'static str, Vec<&Tick>); 5] {
        let settled = SETTLING_TICKS as usize;
        let snapshots = self.closed[..settled + self.ticks as usize]
            .iter()
            .skip(settled.next_multiple_of(SNAPSHOT_TICKS) + SNAPSHOT_TICKS - 1)
            .step_by(SNAPSHOT_TICKS)
            .collect();
        let (index, fault) = (self.seldom.index as usize, self.seldom.fault as usize);
        [
            ("start", self.closed[START].iter().collect()),
            ("lead-in", self.closed[LEAD_IN].iter().collect()),
            ("snapshot", snapshots),
            ("index pulse", self.closed[index..fault].iter().collect()),
            ("fault", self.closed[fault..].iter().collect()),
        ]
    }
}

/// Control ticks from one snapshot for the supervising task to the next.
const SNAPSHOT_TICKS: usize = 10;

/// Ticks in which the outputs are enabled and the motions started.
const START: Range<usize> = 0..250;

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
}

/// The inputs that the reference model reads in closed loop.
pub(crate) fn rehearse(image: &Image, job: &Job, ticks: u32) -> Result<Vec<InputRecord>> {
    let model = ReferenceModel::of(image.target.scalar, job.clone())?;
    Ok(model.run_alone(ticks).0)
}

/// Runs the image on recorded inputs; one count of each tick.
pub(crate) fn trace(image: &Image, job: &Job, inputs: &[InputRecord]) -> Result<Vec<Tick>> {
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
