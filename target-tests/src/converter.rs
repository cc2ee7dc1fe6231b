//! Cycles that a board's converter takes of the control interrupt: what is emulated has no converter.
//!
//! The code of its driver has no loop but the wait that an interrupt meets when it follows the one before at once, which is a
//! function of its own. So the sum of all its instructions, each taken once, bounds every path through it.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail, ensure};

use crate::attribution::Attribution;
use crate::cortex_m::{Core, REFILL};
use xtask::call_graph::{self, Flow};
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::listing::{Function, Listing};
use xtask::prove::ROOT;
use xtask::toolchain::Toolchain;

/// Functions that are the converter's: at the beginning of a tick, and when it has computed its outputs.
pub(crate) const BEGIN: &str =
    "<quadrant_firmware::board::stm32::amplifiers::Amplifiers as quadrant::hal::Amplifiers>::begin";
/// See [`BEGIN`].
pub(crate) const WRITE: &str =
    "<quadrant_firmware::board::stm32::amplifiers::Amplifiers as quadrant::hal::Amplifiers>::write";
/// The register that starts the timer, behind the name of the chip.
const START: &str = "::tim1::cr1::";
/// The function that waits, by the end of its name.
const WAIT: &str = "ConverterBus>::wait";

/// Registers behind a bridge to a slower bus, by the type of their peripheral, and the cycles that an access takes at most beyond the
/// processor's own: three clocks of that bus, one of them to wait for its edge.
pub(crate) const BRIDGES: [(&str, u32); 2] = [
    // APB 2, at half of the processor's clock.
    ("stm32f4::stm32f446::tim1::", 6),
    // APB 1, at a quarter.
    ("stm32f4::stm32f446::spi1::", 12),
];

/// The reference board's image.
pub(crate) fn image(toolchain: Toolchain) -> Result<Image> {
    let target = Target::new(Board::NucleoF446re, Scalar::F32);
    image::build(toolchain, target)
}

/// Bound of a part of the interrupt.
pub(crate) struct Bound {
    /// Cycles of all of it.
    pub(crate) cycles: u32,
    /// Cycles until the timer is started that moves the bus.
    pub(crate) until_start: u32,
}

/// The bound of one of the functions, with as many cycles for each line of the flash that is entered.
pub(crate) fn cycles(
    image: &Image,
    of: &str,
    line_bytes: u32,
    cycles_a_line: u32,
    bridges: &[(&str, u32)],
) -> Result<Bound> {
    let listing = Listing::of(image)?;
    let root = listing
        .named(ROOT)
        .with_context(|| format!("the image has no {ROOT}"))?;
    let attribution = Attribution::of(image)?;
    let (mut cycles, mut until_start, mut line) = (0, 0, None);
    let mut successors = BTreeMap::new();
    for (index, instruction) in root.instructions.iter().enumerate() {
        let functions = attribution.functions(instruction.address)?;
        if !functions.iter().any(|name| name == of) {
            continue;
        }
        let next = root.instructions.get(index + 1);
        cycles += Core::M4F.cycles(instruction, next);
        let mut followers: Vec<u32> = next
            .filter(|_| instruction.mnemonic != "b")
            .map(|next| next.address)
            .into_iter()
            .collect();
        match call_graph::flow(root, index, instruction) {
            Flow::Onward => {}
            Flow::To(target) => {
                ensure_counted(&listing, root, target)?;
                followers.push(target);
                cycles += REFILL;
            }
            Flow::Indirect => bail!("the converter's code jumps anywhere"),
        }
        successors.insert(instruction.address, followers);
        cycles += bridge(&functions, bridges);
        let entered = instruction.address / line_bytes;
        if line.replace(entered) != Some(entered) {
            cycles += cycles_a_line;
        }
        if functions[0].starts_with("core::ptr::write_volatile")
            && functions.iter().any(|name| name.contains(START))
        {
            until_start = cycles;
        }
    }
    ensure!(!has_loop(successors), "the converter's code has a loop");
    ensure!(
        until_start > 0,
        "{ROOT} has no instruction of {of} that starts the timer"
    );
    Ok(Bound {
        cycles,
        until_start,
    })
}

/// Checks that a branch calls nothing but the wait.
fn ensure_counted(listing: &Listing, root: &Function, target: u32) -> Result<()> {
    if root.range.contains(&target) {
        return Ok(());
    }
    let called = listing.at(target).map_or("?", |function| &function.name);
    ensure!(
        called.contains(WAIT),
        "the converter's code calls {called}, which is not counted"
    );
    Ok(())
}

/// True if some instruction can follow itself.
fn has_loop(mut successors: BTreeMap<u32, Vec<u32>>) -> bool {
    loop {
        let leaving: Vec<u32> = successors
            .iter()
            .filter(|(_, followers)| followers.iter().all(|at| !successors.contains_key(at)))
            .map(|(address, _)| *address)
            .collect();
        if leaving.is_empty() {
            return !successors.is_empty();
        }
        successors.retain(|address, _| !leaving.contains(address));
    }
}

/// Cycles that a bridge adds to an instruction, by the functions it was inlined into, innermost first.
pub(crate) fn bridge(functions: &[String], bridges: &[(&str, u32)]) -> u32 {
    let accesses = |name: &String| name.starts_with("core::ptr::");
    if !functions.first().is_some_and(accesses) {
        return 0;
    }
    bridges
        .iter()
        .filter(|(register, _)| functions.iter().any(|name| name.contains(register)))
        .map(|(_, cycles)| cycles)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loop_is_distinguished_from_a_jump_back_to_skipped_code() {
        let graph = |edges: &[(u32, &[u32])]| {
            edges
                .iter()
                .map(|(from, to)| (*from, to.to_vec()))
                .collect::<BTreeMap<_, _>>()
        };
        // 1 goes to 3 or to 9, which jumps back to 3.
        assert!(!has_loop(graph(&[(1, &[3, 9]), (3, &[5]), (9, &[3])])));
        assert!(has_loop(graph(&[(1, &[3]), (3, &[5]), (5, &[7, 3])])));
    }

    #[test]
    fn only_an_access_to_a_register_behind_a_bridge_costs_more() {
        let of = |functions: &[&str]| {
            let functions: Vec<String> = functions.iter().map(|name| name.to_string()).collect();
            bridge(&functions, &BRIDGES)
        };
        let register = "<stm32f4::generic::Reg<stm32f4::stm32f446::spi1::cr1::CR1rs>>::write";
        assert_eq!(of(&["core::ptr::write_volatile::<u16>", register]), 12);
        assert_eq!(of(&[register]), 0);
        let port = "<stm32f4::generic::Reg<stm32f4::stm32f446::gpioa::bsrr::BSRRrs>>::write";
        assert_eq!(of(&["core::ptr::write_volatile::<u32>", port]), 0);
    }
}
