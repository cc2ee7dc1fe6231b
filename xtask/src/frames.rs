//! Stack frame and calls of each function of an image, and the functions that are called by their address.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, Result, ensure};
use object::{Object, ObjectSection};

use xtask::call_graph::{Flow, flow};
use xtask::image::Image;
use xtask::listing::{Function, Instruction, Listing};

/// The function that starts the stack afresh.
pub(crate) const FRESH: &str = "HardFault";

/// One function.
pub(crate) struct Node {
    /// Its name.
    pub(crate) name: String,
    /// Bytes of the stack that it takes itself, at most.
    pub(crate) bytes: u32,
    /// The functions that it names in calls and jumps, by their first address.
    pub(crate) calls: BTreeSet<u32>,
    /// It also calls by an address that it is given.
    pub(crate) is_indirect: bool,
}

/// All functions, by their first address.
pub(crate) struct Frames {
    /// The functions.
    pub(crate) nodes: BTreeMap<u32, Node>,
    /// Those whose address is somewhere in the image, other than in the vector table.
    pub(crate) by_address: BTreeSet<u32>,
    /// The vector table from the reset vector on: first addresses of functions.
    pub(crate) vectors: Vec<u32>,
}

impl Frames {
    /// Reads an image.
    pub(crate) fn of(image: &Image) -> Result<Self> {
        let listing = Listing::of(image)?;
        let mut nodes = BTreeMap::new();
        let mut pointers = BTreeSet::new();
        for function in listing.functions() {
            nodes.insert(function.range.start, node(&listing, function)?);
            pointers.extend(pointers_in_code(function));
        }
        let file = object::File::parse(&*image.elf).context("the image is not an ELF file")?;
        let words = |name: &str| -> Result<Vec<u32>> {
            let section = file.section_by_name(name);
            let section = section.with_context(|| format!("the image has no section {name}"))?;
            let words = section.data()?.chunks_exact(4);
            Ok(words
                .map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]]))
                .collect())
        };
        pointers.extend(words(".rodata")?);
        pointers.extend(words(".data")?);
        // The first word is the stack's start.
        let vectors = words(".vector_table")?.split_off(1);
        let function = |pointer: u32| {
            let start = pointer & !1;
            (pointer & 1 == 1 && nodes.contains_key(&start)).then_some(start)
        };
        let vectors: Vec<_> = vectors.into_iter().filter_map(function).collect();
        // The processor calls the vectors, and nobody else.
        let by_address = pointers.into_iter().filter_map(function);
        let by_address = by_address
            .filter(|start| !vectors.contains(start))
            .collect();
        Ok(Self {
            by_address,
            vectors,
            nodes,
        })
    }
}

fn node(listing: &Listing, function: &Function) -> Result<Node> {
    let mut node = Node {
        name: function.name.clone(),
        bytes: 0,
        calls: BTreeSet::new(),
        is_indirect: false,
    };
    for (index, instruction) in function.instructions.iter().enumerate() {
        let restarts = function.symbol == FRESH && instruction.mnemonic == "mov";
        let bytes = if restarts {
            Some(0)
        } else {
            taken(instruction)
        };
        node.bytes += bytes.with_context(|| {
            format!(
                "{} takes an unknown share of the stack at {:#x}: {} {}",
                function.name, instruction.address, instruction.mnemonic, instruction.operands
            )
        })?;
        match flow(function, index, instruction) {
            Flow::To(target) if leaves(function, instruction, target) => {
                let callee = listing.at(target);
                let callee = callee.with_context(|| format!("no function covers {target:#x}"))?;
                node.calls.insert(callee.range.start);
            }
            Flow::Indirect => node.is_indirect = true,
            Flow::Onward | Flow::To(_) => {}
        }
    }
    ensure!(
        node.bytes < 1 << 20,
        "{} takes {} bytes of the stack",
        node.name,
        node.bytes
    );
    Ok(node)
}

/// Returns true if a branch is to another function, or a call of this one by itself.
fn leaves(function: &Function, instruction: &Instruction, target: u32) -> bool {
    let mnemonic = instruction.mnemonic.as_str();
    // `bl`, and `bleq` and the like; `ble`, `blt` and `bls` are jumps.
    let calls = mnemonic == "bl" || mnemonic.starts_with("bl") && mnemonic.len() == 4;
    !function.range.contains(&target) || calls && target == function.range.start
}

