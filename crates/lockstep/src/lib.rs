//! The channel between the emulated board and the host that simulates its stage: a memory shared by both.
//!
//! In lockstep, inputs and outputs of a tick lie in two rings of [`LOCKSTEP_TICKS`] records, at [`input_offset`] and
//! [`output_offset`]. The host writes the [`InputRecord`]s of one or several ticks and then the last one's number to
//! [`INPUT_SEQUENCE`]; the target runs these ticks, each with an interrupt of its own, and answers each with an
//! [`OutputRecord`] and its number in [`OUTPUT_SEQUENCE`]. A host that asks one tick at a time sees every answer before it
//! says what follows; one that asks several must know their inputs, as a simulation of the firmware does.
//!
//! In the recorded modes the inputs of all ticks lie in the memory beforehand and the outputs are collected there.
//! All words are little-endian; offsets are bytes from the start of the memory.

#![no_std]
#![forbid(unsafe_code)]

use strum::FromRepr;

use quadrant_law::command::Command;
use quadrant_law::encoder::EncoderReading;
use quadrant_law::safety::Switches;
use quadrant_law::stage::{Inputs, Outputs};
use quadrant_law::units::DacCode;

/// Address of the memory on the target: its PSRAM, which the host backs by a shared file.
pub const BASE: usize = 0x2100_0000;
/// Size of the memory.
pub const MEMORY_BYTES: usize = 16 << 20;

/// Number of the last answered tick, a word; the first tick's is 1.
pub const OUTPUT_SEQUENCE: usize = 0x00;
/// The outputs in force in lockstep, an [`OutputRecord`]: those of the last tick, or off, if the firmware has failed since.
pub const OUTPUT: usize = 0x10;
/// Number of the last asked tick, a word; [`END_OF_RUN`] ends the run.
pub const INPUT_SEQUENCE: usize = 0x80;
/// The [`BootBlock`].
pub const BOOT: usize = 0x100;
/// Number of the firmware's starts since the memory was made, a word. A firmware that has reset the processor
/// begins with tick number 1 again, and with empty rings.
pub const STARTS: usize = 0x110;
/// Number of resets that a failed firmware may still perform, a word; at zero it ends the emulator.
pub const RESETS_LEFT: usize = 0x114;
/// The cause of the processor's reset, a [`Reset`]; the firmware reads it once.
pub const RESET: usize = 0x118;
/// The fault to inject, an [`InjectedFault`].
pub const INJECTED_FAULT: usize = 0x11C;
/// The tick of the injected fault: instead of it in lockstep, after it in a paced run; a word.
pub const INJECTED_FAULT_TICK: usize = 0x120;
/// The clock, which counts down, when a firmware began to hang, a word.
pub const HANGS_FROM: usize = 0x124;
/// The clock the last time that a hanging firmware looked at it, a word.
pub const HANGS_UNTIL: usize = 0x128;
/// The job: a postcard-encoded `Job` of `quadrant-settings`.
pub const JOB: usize = 0x200;
/// Largest encoded job.
pub const JOB_BYTES: usize = 0x7E00;
/// Bytes that the host has written to the link's port since the start, a word.
pub const LINK_IN_WRITTEN: usize = 0x8000;
/// Bytes of these that the target had read when it took the last inputs, a word.
pub const LINK_IN_TAKEN: usize = 0x8004;
/// Bytes that the target had written to its port when it took the last inputs, a word.
pub const LINK_OUT_SHOWN: usize = 0x8008;
/// Bytes of these that the host has read, a word.
pub const LINK_OUT_TAKEN: usize = 0x800C;
/// Size of each of the port's rings.
pub const LINK_BYTES: usize = 0x400;
/// The ring of bytes to the target.
pub const LINK_IN: usize = 0x8400;
/// The ring of bytes to the host.
pub const LINK_OUT: usize = 0x8800;
/// Size of the flash for settings: two sectors.
pub const FLASH_BYTES: usize = 0x8000;
/// The flash for settings, every byte inverted.
pub const FLASH: usize = 0x9000;
/// The recorded inputs, an [`InputRecord`] a tick; in lockstep a ring of them.
pub const RECORDED_INPUTS: usize = 0x1_1000;
/// The collected outputs, an [`OutputRecord`] a tick; in lockstep a ring of them.
pub const RECORDED_OUTPUTS: usize = 0xCD_1000;
/// The sequence number that ends a run.
pub const END_OF_RUN: u32 = u32::MAX;
/// Most ticks that a recorded run can hold.
pub const RECORDED_TICKS: usize = (MEMORY_BYTES - RECORDED_OUTPUTS) / OutputRecord::BYTES;

