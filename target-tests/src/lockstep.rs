//! `cargo xtask emulate`: the image in QEMU against the simulated stage, word by word beside the reference model in this process.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};
use indicatif::{ProgressBar, ProgressStyle};
use quadrant_host::machine::emulator::{Clock, Emulator, Lockstep, Memory, input_of};
use quadrant_law::stage::Outputs;
use quadrant_lockstep::{
    InputRecord, Mode, OutputRecord, RECORDED_INPUTS, RECORDED_OUTPUTS, RECORDED_TICKS,
};
use quadrant_settings::Job;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

use crate::ahead;
use crate::reference_model::{self, ReferenceModel, Tally};

/// Control ticks per second of the firmware's time.
const RATE_HZ: f64 = 10_000.0;
/// Latest look of the last tick at the clock, us of firmware time: the interrupt's latency.
const LATENCY_US: u64 = 10;
/// Ticks between two steps of the progress bar.
const PROGRESS_TICKS: u32 = 10_000;

/// Result of a run.
pub(crate) struct Run {
    /// Comparison of the words.
    pub(crate) tally: Tally,
    /// Ticks per second.
    rate: f64,
}

/// Runs the image for some seconds of its time and fails on any difference.
pub(crate) fn run(
    toolchain: Toolchain,
    scalar: Scalar,
    job: Job,
    seconds: f64,
    paced: bool,
    words: Option<&Path>,
) -> Result<()> {
    let ticks = seconds * RATE_HZ;
    ensure!(
        (1.0..f64::from(u32::MAX)).contains(&ticks),
        "{seconds} s is not a time to run"
    );
    let ticks = ticks as u32;
    let image = image::build(toolchain, Target::new(Board::Mps2, scalar))?;
    println!("{}", image.footprint()?);
    let model = ReferenceModel::of(scalar, job)?;
    let Run { tally, rate } = if paced {
        recorded(&image, model, ticks)?
    } else {
        let mut log = words.map(WordsFile::create).transpose()?;
        let run = lockstep(&image, model, ticks, log.as_mut())?;
        if let Some(log) = log {
            log.finish()?;
        }
        run
    };
    if let Some((tick, model, firmware)) = &tally.first {
        println!("first difference at tick {tick}: {model:?} here, {firmware:?} in the firmware");
    }
    println!(
        "{} words compared, {} differ, {} of them not zero, {rate:.0} ticks/s, {:.1} times real time",
        tally.words,
        tally.differ,
        tally.moving,
        rate / RATE_HZ
    );
    ensure!(tally.differ == 0, "{} words differ", tally.differ);
    ensure!(
        2 * tally.moving > tally.words || seconds < 1.0,
        "the stage did not move: only {} words were not zero",
        tally.moving
    );
    Ok(())
}

/// Runs the image beside the reference model, which runs ahead. The time starts with the first answers: compiling tables is
/// not a tick. `words` receives what the firmware read and answered.
pub(crate) fn lockstep(
    image: &Image,
    mut model: ReferenceModel,
    ticks: u32,
    mut words: Option<&mut WordsFile>,
) -> Result<Run> {
    let memory = Memory::create()?;
    memory.prepare(Mode::Lockstep, 0, &reference_model::encode(model.job())?)?;
    let mut firmware = Lockstep::start(reference_model::program(image)?, memory, show)?;
    let bar = progress(ticks);
    let mut first: Option<(Instant, u32)> = None;
    let tally = ahead::run(
        &mut model,
        &mut firmware,
        ticks,
        |firmware, tick, answered| {
            if let Some(words) = &mut words {
                words.add(answered)?;
            }
            first.get_or_insert_with(|| (Instant::now(), tick));
            let seconds = (tick / PROGRESS_TICKS).into();
            if bar.position() != seconds {
                bar.set_position(seconds);
                firmware.new_lines()?;
            }
            Ok(())
        },
    )?;
    bar.finish_and_clear();
    let rate = first.map_or(0.0, |(since, tick)| {
        f64::from(ticks - tick) / since.elapsed().as_secs_f64()
    });
    firmware.finish()?;
    Ok(Run { tally, rate })
}

impl ahead::Firmware for Lockstep {
    fn room(&self) -> usize {
        Lockstep::room(self)
    }

    fn ask(&mut self, inputs: &[InputRecord]) -> Result<()> {
        Ok(self.ask_all(inputs)?)
    }

