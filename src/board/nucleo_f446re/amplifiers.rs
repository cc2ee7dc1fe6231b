//! Three amplifiers: their command voltages through the external converter, their enable line through a pin.

use embedded_hal::delay::DelayNs;
use quadrant::drivers::ad5754r::steps::FRAME_STEPS;
use quadrant::drivers::ad5754r::{ALL_ZERO, Ad5754r, Error, Item};
use quadrant::hal;
use quadrant_law::stage::Outputs;
use stm32f4xx_hal::gpio::{Output, PB2, PB5, PC9};
use stm32f4xx_hal::pac::{self, DMA2, SPI2, TIM1};
use stm32f4xx_hal::rcc::Rcc;

use super::CORE_HZ;
use super::bus_times::{READING, WRITING};
use super::converter_bus::ConverterBus;
pub(super) use super::converter_bus::Pins as BusPins;
use super::pins::{BRAKE, ENABLE, LOAD, SYNC};

/// Number of /CLR in port B.
const CLEAR: u8 = 2;
/// Largest number of polls of the bus before giving up, in the emergency path: far more than one byte takes.
const PATIENCE: u32 = 10_000;

// A tenth of a control period at 10 kHz is what the outputs may take, and the reading is over before the shortest tick writes.
const _: () = assert!(WRITING.load_ns() < 10_000);
const _: () = assert!(READING.steps_ns(FRAME_STEPS) < 8_000);

/// The pins of the amplifiers, as they are after reset.
pub(super) struct Pins {
    pub(super) bus: BusPins,
    pub(super) clear: PB2,
    pub(super) enable: PC9,
    pub(super) brake: PB5,
}

type Converter = Ad5754r<ConverterBus, PB2<Output>, CoreDelay>;

/// Three amplifiers.
pub(crate) struct Amplifiers {
    converter: Converter,
    enable: PC9<Output>,
    brake: PB5<Output>,
    /// The converter answered when it was started. One that did not is left alone, and nothing is ever enabled.
    is_present: bool,
    mismatches: [bool; 3],
}

impl Amplifiers {
    /// Starts the converter with zero volts and the amplifiers disabled.
    pub(super) fn new(parts: (SPI2, TIM1, DMA2), pins: Pins, rcc: &mut Rcc) -> Self {
        let mut enable = pins.enable.into_push_pull_output();
        enable.set_low();
        let mut brake = pins.brake.into_push_pull_output();
        brake.set_low();
        let clear = pins.clear.into_push_pull_output();
        let (spi, timer, dma) = parts;
        let bus = ConverterBus::new(spi, timer, dma, pins.bus, rcc);
        let mut converter = Ad5754r::new(bus, clear, CoreDelay);
        let is_present = match converter.start() {
            Ok(()) => true,
            Err(Error::Bus(_)) => {
                defmt::error!("the converter's bus is stuck: outputs stay off");
                false
            }
            Err(Error::Mismatch {
                expected, answered, ..
            }) => {
                defmt::error!(
                    "the converter answers {=u16:#06x} instead of {=u16:#06x}: outputs stay off; \
                     check its supply and the wires of SCLK, SDIN, SDO and /SYNC",
                    answered,
                    expected
                );
                false
            }
        };
        Self {
            converter,
            enable,
            brake,
            is_present,
            mismatches: [!is_present; 3],
        }
    }
}

impl hal::Amplifiers for Amplifiers {
    #[inline(always)]
    fn begin(&mut self) {
        if self.is_present && self.converter.begin().is_err() {
            self.enable.set_low();
            self.brake.set_low();
            self.mismatches = [true; 3];
        }
    }

