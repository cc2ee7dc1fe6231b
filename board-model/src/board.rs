//! The reference board: chip, crystal, converter, link, and what is wired to its pins.

use std::collections::VecDeque;
use std::num::{NonZeroU32, NonZeroU64};
use std::sync::{Arc, Mutex};

use rigless::chip::Timeline;
use rigless::chip::uart;
use rigless::device::Level;
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::snapshot::{Error as SnapshotError, Reader, Store, Writer};
use rigless::soc::stm32f427::Stm32f427;
use rigless::soc::stm32f427::peripherals::gpio::{Gpio, Pin};
use rigless::soc::stm32f427::peripherals::spi::Select;
use rigless::soc::stm32f427::peripherals::tim::Channel;
use rigless::soc::{Error, Width};
use rigless::time::VirtualNanos;

use crate::ad5754r::{End, Shared, Wire};

/// Instructions a second of virtual time: 180 MHz at 1.8 cycles an instruction. The model counts instructions.
const INSTRUCTIONS_PER_S: u64 = 100_000_000;
/// Rate that the debug probe feeds to OSC_IN, Hz.
pub const HSE_HZ: u64 = 8_000_000;

/// A pin: port (0 for A) and number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct At(pub usize, pub u8);

/// Amplifier enable, high enables.
pub const ENABLE: At = At(2, 9);
/// Holding brake, high releases.
const BRAKE: At = At(1, 5);
/// Second contact of the emergency stop.
pub const EMERGENCY_STOP: At = At(0, 0);
/// Amplifiers ready.
pub const READY: At = At(0, 1);
/// Faults of the amplifiers x, y, z.
pub const FAULTS: [At; 3] = [At(0, 8), At(0, 9), At(0, 10)];
/// Limits x-, x+, y-, y+, z-, z+.
pub const LIMITS: [At; 6] = [At(2, 0), At(2, 1), At(2, 2), At(2, 3), At(2, 4), At(2, 5)];
/// Home switches.
const HOMES: [At; 3] = [At(2, 10), At(2, 11), At(2, 12)];
/// Enabling button: low while pressed.
const BUTTON: At = At(2, 13);
/// Outputs that a resistor pulls to ground: enable, brake, /CLR.
const PULLED_DOWN: [At; 3] = [ENABLE, BRAKE, At(1, 2)];
/// A, B and index of an encoder, with the alternate function that leads them to its timer (data sheet of the F446, table 11).
const ENCODERS: [[(At, u8); 3]; 3] = [
    [(At(1, 8), 1), (At(1, 9), 1), (At(1, 10), 1)],
    [(At(0, 6), 2), (At(0, 7), 2), (At(1, 0), 2)],
    [(At(2, 6), 3), (At(2, 7), 3), (At(2, 8), 3)],
];
/// Base addresses of the encoders' timers: TIM2, TIM3, TIM8.
pub const TIMERS: [u64; 3] = [0x4000_0000, 0x4000_0400, 0x4001_0400];
/// Offset of a timer's counter.
pub const COUNTER: u64 = 0x24;
/// The port of /SYNC (12), /LDAC (1) and /CLR (2).
const CONVERTER_WIRES: [(usize, Wire, u8); 3] =
    [(1, Wire::Bus, 12), (0, Wire::Ldac, 1), (0, Wire::Clr, 2)];

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

/// The board.
#[derive(Debug)]
pub struct Nucleo {
    /// The chip.
    pub mcu: Stm32f427,
}

impl Store for Nucleo {
    fn store(&self, to: &mut Writer) -> Result<(), SnapshotError> {
        self.mcu.store(to)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), SnapshotError> {
        self.mcu.load(from)
    }
}

