//! `cargo xtask count`: the instructions of a control tick, from the interrupt's entry to its return, by stage.
//!
//! QEMU logs every instruction executed. These are instructions, not cycles.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::Stdio;

use anyhow::{Context, Result, bail, ensure};
use quadrant::link::lockstep::{Job, Mode};
use quadrant_sim::emulator::{self, Clock, Emulator, Memory};
use serde::{Deserialize, Serialize};

use crate::attribution::Attribution;
use crate::call_graph::CallGraph;
use crate::image::{self, Board, Image, Scalar, Target};
use crate::listing::Listing;
use crate::prove::ROOT;
use crate::toolchain::Toolchain;
use crate::twin::{self, SETTLING_TICKS, Twin};
use crate::{command, emulate, stages};

/// How much more than expected is accepted, in percent.
const TOLERANCE_PERCENT: f64 = 5.0;

/// Instructions per tick of one stage or of all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Figure {
    mean: f64,
    min: u32,
    max: u32,
}

/// What was counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Count {
    ticks: u32,
    total: Figure,
    /// Empty where only the whole is held.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    stages: BTreeMap<String, Figure>,
}

/// The committed figures, by number type, and law and feedforward if they are not the default's.
type Expected = BTreeMap<String, Count>;

/// Counts the default job stage by stage, prints, and holds the figures against the committed ones.
pub(crate) fn run(toolchain: Toolchain, scalar: Scalar, ticks: u32, overwrite: bool) -> Result<()> {
    let image = emulated(toolchain, scalar)?;
    let count = count(&image, twin::job(), ticks)?;
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
    let key = image.target.scalar_name();
    if overwrite {
        store([(key, count)])
    } else {
        compare(&key, &count)
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
        return store(counts);
    }
    counts
        .iter()
        .try_for_each(|(key, count)| compare(key, count))
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
    // A missing hot symbol must not look like a fast one.
    let root = image.function(ROOT)?;
    let listing = Listing::of(image)?;
    let graph = CallGraph::from(&listing, root)?;
    let tally = Tally {
        root,
        inside: Box::new(|address| {
            listing
                .at(address)
                .filter(|f| graph.reached.contains_key(&f.range.start))
                .map(|f| f.range.start)
        }),
        attribution: Attribution::of(image)?,
        open: None,
        closed: Vec::new(),
    };

    let memory = Memory::create()?;
    // The rehearsal's beginning is spent at rest and is not counted.
    let (inputs, _) = Twin::of(image.target.scalar, job.clone())?.rehearse(SETTLING_TICKS + ticks);
    emulate::load(&memory, Mode::Unpaced, &job, &inputs)?;
    let program = image.program()?;
    let mut qemu = emulator::command_line(&program, &memory, Clock::Host);
    qemu.args(["-singlestep", "-d", "exec,nochain"])
        .args(["-dfilter", &trace_filter(image, &listing, &graph)?])
        .stderr(Stdio::piped());
    let mut emulator = Emulator::spawn(qemu, &program, |_| {})?;
    let trace = emulator.take_stderr().context("QEMU's trace is a pipe")?;
    let closed = tally.read(trace)?;
    emulator.wait()?;
    let Some(counted) = closed.get(SETTLING_TICKS as usize..) else {
        bail!("only {} control ticks seen in the trace", closed.len());
    };
    ensure!(
        counted.len() == ticks as usize,
        "{} control ticks seen in the trace instead of {ticks}",
        counted.len()
    );
    Ok(summary(ticks, counted))
}

/// What follows a control tick: seeing its first instruction ends the tick.
const FOLLOWERS: [&str; 4] = ["DISPATCHER_0", "DISPATCHER_1", "DISPATCHER_2", "main"];

/// The address ranges worth a line in the trace: what the control interrupt can reach and what follows it. The tables
/// that are filled before the first tick take thousands of times as many instructions as all ticks.
fn trace_filter(image: &Image, listing: &Listing, graph: &CallGraph) -> Result<String> {
    let mut starts: Vec<u32> = graph.reached.keys().copied().collect();
    for name in FOLLOWERS {
        starts.push(image.function(name)?);
    }
    let ranges = starts.iter().filter_map(|start| listing.at(*start));
    let ranges = ranges.map(|f| format!("{:#x}..{:#x}", f.range.start, f.range.end - 1));
    Ok(ranges.collect::<Vec<_>>().join(","))
}

/// Instructions of one tick, by stage.
type Tick = BTreeMap<&'static str, u32>;

/// Follows a trace.
struct Tally<'a> {
    root: u32,
    /// The first address of the function around an address, if it can be reached from the interrupt.
    inside: Box<dyn Fn(u32) -> Option<u32> + 'a>,
    attribution: Attribution,
    open: Option<OpenTick>,
    closed: Vec<Tick>,
}