/// Most ticks in lockstep that are asked and not answered: 0.8 s at 10 kHz. A power of two.
pub const LOCKSTEP_TICKS: u32 = 1 << 13;

const _: () =
    assert!(LOCKSTEP_TICKS.is_power_of_two() && LOCKSTEP_TICKS as usize <= RECORDED_TICKS);
const _: () = assert!(LINK_OUT + LINK_BYTES <= FLASH && FLASH + FLASH_BYTES <= RECORDED_INPUTS);
const _: () = assert!(RECORDED_INPUTS + RECORDED_TICKS * InputRecord::BYTES <= RECORDED_OUTPUTS);

/// Offset of the inputs of a tick in lockstep; the first tick's number is 1.
#[inline(always)]
pub const fn input_offset(tick: u32) -> usize {
    RECORDED_INPUTS + InputRecord::BYTES * place(tick)
}

/// Offset of the outputs of a tick in lockstep; the first tick's number is 1.
#[inline(always)]
pub const fn output_offset(tick: u32) -> usize {
    RECORDED_OUTPUTS + OutputRecord::BYTES * place(tick)
}

/// The place of a tick in the rings.
#[inline(always)]
const fn place(tick: u32) -> usize {
    (tick.wrapping_sub(1) % LOCKSTEP_TICKS) as usize
}

/// The source of the control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromRepr)]
#[repr(u32)]
pub enum Mode {
    /// Each tick that the host asks.
    Lockstep = 0,
    /// The hardware timer, on recorded inputs.
    Paced = 1,
    /// The end of the last tick, on recorded inputs.
    Unpaced = 2,
}

/// The parameters of a run, which the target reads at boot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BootBlock {
    /// The source of the control interrupt.
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
        let mode = Mode::from_repr(mode)?;
        (magic == Self::MAGIC && job_bytes as usize <= JOB_BYTES).then_some(Self {
            mode,
            ticks,
            job_bytes,
        })
    }
}

/// The cause of the emulated processor's reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromRepr)]
#[repr(u32)]
pub enum Reset {
    /// It was not: it has just been switched on.
    PowerOn = 0,
    /// The watchdog was not fed.
    Watchdog = 1,
    /// The firmware asked for it.
    Software = 2,
}

impl Reset {
    /// The cause of a word.
    pub fn from_word(word: u32) -> Self {
        Self::from_repr(word).unwrap_or(Self::PowerOn)
    }
}

/// A fault that a host injects into the idle loop of an emulated firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromRepr)]
#[repr(u32)]
pub enum InjectedFault {
    /// Panics.
    Panic = 1,
    /// Executes an undefined instruction.
    UndefinedInstruction = 2,
    /// Reads an address without memory.
    BusError = 3,
    /// Recurses until the stack is full.
    StackOverflow = 4,
    /// Requests an interrupt without a handler.
    StrayInterrupt = 5,
    /// Loops indefinitely with interrupts masked.
    Hang = 6,
    /// Masks interrupts for a control period and a half, where a clock paces the run.
    LateTick = 7,
}

/// The inputs of one tick, from the host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputRecord {
    /// The encoders' readings.
    pub readings: [EncoderReading; 3],
    /// The digital inputs.
    pub switches: Switches,
    /// True if the host that started the motion has fallen silent.
    pub link_lost: bool,
    /// True for converters with a stuck bit; see [`held`].
    pub stuck: [bool; 3],
    /// True if reading the encoders takes a whole control period, where a clock paces the run.
    pub slow: bool,
    /// A request to the supervising task.
    pub request: Option<Command>,
}

impl InputRecord {
    /// Encoded size.
    pub const BYTES: usize = 32;
    /// The word of the request.
    pub const REQUEST_WORD: usize = 3;

    /// The word of the flags; its low half are the switches.
    pub const FLAGS_WORD: usize = 4;

    /// First of three bits, x first, of index pulses in the flags' word.
    const INDEX_SEEN: u32 = 16;
    /// First of three bits of stale samples.
    const STALE: u32 = 19;
    /// First of three bits of invalid encoder readings.
    const INVALID: u32 = 22;
    /// Bit of a lost link.
    const LINK_LOST: u32 = 25;
    /// First of three bits of stuck converters.
    const STUCK: u32 = 26;
    /// Bit of a slow reading of the encoders.
    const SLOW: u32 = 29;
    /// The flags beside the switches, one of which is seldom set.
    pub const SELDOM: u32 = !0 << Self::INDEX_SEEN;

