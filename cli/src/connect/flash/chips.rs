//! The chips of the boards, and their ids: an image is not written to another chip.

use anyhow::bail;
use probe_rs::architecture::arm::{ArmDebugInterface, ArmError, FullyQualifiedApAddress};

/// Access port of the core's memory.
pub(super) const CORE: FullyQualifiedApAddress = FullyQualifiedApAddress::v1_with_default_dp(0);
/// CPUID of a Cortex-M (Armv7-M, B3.2.3).
const CPUID: u64 = 0xE000_ED00;

/// A board's chip.
struct BoardChip {
    /// The name that images have for it, probe-rs'.
    name: &'static str,
    /// CPUID, PARTNO.
    core: u16,
    /// Access port that leads to the chip's id.
    access_port: u8,
    /// Address of the chip's id.
    id_address: u64,
    /// DEV_ID.
    id: u16,
}

const CHIPS: [BoardChip; 2] = [
    // DBGMCU_IDCODE (RM0390, 33.6.1), of a Cortex-M4.
    BoardChip {
        name: "STM32F446RETx",
        core: 0xC24,
        access_port: 0,
        id_address: 0xE004_2000,
        id: 0x421,
    },
    // DBGMCU_IDC (RM0433, 60.5.8), of a Cortex-M7.
    BoardChip {
        name: "STM32H743ZITx",
        core: 0xC27,
        access_port: 2,
        id_address: 0xE00E_1000,
        id: 0x450,
    },
];

/// Ids that a chip has answered with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ids {
    /// CPUID, PARTNO.
    core: u16,
    /// DEV_ID, where a board's chip with this core has it.
    id: Option<u16>,
}

/// Reads the ids of a chip. Its core runs on.
pub(super) fn read(interface: &mut dyn ArmDebugInterface) -> Result<Ids, ArmError> {
    let cpuid = interface.memory_interface(&CORE)?.read_word_32(CPUID)?;
    let core = (cpuid >> 4 & 0xFFF) as u16;
    let id = match CHIPS.iter().find(|chip| chip.core == core) {
        Some(chip) => {
            let port = FullyQualifiedApAddress::v1_with_default_dp(chip.access_port);
            let mut memory = interface.memory_interface(&port)?;
            Some((memory.read_word_32(chip.id_address)? & 0xFFF) as u16)
        }
        None => None,
    };
    Ok(Ids { core, id })
}

/// Checks that a chip is the one that an image is for. Chips of other boards are not known here, and pass.
///
/// # Errors
/// Another chip.
pub(super) fn check(expected: &str, ids: Ids) -> anyhow::Result<()> {
    let is_it = |chip: &&BoardChip| chip.core == ids.core && Some(chip.id) == ids.id;
    let found = CHIPS.iter().find(is_it);
    if !CHIPS.iter().any(|chip| chip.name == expected)
        || found.is_some_and(|chip| chip.name == expected)
    {
        return Ok(());
    }
    let found = match (found, ids.id) {
        (Some(chip), _) => chip.name.to_owned(),
        (None, Some(id)) => format!("one with the id {id:#05x}"),
        (None, None) => format!("one with the core {:#05x}", ids.core),
    };
    bail!(
        "the image is for {expected}, and the chip is {found}: nothing was erased; give the image of this board"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    // CPUID and DEV_ID as RM0390 and RM0433 print them; an STM32F411 (RM0383) and a Cortex-M33.
    const F446: Ids = Ids {
        core: 0xC24,
        id: Some(0x421),
    };
    const H743: Ids = Ids {
        core: 0xC27,
        id: Some(0x450),
    };
    const F411: Ids = Ids {
        core: 0xC24,
        id: Some(0x431),
    };
    const M33: Ids = Ids {
        core: 0xD21,
        id: None,
    };

    #[test]
    fn each_board_takes_its_own_image() {
        check("STM32F446RETx", F446).unwrap();
        check("STM32H743ZITx", H743).unwrap();
    }

    #[test]
    fn the_image_of_another_board_is_refused_by_both_names() {
        let refused = |image, ids| check(image, ids).unwrap_err().to_string();
        let said = refused("STM32F446RETx", H743);
        assert!(
            said.contains("for STM32F446RETx, and the chip is STM32H743ZITx"),
            "{said}"
        );
        assert!(said.contains("nothing was erased"), "{said}");
        let said = refused("STM32H743ZITx", F446);
        assert!(said.contains("the chip is STM32F446RETx"), "{said}");
        assert!(refused("STM32F446RETx", F411).contains("id 0x431"));
        assert!(refused("STM32H743ZITx", M33).contains("core 0xd21"));
    }

    #[test]
    fn a_chip_of_an_own_board_is_not_compared() {
        check("nRF52840_xxAA", F446).unwrap();
    }

    #[test]
    fn probe_rs_knows_the_chip_of_each_board() {
        let registry = probe_rs::config::Registry::from_builtin_families();
        for chip in CHIPS {
            assert_eq!(
                registry.get_target_by_name(chip.name).unwrap().name,
                chip.name
            );
        }
    }
}
