//! The instructions that QEMU executes, followed through the control interrupt.
//!
//! QEMU translates straight runs of instructions. It lists each once, when it is translated, and then writes a line whenever it
//! is about to be executed.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io::{BufRead, BufReader, Read};
use std::process::Stdio;

use anyhow::{Context, Result, anyhow, bail};
use quadrant_host::machine::emulator::{self, Clock, Emulator, Memory};
use xtask::call_graph::{CallGraph, Flow, flow};
use xtask::image::Image;
use xtask::listing::{Function, Listing};
use xtask::prove::ROOT;

use crate::attribution::Attribution;
use crate::gdb::{Debugger, Port};
use crate::{reference_model, stages};

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
        Ok(self.read_with_functions(image, trace)?.0)
    }

    /// The same, and the functions that were executed, inlined or not.
    pub(crate) fn read_with_functions(
        &self,
        image: &Image,
        trace: impl Read,
    ) -> Result<(Vec<Tick>, BTreeSet<String>)> {
        let Self {
            root,
            listing,
            reached,
        } = self;
        let frame = listing.at(*root).context("the root is listed")?;
        let functions = reached.iter().filter_map(|start| listing.at(*start));
        let tally = Tally {
            root: *root,
            returns: frame
                .instructions
                .iter()
                .filter(|instruction| instruction.returns())
                .map(|instruction| instruction.address)
                .collect(),
            calls: functions.flat_map(calls).collect(),
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

/// The switch of a trace. Traced code takes tens of times as long as other: what comes before the ticks that count, such as the
/// building of tables, runs without.
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

    /// Runs without a trace until a word of memory has been written, and with a trace from there on.
    pub(crate) fn trace_from_write(&mut self, address: u32) -> Result<()> {
        self.debugger.run_to_write(address)?;
        self.switch_on()
    }

    /// Traces from now on.
    pub(crate) fn trace(&mut self) -> Result<()> {
        self.debugger.stop()?;
        self.switch_on()
    }

    /// Traces no longer.
    pub(crate) fn pause(&mut self) -> Result<()> {
        self.debugger.stop()?;
        self.debugger.monitor("log none")?;
        self.debugger.resume()
    }

    fn switch_on(&mut self) -> Result<()> {
        // Unchained code is translated again, and so listed.
        self.debugger.monitor("log exec,nochain,in_asm")?;
        self.debugger.resume()
    }
}

/// Functions that follow a control tick: seeing the first instruction of one ends the tick.
const FOLLOWERS: [&str; 4] = ["DISPATCHER_0", "DISPATCHER_1", "DISPATCHER_2", "main"];

/// One tick.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tick {
    /// Its number of instructions, by stage.
    pub(crate) stages: BTreeMap<&'static str, u32>,
    /// The addresses of its instructions, in the order of execution.
    pub(crate) path: Vec<u32>,
    /// The reason for which it does not count; none of a tick that is whole.
    flaw: Option<String>,
}

impl Tick {
    /// Returns the tick, if all of its instructions are there. The last one before a trace pauses may be cut.
    pub(crate) fn whole(&self) -> Result<&Self> {
        match &self.flaw {
            None => Ok(self),
            Some(flaw) => bail!("a tick of the trace is not whole: {flaw}"),
        }
    }

    /// Its number of instructions.
    pub(crate) fn instructions(&self) -> u32 {
        self.path.len() as u32
    }
}

/// Follows a trace.
struct Tally<'a> {
    root: u32,
    /// The root's instructions that return.
    returns: BTreeSet<u32>,
    /// The called functions, by the addresses of the calls.
    calls: BTreeMap<u32, u32>,
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
    fn read(mut self, trace: impl Read) -> Result<(Vec<Tick>, BTreeSet<String>)> {
        for_each_instruction(trace, |address| self.executed(address))?;
        self.close(Some("the trace ends within it"));
        Ok((self.closed, self.attribution.seen_functions()?))
    }

    fn executed(&mut self, address: u32) -> Result<()> {
        if address == self.root {
            self.close(Some("another begins within it"));
            self.open = Some(OpenTick {
                tick: Tick::default(),
                calls: Vec::new(),
                last: stages::OTHER,
            });
        }
        let Some(open) = &mut self.open else {
            return Ok(());
        };
        let called = open.tick.path.last().and_then(|last| self.calls.get(last));
        if let Some(called) = called.filter(|called| **called != address) {
            open.tick
                .flaw
                .get_or_insert_with(|| format!("{address:#x} comes after a call of {called:#x}"));
        }
        let Some(function) = (self.inside)(address) else {
            open.tick.flaw.get_or_insert_with(|| {
                format!("it is at {address:#x}, which the calls that are known do not reach")
            });
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
        *open.tick.stages.entry(stage).or_default() += 1;
        open.tick.path.push(address);
        open.last = stage;
        if self.returns.contains(&address) {
            self.close(None);
        }
        Ok(())
    }

    /// Ends the tick that has begun, if there is one.
    fn close(&mut self, flaw: Option<&str>) {
        if let Some(OpenTick { mut tick, .. }) = self.open.take() {
            tick.flaw = tick.flaw.or(flaw.map(str::to_owned));
            self.closed.push(tick);
        }
    }
}

