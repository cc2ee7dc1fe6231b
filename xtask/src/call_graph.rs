//! Functions that can be reached from a function by direct calls and jumps.

use std::collections::BTreeMap;

use anyhow::{Context, Result};

use crate::listing::{Function, Instruction, Listing};

/// A function that can be reached, and from where.
pub struct Reached<'a> {
    /// The function.
    pub function: &'a Function,
    /// The first caller found, by its first address; none for the root.
    pub caller: Option<u32>,
}

/// Everything reachable from one function.
pub struct CallGraph<'a> {
    /// The functions, by their first address.
    pub reached: BTreeMap<u32, Reached<'a>>,
    /// Calls whose target is not in the code: `function: instruction`.
    pub indirect: Vec<String>,
}

/// Destinations of an instruction besides the next one.
pub enum Flow {
    /// Nowhere.
    Onward,
    /// To an address.
    To(u32),
    /// To an address that is not in the code.
    Indirect,
}

impl<'a> CallGraph<'a> {
    /// Follows every direct branch from the function at `root`.
    pub fn from(listing: &'a Listing, root: u32) -> Result<Self> {
        let mut graph = Self {
            reached: BTreeMap::new(),
            indirect: Vec::new(),
        };
        let mut waiting = vec![(root, None)];
        while let Some((address, caller)) = waiting.pop() {
            let function = listing
                .at(address)
                .with_context(|| format!("no function covers {address:#x}"))?;
            let start = function.range.start;
            if graph.reached.contains_key(&start) {
                continue;
            }
            graph.reached.insert(start, Reached { function, caller });
            for (index, instruction) in function.instructions.iter().enumerate() {
                match flow(function, index, instruction) {
                    Flow::To(target) if !function.range.contains(&target) => {
                        waiting.push((target, Some(start)))
                    }
                    Flow::Onward | Flow::To(_) => {}
                    Flow::Indirect => graph.indirect.push(format!(
                        "{} at {:#x}: {} {}",
                        function.name,
                        instruction.address,
                        instruction.mnemonic,
                        instruction.operands
                    )),
                }
            }
        }
        Ok(graph)
    }

    /// The chain of calls that leads to a function, root first.
    pub fn chain(&self, start: u32) -> String {
        let mut names = Vec::new();
        let mut next = Some(start);
        while let Some(reached) = next.and_then(|address| self.reached.get(&address)) {
            names.push(reached.function.name.as_str());
            next = reached.caller;
        }
        names.reverse();
        names.join(" -> ")
    }
}

/// Returns the destinations of the instruction at `index` of a function.
pub fn flow(function: &Function, index: usize, instruction: &Instruction) -> Flow {
    let Instruction {
        mnemonic, operands, ..
    } = instruction;
    if mnemonic.starts_with('b') || mnemonic.starts_with("cb") {
        // Direct branches name their target: `e0 <symbol+0x4>`, after a register for cbz and cbnz.
        if let Some((target, _)) = operands.split_once(" <") {
            let target = target
                .rsplit(' ')
                .next()
                .and_then(|word| u32::from_str_radix(word, 16).ok());
            return target.map_or(Flow::Indirect, Flow::To);
        }
        let by_register = mnemonic.starts_with("bx") || mnemonic.starts_with("blx");
        return if by_register && !instruction.returns() {
            Flow::Indirect
        } else {
            Flow::Onward
        };
    }
    let loads_pc = operands.starts_with("pc,") && !mnemonic.starts_with("cmp");
    if !loads_pc {
        return Flow::Onward;
    }
    // The linker's long branches load the address that follows: `.word 0x08001235`.
    let word = function
        .instructions
        .get(index + 1)
        .filter(|next| next.mnemonic == ".word");
    let target =
        word.and_then(|next| u32::from_str_radix(next.operands.strip_prefix("0x")?, 16).ok());
    match target {
        Some(target) if function.symbol.ends_with("_veneer") => Flow::To(target & !1),
        _ => Flow::Indirect,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flow_of(mnemonic: &str, operands: &str) -> Flow {
        let listing = Listing::parse(&format!("00000000 <f>:\n   0:\t{mnemonic}\t{operands}\n"));
        let function = listing.at(0).expect("it is listed");
        flow(function, 0, &function.instructions[0])
    }

    #[test]
    fn a_call_by_a_register_is_no_return_even_if_the_register_is_lr() {
        assert!(matches!(flow_of("bx", "lr"), Flow::Onward));
        assert!(matches!(flow_of("bxeq", "lr"), Flow::Onward));
        assert!(matches!(flow_of("blx", "lr"), Flow::Indirect));
        assert!(matches!(flow_of("blx", "r3"), Flow::Indirect));
        assert!(matches!(flow_of("bx", "r3"), Flow::Indirect));
        assert!(matches!(flow_of("bl", "e0 <g>"), Flow::To(0xe0)));
    }
}