/// Bytes by which an instruction lowers the stack pointer; none if that is not in the instruction. The sum over a
/// function's instructions is no less than what it takes at any time.
fn taken(instruction: &Instruction) -> Option<u32> {
    let Instruction {
        mnemonic, operands, ..
    } = instruction;
    let list = || {
        let (_, list) = operands.split_once('{')?;
        Some(registers(list.trim_end_matches('}')))
    };
    match mnemonic.as_str() {
        "push" => Some(4 * list()?),
        "stmdb" | "stmfd" if operands.starts_with("sp!") => Some(4 * list()?),
        "vpush" | "vstmdb" if mnemonic == "vpush" || operands.starts_with("sp!") => {
            let size = if operands.contains("{d") { 8 } else { 4 };
            Some(size * list()?)
        }
        "sub" | "subw" | "subs" if operands.starts_with("sp,") => immediate(operands),
        "str" | "strd" if operands.contains("[sp, #-") && operands.contains("]!") => {
            let (_, offset) = operands.split_once("[sp, #-")?;
            offset.split(']').next()?.parse().ok()
        }
        "mov" if operands.starts_with("sp,") => None,
        _ => Some(0),
    }
}

/// `sp, #4`, `sp, sp, #868 @ 0x364`
fn immediate(operands: &str) -> Option<u32> {
    let (_, value) = operands.split_once('#')?;
    value.split_whitespace().next()?.parse().ok()
}

/// Registers in a list: `r4, r5, lr`, `r4-r7`, `d8-d15`.
fn registers(list: &str) -> u32 {
    let number = |name: &str| name.trim().get(1..).and_then(|n| n.parse::<u32>().ok());
    list.split(',')
        .map(|part| match part.split_once('-') {
            Some((first, last)) => number(last)
                .zip(number(first))
                .map_or(16, |(last, first)| last - first + 1),
            None => 1,
        })
        .sum()
}

/// Returns the words that may be addresses in a function: among its instructions, and constants made of two halves.
pub(crate) fn pointers_in_code(function: &Function) -> Vec<u32> {
    let mut pointers = Vec::new();
    let mut halves: BTreeMap<&str, BTreeSet<u32>> = BTreeMap::new();
    for instruction in &function.instructions {
        let operands = instruction.operands.as_str();
        let register = operands.split(',').next().unwrap_or_default();
        match instruction.mnemonic.as_str() {
            ".word" => {
                let digits = operands.strip_prefix("0x");
                pointers.extend(digits.and_then(|digits| u32::from_str_radix(digits, 16).ok()));
            }
            // With a condition, too: `movwne`.
            name if name.starts_with("movt") => {
                if let (Some(lows), Some(high)) = (halves.get(register), immediate(operands)) {
                    pointers.extend(lows.iter().map(|low| low & 0xFFFF | high << 16));
                }
            }
            name if name.starts_with("mov") => {
                if let Some(low) = immediate(operands) {
                    halves.entry(register).or_default().insert(low);
                }
            }
            _ => {}
        }
    }
    pointers
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(mnemonic: &str, operands: &str) -> Option<u32> {
        taken(&Instruction {
            address: 0,
            mnemonic: mnemonic.into(),
            operands: operands.into(),
        })
    }

    #[test]
    fn what_lowers_the_stack_pointer_is_counted() {
        assert_eq!(bytes("push", "{r4, r5, r6, r7, lr}"), Some(20));
        assert_eq!(bytes("stmdb", "sp!, {r4-r11, lr}"), Some(36));
        assert_eq!(bytes("vpush", "{d8-d15}"), Some(64));
        assert_eq!(bytes("sub", "sp, #4"), Some(4));
        assert_eq!(bytes("sub", "sp, sp, #868\t@ 0x364"), Some(868));
        assert_eq!(bytes("str", "r0, [sp, #-16]!"), Some(16));
        assert_eq!(bytes("str", "r0, [sp, #16]"), Some(0));
        assert_eq!(bytes("add", "sp, #4"), Some(0));
    }

    #[test]
    fn what_cannot_be_known_is_refused() {
        assert_eq!(bytes("sub", "sp, sp, r4"), None);
        assert_eq!(bytes("mov", "sp, r7"), None);
    }

    #[test]
    fn a_function_that_calls_itself_is_a_callee_of_its_own() {
        let listing =
            Listing::parse("000000d8 <again>:\n  d8:\tbl\td8 <again>\n  dc:\tblt.n\td8 <again>\n");
        let of = |index: usize| {
            let function = listing.at(0xd8).expect("it is listed");
            leaves(function, &function.instructions[index], 0xd8)
        };
        assert_eq!((of(0), of(1)), (true, false));
        let node = node(&listing, listing.at(0xd8).expect("it is listed")).expect("no frame");
        assert_eq!(node.calls, BTreeSet::from([0xd8]));
    }

    #[test]
    fn addresses_in_two_halves_are_found() {
        let instruction = |mnemonic: &str, operands: &str| Instruction {
            address: 0,
            mnemonic: mnemonic.into(),
            operands: operands.into(),
        };
        let function = Function {
            symbol: "f".into(),
            name: "f".into(),
            range: 0..12,
            instructions: vec![
                instruction("movw", "r0, #4661\t@ 0x1235"),
                instruction("movt", "r0, #2048\t@ 0x800"),
                instruction(".word", "0x08001237"),
            ],
        };
        assert_eq!(pointers_in_code(&function), [0x0800_1235, 0x0800_1237]);
    }
}
