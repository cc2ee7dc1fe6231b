//! A board: chip, crystal, converter, link, and what is wired to its pins.

use std::collections::VecDeque;
use std::num::{NonZeroU32, NonZeroU64};
use std::sync::{Arc, Mutex};

use rigless::chip::{Timeline, uart};
use rigless::device::{DeviceContext, Level, RegisterFile};
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::{Error as SnapshotError, Reader, Store, Writer};
use rigless::soc::st::gpio::Pin;
use rigless::soc::st::tim::Channel;
use rigless::soc::stm32f427::{self, Stm32f427};
use rigless::soc::stm32h743::{self, Stm32h743};
use rigless::soc::{Error, Width};
use rigless::time::VirtualNanos;

use crate::ad5754r::{End, Shared, Wire};
use crate::bench::Subject;
use crate::biss::{CableEnd, SharedEncoder};
use crate::wiring::{At, Family, TimerModel, Wiring};

/// Rate that the debug probe feeds to OSC_IN, Hz.
pub const HSE_HZ: u64 = 8_000_000;
/// Offset of a timer's counter.
pub const COUNTER: u64 = 0x24;
/// Offset of what a timer has captured on its third channel.
const CAPTURED: u64 = 0x3C;

/// Far end of the link's line.
#[derive(Debug, Default)]
pub struct Line {
    /// Bytes on their way to the board.
    pub to_board: VecDeque<u8>,
    /// Bytes that the board has sent.
    pub from_board: VecDeque<u8>,
}

/// The line, shared by the port and the scenario.
pub type SharedLine = Arc<Mutex<Line>>;

#[derive(Debug)]
struct LineEnd(SharedLine);

impl Store for LineEnd {
    fn store(&self, _: &mut Writer) -> Result<(), SnapshotError> {
        Ok(())
    }

    fn load(&mut self, _: &mut Reader) -> Result<(), SnapshotError> {
        Ok(())
    }
}

impl uart::Peer for LineEnd {
    fn receive(&mut self, word: u16, _: &mut Timeline<'_, '_>) {
        self.0
            .lock()
            .expect("the line")
            .from_board
            .push_back(word as u8);
    }

    fn transmit(&mut self, _: VirtualNanos) -> Option<u16> {
        self.0
            .lock()
            .expect("the line")
            .to_board
            .pop_front()
            .map(u16::from)
    }
}

/// An input of a timer, at its pin.
struct TimerInput {
    at: At,
    /// The alternate function that leads the pin to the timer.
    function: u8,
    timer: TimerModel,
    channel: u8,
}

/// The chip.
#[derive(Debug)]
pub enum Chip {
    /// An STM32F427 in the place of an STM32F446.
    F4(Box<Stm32f427>),
    /// An STM32H743.
    H7(Box<Stm32h743>),
}

/// The board.
#[derive(Debug)]
pub struct Nucleo {
    chip: Chip,
    instructions_per_s: u64,
    /// Its wiring.
    pub wiring: &'static Wiring,
}

impl Store for Nucleo {
    fn store(&self, to: &mut Writer) -> Result<(), SnapshotError> {
        match &self.chip {
            Chip::F4(chip) => chip.store(to),
            Chip::H7(chip) => chip.store(to),
        }
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), SnapshotError> {
        match &mut self.chip {
            Chip::F4(chip) => chip.load(from),
            Chip::H7(chip) => chip.load(from),
        }
    }
}

