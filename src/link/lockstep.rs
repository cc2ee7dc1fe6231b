//! The channel between the emulated board and the host that plays its stage: a memory both see.
//!
//! One exchange per control tick. The host writes an [`InputRecord`] and then its number to
//! [`INPUT_SEQUENCE`]; the target answers with an [`OutputRecord`] and the same number in [`OUTPUT_SEQUENCE`]. In the
//! recorded modes the inputs of all ticks lie in the memory beforehand and the outputs are collected there.
//! All words are little-endian; offsets are bytes from the start of the memory.

use serde::{Deserialize, Serialize};

use crate::safety::Command;
use crate::settings::{PlanSettings, StageSettings};
use crate::stage::Outputs;
use crate::units::DacCode;

/// Size of the memory.
pub const MEMORY_BYTES: usize = 16 << 20;

/// Number of the last answered exchange, a word.
pub const OUTPUT_SEQUENCE: usize = 0x00;
/// The answer: an [`OutputRecord`].
pub const OUTPUT: usize = 0x10;
/// Number of the last asked exchange, a word; [`END_OF_RUN`] ends the run.
pub const INPUT_SEQUENCE: usize = 0x80;
/// The question: an [`InputRecord`].
pub const INPUT: usize = 0x90;
/// The [`BootBlock`].
pub const BOOT: usize = 0x100;
/// The job: a postcard-encoded [`Job`].
pub const JOB: usize = 0x200;
/// Largest encoded job.
pub const JOB_BYTES: usize = 0x7E00;
/// The recorded inputs, an [`InputRecord`] a tick.
pub const RECORDED_INPUTS: usize = 0x1_0000;
/// The collected outputs, an [`OutputRecord`] a tick.
pub const RECORDED_OUTPUTS: usize = 0xAC_0000;
/// The sequence number that ends a run.
pub const END_OF_RUN: u32 = u32::MAX;
/// Most ticks that a recorded run can hold.
pub const RECORDED_TICKS: usize = (MEMORY_BYTES - RECORDED_OUTPUTS) / OutputRecord::BYTES;

const _: () = assert!(RECORDED_INPUTS + RECORDED_TICKS * InputRecord::BYTES <= RECORDED_OUTPUTS);

/// What paces the control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Mode {
    /// Each exchange with the host.
    Lockstep = 0,
    /// The hardware timer, on recorded inputs.
    Paced = 1,
    /// The end of the last tick, on recorded inputs.
    Unpaced = 2,
}

/// What the target finds at boot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootBlock {
    /// What paces the run.
    pub mode: Mode,
    /// Ticks of a recorded run.
    pub ticks: u32,
    /// Bytes of the encoded job.
    pub job_bytes: u32,
}

impl BootBlock {
    /// Encoded size.
    pub const BYTES: usize = 16;
    /// Marks a memory that a host has prepared: "QUAD".
    const MAGIC: u32 = 0x5155_4144;

    /// The block as words.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        words([Self::MAGIC, self.mode as u32, self.ticks, self.job_bytes])
    }

    /// The block, if a host has prepared the memory.
    pub fn decode(bytes: &[u8; Self::BYTES]) -> Option<Self> {
        let [magic, mode, ticks, job_bytes] = unwords(bytes);
        let mode = match mode {
            0 => Mode::Lockstep,
            1 => Mode::Paced,
            2 => Mode::Unpaced,
            _ => return None,
        };
        (magic == Self::MAGIC && job_bytes as usize <= JOB_BYTES).then_some(Self {
            mode,
            ticks,
            job_bytes,
        })
    }
}

/// What the target is to run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// The control law.
    pub stage: StageSettings,
    /// The motions.
    pub plan: PlanSettings,
}

/// What the host tells the target for one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputRecord {
    /// The encoders' raw counters.
    pub counts: [u32; 3],
    /// A request to the supervising task.
    pub request: Option<Command>,
}

impl InputRecord {
    /// Encoded size.
    pub const BYTES: usize = 16;

    /// The record as words.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let [x, y, z] = self.counts;
        words([x, y, z, self.request.map_or(0, Command::number)])
    }

    /// The record of words.
    #[inline(always)]
    pub fn decode(bytes: &[u8; Self::BYTES]) -> Self {
        let [x, y, z, request] = unwords(bytes);
        Self {
            counts: [x, y, z],
            request: Command::from_number(request),
        }
    }
}

/// What the target tells the host of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputRecord {
    /// What the stage put out.
    pub outputs: Outputs,
}

impl OutputRecord {
    /// Encoded size.
    pub const BYTES: usize = 8;

    /// The record as words.
    #[inline(always)]
    pub fn words(&self) -> [u32; 2] {
        let [x, y, z] = self.outputs.codes.map(|code| u32::from(code.0 as u16));
        [x | y << 16, z | u32::from(self.outputs.enabled) << 16]
    }

    /// The record as bytes.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        words(self.words())
    }

    /// The record of words.
    pub fn decode(bytes: &[u8; Self::BYTES]) -> Self {
        let [low, high]: [u32; 2] = unwords(bytes);
        let code = |word: u32| DacCode(word as u16 as i16);
        Self {
            outputs: Outputs {
                codes: [code(low), code(low >> 16), code(high)],
                enabled: high >> 16 & 1 == 1,
            },
        }
    }
}

#[inline(always)]
fn words<const WORDS: usize, const BYTES: usize>(words: [u32; WORDS]) -> [u8; BYTES] {
    const { assert!(BYTES == 4 * WORDS) };
    let mut bytes = [0; BYTES];
    for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
        chunk.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

#[inline(always)]
fn unwords<const WORDS: usize, const BYTES: usize>(bytes: &[u8; BYTES]) -> [u32; WORDS] {
    const { assert!(BYTES == 4 * WORDS) };
    core::array::from_fn(|index| {
        u32::from_le_bytes(core::array::from_fn(|byte| bytes[4 * index + byte]))
    })
}