/// A tick that has begun.
struct OpenTick {
    tick: Tick,
    /// The functions entered and not left, each with the stage it was called from.
    calls: Vec<(u32, &'static str)>,
    last: &'static str,
}

impl Tally<'_> {
    /// Reads a trace to its end.
    fn read(mut self, trace: impl Read) -> Result<Vec<Tick>> {
        let mut lines = BufReader::with_capacity(1 << 20, trace);
        let mut line = Vec::new();
        let mut previous = None;
        loop {
            line.clear();
            if lines
                .read_until(b'\n', &mut line)
                .context("cannot read QEMU's trace")?
                == 0
            {
                break;
            }
            match traced(&line) {
                // A line comes before its instruction is executed: it counts when the next one comes.
                Some(Traced::Begun(address)) => {
                    if let Some(address) = previous.replace(address) {
                        self.executed(address)?;
                    }
                }
                // An interrupt came first: the instruction announced last was not executed.
                Some(Traced::Stopped) => previous = None,
                None => eprint!("{}", String::from_utf8_lossy(&line)),
            }
        }
        if let Some(address) = previous {
            self.executed(address)?;
        }
        self.closed.extend(self.open.take().map(|open| open.tick));
        Ok(self.closed)
    }

    fn executed(&mut self, address: u32) -> Result<()> {
        if address == self.root {
            self.closed.extend(self.open.take().map(|open| open.tick));
            self.open = Some(OpenTick {
                tick: Tick::new(),
                calls: Vec::new(),
                last: stages::OTHER,
            });
        }
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        let Some(function) = (self.inside)(address) else {
            // The interrupt has returned.
            self.closed.extend(self.open.take().map(|open| open.tick));
            return Ok(());
        };
        if let Some(depth) = open
            .calls
            .iter()
            .position(|(called, _)| *called == function)
        {
            open.calls.truncate(depth + 1);
        } else {
            open.calls.push((function, open.last));
        }
        // A function of no stage, such as a copy of memory, works for the stage that called it.
        let caller = open
            .calls
            .last()
            .map_or(stages::OTHER, |(_, caller)| caller);
        let stage = self.attribution.stage(address)?.unwrap_or(caller);
        *open.tick.entry(stage).or_default() += 1;
        open.last = stage;
        Ok(())
    }
}

/// A line of the trace.
#[derive(Debug, PartialEq)]
enum Traced {
    Begun(u32),
    Stopped,
}

/// `Trace 0: 0x7f41c4000100 [00000000/000000d8/00000110/00000201] CONTROL_TICK`
fn traced(line: &[u8]) -> Option<Traced> {
    if line.starts_with(b"Stopped execution") {
        return Some(Traced::Stopped);
    }
    let line = line.strip_prefix(b"Trace ")?;
    let open = line.iter().position(|byte| *byte == b'[')?;
    let fields = std::str::from_utf8(&line[open + 1..]).ok()?;
    let address = fields.split('/').nth(1)?;
    u32::from_str_radix(
        address
            .trim_start_matches("00000000")
            .trim_start_matches("0x"),
        16,
    )
    .or_else(|_| u32::from_str_radix(address, 16))
    .ok()
    .map(Traced::Begun)
}

fn summary(ticks: u32, closed: &[Tick]) -> Count {
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

fn path() -> PathBuf {
    command::root().join("xtask/golden/instructions.toml")
}

fn expected() -> Result<Expected> {
    let path = path();
    match fs::read_to_string(&path) {
        Ok(text) => {
            toml::from_str(&text).with_context(|| format!("{} does not parse", path.display()))
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Expected::new()),
        Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
    }
}

fn store(counts: impl IntoIterator<Item = (String, Count)>) -> Result<()> {
    let mut expected = expected()?;
    expected.extend(counts);
    let path = path();
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)
            .with_context(|| format!("cannot create {}", folder.display()))?;
    }
    let head = "# Written by `cargo xtask count --overwrite-expected`; `cargo xtask count` holds its figures against these.\n\n";
    fs::write(&path, format!("{head}{}", toml::to_string(&expected)?))
        .with_context(|| format!("cannot write {}", path.display()))?;
    println!("written to {}", path.display());
    Ok(())
}

fn compare(key: &str, count: &Count) -> Result<()> {
    let Some(expected) = expected()?.remove(key) else {
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
        ensure!(
            growth <= TOLERANCE_PERCENT,
            "{key}: the {name} has grown by {growth:.1} %, more than {TOLERANCE_PERCENT} %; if that is wanted, \
             `cargo xtask count --overwrite-expected` accepts it"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trace_lines_are_read() {
        let line = b"Trace 0: 0x7f41c4000100 [00000000/000000d8/00000110/00000201] CONTROL_TICK\n";
        assert_eq!(traced(line), Some(Traced::Begun(0xd8)));
        let line = b"Stopped execution of TB chain before 0x7f41c4000100 [000000d8] CONTROL_TICK\n";
        assert_eq!(traced(line), Some(Traced::Stopped));
        assert_eq!(traced(b"qemu-system-arm: terminating\n"), None);
    }
}