/// Hangs the converter's wires, the link's line and a serial encoder on a chip, and fits crystal and supply.
macro_rules! fit {
    ($chip:expr, $family:ident, $wiring:expr, $converter:expr, $line:expr, $encoder:expr, $hse_hz:expr) => {{
        $chip.rcc.attach_crystals($hse_hz, 0);
        $chip.set_supply(3300);
        // /LDAC and /CLR are no chip selects of the bus; an SPI that is not used reports their edges.
        let [bus, unused] = $wiring.spi;
        let wires = [(bus, Wire::Bus), (unused, Wire::Ldac), (unused, Wire::Clr)];
        for ((spi, wire), pin) in wires.into_iter().zip($wiring.converter_pins) {
            let select = $family::peripherals::spi::Select {
                port: $wiring.converter_port,
                pin: pin_of(pin),
                active: wire.active(),
            };
            $chip.spi[spi].attach_selected(End::new(wire, $converter), select);
        }
        $chip.spi[$wiring.serial_spi].attach(CableEnd($encoder.clone()));
        $chip.usart[$wiring.usart].attach(LineEnd($line.clone()));
    }};
}

impl Nucleo {
    /// A board with a converter, a link's line, a serial encoder, and a rate at OSC_IN, Hz.
    pub fn new(
        subject: &Subject,
        converter: &Shared,
        line: &SharedLine,
        encoder: &SharedEncoder,
        hse_hz: u64,
    ) -> Result<Self, Error> {
        let wiring = subject.board;
        let chip = match wiring.family {
            Family::F4 => {
                let mut chip = Box::new(Stm32f427::new()?);
                fit!(chip, stm32f427, wiring, converter, line, encoder, hse_hz);
                Chip::F4(chip)
            }
            Family::H7 => {
                let mut chip = Box::new(Stm32h743::new()?);
                fit!(chip, stm32h743, wiring, converter, line, encoder, hse_hz);
                Chip::H7(chip)
            }
        };
        Ok(Self {
            chip,
            wiring,
            instructions_per_s: subject.instructions_per_s,
        })
    }

    /// The level of a pin.
    pub fn level(&mut self, At(port, pin): At) -> bool {
        let level = match &mut self.chip {
            Chip::F4(chip) => {
                let (gpio, registers) = chip.port(port);
                gpio.level(pin_of(pin), registers)
            }
            Chip::H7(chip) => {
                let (gpio, registers) = chip.port(port);
                gpio.level(pin_of(pin), registers)
            }
        };
        level == Level::High
    }

    /// The level of the amplifiers' enable line.
    pub fn is_enabled(&mut self) -> bool {
        self.level(self.wiring.enable)
    }

    /// Drives a pin from outside; an output of the chip is stronger.
    pub fn drive(&mut self, now: VirtualNanos, At(port, pin): At, high: bool) {
        let (pin, level) = (pin_of(pin), Some(Level::from(high)));
        match &mut self.chip {
            Chip::F4(chip) => chip.drive_port(now, port, |gpio, registers, context| {
                gpio.drive(pin, level, registers, context);
            }),
            Chip::H7(chip) => chip.drive_port(now, port, |gpio, registers, context| {
                gpio.drive(pin, level, registers, context);
            }),
        }
    }

    /// Drives what is connected as a machine at rest does: contacts closed, button up, pull-downs.
    pub fn drive_all(&mut self, now: VirtualNanos) {
        let wiring = self.wiring;
        let closed = [wiring.emergency_stop, wiring.ready];
        let low = closed
            .iter()
            .chain(&wiring.faults)
            .chain(&wiring.limits)
            .chain(&wiring.homes)
            .chain(&wiring.pulled_down);
        for &at in low {
            self.drive(now, at, false);
        }
        let (button, up) = wiring.button;
        self.drive(now, button, up);
    }

    /// Drives a line of an encoder: A, B, index.
    pub fn encoder_line(&mut self, now: VirtualNanos, axis: usize, line: usize, high: bool) {
        let encoder = self.wiring.encoders[axis];
        let input = TimerInput {
            at: encoder.lines[line],
            function: encoder.function,
            timer: encoder.timer,
            channel: line as u8 + 1,
        };
        self.timer_line(now, input, high);
    }

    /// Drives a line of another control: step, direction.
    pub fn pulse_line(&mut self, now: VirtualNanos, line: usize, high: bool) {
        let pulses = self.wiring.pulses;
        let input = TimerInput {
            at: pulses.lines[line],
            function: pulses.function,
            timer: pulses.timer,
            channel: line as u8 + 1,
        };
        self.timer_line(now, input, high);
    }

