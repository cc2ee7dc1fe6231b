//! Place of an image in the machine's memories, and its sizes.
//!
//! Two promises of the linker scripts are checked in the linked image: the stack is below everything else in RAM, so
//! that growing too far is a fault and nothing worse; and flashing an image never touches the sectors of the stored
//! settings. The sizes are compared with those committed in `golden/sizes.toml`.

use std::ops::Range;

use anyhow::{Context, Result, bail, ensure};
use object::read::elf::{FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, elf};
use serde::{Deserialize, Serialize};

use crate::frames::pointers_in_code;
use xtask::golden::{self, Golden};
use xtask::image::{Board, Image, Target};
use xtask::listing::{Instruction, Listing};

/// The reference board's flash.
const FLASH: Range<u32> = 0x0800_0000..0x0808_0000;
/// Growth that is no news, share of the committed size: compilers differ by as much.
const TOLERANCE: f64 = 0.02;

/// Memory that an image takes, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Sizes {
    /// Code, constants, and the first values of variables.
    pub(crate) flash: u64,
    /// Variables.
    pub(crate) variables: u64,
    /// Stack set aside.
    pub(crate) stack: u64,
    /// Bound of the stack in use: [`crate::stack`].
    pub(crate) stack_bound: u64,
}

impl Sizes {
    fn of(image: &Image) -> Result<Self> {
        let footprint = image.footprint()?;
        let stack = image.symbol("_stack_start")? - image.symbol("_stack_end")?;
        let stack_bound = crate::stack::check(image)?.into();
        Ok(Self {
            flash: footprint.flash_bytes(),
            variables: footprint.ram_bytes(),
            stack,
            stack_bound,
        })
    }
}

/// Checks an image's layout, and its sizes against the committed ones; `overwrite` commits these.
pub(crate) fn check(image: &Image, overwrite: bool) -> Result<()> {
    stack_is_at_the_bottom(image)?;
    if let Some(settings) = image.target.board.settings() {
        settings_are_left_alone(image, &settings)?;
    }
    if let Some(chip) = image.target.board.chip() {
        chip_is_named(image, chip)?;
    }
    if image.target.board == Board::NucleoF446re {
        erasing_calls_nothing(image)?;
    }
    if image.target.board == Board::NucleoH743zi2 {
        streams_reach_their_memory(image)?;
    }
    let sizes = Sizes::of(image)?;
    println!(
        "{}: flash {} bytes, variables {} bytes, stack {} bytes, of which at most {} are in use",
        image.target, sizes.flash, sizes.variables, sizes.stack, sizes.stack_bound
    );
    if overwrite {
        GOLDEN.store(Some(&image.compiler), [(key(image.target), sizes)])
    } else {
        compare(image.target, &image.compiler, sizes)
    }
}

/// The stack begins where RAM does, and everything else in RAM is above it.
fn stack_is_at_the_bottom(image: &Image) -> Result<()> {
    const RAM: u64 = 0x2000_0000;
    let bottom = image.symbol("_stack_end")?;
    let top = image.symbol("_stack_start")?;
    ensure!(
        bottom == RAM && top > bottom,
        "{}: the stack is at {bottom:#010x} to {top:#010x}, but must begin at the bottom of RAM, {RAM:#010x}",
        image.target
    );
    let file = object::File::parse(&*image.elf).context("the image is not an ELF file")?;
    for section in file.sections() {
        let object::SectionFlags::Elf { sh_flags } = section.flags() else {
            continue;
        };
        let is_allocated = sh_flags & u64::from(elf::SHF_ALLOC) != 0;
        if is_allocated && section.size() > 0 && section.address() >= RAM {
            ensure!(
                section.address() >= top,
                "{}: section {} at {:#010x} is below the top of the stack, {top:#010x}",
                image.target,
                section.name().unwrap_or("?"),
                section.address()
            );
        }
    }
    Ok(())
}

