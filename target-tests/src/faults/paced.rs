//! Faults that need a clock: the hardware timer paces the firmware, on recorded inputs, and instructions are its time.

use anyhow::{Context, Result, ensure};
use quadrant_host::machine::emulator::{Clock, Emulator, Memory};
use quadrant_law::safety::FaultCode;
use quadrant_law::stage::Outputs;
use quadrant_lockstep::{
    HANGS_FROM, HANGS_UNTIL, INJECTED_FAULT, INJECTED_FAULT_TICK, InjectedFault, InputRecord, Mode,
    OutputRecord, RECORDED_OUTPUTS,
};
use xtask::image::Image;

use super::finding::{Finding, are_off, log_contains};
use crate::lockstep;
use crate::reference_model::{self, ReferenceModel, SETTLING_TICKS};

/// Ticks of the runs.
const TICKS: u32 = SETTLING_TICKS + 250;
/// Cycles of the emulated timers in a control period.
const PERIOD_CYCLES: u32 = 2_500;

/// A run of recorded inputs, and what came of it.
struct Run {
    expected: Vec<Outputs>,
    memory: Memory,
    log: Vec<String>,
}

impl Run {
    /// Runs the circle; `adjust` changes what the firmware reads, `prepare` the memory.
    fn of(
        image: &Image,
        adjust: impl FnOnce(&mut [InputRecord]),
        prepare: impl FnOnce(&Memory) -> Result<()>,
    ) -> Result<Self> {
        let mut model = ReferenceModel::of(image.target.scalar, reference_model::job())?;
        let job = model.job().clone();
        let (mut inputs, expected) = model.run_alone(TICKS);
        adjust(&mut inputs);
        let memory = Memory::create()?;
        lockstep::load(&memory, Mode::Paced, &job, &inputs)?;
        prepare(&memory)?;
        let log = Emulator::start(
            &reference_model::program(image)?,
            &memory,
            Clock::Instructions,
            |_| {},
        )?
        .wait()?;
        Ok(Self {
            expected,
            memory,
            log,
        })
    }

    /// The outputs of the firmware that started as number `start`, from zero.
    fn outputs(&self, start: u32) -> Result<Vec<Outputs>> {
        let mut bytes = vec![0; TICKS as usize * OutputRecord::BYTES];
        let at = RECORDED_OUTPUTS + start as usize * bytes.len();
        self.memory.read(at, &mut bytes)?;
        let (records, _) = bytes.as_chunks();
        Ok(records
            .iter()
            .map(|record| OutputRecord::decode(record).outputs)
            .collect())
    }
}

/// A tick that ends too late, and one that begins too late.
pub(crate) fn deadlines_missed(image: &Image) -> Result<Vec<Finding>> {
    let at = SETTLING_TICKS;
    Ok(vec![
        late_tick(
            "reading the encoders takes a control period, once, 15 mm/s",
            &Run::of(image, |inputs| inputs[at as usize].slow = true, |_| Ok(()))?,
        )?,
        late_tick(
            "interrupts are masked for a period and a half, once, 15 mm/s",
            &Run::of(
                image,
                |_| {},
                |memory| {
                    memory.set_word(INJECTED_FAULT, InjectedFault::LateTick as u32)?;
                    memory.set_word(INJECTED_FAULT_TICK, at)?;
                    Ok(())
                },
            )?,
        )?,
    ])
}

/// The finding of a run in which the tick of index [`SETTLING_TICKS`] is late.
fn late_tick(how: &'static str, run: &Run) -> Result<Finding> {
    let late = SETTLING_TICKS as usize;
    let outputs = run.outputs(0)?;
    let found = outputs
        .iter()
        .skip(late)
        .position(|outputs| !outputs.enabled)
        .context("the outputs stay enabled")?
        + late;
    let (before, after) = outputs.split_at(found);
    ensure!(
        before == &run.expected[..found],
        "the outputs before the fault are not the reference model's"
    );
    ensure!(are_off(after), "the outputs were enabled again");
    log_contains(
        &run.log,
        &format!(
            "fault {} on the stage at tick {found}",
            FaultCode::DeadlineMissed.number()
        ),
    )?;
    // The tick after it begins late, too, if this one took far more than its period.
    log_contains(&run.log, " 1 overruns").or_else(|_| log_contains(&run.log, " 2 overruns"))?;
    Ok(Finding {
        ticks: Some(u32::try_from(found - late)? + 1),
        compared: (3 * u64::from(TICKS), 0),
        ..Finding::at_start(how, FaultCode::DeadlineMissed)
    })
}

/// An idle loop that masks all interrupts and does nothing any more; gives the time to the reset in control periods, too.
pub(crate) fn watchdog(image: &Image) -> Result<(Finding, f64)> {
    let run = Run::of(
        image,
        |_| {},
        |memory| {
            memory.set_word(INJECTED_FAULT, InjectedFault::Hang as u32)?;
            memory.set_word(INJECTED_FAULT_TICK, SETTLING_TICKS)?;
            Ok(())
        },
    )?;
    let first = run.outputs(0)?;
    let asked = SETTLING_TICKS as usize;
    // The idle loop may get to it a tick later.
    let until = first.iter().rposition(|output| output.enabled);
    let hung = until.map_or(0, |last| last + 1);
    ensure!(
        (asked..=asked + 1).contains(&hung),
        "a firmware that hangs from tick {asked} on put out something until tick {hung}"
    );
    ensure!(
        first[..hung] == run.expected[..hung],
        "the outputs before the fault are not the reference model's"
    );
    ensure!(
        are_off(&first[hung..]),
        "a firmware that hangs put out something"
    );
    let second = run.outputs(1)?;
    // The same requests to enable and to run as before.
    ensure!(are_off(&second), "the next firmware could be enabled");
    log_contains(
        &run.log,
        &format!(
            "fault {} on the stage at tick 0",
            FaultCode::WatchdogReset.number()
        ),
    )?;
    log_contains(&run.log, &format!("finished: {TICKS} ticks"))?;
    let cycles = run
        .memory
        .word(HANGS_FROM)?
        .wrapping_sub(run.memory.word(HANGS_UNTIL)?);
    let finding = Finding {
        compared: (3 * u64::from(SETTLING_TICKS) + 3 * u64::from(TICKS), 0),
        ..Finding::at_start(
            "the idle loop masks interrupts and hangs, 15 mm/s",
            FaultCode::WatchdogReset,
        )
    };
    let periods = f64::from(cycles) / f64::from(PERIOD_CYCLES);
    ensure!(
        (95.0..105.0).contains(&periods),
        "the watchdog took {periods:.1} control periods instead of 100"
    );
    Ok((finding, periods))
}
