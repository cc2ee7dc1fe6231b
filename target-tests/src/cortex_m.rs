//! Cycles of an instruction on a Cortex-M3 or M4F, by its name: the tables of the cores' technical reference manuals (ARM DDI 0337
//! and DDI 0439, "processor instruction timings"), the largest figure wherever they give a range.

use xtask::image::Scalar;
use xtask::listing::Instruction;

/// Cycles that a change of the program counter adds: the pipeline is refilled.
pub(crate) const REFILL: u32 = 3;
/// Cycles from an exception to its first instruction, and from its last one back, with all floating-point registers saved.
pub(crate) const ENTRY_AND_RETURN: u32 = 29 + 27;

/// A core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Core {
    /// Cortex-M3: long products take longer.
    M3,
    /// Cortex-M4 with a floating-point unit.
    M4F,
}

impl Core {
    /// The core for which images of a number type are built.
    pub(crate) fn of(scalar: Scalar) -> Self {
        match scalar {
            Scalar::F32 => Self::M4F,
            Scalar::Fixed => Self::M3,
        }
    }

    /// Largest number of cycles of an instruction, without the refill of a branch that is taken and without wait states. `next` is
    /// the one that follows in memory: it waits if it uses a floating-point result at once.
    pub(crate) fn cycles(self, instruction: &Instruction, next: Option<&Instruction>) -> u32 {
        let name = instruction.mnemonic.as_str();
        let is = |prefixes: &[&str]| prefixes.iter().any(|prefix| name.starts_with(prefix));
        let words = || registers(&instruction.operands);
        if name.starts_with('v') {
            let waits = u32::from(next.is_some_and(|next| uses_result(instruction, next)));
            return match () {
                () if is(&["vdiv", "vsqrt"]) => 14 + waits,
                () if is(&["vmla", "vmls", "vnmla", "vnmls", "vfma", "vfms"]) => 3 + waits,
                () if is(&["vpush", "vpop", "vldm", "vstm"]) => 1 + words(),
                () if is(&["vldr", "vstr"]) => 1 + words(),
                () if is(&["vadd", "vsub", "vmul", "vnmul", "vcvt"]) => 1 + waits,
                // Between two core registers and two others.
                () if is(&["vmov"]) && instruction.operands.matches(',').count() > 1 => 2,
                () => 1,
            };
        }
        match () {
            () if is(&["ldrd", "strd"]) => 3,
            () if is(&["ldm", "stm", "push", "pop"]) => 1 + words(),
            () if is(&["ldr", "str", "tbb", "tbh"]) => 2,
            () if is(&["sdiv", "udiv"]) => 12,
            () if is(&["smull", "umull", "smlal", "umlal"]) && self == Self::M3 => 7,
            () if is(&["mla", "mls"]) => 2,
            () if is(&["dsb", "dmb", "isb"]) => 4,
            () if is(&["mrs", "msr", "cps"]) => 2,
            () => 1,
        }
    }
}

/// True if the instruction reads a literal from where the code is.
pub(crate) fn reads_literal(instruction: &Instruction) -> bool {
    instruction.operands.contains("[pc")
}

/// Words that a list of registers, or a single one, stands for.
fn registers(operands: &str) -> u32 {
    let words = |name: &str| if name.starts_with('d') { 2 } else { 1 };
    let Some((_, list)) = operands.split_once('{') else {
        return words(operands);
    };
    let list = list.split('}').next().unwrap_or(list);
    list.split(',')
        .map(str::trim)
        .map(|item| match item.split_once('-') {
            Some((first, last)) => {
                let number = |name: &str| name.trim_start_matches(char::is_alphabetic).parse();
                let (first_number, last_number): (Result<u32, _>, Result<u32, _>) =
                    (number(first), number(last));
                let count = match (first_number, last_number) {
                    (Ok(first), Ok(last)) => last.saturating_sub(first) + 1,
                    // r4-fp and the like: all that there are.
                    _ => 12,
                };
                count * words(first)
            }
            None => words(item),
        })
        .sum()
}

fn uses_result(instruction: &Instruction, next: &Instruction) -> bool {
    let Some((result, _)) = instruction.operands.split_once(',') else {
        return false;
    };
    next.mnemonic.starts_with('v')
        && next
            .operands
            .split([',', ' ', '{', '}'])
            .any(|operand| operand == result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn instruction(mnemonic: &str, operands: &str) -> Instruction {
        Instruction {
            address: 0,
            mnemonic: mnemonic.into(),
            operands: operands.into(),
        }
    }

    #[test]
    fn instructions_take_what_the_manual_says() {
        for (mnemonic, operands, cycles) in [
            ("adds", "r0, r1, #1", 1),
            ("bic", "r0, r1, r2", 1),
            ("ldr", "r0, [r1, #4]", 2),
            ("ldrd", "r0, r1, [r2]", 3),
            ("push", "{r4, r5, r6, r7, lr}", 6),
            ("ldmia", "sp!, {r4-r8, pc}", 7),
            ("vpush", "{d8-d10}", 7),
            ("vldr", "s0, [r0, #8]", 2),
            ("vldr", "d0, [r0, #8]", 3),
            ("vdiv.f32", "s0, s1, s2", 14),
            ("vmul.f32", "s0, s1, s2", 1),
            ("vmov", "r0, r1, d0", 2),
            ("vmov.f32", "s0, s1", 1),
            ("udiv", "r0, r1, r2", 12),
        ] {
            let found = Core::M4F.cycles(&instruction(mnemonic, operands), None);
            assert_eq!(found, cycles, "{mnemonic} {operands}");
        }
        let long = instruction("smull", "r0, r1, r2, r3");
        assert_eq!(Core::M4F.cycles(&long, None), 1);
        assert_eq!(Core::M3.cycles(&long, None), 7);
    }

    #[test]
    fn a_result_that_is_used_at_once_is_waited_for() {
        let product = instruction("vmul.f32", "s0, s1, s2");
        let sum = instruction("vadd.f32", "s3, s3, s0");
        let other = instruction("vadd.f32", "s10, s10, s11");
        assert_eq!(Core::M4F.cycles(&product, Some(&sum)), 2);
        assert_eq!(Core::M4F.cycles(&product, Some(&other)), 1);
    }
}
