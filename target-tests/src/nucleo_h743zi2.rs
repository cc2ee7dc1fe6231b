//! Cycles of a control tick on the Nucleo-H743ZI2, by calculation: a Cortex-M7, whose manual has no table of instruction timings.
//!
//! What is assumed of it is meant to be too much. Instructions take what they take on a Cortex-M4F: this core issues two at once where
//! it can. Every change of the program counter costs a refill of its longer pipeline: this core predicts most of them. Every access
//! to a peripheral's register waits for the answer from behind two bridges: this core waits for none that it writes. Stack and variables are in
//! the DTCM, which has no wait states.

use std::collections::BTreeSet;

use anyhow::{Context, Result};

use crate::attribution::Attribution;
use crate::converter::{self, BEGIN, WRITE};
use crate::cortex_m::ENTRY_AND_RETURN;
use crate::cycles::Code;
use crate::kinds::Kinds;
use crate::longest_path::{OUTSIDE, whole};
use crate::trace::Tick;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::listing::Listing;
use xtask::prove::ROOT;
use xtask::toolchain::Toolchain;

/// Clock of the processor, Hz.
const CORE_HZ: f64 = 480e6;
/// Control rate for which the share of the processor is printed, Hz.
const RATE_HZ: f64 = 20e3;
/// Cycles of a change of the program counter, assumed: a pipeline of six stages, filled anew, and three in reserve.
const REFILL: u32 = 9;
/// Cycles of an access to a register, assumed: twenty clocks of the buses.
const ACCESS: u32 = 40;
/// Bytes of a line of both caches (DS12110, 3.1; Cortex-M7 TRM).
const LINE_BYTES: u32 = 32;
/// Cycles until a line is there that no cache holds, assumed: five clocks of the flash at four wait states (RM0433, table 17), which
/// returns a whole line, and fifteen of the bus.
const MISS: u32 = 40;
/// Registers of the chip, by the path of their types.
const REGISTERS: &[(&str, u32)] = &[("stm32h7::stm32h743v::", ACCESS)];

/// Prints the cycles of the usual and of the longest traced tick, with caches that hold all of it and with caches that hold nothing.
pub(crate) fn print(toolchain: Toolchain, code: &Code, kinds: &Kinds) -> Result<()> {
    let image = image::build(toolchain, Target::new(Board::NucleoH743zi2, Scalar::F32))?;
    let board = of_board(&image)?;
    println!(
        "nucleo-h743zi2 f32, {:.0} MHz: timings of a Cortex-M4F, {REFILL} cycles a change of the program counter, {ACCESS} an access to a \
         register, {MISS} a line of {LINE_BYTES} bytes that no cache holds; in the board's own code {board} cycles",
        CORE_HZ / 1e6
    );
    let any = ("any", kinds.all().iter().collect::<Vec<_>>());
    for (name, ticks) in kinds.each().chain([any]) {
        let most = |of: &dyn Fn(&Tick) -> u32| ticks.iter().map(|tick| of(tick)).max();
        let warm = most(&|tick| along(code, tick)).unwrap_or(0) + board;
        let cold = most(&|tick| along(code, tick) + MISS * lines(code, tick)).unwrap_or(0) + board;
        let share = |cycles: u32| 100.0 * f64::from(cycles) / CORE_HZ * RATE_HZ;
        println!(
            "  {name:<20} {warm:>6} cycles, {:.0} % at {:.0} kHz; with cold caches {cold:>6}, {:.0} %",
            share(warm),
            RATE_HZ / 1e3,
            share(cold)
        );
    }
    Ok(())
}

/// Cycles of the board's own code in the interrupt: the converter's driver, every instruction of it once, and all accesses to registers.
fn of_board(image: &Image) -> Result<u32> {
    let converter = [BEGIN, WRITE]
        .map(|of| converter::cycles(image, of, LINE_BYTES, 0, &[]))
        .into_iter()
        .map(|bound| Ok(bound?.cycles))
        .sum::<Result<u32>>()?;
    let listing = Listing::of(image)?;
    let root = listing
        .named(ROOT)
        .with_context(|| format!("the image has no {ROOT}"))?;
    let attribution = Attribution::of(image)?;
    let mut accesses = 0;
    for instruction in &root.instructions {
        let functions = attribution.functions(instruction.address)?;
        accesses += converter::bridge(&functions, REGISTERS);
    }
    Ok(converter + accesses)
}

/// Cycles of a tick without wait states.
fn along(code: &Code, tick: &Tick) -> u32 {
    let pairs = whole(&tick.path);
    let of = |from: u32, to: u32| match code.at(from) {
        None => ENTRY_AND_RETURN,
        Some((timed, behind)) if to != behind && to != OUTSIDE => timed.cycles + REFILL,
        Some((timed, _)) => timed.cycles,
    };
    pairs.windows(2).map(|pair| of(pair[0], pair[1])).sum()
}

/// Lines of code and literals that a tick touches.
fn lines(code: &Code, tick: &Tick) -> u32 {
    let mut touched = BTreeSet::new();
    for address in &tick.path {
        if let Some((timed, behind)) = code.at(*address) {
            touched.extend([address / LINE_BYTES, (behind - 2) / LINE_BYTES]);
            touched.extend(timed.literal.map(|literal| literal / LINE_BYTES));
        }
    }
    touched.len() as u32
}
