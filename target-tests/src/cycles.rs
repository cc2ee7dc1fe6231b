//! `cargo xtask cycles`: how long a control tick can take on the processor, by calculation.
//!
//! The trace of every tick that `cargo xtask count` counts is replayed against the instruction timings of the core's manual and a
//! model of flash with wait states. Nothing here was measured on a chip.

use std::collections::{BTreeMap, VecDeque};

use anyhow::{Result, bail};
use serde::{Deserialize, Serialize};

use crate::converter;
use crate::cortex_m::{Core, ENTRY_AND_RETURN, REFILL, reads_literal};
use crate::kinds::{Kinds, emulated};
use crate::longest_path::{OUTSIDE, Transitions, whole};
use crate::nucleo_h743zi2;
use crate::trace::Tick;
use xtask::golden::{self, Golden};
use xtask::image::{Image, Scalar};
use xtask::listing::{Instruction, Listing};
use xtask::toolchain::Toolchain;

/// Clock of the reference board's processor, Hz.
const CORE_HZ: f64 = 180e6;
/// Wait states of its flash at that clock (RM0390, table 5).
const WAIT_STATES: u32 = 5;
/// Bytes that the flash returns at a time (RM0390, 3.4.2).
const LINE_BYTES: u32 = 16;
/// Lines of code that the accelerator keeps.
const CODE_LINES: usize = 64;
/// Lines of literals that it keeps.
const LITERAL_LINES: usize = 8;

/// Control rate for which the share of the processor is printed, Hz.
const RATE_HZ: f64 = 20_000.0;
/// Tolerance about the expected bound without wait states, %.
const TOLERANCE_PERCENT: f64 = 5.0;
/// Tolerance about the expected bound without a cache, %: a loop of two instructions that any change elsewhere moves across the edge
/// of a line costs two lines a turn more, and the largest copy of a tick takes 240 turns.
const NO_CACHE_TOLERANCE_PERCENT: f64 = 20.0;

/// File of the expected bounds.
const GOLDEN: Golden = Golden {
    path: golden::CYCLES,
    head: "Written by `cargo xtask cycles --overwrite-expected`; `cargo xtask cycles` compares its figures with these.",
};

/// Bounds of any tick, in cycles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Bounds {
    /// Without wait states.
    no_wait_states: f64,
    /// With the flash's wait states at every line, as if nothing were kept or fetched ahead.
    no_cache: f64,
}

/// Prints cycles by kind of tick and their bounds, and compares these with the committed ones.
pub(crate) fn run(toolchain: Toolchain, scalar: Scalar, ticks: u32, overwrite: bool) -> Result<()> {
    let image = emulated(toolchain, scalar)?;
    let code = Code::of(&image, scalar)?;
    let kinds = Kinds::traced(&image, ticks)?;
    println!(
        "{}: cycles of a control tick, calculated; {WAIT_STATES} wait states and {CODE_LINES} cached lines as at {:.0} MHz\n\
         the largest of each kind as traced, and a bound of every combination of the branches that its ticks have taken",
        image.target,
        CORE_HZ / 1e6
    );
    println!(
        "  {:<20} {:>12} {:>14} {:>11} {:>21}",
        "kind", "instructions", "0 wait states", "with cache", "bound, 0 wait states"
    );
    let any = ("any", kinds.all().iter().collect());
    let cached = code.cached(kinds.all());
    for (name, ticks) in kinds.each().chain([any]) {
        let most = |of: &dyn Fn(&Tick) -> u32| ticks.iter().map(|tick| of(tick)).max().unwrap_or(0);
        let bound = transitions(ticks.iter().copied()).longest(|from, to| code.cycles(from, to))?;
        println!(
            "  {name:<20} {:>12} {:>14} {:>11} {bound:>21.0}",
            most(&Tick::instructions),
            most(&|tick| code.along(&tick.path)),
            most(&|tick| cached.get(&std::ptr::from_ref(tick)).copied().unwrap_or(0)),
        );
    }
    let transitions = transitions(kinds.all());
    let bounds = Bounds {
        no_wait_states: transitions.longest(|from, to| code.cycles(from, to))?,
        no_cache: transitions.longest(|from, to| code.cycles(from, to) + code.lines(from, to))?,
    };
    print("bound, 0 wait states", bounds.no_wait_states);
    print("bound, no cache", bounds.no_cache);
    let mut held = vec![(image.target.scalar_name(), bounds)];
    // The reference board computes in f32.
    if scalar == Scalar::F32 {
        let image = converter::image(toolchain)?;
        let bound =
            |of, a_line| converter::cycles(&image, of, LINE_BYTES, a_line, &converter::BRIDGES);
        let (begin, write) = (bound(converter::BEGIN, 0)?, bound(converter::WRITE, 0)?);
        let no_cache = bound(converter::BEGIN, WAIT_STATES)?.cycles
            + bound(converter::WRITE, WAIT_STATES)?.cycles;
        let converter = Bounds {
            no_wait_states: (begin.cycles + write.cycles).into(),
            no_cache: no_cache.into(),
        };
        println!(
            "  converter: {:.0} cycles of the interrupt, {:.0} without a cache: {} at its beginning, {} in the write, of which {} until the \
             codes are on their way",
            converter.no_wait_states,
            converter.no_cache,
            begin.cycles,
            write.cycles,
            write.until_start
        );
        print("with it", bounds.no_wait_states + converter.no_wait_states);
        print("with it, no cache", bounds.no_cache + converter.no_cache);
        held.push(("converter".into(), converter));
        nucleo_h743zi2::print(toolchain, &code, &kinds)?;
    }
    if overwrite {
        return GOLDEN.store(Some(&image.compiler), held);
    }
    held.into_iter()
        .try_for_each(|(key, bounds)| compare(&key, bounds, &image.compiler))
}