    /// Drives a pin of a timer. The level reaches the timer if the pin has that timer's function.
    fn timer_line(&mut self, now: VirtualNanos, input: TimerInput, high: bool) {
        let TimerInput {
            at,
            function,
            timer,
            channel,
        } = input;
        self.drive(now, at, high);
        let pin = pin_of(at.1);
        let has = match &mut self.chip {
            Chip::F4(chip) => stm32f427::peripherals::gpio::Gpio::function(pin, chip.port(at.0).1),
            Chip::H7(chip) => stm32h743::peripherals::gpio::Gpio::function(pin, chip.port(at.0).1),
        };
        if has != Some(function) {
            return;
        }
        let level = Level::from(high);
        let channel = Channel::new(channel).expect("a channel");
        match (&mut self.chip, timer) {
            (Chip::F4(chip), TimerModel::General(nth)) => {
                chip.drive_timer(now, nth, |timer, r, c| {
                    timer.drive_input(channel, level, r, c)
                })
            }
            (Chip::F4(chip), TimerModel::Advanced(nth)) => {
                chip.drive_advanced_timer(now, nth, |timer, r, c| {
                    timer.drive_input(channel, level, r, c);
                })
            }
            (Chip::H7(chip), TimerModel::General(nth)) => {
                chip.drive_timer(now, nth, |timer, r, c| {
                    timer.drive_input(channel, level, r, c)
                })
            }
            (Chip::H7(chip), TimerModel::Advanced(nth)) => {
                chip.drive_advanced_timer(now, nth, |timer, r, c| {
                    timer.drive_input(channel, level, r, c);
                })
            }
            (Chip::H7(chip), TimerModel::Fifteen) => {
                chip.drive_tim15(now, |timer, r, c| timer.drive_input(channel, level, r, c))
            }
            (Chip::F4(_), TimerModel::Fifteen) => unreachable!("this chip has no TIM15"),
        }
    }

    /// Reads a register without the effects of a read.
    pub fn peek(&mut self, now: VirtualNanos, address: u64) -> u32 {
        let word = match &mut self.chip {
            Chip::F4(chip) => chip.peek(now, address, Width::W32),
            Chip::H7(chip) => chip.peek(now, address, Width::W32),
        };
        word.unwrap_or(0) as u32
    }

    /// The count of an encoder's timer, and the count captured at its index.
    pub fn counter(&mut self, now: VirtualNanos, axis: usize) -> (u32, u32) {
        let base = self.wiring.encoders[axis].base;
        (
            self.peek(now, base + COUNTER),
            self.peek(now, base + CAPTURED),
        )
    }

    /// The count of another control's steps, 16 bits.
    pub fn pulses(&mut self, now: VirtualNanos) -> u32 {
        self.peek(now, self.wiring.pulses.base + COUNTER)
    }

    /// Sets the supply, mV.
    pub fn set_supply(&mut self, millivolts: u32) {
        match &mut self.chip {
            Chip::F4(chip) => chip.set_supply(millivolts),
            Chip::H7(chip) => chip.set_supply(millivolts),
        }
    }

