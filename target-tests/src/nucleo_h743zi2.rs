//! Cycles of a control tick on the Nucleo-H743ZI2, by calculation: a Cortex-M7, whose manual has no table of instruction timings.
//!
//! Instructions and changes of the program counter take what they take on a Cortex-M4F. A Cortex-M7 issues two at once where it can and
//! predicts branches, but refills a longer pipeline where it predicts wrongly: on the whole it does 1.46 times as much in a cycle (5.01 and
//! 3.42 CoreMark/MHz, Arm's figures). Every access to a peripheral's register waits for its answer from behind two bridges; this core
//! waits for none that it writes. Stack and variables are in the DTCM, which has no wait states.

use std::collections::BTreeSet;

use anyhow::{Context, Result};

use crate::attribution::Attribution;
use crate::converter::{self, BEGIN, WRITE};
use crate::cycles::Code;
use crate::kinds::Kinds;
use crate::trace::Tick;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::listing::Listing;
use xtask::prove::ROOT;
use xtask::toolchain::Toolchain;

/// Clock of the processor, Hz.
const CORE_HZ: f64 = 480e6;
/// Control rate for which the share of the processor is printed, Hz.
const RATE_HZ: f64 = 20e3;
/// Cycles of an access to a register, assumed: twenty clocks of the buses.
const ACCESS: u32 = 40;
/// Bytes of a line of both caches (DS12110, 3.1; Cortex-M7 TRM).
const LINE_BYTES: u32 = 32;
/// Cycles until a line is there that no cache holds, assumed: five clocks of the flash at four wait states (RM0433, table 17), which
/// returns a whole line, and fifteen of the bus.
const MISS: u32 = 40;
/// Registers of the chip, by the path of their types.
const REGISTERS: &[(&str, u32)] = &[("stm32h7::stm32h743v::", ACCESS)];

/// Prints the cycles of the traced ticks by kind, with caches that hold all of a tick's code, and with caches that hold nothing of it.
pub(crate) fn print(toolchain: Toolchain, code: &Code, kinds: &Kinds) -> Result<()> {
    let image = image::build(toolchain, Target::new(Board::NucleoH743zi2, Scalar::F32))?;
    let board = of_board(&image)?;
    println!(
        "nucleo-h743zi2 f32: cycles of a control tick, calculated, at {:.0} MHz: timings of a Cortex-M4F, {board} cycles in the board's own code; \
         with cold caches {MISS} more for each line of {LINE_BYTES} bytes",
        CORE_HZ / 1e6
    );
    println!(
        "  {:<20} {:>6} {:>16} {:>9} {:>6} {:>16}",
        "kind", "mean", "at 20 kHz", "largest", "lines", "with cold caches"
    );
    let any = ("any", kinds.all().iter().collect::<Vec<_>>());
    let share = |cycles: f64| 100.0 * cycles / CORE_HZ * RATE_HZ;
    for (name, ticks) in kinds.each().chain([any]) {
        let warm = |tick: &Tick| code.along(&tick.path) + board;
        let sum: u32 = ticks.iter().map(|tick| warm(tick)).sum();
        let mean = f64::from(sum) / ticks.len() as f64;
        let most = |of: &dyn Fn(&Tick) -> u32| ticks.iter().map(|tick| of(tick)).max().unwrap_or(0);
        let cold = most(&|tick| warm(tick) + MISS * lines(code, tick));
        println!(
            "  {name:<20} {mean:>6.0} {:>14.1} % {:>9} {:>6} {cold:>8} {:>5.1} %",
            share(mean),
            most(&warm),
            most(&|tick| lines(code, tick)),
            share(cold.into())
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
