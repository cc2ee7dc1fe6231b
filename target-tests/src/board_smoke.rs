//! `cargo xtask board-smoke`: the reference board's own image in QEMU's model of a near relative of its chip.
//!
//! QEMU's STM32F405 has the memory map, the SPI and the processor, and nothing behind RCC, GPIO, DMA, TIM1, TIM7 and the watchdog:
//! those read as zero. Two things are done for it from the debugger's port: flags that the clock set-up waits for read as
//! ones, and the control interrupt is made pending as TIM7 would.

use std::fs;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use quadrant_host::machine::emulator::Program;
use xtask::command;
use xtask::image::{self, Board, Image, Scalar, Target};
use xtask::toolchain::Toolchain;

use crate::gdb::{Debugger, PROGRAM_COUNTER, Port, STACK_POINTER};

/// QEMU's machine with an STM32F405.
const MACHINE: &str = "netduinoplus2";
/// RCC and PWR: what the clock set-up waits for.
const CLOCK_REGISTERS: [std::ops::Range<u32>; 2] =
    [0x4002_3800..0x4002_3C00, 0x4000_7000..0x4000_7400];
/// Instructions that are examined for a wait.
const INSTRUCTIONS: usize = 40;
/// Largest number of looks.
const LOOKS: usize = 40;
/// Control ticks to run.
const TICKS: u32 = 100;
/// Least number of runs of the supervising task and the server in them.
const POLLS: u32 = 9;
/// Timeout of the first tick, in the host's time: settings are built before it, with interrupts masked.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Address of NVIC_ISPR1.
const SET_PENDING: u32 = 0xE000_E204;
/// Bit of TIM7 in it.
const TIM7: u32 = 1 << (55 - 32);
/// `str r0, [r1]` and a branch to itself.
const PEND: [u8; 4] = [0x08, 0x60, 0xFE, 0xE7];
/// Address of these instructions: the bottom of the stack, which is unused.
const SCRATCH: u32 = 0x2000_0000;
/// Lines that the log must have: the converter's memory holds zero instead of an answer, the flash was found empty and the board not
/// commissioned, initialisation came to its end; and that a full stack ended it.
const EXPECTED: [&str; 6] = [
    "the converter answers 0x0000 instead of 0x0004",
    "quadrant ",
    "no settings are stored",
    "not commissioned: no axis is",
    "10000 control ticks per second, outputs off",
    "hard fault, outputs are off: the stack is full",
];
/// Lines that it must not have: the button reads as pressed here, but was never seen up.
const FORBIDDEN: [&str; 2] = ["outputs enabled", "request refused"];

/// The sectors of the settings, which are to be found erased: QEMU's flash is all zeros, and that is damaged.
const SETTINGS: (u32, usize) = (0x0800_4000, 32 * 1024);
/// Byte of an erased sector.
const ERASED: u8 = 0xFF;
/// File with what erased flash reads as.
const ERASED_FILE: &str = "target/xtask/erased-flash.bin";

/// QEMU, ended when dropped.
struct Machine(Child);