/// No part of the image is loaded into the sectors of the settings.
fn settings_are_left_alone(image: &Image, settings: &Range<u64>) -> Result<()> {
    let header = elf::FileHeader32::<Endianness>::parse(&*image.elf)?;
    let endian = header.endian()?;
    for segment in header.program_headers(endian, &*image.elf)? {
        let start = u64::from(segment.p_paddr(endian));
        let end = start + u64::from(segment.p_filesz(endian));
        let is_loaded = segment.p_type(endian) == elf::PT_LOAD && end > start;
        ensure!(
            !is_loaded || end <= settings.start || start >= settings.end,
            "{}: {start:#010x} to {end:#010x} is loaded over the stored settings at {:#010x} to {:#010x}",
            image.target,
            settings.start,
            settings.end
        );
    }
    Ok(())
}

/// The image names its chip, and that name takes no memory: `quadrant connect flash` refuses another chip by it.
fn chip_is_named(image: &Image, chip: &str) -> Result<()> {
    const SECTION: &str = ".probe-rs.chip";
    let file = object::File::parse(&*image.elf)?;
    let section = file.section_by_name(SECTION);
    let section = section.with_context(|| format!("{}: no {SECTION}", image.target))?;
    ensure!(
        section.data()? == chip.as_bytes(),
        "{}: {SECTION} is not {chip}",
        image.target
    );
    let object::SectionFlags::Elf { sh_flags } = section.flags() else {
        bail!("{}: not an ELF file", image.target);
    };
    ensure!(
        sh_flags & u64::from(elf::SHF_ALLOC) == 0,
        "{}: {SECTION} takes memory",
        image.target
    );
    Ok(())
}

/// The memory of DMA streams lies in SRAM 1 of the STM32H743: they reach no tightly coupled memory.
fn streams_reach_their_memory(image: &Image) -> Result<()> {
    const SRAM_1: Range<u64> = 0x3000_0000..0x3002_0000;
    let (start, end) = (image.symbol("_dma_start")?, image.symbol("_dma_end")?);
    ensure!(
        SRAM_1.contains(&start) && end <= SRAM_1.end && end > start,
        "{}: the streams' memory is at {start:#010x} to {end:#010x}, out of SRAM 1",
        image.target
    );
    let file = object::File::parse(&*image.elf).context("the image is not an ELF file")?;
    for name in ["PIN_WORDS", "TO_SEND", "RECEIVED"] {
        let mangled = format!("{}{name}", name.len());
        let mut places = file
            .symbols()
            .filter(|symbol| symbol.name().is_ok_and(|n| n.contains(&mangled)))
            .map(|symbol| symbol.address())
            .peekable();
        ensure!(places.peek().is_some(), "{}: no `{name}`", image.target);
        ensure!(
            places.all(|place| (start..end).contains(&place)),
            "{}: `{name}` is not where streams reach it",
            image.target
        );
    }
    Ok(())
}

/// The function that waits for an erase lies in RAM and never leaves it: everything else is in the flash that cannot be read
/// meanwhile, and a processor that fetches from there stands still until the watchdog bites.
fn erasing_calls_nothing(image: &Image) -> Result<()> {
    const SYMBOL: &str = "erase_from_ram";
    let listing = Listing::of_ram(image)?;
    let function = listing
        .named(SYMBOL)
        .with_context(|| format!("{}: `{SYMBOL}` is not in RAM", image.target))?;
    for instruction in &function.instructions {
        ensure!(
            !leaves(instruction, SYMBOL),
            "{}: `{SYMBOL}` leaves RAM at {:#010x}: {} {}",
            image.target,
            instruction.address,
            instruction.mnemonic,
            instruction.operands
        );
    }
    let in_flash = pointers_in_code(function)
        .into_iter()
        .find(|address| FLASH.contains(address));
    ensure!(
        in_flash.is_none(),
        "{}: `{SYMBOL}` has an address in flash, {:#010x}",
        image.target,
        in_flash.unwrap_or_default()
    );
    Ok(())
}