    /// Lets the clock at OSC_IN fail, for good.
    pub fn fail_hse(&mut self, now: VirtualNanos) {
        match &mut self.chip {
            Chip::F4(chip) => {
                chip.drive_clocks(now, |rcc, r, c: &mut DeviceContext<'_>| rcc.fail_hse(r, c));
                chip.rcc.attach_crystals(0, 0);
            }
            Chip::H7(chip) => {
                chip.drive_clocks(now, |rcc, r, c: &mut DeviceContext<'_>| rcc.fail_hse(r, c));
                chip.rcc.attach_crystals(0, 0);
            }
        }
    }

    /// Rates of SYSCLK, HCLK, PCLK1, PCLK2, timers of APB 1, timers of APB 2, Hz.
    pub fn clocks(&mut self) -> [u64; 6] {
        match &mut self.chip {
            Chip::F4(chip) => {
                use stm32f427::peripherals::rcc::Apb;
                let (rcc, r): (_, &mut RegisterFile) = chip.clocks();
                let timers = [Apb::One, Apb::Two].map(|apb| rcc.timer_clock(r, apb));
                let buses = [rcc.pclk1(r), rcc.pclk2(r)];
                [
                    rcc.sysclk(r),
                    rcc.hclk(r),
                    buses[0],
                    buses[1],
                    timers[0],
                    timers[1],
                ]
            }
            Chip::H7(chip) => {
                use stm32h743::peripherals::rcc::{Apb, TimerBus};
                let (rcc, r): (_, &mut RegisterFile) = chip.clocks();
                let timers = [TimerBus::Apb1, TimerBus::Apb2].map(|bus| rcc.timer_clock(r, bus));
                let buses = [Apb::One, Apb::Two].map(|apb| rcc.pclk(r, apb));
                [
                    rcc.sysclk(r),
                    rcc.hclk(r),
                    buses[0],
                    buses[1],
                    timers[0],
                    timers[1],
                ]
            }
        }
    }
}

fn pin_of(number: u8) -> Pin {
    Pin::new(number).expect("a pin")
}

/// Caches of the STM32H743 as its core describes them: CLIDR, CTR and CCSIDR (PM0253, tables 77 and 81). The model has none.
const CACHES: armv7m::Caches = armv7m::Caches {
    clidr: 0x0900_0003,
    ctr: 0x8303_C003,
    ccsidr: &[0xF00F_E019, 0xF01F_E009],
};

impl Board for Nucleo {
    fn name(&self) -> &'static str {
        self.wiring.name
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        let chip: &mut dyn Mcu = match &mut self.chip {
            Chip::F4(chip) => chip.as_mut(),
            Chip::H7(chip) => chip.as_mut(),
        };
        (target == 0).then_some(chip)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let (variant, lines) = match &self.chip {
            Chip::F4(chip) => (
                armv7m::Variant::M4,
                Operate::cpu(chip.as_ref()).interrupt_lines,
            ),
            Chip::H7(chip) => (
                armv7m::Variant::M7,
                Operate::cpu(chip.as_ref()).interrupt_lines,
            ),
        };
        let core = armv7m::Core {
            variant,
            clock_hz: NonZeroU64::new(self.wiring.core_hz).expect("a clock"),
            interrupt_lines: NonZeroU32::new(u32::from(lines)).expect("lines"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("a divider"),
            instructions_per_second: NonZeroU64::new(self.instructions_per_s).expect("a rate"),
            boot: "flash",
        };
        match &mut self.chip {
            Chip::F4(chip) => {
                let windows = rigless::cpu::armv7m::windows(Mcu::bus(chip.as_ref()));
                let spec =
                    core.spec_with_parts(&windows, armv7m::Fpu::FpV4Sp, armv7m::MpuRegions::Eight);
                vec![Target::new("stm32", chip.as_mut(), spec)]
            }
            Chip::H7(chip) => {
                let windows = rigless::cpu::armv7m::windows(Mcu::bus(chip.as_ref()));
                let mut config = armv7m::Config::new(core, &windows);
                config.fpu = armv7m::Fpu::FpV5Dp;
                config.mpu_regions = armv7m::MpuRegions::Sixteen;
                // Cortex-M7 r1p1 (ES0392, 2.1).
                config.cpuid = 0x411F_C271;
                config.caches = Some(CACHES);
                config.branch_prediction = armv7m::BranchPrediction::Always;
                // BOOT_ADD0 as delivered (RM0433, table 9).
                config.vector_table = Some(0x0800_0000);
                vec![Target::new("stm32", chip.as_mut(), config.spec())]
            }
        }
    }
}