impl Drop for Machine {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Loads the image and stops before its first instruction.
fn start(image: &Image) -> Result<(Machine, Debugger)> {
    let mut qemu = command::command("qemu-system-arm");
    qemu.args(["-machine", MACHINE, "-nographic"]);
    qemu.args(["-monitor", "none", "-serial", "none"]);
    let port = Port::new();
    port.add_to(&mut qemu);
    qemu.arg("-kernel").arg(&image.path);
    let erased = command::root().join(ERASED_FILE);
    fs::create_dir_all(erased.parent().context("the file has a folder")?)?;
    fs::write(&erased, [ERASED].repeat(SETTINGS.1))?;
    qemu.arg("-device").arg(format!(
        "loader,file={},addr={:#x},force-raw=on",
        erased.display(),
        SETTINGS.0
    ));
    let child = qemu
        .stdout(Stdio::null())
        .spawn()
        .context("cannot start qemu-system-arm: `cargo xtask setup` installs it")?;
    let machine = Machine(child);
    let debugger = port.connect()?;
    Ok((machine, debugger))
}

/// Builds the image, lets it start and tick, fills its stack, and checks what it logs.
pub(crate) fn run(toolchain: Toolchain) -> Result<()> {
    let image = image::build(toolchain, Target::new(Board::NucleoF446re, Scalar::F32))?;
    let (_machine, mut debugger) = start(&image)?;
    pass_clock_setup(&mut debugger)?;
    let mut log = Log::of(&image)?;
    log.read(&mut debugger)?;
    debugger.write(SCRATCH, &PEND)?;
    for _ in 0..TICKS {
        tick(&mut debugger)?;
    }
    // The last one has been taken, and ends on a busy host, too.
    let count = image.variable("TICK")?;
    let begun = Instant::now();
    while debugger.word(count)? < TICKS && begun.elapsed() < TIMEOUT {
        debugger.run(Duration::from_millis(5))?;
    }
    log.read(&mut debugger)?;
    overflow(&mut debugger, &mut log)?;
    let ticked = debugger.word(count)?;
    let polled = debugger.word(image.variable("POLLS")?)?;
    println!("{ticked} control ticks, {polled} polls of the server");
    ensure!(
        ticked == TICKS && polled >= POLLS,
        "expected {TICKS} ticks and at least {POLLS} polls"
    );
    let lines = log.lines(&image)?;
    for words in EXPECTED {
        ensure!(
            lines.iter().any(|line| line.contains(words)),
            "the log does not say `{words}`:\n{}",
            lines.join("\n")
        );
    }
    for words in FORBIDDEN {
        ensure!(
            !lines.iter().any(|line| line.contains(words)),
            "the log says `{words}`, though nobody pressed the button"
        );
    }
    Ok(())
}

/// Runs on until the processor no longer waits for a clock.
fn pass_clock_setup(debugger: &mut Debugger) -> Result<()> {
    for _ in 0..LOOKS {
        debugger.run(Duration::from_millis(250))?;
        let mut is_waiting = false;
        for _ in 0..INSTRUCTIONS {
            let load = loaded(debugger)?;
            debugger.step()?;
            if let Some((register, address)) = load
                && CLOCK_REGISTERS.iter().any(|range| range.contains(&address))
            {
                debugger.set_register(register, u32::MAX)?;
                is_waiting = true;
            }
        }
        if !is_waiting {
            return Ok(());
        }
    }
    bail!("the image still waits for its clocks")
}

/// The register that the next instruction loads, and from which address, if it is `LDR` with an immediate offset.
fn loaded(debugger: &mut Debugger) -> Result<Option<(usize, u32)>> {
    let at = debugger.register(PROGRAM_COUNTER)?;
    let word = debugger.word(at)?;
    let Some((register, base, offset)) = decode_load(word as u16, (word >> 16) as u16) else {
        return Ok(None);
    };
    let base = debugger.register(base)?;
    Ok(Some((register, base.wrapping_add_signed(offset))))
}

/// Target, base and offset of a load: encodings T1, T3 and T4 of `LDR (immediate)`, the last with a negative offset.
fn decode_load(first: u16, second: u16) -> Option<(usize, usize, i32)> {
    let nibble = |half: u16, shift: u32| usize::from(half >> shift & 0xF);
    match first {
        _ if first & 0xF800 == 0x6800 => Some((
            nibble(first, 0) & 7,
            nibble(first, 3) & 7,
            4 * i32::from(first >> 6 & 0x1F),
        )),
        _ if first & 0xFFF0 == 0xF8D0 => Some((
            nibble(second, 12),
            nibble(first, 0),
            i32::from(second & 0xFFF),
        )),
        _ if first & 0xFFF0 == 0xF850 && second & 0x0F00 == 0x0C00 => Some((
            nibble(second, 12),
            nibble(first, 0),
            -i32::from(second & 0xFF),
        )),
        _ => None,
    }
}

/// Makes the control interrupt pending.
fn pend(debugger: &mut Debugger) -> Result<()> {
    let before = [0, 1, PROGRAM_COUNTER].map(|number| (number, debugger.register(number)));
    debugger.set_register(0, TIM7)?;
    debugger.set_register(1, SET_PENDING)?;
    debugger.set_register(PROGRAM_COUNTER, SCRATCH)?;
    debugger.step()?;
    for (number, value) in before {
        debugger.set_register(number, value?)?;
    }
    Ok(())
}

/// Lets the control interrupt and what it spawns run.
fn tick(debugger: &mut Debugger) -> Result<()> {
    pend(debugger)?;
    let begun = Instant::now();
    while begun.elapsed() < TIMEOUT {
        debugger.run(Duration::from_millis(5))?;
        if debugger.word(SET_PENDING)? & TIM7 == 0 {
            return Ok(());
        }
    }
    bail!("the control interrupt is not taken within {TIMEOUT:?}")
}

/// Lets the control interrupt meet a stack that is full, until the fault's handler has spoken.
fn overflow(debugger: &mut Debugger, log: &mut Log) -> Result<()> {
    debugger.set_register(STACK_POINTER, SCRATCH + 16)?;
    pend(debugger)?;
    let begun = Instant::now();
    while begun.elapsed() < TIMEOUT {
        debugger.run(Duration::from_millis(5))?;
        let so_far = log.bytes.len();
        log.read(debugger)?;
        if log.bytes.len() > so_far {
            return Ok(());
        }
    }
    bail!("a full stack is no fault")
}

/// The log's ring in the image's RAM: SEGGER's RTT, one channel up.
struct Log {
    channel: u32,
    bytes: Vec<u8>,
}

impl Log {
    fn of(image: &Image) -> Result<Self> {
        // Behind the name, and the numbers of channels up and down.
        let channel = u32::try_from(image.symbol("_SEGGER_RTT")?)? + 24;
        Ok(Self {
            channel,
            bytes: Vec::new(),
        })
    }

    /// Takes the bytes that have come, as a probe does.
    fn read(&mut self, debugger: &mut Debugger) -> Result<()> {
        let buffer = debugger.word(self.channel + 4)?;
        let size = debugger.word(self.channel + 8)?;
        let end = debugger.word(self.channel + 12)?;
        let mut next = debugger.word(self.channel + 16)?;
        ensure!(
            size > 0 && end < size && next < size,
            "the image has no log: {size} bytes, {next} to {end}"
        );
        while next != end {
            self.bytes.extend(debugger.read(buffer + next, 1)?);
            next = (next + 1) % size;
        }
        debugger.write(self.channel + 16, &end.to_le_bytes())
    }

    /// The lines, printed as well.
    fn lines(&self, image: &Image) -> Result<Vec<String>> {
        let lines = Program::read(&image.path)?.decode_log(&self.bytes);
        for line in &lines {
            println!("  firmware: {line}");
        }
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_are_distinguished_from_other_instructions() {
        // ldr r2, [r1, #4]; ldr.w r12, [r3, #64]; ldr.w r0, [r4, #-8]; movs r0, #1; str r0, [r1].
        assert_eq!(decode_load(0x684A, 0), Some((2, 1, 4)));
        assert_eq!(decode_load(0xF8D3, 0xC040), Some((12, 3, 64)));
        assert_eq!(decode_load(0xF854, 0x0C08), Some((0, 4, -8)));
        assert_eq!(decode_load(0x2001, 0), None);
        assert_eq!(decode_load(0x6008, 0), None);
    }
}