    fn answers(&mut self) -> Result<Vec<Outputs>> {
        Ok(Lockstep::answers(self)?)
    }
}

/// File of the counts and words of x, a line a control tick.
pub(crate) struct WordsFile(BufWriter<File>);

impl WordsFile {
    fn create(path: &Path) -> Result<Self> {
        let file =
            File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        let mut out = BufWriter::new(file);
        writeln!(out, "counts,word,enabled")?;
        Ok(Self(out))
    }

    fn add(&mut self, answered: &[(InputRecord, Outputs)]) -> Result<()> {
        for (input, outputs) in answered {
            let counts = input_of(input).readings[0].count as i32;
            let (word, enabled) = (outputs.codes[0].0, u8::from(outputs.enabled));
            writeln!(self.0, "{counts},{word},{enabled}")?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<()> {
        Ok(self.0.flush()?)
    }
}

/// Prints a line of the firmware's log.
pub(crate) fn show(line: &str) {
    println!("  firmware: {line}");
}

/// A bar over seconds of firmware time; hidden where nobody watches.
fn progress(ticks: u32) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{wide_bar} {pos}/{len} s of firmware time, {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new((ticks / PROGRESS_TICKS).into()).with_style(style)
}

/// Lets the hardware timer pace the firmware on the inputs of a rehearsal, and compares the answers.
fn recorded(image: &Image, mut model: ReferenceModel, ticks: u32) -> Result<Run> {
    let memory = Memory::create()?;
    let job = model.job().clone();
    let (inputs, expected) = model.run_alone(ticks);
    load(&memory, Mode::Paced, &job, &inputs)?;
    let started = Instant::now();
    let log = Emulator::start(
        &reference_model::program(image)?,
        &memory,
        Clock::Instructions,
        show,
    )?
    .wait()?;
    let rate = f64::from(ticks) / started.elapsed().as_secs_f64();
    check_paced(&log, ticks)?;
    let mut bytes = vec![0; inputs.len() * OutputRecord::BYTES];
    memory.read(RECORDED_OUTPUTS, &mut bytes)?;
    let (records, _) = bytes.as_chunks();
    let mut tally = Tally::default();
    for ((tick, expected), record) in (0..).zip(expected).zip(records) {
        tally.add(tick, expected, OutputRecord::decode(record).outputs);
    }
    Ok(Run { tally, rate })
}

/// Prepares a run of recorded inputs.
pub(crate) fn load(memory: &Memory, mode: Mode, job: &Job, inputs: &[InputRecord]) -> Result<()> {
    ensure!(
        inputs.len() <= RECORDED_TICKS,
        "{} ticks asked for, but a recorded run holds at most {RECORDED_TICKS}",
        inputs.len()
    );
    let ticks = u32::try_from(inputs.len())?;
    let bytes: Vec<u8> = inputs.iter().flat_map(InputRecord::encode).collect();
    memory.write(RECORDED_INPUTS, &bytes)?;
    Ok(memory.prepare(mode, ticks, &reference_model::encode(job)?)?)
}

/// Checks what the firmware says of a paced run: all ticks, no overrun, and the time they should take.
fn check_paced(lines: &[String], ticks: u32) -> Result<()> {
    let numbers = lines.iter().rev().find_map(|line| {
        let (_, line) = line.split_once("finished: ")?;
        let words = line
            .split(|c: char| !c.is_ascii_digit())
            .filter(|word| !word.is_empty());
        words
            .map(|word| word.parse::<u64>().ok())
            .collect::<Option<Vec<_>>>()
    });
    let numbers = numbers.context("the firmware has not said how the run went")?;
    let [ran, overruns, _longest, microseconds] = numbers[..] else {
        bail!("the firmware's account of the run is not as expected: {numbers:?}");
    };
    ensure!(
        ran == u64::from(ticks),
        "{ran} ticks ran instead of {ticks}"
    );
    ensure!(
        overruns == 0,
        "{overruns} control ticks overran their deadline"
    );
    let expected = (f64::from(ticks) * 1e6 / RATE_HZ) as u64;
    ensure!(
        microseconds.abs_diff(expected) <= LATENCY_US,
        "{ticks} ticks took {microseconds} us of firmware time instead of {expected}"
    );
    Ok(())
}