impl Nucleo {
    /// The board with a converter, a link's line and a rate at OSC_IN, Hz.
    pub fn new(converter: &Shared, line: &SharedLine, hse_hz: u64) -> Result<Self, Error> {
        let mut mcu = Stm32f427::new()?;
        mcu.rcc.attach_crystals(hse_hz, 0);
        mcu.set_supply(3300);
        // SPI2 has the bus. /LDAC and /CLR are no chip selects of it; SPI1, which is not used, reports their edges.
        for (spi, wire, pin) in CONVERTER_WIRES {
            let select = Select {
                port: "GPIOB",
                pin: pin_of(pin),
                active: Level::Low,
            };
            mcu.spi[spi].attach_selected(End::new(wire, converter), select);
        }
        mcu.usart[1].attach(LineEnd(line.clone()));
        Ok(Self { mcu })
    }

    /// The level of a pin.
    pub fn level(&mut self, At(port, pin): At) -> bool {
        let (gpio, registers) = self.mcu.port(port);
        gpio.level(pin_of(pin), registers) == Level::High
    }

    /// Drives a pin from outside; an output of the chip is stronger.
    pub fn drive(&mut self, now: VirtualNanos, At(port, pin): At, high: bool) {
        self.mcu.drive_port(now, port, |gpio, registers, context| {
            gpio.drive(pin_of(pin), Some(Level::from(high)), registers, context);
        });
    }

    /// Drives what is connected as a machine at rest does: contacts closed, button up, pull-downs.
    pub fn drive_all(&mut self, now: VirtualNanos) {
        let closed = [EMERGENCY_STOP, READY];
        let low = closed
            .iter()
            .chain(&FAULTS)
            .chain(&LIMITS)
            .chain(&HOMES)
            .chain(&PULLED_DOWN);
        for &at in low {
            self.drive(now, at, false);
        }
        self.drive(now, BUTTON, true);
    }

    /// Drives a line of an encoder: A, B, index. The level reaches the timer if the pin has that timer's function.
    pub fn encoder_line(&mut self, now: VirtualNanos, axis: usize, line: usize, high: bool) {
        let (at, function) = ENCODERS[axis][line];
        self.drive(now, at, high);
        let (_, registers) = self.mcu.port(at.0);
        if Gpio::function(pin_of(at.1), registers) != Some(function) {
            return;
        }
        let channel = Channel::new(line as u8 + 1).expect("a channel");
        let level = Level::from(high);
        match axis {
            0 | 1 => self
                .mcu
                .drive_timer(now, axis, |t, r, c| t.drive_input(channel, level, r, c)),
            _ => self
                .mcu
                .drive_advanced_timer(now, 1, |t, r, c| t.drive_input(channel, level, r, c)),
        }
    }

    /// Reads a register without the effects of a read.
    pub fn peek(&mut self, now: VirtualNanos, address: u64) -> u32 {
        self.mcu.peek(now, address, Width::W32).unwrap_or(0) as u32
    }

    /// The count of an encoder's timer, and the count captured at its index.
    pub fn counter(&mut self, now: VirtualNanos, axis: usize) -> (u32, u32) {
        (
            self.peek(now, TIMERS[axis] + COUNTER),
            self.peek(now, TIMERS[axis] + 0x3C),
        )
    }
}

fn pin_of(number: u8) -> Pin {
    Pin::new(number).expect("a pin")
}

impl Board for Nucleo {
    fn name(&self) -> &'static str {
        "nucleo-f446re"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let lines = u32::from(Operate::cpu(&self.mcu).interrupt_lines);
        let core = armv7m::Core {
            variant: armv7m::Variant::M4,
            clock_hz: NonZeroU64::new(180_000_000).expect("a clock"),
            interrupt_lines: NonZeroU32::new(lines).expect("lines"),
            priority_bits: 4,
            refclk_divider: NonZeroU32::new(8).expect("a divider"),
            instructions_per_second: NonZeroU64::new(INSTRUCTIONS_PER_S).expect("a rate"),
            boot: "flash",
        };
        let windows = rigless::cpu::armv7m::windows(Mcu::bus(&self.mcu));
        let spec = core.spec_with_parts(&windows, armv7m::Fpu::FpV4Sp, armv7m::MpuRegions::Eight);
        vec![Target::new("stm32", &mut self.mcu, spec)]
    }
}