/// The calls of a function that are always taken, and what they call.
fn calls(function: &Function) -> impl Iterator<Item = (u32, u32)> {
    let instructions = function.instructions.iter().enumerate();
    instructions.filter_map(
        |(index, instruction)| match flow(function, index, instruction) {
            Flow::To(target) if instruction.mnemonic == "bl" => Some((instruction.address, target)),
            _ => None,
        },
    )
}

/// Calls back with the address of each instruction that a trace shows executed, in order.
pub(crate) fn for_each_instruction(
    trace: impl Read,
    mut executed: impl FnMut(u32) -> Result<()>,
) -> Result<()> {
    let mut lines = BufReader::with_capacity(1 << 20, trace);
    let mut line = Vec::new();
    // Straight runs of instructions, by the first address.
    let mut runs: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut listed = None;
    let mut announced = None;
    let mut execute = |run: Option<u32>, runs: &HashMap<u32, Vec<u32>>| -> Result<()> {
        let Some(first) = run else { return Ok(()) };
        let run = runs.get(&first).ok_or_else(|| {
            anyhow!("QEMU has not listed the instructions at {first:#x}; was it built without a disassembler?")
        })?;
        run.iter().try_for_each(|address| executed(*address))
    };
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
            Some(Traced::Listing) => listed = None,
            Some(Traced::Listed(address)) => {
                let first = *listed.get_or_insert(address);
                let run = runs.entry(first).or_default();
                if address == first {
                    run.clear();
                }
                run.push(address);
            }
            // It counts when the next one comes.
            Some(Traced::Begun(first)) => execute(announced.replace(first), &runs)?,
            // An interrupt came first: what was announced last was not executed.
            Some(Traced::Stopped) => announced = None,
            None => eprint!("{}", String::from_utf8_lossy(&line)),
        }
    }
    execute(announced, &runs)
}

/// A line of the trace.
#[derive(Debug, PartialEq)]
enum Traced {
    /// Instructions that have been translated follow.
    Listing,
    /// One of them, at an address.
    Listed(u32),
    /// Those from an address on are about to be executed.
    Begun(u32),
    /// They are not, after all.
    Stopped,
}

/// `Trace 0: 0x7f41c4000100 [00000000/000000d8/00000110/00000201] CONTROL_TICK`, or a line of a listing:
/// `0x000000d8:  b5f0       push     {r4, r5, r6, r7, lr}`
fn traced(line: &[u8]) -> Option<Traced> {
    if line.starts_with(b"Stopped execution") {
        return Some(Traced::Stopped);
    }
    if line.starts_with(b"--------") || line.starts_with(b"IN:") || line == b"\n" {
        return Some(Traced::Listing);
    }
    let hexadecimal =
        |digits: &[u8]| u32::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok();
    if let Some(listed) = line.strip_prefix(b"0x") {
        let colon = listed.iter().position(|byte| *byte == b':')?;
        return hexadecimal(&listed[..colon]).map(Traced::Listed);
    }
    let line = line.strip_prefix(b"Trace ")?;
    let open = line.iter().position(|byte| *byte == b'[')?;
    let address = line[open + 1..].split(|byte| *byte == b'/').nth(1)?;
    hexadecimal(address).map(Traced::Begun)
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
        let line = b"0x000000d8:  b5f0       push     {r4, r5, r6, r7, lr}\n";
        assert_eq!(traced(line), Some(Traced::Listed(0xd8)));
        assert_eq!(traced(b"IN: CONTROL_TICK\n"), Some(Traced::Listing));
        assert_eq!(traced(b"qemu-system-arm: terminating\n"), None);
    }

    #[test]
    fn runs_of_instructions_are_executed_unless_an_interrupt_comes_first() {
        let trace = b"----------------\nIN: a\n0x00000010:  bf00 nop\n0x00000012:  bf00 nop\n\n\
            Trace 0: 0x1 [0/00000010/0/0] a\nTrace 0: 0x1 [0/00000010/0/0] a\n\
            Stopped execution of TB chain before 0x1 [00000010] a\nTrace 0: 0x1 [0/00000010/0/0] a\n";
        let mut executed = Vec::new();
        for_each_instruction(trace.as_slice(), |address| {
            executed.push(address);
            Ok(())
        })
        .unwrap();
        assert_eq!(executed, [0x10, 0x12, 0x10, 0x12]);
        let unlisted = b"Trace 0: 0x1 [0/00000020/0/0] a\n";
        assert!(for_each_instruction(unlisted.as_slice(), |_| Ok(())).is_err());
    }
}
