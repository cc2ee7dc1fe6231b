//! The instructions that QEMU executes, one line each, followed through the control interrupt.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

use anyhow::{Context, Result};
use quadrant_sim::machine::emulator::{self, Clock, Emulator, Memory};

use crate::attribution::Attribution;
use crate::gdb::{Debugger, Port};
use crate::reference_model;
use crate::stages;
use xtask::call_graph::CallGraph;
use xtask::image::Image;
use xtask::listing::Listing;
use xtask::prove::ROOT;

/// Trace of an image.
pub(crate) struct Trace {
    root: u32,
    listing: Listing,
    /// First addresses of the functions that the control interrupt can reach.
    reached: Vec<u32>,
}

impl Trace {
    /// Of an image.
    pub(crate) fn of(image: &Image) -> Result<Self> {
        // A missing hot symbol must not look like a fast one.
        let root = image.function(ROOT)?;
        let listing = Listing::of(image)?;
        let reached = CallGraph::from(&listing, root)?;
        Ok(Self {
            root,
            reached: reached.reached.into_keys().collect(),
            listing,
        })
    }

    /// Starts the image, stopped before its first instruction.
    pub(crate) fn start(&self, image: &Image, memory: &Memory) -> Result<(Emulator, Tracer)> {
        start(image, memory, &self.filter(image)?)
    }

    /// The first instruction of a control tick.
    pub(crate) fn root(&self) -> u32 {
        self.root
    }

    /// Reads a trace to its end: the control ticks, the first being number 1.
    pub(crate) fn read(&self, image: &Image, trace: impl Read) -> Result<Vec<Tick>> {
        let Self {
            root,
            listing,
            reached,
        } = self;
        let tally = Tally {
            root: *root,
            inside: Box::new(|address| {
                let start = listing.at(address)?.range.start;
                reached.binary_search(&start).is_ok().then_some(start)
            }),
            attribution: Attribution::of(image)?,
            open: None,
            closed: Vec::new(),
        };
        tally.read(trace)
    }

    /// The address ranges worth a line in the trace: what the control interrupt can reach and what follows it. The tables
    /// that are filled before the first tick take thousands of times as many instructions as all ticks.
    fn filter(&self, image: &Image) -> Result<String> {
        let mut starts = self.reached.clone();
        for name in FOLLOWERS {
            starts.push(image.function(name)?);
        }
        let ranges = starts.iter().filter_map(|start| self.listing.at(*start));
        let ranges = ranges.map(|f| format!("{:#x}..{:#x}", f.range.start, f.range.end - 1));
        Ok(ranges.collect::<Vec<_>>().join(","))
    }
}

/// Starts an image, stopped before its first instruction, whose trace in some ranges of addresses comes at standard error.
pub(crate) fn start(image: &Image, memory: &Memory, filter: &str) -> Result<(Emulator, Tracer)> {
    let program = reference_model::program(image)?;
    let port = Port::new();
    let mut qemu = emulator::command_line(&program, memory, Clock::Host);
    qemu.args(["-dfilter", filter]).stderr(Stdio::piped());
    port.add_to(&mut qemu);
    let emulator = Emulator::spawn(qemu, &program, |_| {})?;
    let debugger = port.connect()?;
    Ok((emulator, Tracer { debugger }))
}

/// The switch of a trace. Single instructions take hundreds of times as long as translated code: what comes before those
/// that count, such as the building of tables, runs without.
pub(crate) struct Tracer {
    debugger: Debugger,
}

impl Tracer {
    /// Runs without a trace.
    pub(crate) fn run(&mut self) -> Result<()> {
        self.debugger.resume()
    }

    /// Runs without a trace to an instruction, and with a trace from there on.
    pub(crate) fn trace_from(&mut self, address: u32) -> Result<()> {
        self.debugger.run_to(address)?;
        self.switch_on()
    }

    /// Traces from now on.
    pub(crate) fn trace(&mut self) -> Result<()> {
        self.debugger.stop()?;
        self.switch_on()
    }

    fn switch_on(&mut self) -> Result<()> {
        // Its name until QEMU 8.0, and since.
        self.debugger.monitor("singlestep on")?;
        self.debugger.monitor("one-insn-per-tb on")?;
        self.debugger.monitor("log exec,nochain")?;
        self.debugger.resume()
    }
}

/// Functions that follow a control tick: seeing the first instruction of one ends the tick.
const FOLLOWERS: [&str; 4] = ["DISPATCHER_0", "DISPATCHER_1", "DISPATCHER_2", "main"];

/// Instructions of one tick, by stage.
pub(crate) type Tick = BTreeMap<&'static str, u32>;

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
pub(crate) enum Traced {
    /// The instruction at an address is about to be executed.
    Begun(u32),
    /// It is not, after all.
    Stopped,
}

/// `Trace 0: 0x7f41c4000100 [00000000/000000d8/00000110/00000201] CONTROL_TICK`
pub(crate) fn traced(line: &[u8]) -> Option<Traced> {
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