    /// Fresh and valid raw counts and a request: a stage without switches and index pulses.
    #[inline]
    pub fn of_counts(counts: [u32; 3], request: Option<Command>) -> Self {
        Self {
            readings: counts.map(EncoderReading::of),
            request,
            ..Self::default()
        }
    }

    /// The tick's inputs; the request goes to the supervising task.
    #[inline(always)]
    pub fn inputs(&self) -> Inputs {
        Inputs {
            readings: self.readings.into(),
            switches: self.switches,
            link_lost: self.link_lost,
            ..Inputs::default()
        }
    }

    /// Decodes the stuck converters from the word of the flags.
    #[inline(always)]
    pub fn stuck_of(flags: u32) -> [bool; 3] {
        [0, 1, 2].map(|bit| flags >> (Self::STUCK + bit) & 1 == 1)
    }

    /// The record as words: three counts, the request, the flags, three latched counts.
    pub fn encode(&self) -> [u8; Self::BYTES] {
        let mut flags = u32::from(self.switches.bits());
        for (bit, reading) in self.readings.iter().enumerate() {
            flags |= u32::from(reading.index.is_some()) << (Self::INDEX_SEEN as usize + bit);
            flags |= u32::from(!reading.fresh) << (Self::STALE as usize + bit);
            flags |= u32::from(!reading.valid) << (Self::INVALID as usize + bit);
            flags |= u32::from(self.stuck[bit]) << (Self::STUCK as usize + bit);
        }
        flags |= u32::from(self.link_lost) << Self::LINK_LOST;
        flags |= u32::from(self.slow) << Self::SLOW;
        let [x, y, z] = self.readings.map(|reading| reading.count);
        let [at_x, at_y, at_z] = self.readings.map(|reading| reading.index.unwrap_or(0));
        let request = self.request.and_then(Command::number).unwrap_or(0);
        words([x, y, z, request, flags, at_x, at_y, at_z])
    }

    /// The record of words.
    pub fn decode(bytes: &[u8; Self::BYTES]) -> Self {
        Self::from_words(unwords(bytes))
    }

    /// The record of words as the memory holds them.
    #[inline(always)]
    pub fn from_words(words: [u32; Self::BYTES / 4]) -> Self {
        let [x, y, z, request, flags, at_x, at_y, at_z] = words;
        let is_set = |lowest: u32, bit: u32| flags >> (lowest + bit) & 1 == 1;
        let reading = |count, latched, bit| EncoderReading {
            count,
            index: is_set(Self::INDEX_SEEN, bit).then_some(latched),
            fresh: !is_set(Self::STALE, bit),
            valid: !is_set(Self::INVALID, bit),
        };
        Self {
            readings: [
                reading(x, at_x, 0),
                reading(y, at_y, 1),
                reading(z, at_z, 2),
            ],
            switches: Switches::from_bits(flags as u16),
            link_lost: is_set(Self::LINK_LOST, 0),
            stuck: Self::stuck_of(flags),
            slow: is_set(Self::SLOW, 0),
            request: Command::from_number(request),
        }
    }
}

/// The bit of a converter's word that sticks at one: 1.25 V of 10 V.
const STUCK_BIT: i16 = 1 << 12;

/// The codes that the converters hold: those written, but for a stuck bit.
#[inline(always)]
pub fn held(codes: [DacCode; 3], stuck: [bool; 3]) -> [DacCode; 3] {
    let [x, y, z] = codes;
    let [at_x, at_y, at_z] = stuck;
    let held = |code: DacCode, sticks| DacCode(code.0 | if sticks { STUCK_BIT } else { 0 });
    [held(x, at_x), held(y, at_y), held(z, at_z)]
}

/// The outputs of one tick, from the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutputRecord {
    /// The codes that the converters hold, the amplifiers' enable, and the brake's current.
    pub outputs: Outputs,
}

impl OutputRecord {
    /// Encoded size.
    pub const BYTES: usize = 8;

    /// The record as words.
    #[inline(always)]
    pub fn words(&self) -> [u32; 2] {
        let [x, y, z] = (*self.outputs.codes).map(|code| u32::from(code.0 as u16));
        [
            x | y << 16,
            z | u32::from(self.outputs.enabled) << 16
                | u32::from(self.outputs.brake_released) << 17,
        ]
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
                codes: [code(low), code(low >> 16), code(high)].into(),
                enabled: high >> 16 & 1 == 1,
                brake_released: high >> 17 & 1 == 1,
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