/// Returns true if an instruction is a branch to anywhere but into the function itself and back to its caller.
fn leaves(instruction: &Instruction, symbol: &str) -> bool {
    let own = [format!("<{symbol}>"), format!("<{symbol}+")];
    let is_own = own.iter().any(|own| instruction.operands.contains(own));
    let mnemonic = instruction.mnemonic.as_str();
    match mnemonic {
        "bx" => instruction.operands != "lr",
        "bl" | "blx" => true,
        "bic" | "bics" | "bfi" | "bfc" | "bkpt" => false,
        _ if instruction.operands.starts_with("pc,") => true,
        _ => (mnemonic.starts_with('b') || mnemonic.starts_with("cb")) && !is_own,
    }
}

/// The committed sizes.
const GOLDEN: Golden = Golden {
    path: golden::SIZES,
    head: "Bytes that the images take, written by `cargo xtask sizes --overwrite-expected`.",
};

fn key(target: Target) -> String {
    target.to_string().replace(' ', "-")
}

/// Compares sizes with the committed ones: another one is a failure if the same compiler made both. Smaller is good news, or something
/// that the tool has not seen.
fn compare(target: Target, compiler: &str, sizes: Sizes) -> Result<()> {
    const REMEDY: &str = "if that is meant, run `cargo xtask sizes --overwrite-expected`";
    let recorded = GOLDEN.read::<Sizes>()?.table(&key(target), compiler);
    let Some((expected, difference)) = recorded else {
        bail!("{target} has no committed sizes; {REMEDY}");
    };
    for (name, size, expected) in [
        ("flash", sizes.flash, expected.flash),
        ("variables", sizes.variables, expected.variables),
        ("stack", sizes.stack, expected.stack),
        ("stack bound", sizes.stack_bound, expected.stack_bound),
    ] {
        let allowed = size.abs_diff(expected) as f64 <= expected as f64 * TOLERANCE;
        difference.ensure(allowed, || {
            format!(
                "{target}: {name} {size} bytes, more than {} % from the committed {expected}; {REMEDY}",
                100.0 * TOLERANCE
            )
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use xtask::image::Scalar;

    #[test]
    fn a_change_beyond_the_tolerance_is_refused_and_names_both_sizes() {
        let target = Target::new(Board::NucleoF446re, Scalar::F32);
        let recorded = GOLDEN.read::<Sizes>().expect("sizes are committed");
        let compiler = recorded.compiler.as_deref().expect("its compiler is named");
        let expected = recorded.tables[&key(target)];
        let grown = |flash| Sizes { flash, ..expected };
        assert!(
            compare(
                target,
                compiler,
                grown(expected.flash + expected.flash / 100)
            )
            .is_ok()
        );
        let error = compare(
            target,
            compiler,
            grown(expected.flash + expected.flash / 10),
        )
        .unwrap_err();
        assert!(compare(target, compiler, grown(expected.flash / 2)).is_err());
        assert!(compare(target, "another", grown(2 * expected.flash)).is_ok());
        let text = error.to_string();
        assert!(
            text.contains("flash") && text.contains(&expected.flash.to_string()),
            "{text}"
        );
    }

    #[test]
    fn branches_within_the_function_stay_and_calls_leave() {
        let is_leaving = |mnemonic: &str, operands: &str| {
            let instruction = Instruction {
                address: 0,
                mnemonic: mnemonic.into(),
                operands: operands.into(),
            };
            leaves(&instruction, "wait")
        };
        assert!(is_leaving("bl", "8001234 <memcpy>"));
        assert!(is_leaving("b", "8001234 <memcpy>"));
        assert!(is_leaving("blx", "r3"));
        assert!(is_leaving("bx", "r3"));
        assert!(is_leaving("ldr", "pc, [r0]"));
        for (mnemonic, operands) in [
            ("bne", "20010010 <wait+0x10>"),
            ("cbz", "r0, 20010010 <wait+0x10>"),
            ("bx", "lr"),
            ("bic", "r0, r0, #1"),
            ("ldr", "r0, [pc, #8]"),
        ] {
            assert!(!is_leaving(mnemonic, operands), "{mnemonic} {operands}");
        }
    }

    #[test]
    fn every_image_has_committed_sizes() {
        let golden = GOLDEN.read::<Sizes>().expect("sizes are committed");
        for target in Target::ALL {
            assert!(golden.tables.contains_key(&key(target)), "{target}");
        }
    }
}
