//! Cycles of a control tick on the Nucleo-H743ZI2, by calculation: a Cortex-M7, whose manual has no table of instruction timings.
//!
//! Instructions and changes of the program counter take what they take on a Cortex-M4F, divided by what Arm's own figures say that this
//! core does more in a cycle. Accesses to registers take the clocks of the bridges that they cross. Stack and variables are in the DTCM,
//! which has no wait states. A tick's code and literals fit into the caches; the supervising task, which runs after every tenth tick, is
//! taken to have put all of them out.

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
/// Work of a Cortex-M7 in a cycle by that of a Cortex-M4: 5.01 and 3.42 CoreMark/MHz, Arm's figures.
const M7_BY_M4: f64 = 5.01 / 3.42;
/// Cycles of a read of a register, assumed: fifteen clocks of the buses at 240 MHz, there and back.
const READ: u32 = 30;
/// Cycles of a write, which the processor does not wait for: those after which a bridge at 120 MHz takes the next one, and two clocks in reserve.
const WRITTEN: u32 = 12;
/// Bytes of a line of both caches (DS12110, 3.1; Cortex-M7 TRM).
const LINE_BYTES: u32 = 32;
/// Cycles until a line is there that no cache holds, assumed: five clocks of the flash at four wait states (RM0433, table 17), which
/// returns a whole line, and fifteen of the bus.
const MISS: u32 = 40;
/// Ticks from one run of the supervising task to the next.
const SUPERVISED: f64 = 10.0;
/// Registers of the chip, by the path of their types.
const REGISTERS: &str = "stm32h7::stm32h743v::";

/// Prints the cycles of the traced ticks by kind, with caches that hold all of a tick's code, and with caches that hold nothing of it.
pub(crate) fn print(toolchain: Toolchain, code: &Code, kinds: &Kinds) -> Result<()> {
    let image = image::build(toolchain, Target::new(Board::NucleoH743zi2, Scalar::F32))?;
    let driver = converter_cycles(&image)?;
    let accesses = access_cycles(&image)?;
    println!(
        "nucleo-h743zi2 f32: cycles of a control tick, calculated, at {:.0} MHz; of a Cortex-M4F's, {driver} of them the converter's driver, and \
         in the share of a Cortex-M7 with {accesses} for registers and {MISS} a line in every tenth tick",
        CORE_HZ / 1e6
    );
    println!(
        "  {:<20} {:>9} {:>12} {:>6} {:>12} {:>20}",
        "kind", "M4F, mean", "M4F, largest", "lines", "M7 at 20 kHz", "largest, cold caches"
    );
    let any = ("any", kinds.all().iter().collect::<Vec<_>>());
    for (name, ticks) in kinds.each().chain([any]) {
        let of = |tick: &Tick| f64::from(code.along(&tick.path) + driver);
        let most =
            |of: &dyn Fn(&Tick) -> f64| ticks.iter().map(|tick| of(tick)).fold(0.0, f64::max);
        let mean = ticks.iter().map(|tick| of(tick)).sum::<f64>() / ticks.len() as f64;
        let missed = |tick: &Tick| f64::from(MISS * lines(code, tick));
        let usual = mean / M7_BY_M4 + f64::from(accesses) + most(&missed) / SUPERVISED;
        let cold = most(&|tick| of(tick) / M7_BY_M4 + f64::from(accesses) + missed(tick));
        let share = |cycles: f64| 100.0 * cycles / CORE_HZ * RATE_HZ;
        println!(
            "  {name:<20} {mean:>9.0} {:>12.0} {:>6.0} {:>10.1} % {:>18.1} %",
            most(&of),
            most(&missed) / f64::from(MISS),
            share(usual),
            share(cold)
        );
    }
    Ok(())
}

/// Cycles of the converter's driver, every instruction of it once, on a Cortex-M4F.
fn converter_cycles(image: &Image) -> Result<u32> {
    let mut cycles = 0;
    for of in [BEGIN, WRITE] {
        cycles += converter::cycles(image, of, LINE_BYTES, 0, &[])?.cycles;
    }
    Ok(cycles)
}

/// Cycles of all accesses to registers in the interrupt, whatever branch they are in.
fn access_cycles(image: &Image) -> Result<u32> {
    let listing = Listing::of(image)?;
    let root = listing
        .named(ROOT)
        .with_context(|| format!("the image has no {ROOT}"))?;
    let attribution = Attribution::of(image)?;
    let mut cycles = 0;
    for instruction in &root.instructions {
        let functions = attribution.functions(instruction.address)?;
        let is_write = instruction.mnemonic.starts_with("str");
        let access = if is_write { WRITTEN } else { READ };
        cycles += converter::bridge(&functions, &[(REGISTERS, access)]);
    }
    Ok(cycles)
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
