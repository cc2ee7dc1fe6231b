//! The image as machine code: functions and their instructions, from the disassembler.

use std::collections::BTreeMap;
use std::ops::Range;

use anyhow::{Context, Result, ensure};

use crate::command;
use crate::image::Image;

/// One instruction.
pub struct Instruction {
    /// Address of the instruction.
    pub address: u32,
    /// Its name, without a width suffix.
    pub mnemonic: String,
    /// The rest of the line.
    pub operands: String,
}

impl Instruction {
    /// Returns true if it returns from its function.
    pub fn returns(&self) -> bool {
        let loads = self.mnemonic.starts_with("pop") || self.mnemonic.starts_with("ldm");
        loads && self.operands.contains("pc")
            || self.mnemonic.starts_with("bx") && self.operands == "lr"
    }
}

/// One function.
pub struct Function {
    /// Its linker symbol.
    pub symbol: String,
    /// Its name as a person would write it.
    pub name: String,
    /// The addresses it covers.
    pub range: Range<u32>,
    /// Its instructions in order of address.
    pub instructions: Vec<Instruction>,
}

/// All functions of an image, by their first address.
pub struct Listing {
    functions: BTreeMap<u32, Function>,
}

impl Listing {
    /// Disassembles an image.
    pub fn of(image: &Image) -> Result<Self> {
        let mut objdump = command::command("arm-none-eabi-objdump");
        objdump
            .args(["--disassemble", "--no-show-raw-insn"])
            .arg(&image.path);
        let text = command::output(&mut objdump)
            .context("`cargo xtask setup` installs the disassembler")?;
        let listing = Self::parse(&text);
        ensure!(
            !listing.functions.is_empty(),
            "the disassembler found no function in {}",
            image.path.display()
        );
        Ok(listing)
    }

    /// Disassembles what an image keeps among its variables: code that runs from RAM, and data that means nothing.
    pub fn of_ram(image: &Image) -> Result<Self> {
        let mut objdump = command::command("arm-none-eabi-objdump");
        objdump
            .args(["--disassemble-all", "--section=.data", "--no-show-raw-insn"])
            .arg(&image.path);
        let text = command::output(&mut objdump)
            .context("`cargo xtask setup` installs the disassembler")?;
        Ok(Self::parse(&text))
    }

    /// Reads what the disassembler writes.
    pub fn parse(text: &str) -> Self {
        let mut functions: BTreeMap<u32, Function> = BTreeMap::new();
        let mut current = None;
        for line in text.lines() {
            if let Some((address, symbol)) = header(line) {
                let name = format!("{:#}", rustc_demangle::demangle(symbol));
                let function = Function {
                    symbol: symbol.into(),
                    name,
                    range: address..address,
                    instructions: Vec::new(),
                };
                functions.insert(address, function);
                current = Some(address);
            } else if let Some(instruction) = instruction(line)
                && let Some(function) = current.and_then(|address| functions.get_mut(&address))
            {
                // At least one half-word; what follows says how much.
                function.range.end = instruction.address + 2;
                function.instructions.push(instruction);
            }
        }
        // The last instruction may have 32 bits; what the next function begins with belongs to that.
        let mut next = u32::MAX;
        for function in functions.values_mut().rev() {
            function.range.end = (function.range.end + 2).min(next);
            next = function.range.start;
        }
        Self { functions }
    }

    /// The function of a linker symbol.
    pub fn named(&self, symbol: &str) -> Option<&Function> {
        self.functions
            .values()
            .find(|function| function.symbol == symbol)
    }

    /// All functions, in order of their addresses.
    pub fn functions(&self) -> impl Iterator<Item = &Function> {
        self.functions.values()
    }

    /// The function that covers an address.
    pub fn at(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        function.range.contains(&address).then_some(function)
    }
}

/// `000000d8 <CONTROL_TICK>:`
fn header(line: &str) -> Option<(u32, &str)> {
    let (address, symbol) = line.strip_suffix(">:")?.split_once(" <")?;
    Some((u32::from_str_radix(address, 16).ok()?, symbol))
}

/// `     0d8:\tpush\t{r4, r5, r6, r7, lr}`
fn instruction(line: &str) -> Option<Instruction> {
    let (address, rest) = line.split_once(":\t")?;
    let address = u32::from_str_radix(address.trim(), 16).ok()?;
    let (mnemonic, operands) = rest.split_once('\t').unwrap_or((rest, ""));
    let mnemonic = mnemonic
        .trim()
        .trim_end_matches(".n")
        .trim_end_matches(".w")
        .to_owned();
    Some(Instruction {
        address,
        mnemonic,
        operands: operands.trim().to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_are_found_with_their_instructions() {
        let listing = Listing::parse(
            "000000d8 <CONTROL_TICK>:\n  d8:\tpush\t{r4, lr}\n  da:\tbl\te0 <_ZN4core3fooE>\n",
        );
        let function = listing.at(0xda).expect("the address is covered");
        assert_eq!(function.symbol, "CONTROL_TICK");
        assert_eq!(function.range, 0xd8..0xde);
        assert_eq!(function.instructions[1].mnemonic, "bl");
        assert_eq!(function.instructions[1].operands, "e0 <_ZN4core3fooE>");
        assert!(listing.at(0xd6).is_none() && listing.at(0xde).is_none());
    }

    #[test]
    fn a_function_that_ends_in_a_short_instruction_does_not_reach_into_the_next() {
        let listing = Listing::parse(
            "000000d8 <first>:\n  d8:\tbl\tdc <second>\n\n000000dc <second>:\n  dc:\tbx\tlr\n\n\
             000000de <third>:\n  de:\tbx\tlr\n",
        );
        let ranges: Vec<_> = listing.functions().map(|f| f.range.clone()).collect();
        assert_eq!(ranges, [0xd8..0xdc, 0xdc..0xde, 0xde..0xe2]);
    }
}
