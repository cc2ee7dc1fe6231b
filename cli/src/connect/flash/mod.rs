//! A board's debug probe: `quadrant connect flash` and `log --elf`.

#[cfg(feature = "flash")]
mod chips;
#[cfg(feature = "flash")]
mod library;
#[cfg(feature = "flash")]
mod log_buffer;
#[cfg(feature = "flash")]
mod probes;
#[cfg(not(feature = "flash"))]
mod program;

use std::fs;
use std::path::Path;

use anyhow::{Context, bail};
use object::{Object, ObjectSection};

#[cfg(feature = "flash")]
use self::library as by;
#[cfg(not(feature = "flash"))]
use self::program as by;
use super::command::{FlashOptions, LogOptions};

/// An image and the board that it is for.
struct Job<'a> {
    elf: &'a Path,
    /// The chip, by probe-rs' name.
    chip: String,
    /// The debug probe, `VID:PID[:SERIAL]`; `None` is the only one.
    probe: Option<&'a str>,
}

impl<'a> Job<'a> {
    fn new(elf: &'a Path, chip: Option<&str>, probe: Option<&'a str>) -> anyhow::Result<Self> {
        let shown = elf.display();
        if !elf.exists() {
            bail!(
                "{shown}: no such file; a release has images, and docs/board-nucleo-f446re.md says how one is built"
            );
        }
        if !elf.is_file() {
            bail!("{shown}: it is a folder or a device; give the firmware's ELF file");
        }
        let image = fs::read(elf).with_context(|| format!("cannot read {shown}"))?;
        let file = object::File::parse(&*image).with_context(|| {
            format!("{shown}: it is no ELF file, or not the whole of one; give the firmware's")
        })?;
        let chip =
            chip_for(named_chip(&file).as_deref(), chip).with_context(|| shown.to_string())?;
        Ok(Self { elf, chip, probe })
    }
}

/// Returns the chip that an image names; `None` if it names none.
fn named_chip(file: &object::File<'_>) -> Option<String> {
    let section = file.section_by_name(".probe-rs.chip")?;
    String::from_utf8(section.data().ok()?.to_vec()).ok()
}

/// Returns the chip to flash: the one that the image names, or the requested one.
///
/// # Errors
/// A requested chip that is not the image's; none of both.
fn chip_for(named: Option<&str>, requested: Option<&str>) -> anyhow::Result<String> {
    match (named, requested) {
        (Some(named), Some(requested)) if !named.eq_ignore_ascii_case(requested) => bail!(
            "it is built for {named}, not for {requested}: give the image of your board, or no --chip"
        ),
        (Some(chip), _) | (None, Some(chip)) => Ok(chip.to_owned()),
        (None, None) => bail!(
            "it names no chip: give the firmware's ELF file, or for an image of your own --chip, such as --chip STM32F446RETx"
        ),
    }
}

/// Flashes the firmware and lets it start.
pub(super) fn run(arguments: &FlashOptions) -> anyhow::Result<()> {
    let job = Job::new(
        &arguments.elf,
        arguments.chip.as_deref(),
        arguments.probe.as_deref(),
    )?;
    by::flash(&job, arguments.run)
}

/// Shows the log of a board that runs, until Ctrl-C.
pub(super) fn log(elf: &Path, arguments: &LogOptions) -> anyhow::Result<()> {
    if arguments.chooses() {
        bail!(
            "log: --level, --axis, --from and --to choose lines of the link (--port) or of a file (--file), not of a debug probe"
        );
    }
    by::log(&Job::new(
        elf,
        arguments.chip.as_deref(),
        arguments.probe.as_deref(),
    )?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_names_its_chip_and_another_is_refused() {
        let chip = chip_for(Some("STM32F446RETx"), None).unwrap();
        assert_eq!(chip, "STM32F446RETx");
        let chip = chip_for(Some("STM32F446RETx"), Some("stm32f446retx")).unwrap();
        assert_eq!(chip, "STM32F446RETx");
        let refused = chip_for(Some("STM32F446RETx"), Some("STM32H743ZITx")).unwrap_err();
        let refused = refused.to_string();
        assert!(
            refused.contains("for STM32F446RETx, not for STM32H743ZITx"),
            "{refused}"
        );
    }

    /// An ELF file with one section (System V ABI, chapter 4).
    fn elf(section: &str, content: &[u8]) -> Vec<u8> {
        const HEADER: u32 = 52;
        let names = [b"\0", section.as_bytes(), b"\0.names\0"].concat();
        let (length, names_at) = (content.len() as u32, HEADER + content.len() as u32);
        let sections = names_at + names.len() as u32;
        // Name, type (1: content, 3: names), flags, address, offset, size, link, info, alignment, size of an entry.
        let rows = [
            [0; 10],
            [1, 1, 0, 0, HEADER, length, 0, 0, 1, 0],
            [
                section.len() as u32 + 2,
                3,
                0,
                0,
                names_at,
                names.len() as u32,
                0,
                0,
                1,
                0,
            ],
        ];
        // 32 bits, the least byte first; an executable file for Arm.
        let mut file = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x28\0\x01\0\0\0".to_vec();
        // Entry, segments, sections, flags; then sizes and numbers of the header, segments and sections.
        file.extend([0, 0, sections, 0].map(u32::to_le_bytes).as_flattened());
        file.extend(
            [52_u16, 32, 0, 40, 3, 2]
                .map(u16::to_le_bytes)
                .as_flattened(),
        );
        file.extend(content);
        file.extend(names);
        file.extend(
            rows.as_flattened()
                .iter()
                .flat_map(|word| word.to_le_bytes()),
        );
        file
    }

    #[test]
    fn the_chip_is_read_from_its_section() {
        let chip = |section| {
            let image = elf(section, b"STM32F446RETx");
            named_chip(&object::File::parse(&*image).unwrap())
        };
        assert_eq!(chip(".probe-rs.chip").as_deref(), Some("STM32F446RETx"));
        assert_eq!(chip(".probe-rs.text"), None);
    }

    #[test]
    fn an_image_without_a_chip_asks_for_it() {
        assert_eq!(
            chip_for(None, Some("nRF52840_xxAA")).unwrap(),
            "nRF52840_xxAA"
        );
        let asked = chip_for(None, None).unwrap_err().to_string();
        assert!(asked.contains("--chip STM32F446RETx"), "{asked}");
    }
}