/// Prints a bound.
fn print(name: &str, cycles: f64) {
    println!(
        "  {name:<20} {cycles:>12.0} cycles = {:.1} us, {:.0} % of the processor at {:.0} kHz",
        1e6 * cycles / CORE_HZ,
        100.0 * cycles / CORE_HZ * RATE_HZ,
        RATE_HZ / 1e3
    );
}

/// The transitions of some ticks.
fn transitions<'a>(ticks: impl IntoIterator<Item = &'a Tick>) -> Transitions {
    let mut transitions = Transitions::default();
    for tick in ticks {
        transitions.add(&tick.path);
    }
    transitions
}

fn compare(key: &str, bounds: Bounds, compiler: &str) -> Result<()> {
    let Some((expected, difference)) = GOLDEN.read::<Bounds>()?.table(key, compiler) else {
        bail!(
            "no figure is committed for {key}: `cargo xtask cycles --overwrite-expected` makes one"
        );
    };
    let [grown, no_cache_grown] = [
        (bounds.no_wait_states, expected.no_wait_states),
        (bounds.no_cache, expected.no_cache),
    ]
    .map(|(now, then)| 100.0 * (now / then - 1.0));
    println!(
        "  {key}: {grown:+.1} % against the committed bound, {no_cache_grown:+.1} % without a cache"
    );
    let allowed =
        grown.abs() <= TOLERANCE_PERCENT && no_cache_grown.abs() <= NO_CACHE_TOLERANCE_PERCENT;
    difference.ensure(allowed, || {
        format!(
            "{key}: the bound has changed by {grown:+.1} %, without a cache by {no_cache_grown:+.1} %, more than {TOLERANCE_PERCENT} or \
             {NO_CACHE_TOLERANCE_PERCENT} %; if that is intended, `cargo xtask cycles --overwrite-expected` accepts it"
        )
    })
}

/// The image's instructions, by address, each with the address behind it.
pub(crate) struct Code {
    instructions: BTreeMap<u32, (Timed, u32)>,
}

/// An instruction's share of the time.
#[derive(Clone, Copy)]
pub(crate) struct Timed {
    /// Without a refill and without wait states.
    pub(crate) cycles: u32,
    /// The address of what it reads from where the code is.
    pub(crate) literal: Option<u32>,
}

impl Code {
    fn of(image: &Image, scalar: Scalar) -> Result<Self> {
        let core = Core::of(scalar);
        let listing = Listing::of(image)?;
        let mut instructions = BTreeMap::new();
        for function in listing.functions() {
            let of_function = &function.instructions;
            for (index, instruction) in of_function.iter().enumerate() {
                let next = of_function.get(index + 1);
                let behind = next.map_or(function.range.end, |next| next.address);
                let timed = Timed {
                    cycles: core.cycles(instruction, next),
                    literal: reads_literal(instruction).then(|| literal(instruction)),
                };
                instructions.insert(instruction.address, (timed, behind));
            }
        }
        Ok(Self { instructions })
    }

    /// The instruction at an address, and the address behind it.
    pub(crate) fn at(&self, address: u32) -> Option<(Timed, u32)> {
        self.instructions.get(&address).copied()
    }

