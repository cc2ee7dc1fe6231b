//! For how long the control interrupt can be kept waiting: the longest stretches of instructions with interrupts masked,
//! seen while every tick brings a line for the log.

use std::collections::{BTreeMap, HashMap};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::PathBuf;
use std::process::Stdio;
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use quadrant::command::Command;

use super::bench::Bench;
use super::case::{moving, setup};
use crate::image::Image;
use crate::listing::Listing;
use crate::trace::{Traced, traced};
use quadrant_sim::emulator::{self, Clock, Emulator};

/// Ticks that are traced.
const TICKS: u32 = 200;
/// How long QEMU's monitor may take to answer.
const PATIENCE: Duration = Duration::from_secs(20);
/// What is not traced: initialisation and the idle loop, which masks nothing once ticks are due.
const IDLE: &str = "main";

/// What an instruction does to the mask.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Effect {
    Mask,
    Restore,
    Unmask,
}

/// The longest stretch with interrupts masked, by the function that it is spent in.
pub(super) fn longest(image: &Image) -> Result<BTreeMap<String, u32>> {
    let listing = Listing::of(image)?;
    let idle = image.function(IDLE)?;
    let ranges: Vec<String> = listing
        .functions()
        .filter(|function| function.range.start != idle)
        .map(|function| {
            let range = &function.range;
            format!("{:#x}..{:#x}", range.start, range.end - 1)
        })
        .collect();
    let socket = monitor_path();
    let stretches = std::thread::scope(|scope| {
        let mut reader = None;
        let listing = &listing;
        let bench = Bench::start_with(image, setup(), |memory| {
            let mut qemu = emulator::command_line(&image.program()?, memory, Clock::Host);
            let monitor = format!("unix:{},server=on,wait=off", socket.display());
            qemu.args(["-singlestep", "-d", "nochain", "-monitor", &monitor])
                .args(["-dfilter", &ranges.join(",")])
                .stderr(Stdio::piped());
            let mut emulator = Emulator::spawn(qemu, &image.program()?, |_| {})?;
            let lines = emulator.take_stderr().context("QEMU's trace is a pipe")?;
            reader = Some(scope.spawn(move || Stretches::of(listing).read(lines)));
            Ok(emulator)
        })?;
        drive(bench, &socket)?;
        match reader.context("it was started")?.join() {
            Ok(stretches) => stretches,
            Err(_) => Err(anyhow!("the thread that reads the trace panicked")),
        }
    });
    // It may never have come to be.
    let _ = std::fs::remove_file(&socket);
    stretches
}

fn monitor_path() -> PathBuf {
    std::env::temp_dir().join(format!("quadrant-monitor-{}", std::process::id()))
}

/// A motion with a refused request in every tick, traced from then on.
fn drive(mut bench: Bench, socket: &std::path::Path) -> Result<()> {
    moving(&mut bench, 1.0)?;
    bench.break_with(Box::new(|input, _, _| input.request = Some(Command::Run)));
    bench.run(100)?;
    let mut monitor = UnixStream::connect(socket).context("cannot reach QEMU's monitor")?;
    monitor.set_read_timeout(Some(PATIENCE))?;
    await_prompt(&mut monitor)?;
    monitor.write_all(b"log exec,nochain\n")?;
    await_prompt(&mut monitor)?;
    bench.run(TICKS)?;
    bench.end().map(drop)
}

/// Reads until the monitor is ready for a command.
fn await_prompt(monitor: &mut UnixStream) -> Result<()> {
    let mut seen = Vec::new();
    let mut byte = [0];
    while !seen.ends_with(b"(qemu) ") {
        monitor
            .read_exact(&mut byte)
            .context("QEMU's monitor does not answer")?;
        seen.push(byte[0]);
    }
    Ok(())
}

/// Follows a trace.
struct Stretches<'a> {
    listing: &'a Listing,
    effects: HashMap<u32, Effect>,
    depth: u32,
    length: u32,
    /// The function in which the stretch is spent: the first that is no helper.
    place: Option<&'a str>,
    longest: BTreeMap<String, u32>,
}

impl<'a> Stretches<'a> {
    fn of(listing: &'a Listing) -> Self {
        let instructions = listing
            .functions()
            .flat_map(|function| &function.instructions);
        let effects = instructions
            .filter_map(|instruction| {
                let effect = match (&*instruction.mnemonic, &*instruction.operands) {
                    ("cpsid", "i") => Effect::Mask,
                    ("cpsie", "i") => Effect::Unmask,
                    ("msr", operands) if operands.starts_with("PRIMASK") => Effect::Restore,
                    _ => return None,
                };
                Some((instruction.address, effect))
            })
            .collect();
        Self {
            listing,
            effects,
            depth: 0,
            length: 0,
            place: None,
            longest: BTreeMap::new(),
        }
    }

    fn read(mut self, trace: impl Read) -> Result<BTreeMap<String, u32>> {
        let mut lines = BufReader::with_capacity(1 << 20, trace);
        let mut line = Vec::new();
        while lines
            .read_until(b'\n', &mut line)
            .context("cannot read QEMU's trace")?
            > 0
        {
            if let Some(Traced::Begun(address)) = traced(&line) {
                self.executed(address);
            }
            line.clear();
        }
        Ok(self.longest)
    }

    fn executed(&mut self, address: u32) {
        let effect = self.effects.get(&address).copied();
        if self.depth > 0 {
            self.length += 1;
            if self.place.is_none() {
                let function = self.listing.at(address);
                self.place = function
                    .map(|function| function.name.as_str())
                    .filter(|name| !name.contains("critical_section"));
            }
        }
        match effect {
            Some(Effect::Mask) => {
                if self.depth == 0 {
                    (self.length, self.place) = (0, None);
                }
                self.depth += 1;
            }
            Some(Effect::Restore) => self.leave(self.depth.saturating_sub(1)),
            Some(Effect::Unmask) => self.leave(0),
            None => {}
        }
    }

    fn leave(&mut self, depth: u32) {
        if self.depth > 0 && depth == 0 {
            let place = self.place.unwrap_or("?").to_owned();
            let longest = self.longest.entry(place).or_default();
            *longest = self.length.max(*longest);
        }
        self.depth = depth;
    }
}