    /// Disabled before the codes change. Enabled while they are on their way: until they are there the outputs are at zero volts,
    /// as a stage that is not enabled has no other codes.
    #[inline(always)]
    fn write(&mut self, outputs: &Outputs) {
        if !outputs.enabled {
            self.enable.set_low();
        }
        if !outputs.brake_released {
            self.brake.set_low();
        }
        if self.is_present {
            let codes = outputs.codes.into_array();
            let written = self.converter.write(codes.map(|code| code.0));
            self.mismatches = match written {
                Ok(()) => [false; 3],
                Err(Error::Mismatch {
                    item: Item::Code(channel),
                    ..
                }) => [channel == 0, channel == 1, channel == 2],
                Err(_) => [true; 3],
            };
        }
        if outputs.enabled && self.mismatches == [false; 3] {
            self.enable.set_high();
            if outputs.brake_released {
                self.brake.set_high();
            }
        } else {
            // Codes that did not get through must not keep driving the machine.
            self.enable.set_low();
            self.brake.set_low();
        }
    }

    #[inline(always)]
    fn mismatches(&self) -> [bool; 3] {
        self.mismatches
    }
}

/// Short waits by counting turns of a loop.
pub(super) struct CoreDelay;

/// Cycles that a turn of `cortex_m::asm::delay`'s loop takes at least: one for the subtraction, two for a branch that is
/// taken (Cortex-M4 TRM, 3.3.1).
const CYCLES_PER_TURN: u32 = 3;

impl DelayNs for CoreDelay {
    #[inline(always)]
    fn delay_ns(&mut self, ns: u32) {
        // Rounded up; all waits are constants, so nothing is divided at run time.
        cortex_m::asm::delay((ns * (CORE_HZ / 1_000_000)).div_ceil(1_000 * CYCLES_PER_TURN));
    }

    fn delay_us(&mut self, us: u32) {
        cortex_m::asm::delay((us * (CORE_HZ / 1_000_000)).div_ceil(CYCLES_PER_TURN));
    }
}

/// Zero volts, amplifiers disabled, brake applied, from any context: also from a panic before or in the middle of anything.
pub(crate) fn outputs_off() {
    // SAFETY: the owner of these peripherals does not run again: this runs with interrupts disabled on the way to
    // `halt`. Only single register writes are made, each valid in any state the owner left.
    let (port_b, port_c, bus, timer, dma) = unsafe {
        (
            pac::GPIOB::steal(),
            pac::GPIOC::steal(),
            pac::SPI2::steal(),
            pac::TIM1::steal(),
            pac::DMA2::steal(),
        )
    };
    // First of all, and independent of the bus.
    port_c.bsrr().write(|w| w.br(ENABLE).set_bit());
    port_b.bsrr().write(|w| w.br(BRAKE).set_bit());
    port_b.bsrr().write(|w| w.br(CLEAR).set_bit());

    // /CLR holds the outputs at zero; should that wire be broken, the zero codes do. End the frame that may be under way;
    // the chip ignores it unless it is complete.
    timer.cr1().reset();
    for stream in dma.st_iter() {
        stream.cr().reset();
    }
    wait_for(|| !bus.sr().read().bsy().bit_is_set());
    port_b
        .bsrr()
        .write(|w| w.bs(SYNC).set_bit().bs(LOAD).set_bit());
    CoreDelay.delay_us(1);
    port_b.bsrr().write(|w| w.br(SYNC).set_bit());
    for byte in ALL_ZERO {
        wait_for(|| bus.sr().read().txe().bit_is_set());
        bus.dr8().write(|w| w.dr().set(byte));
    }
    wait_for(|| bus.sr().read().txe().bit_is_set());
    wait_for(|| !bus.sr().read().bsy().bit_is_set());
    port_b.bsrr().write(|w| w.bs(SYNC).set_bit());
    CoreDelay.delay_us(1);
    port_b.bsrr().write(|w| w.br(LOAD).set_bit());
    CoreDelay.delay_us(1);
    port_b.bsrr().write(|w| w.bs(LOAD).set_bit());
}

/// Waits for the bus, with a limit: a bus that was never started does not get ready.
fn wait_for(ready: impl Fn() -> bool) {
    for _ in 0..PATIENCE {
        if ready() {
            return;
        }
    }
}