    /// Cycles of an instruction that another one follows, without wait states.
    fn cycles(&self, from: u32, to: u32) -> u32 {
        let Some((timed, behind)) = self.at(from) else {
            return ENTRY_AND_RETURN;
        };
        let jumps = to != behind && to != OUTSIDE;
        timed.cycles + if jumps { REFILL } else { 0 }
    }

    /// Cycles that the flash makes them wait, if nothing is kept but the line in use. An instruction may have its second half in the
    /// next line.
    fn lines(&self, from: u32, to: u32) -> u32 {
        let Some((timed, behind)) = self.at(from) else {
            return WAIT_STATES * u32::from(to != OUTSIDE);
        };
        let last = line(behind - 2);
        let fetches = [
            timed.literal.is_some(),
            last != line(from),
            to != OUTSIDE && line(to) != last,
        ];
        WAIT_STATES * fetches.into_iter().map(u32::from).sum::<u32>()
    }

    /// Cycles along a path, without wait states.
    pub(crate) fn along(&self, path: &[u32]) -> u32 {
        let pairs = whole(path);
        pairs
            .windows(2)
            .map(|pair| self.cycles(pair[0], pair[1]))
            .sum()
    }

    /// Cycles of consecutive ticks, each by its place in memory, with the lines that the accelerator keeps, those used last, and the
    /// next one, which it fetches while one is executed.
    fn cached(&self, ticks: &[Tick]) -> BTreeMap<*const Tick, u32> {
        let mut code = Lines::new(CODE_LINES);
        let mut literals = Lines::new(LITERAL_LINES);
        ticks
            .iter()
            .map(|tick| {
                let mut cycles = 0;
                let (mut last, mut entered) = (OUTSIDE, 0);
                for pair in whole(&tick.path).windows(2) {
                    let (address, next) = (pair[0], pair[1]);
                    if address != OUTSIDE && line(address) != last {
                        let ahead = if line(address) == last.wrapping_add(1) {
                            cycles - entered
                        } else {
                            0
                        };
                        if !code.holds(line(address)) {
                            cycles += WAIT_STATES.saturating_sub(ahead);
                        }
                        (last, entered) = (line(address), cycles);
                    }
                    if let Some((
                        Timed {
                            literal: Some(at), ..
                        },
                        _,
                    )) = self.at(address)
                        && !literals.holds(line(at))
                    {
                        cycles += WAIT_STATES;
                    }
                    cycles += self.cycles(address, next);
                }
                (std::ptr::from_ref(tick), cycles)
            })
            .collect()
    }
}

fn line(address: u32) -> u32 {
    address / LINE_BYTES
}

/// The address of an instruction's literal: `r3, [pc, #100] @ (d8 <symbol>)`. Of one that the disassembler does not name, its own.
fn literal(instruction: &Instruction) -> u32 {
    instruction
        .operands
        .rsplit_once('(')
        .and_then(|(_, target)| target.split([' ', ')']).next())
        .and_then(|digits| u32::from_str_radix(digits, 16).ok())
        .unwrap_or(instruction.address)
}

/// Lines that are kept, the one used last at the back.
struct Lines {
    kept: VecDeque<u32>,
    room: usize,
}

impl Lines {
    fn new(room: usize) -> Self {
        Self {
            kept: VecDeque::with_capacity(room),
            room,
        }
    }

    /// True if a line is there already; from now on it is.
    fn holds(&mut self, line: u32) -> bool {
        if self.kept.back() == Some(&line) {
            return true;
        }
        let place = self.kept.iter().position(|kept| *kept == line);
        if let Some(place) = place {
            self.kept.remove(place);
        } else if self.kept.len() == self.room {
            self.kept.pop_front();
        }
        self.kept.push_back(line);
        place.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_that_was_not_used_for_longest_goes_first() {
        let mut lines = Lines::new(2);
        let held = [1, 2, 1, 3, 1, 2].map(|line| lines.holds(line));
        assert_eq!(held, [false, false, true, false, true, false]);
    }

    #[test]
    fn a_literal_is_found_in_the_disassembly() {
        let instruction = Instruction {
            address: 0x10,
            mnemonic: "ldr".into(),
            operands: "r3, [pc, #100]\t@ (d8 <CONTROL_TICK+0x10>)".into(),
        };
        assert!(reads_literal(&instruction));
        assert_eq!(literal(&instruction), 0xd8);
    }
}
