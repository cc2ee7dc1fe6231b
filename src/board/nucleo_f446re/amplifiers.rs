//! Three amplifiers: their command voltages through the converter, their enable line through a pin.

use embedded_hal::delay::DelayNs;
use stm32f4xx_hal::gpio::{Output, PB12, PB13, PB14, PB15, PC8, Speed};
use stm32f4xx_hal::pac::{self, SPI2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use stm32f4xx_hal::spi::{Mode, Phase, Polarity, Spi};

use quadrant::hal;
use quadrant::units::DacCode;

use super::super::ad5754r::{ALL_ZERO, Ad5754r};
use super::CORE_HZ;

/// Number of the /SYNC pin in port B.
const SYNC: u8 = 12;
/// Number of the /LDAC pin in port B.
const LOAD: u8 = 14;
/// Number of the enable pin in port C.
const ENABLE: u8 = 8;
/// How often to look for the bus before giving up, in the emergency path: far more than one byte takes.
const PATIENCE: u32 = 10_000;

/// The pins of the amplifiers, as they are after reset.
pub(super) struct Pins {
    pub(super) clock: PB13,
    pub(super) data: PB15,
    pub(super) sync: PB12,
    pub(super) load: PB14,
    pub(super) enable: PC8,
}

/// Three amplifiers.
pub(crate) struct Amplifiers {
    converter: Ad5754r<Spi<SPI2>, PB12<Output>, PB14<Output>, CoreDelay>,
    enable: PC8<Output>,
}

impl Amplifiers {
    /// Starts the converter with zero volts and the amplifiers disabled.
    pub(super) fn new(spi: SPI2, pins: Pins, rcc: &mut Rcc) -> Self {
        let mut enable = pins.enable.into_push_pull_output();
        enable.set_low();
        let sync = pins.sync.into_push_pull_output().speed(Speed::VeryHigh);
        let load = pins.load.into_push_pull_output().speed(Speed::VeryHigh);
        // The converter takes 30 MHz; the fastest this bus has below that is half its clock, 22.5 MHz.
        let mode = Mode {
            polarity: Polarity::IdleLow,
            phase: Phase::CaptureOnSecondTransition,
        };
        let clock = pins.clock.into_alternate().speed(Speed::VeryHigh);
        let data = pins.data.into_alternate().speed(Speed::VeryHigh);
        let pins = (Some(clock), SPI2::NoMiso, Some(data));
        let bus = Spi::new(spi, pins, mode, 22_500.kHz(), rcc);
        let Ok(converter) = Ad5754r::new(bus, sync, load, CoreDelay) else {
            panic!("the converter's bus does not work");
        };
        Self { converter, enable }
    }
}

impl hal::Amplifiers for Amplifiers {
    /// Disabled before the codes change, enabled after.
    #[inline(always)]
    fn write(&mut self, codes: [DacCode; 3], enabled: bool) {
        if !enabled {
            self.enable.set_low();
        }
        let written = self.converter.write(codes.map(|code| code.0)).is_ok();
        if enabled && written {
            self.enable.set_high();
        } else {
            // Codes that did not get through must not keep driving the machine.
            self.enable.set_low();
        }
    }
}

/// Short waits by counting instructions.
struct CoreDelay;

impl DelayNs for CoreDelay {
    #[inline(always)]
    fn delay_ns(&mut self, ns: u32) {
        // Rounded up; all waits are constants, so nothing is divided at run time.
        cortex_m::asm::delay((ns * (CORE_HZ / 1_000_000)).div_ceil(1_000));
    }

    fn delay_us(&mut self, us: u32) {
        cortex_m::asm::delay(us * (CORE_HZ / 1_000_000));
    }
}

/// Zero codes, amplifiers disabled, from any context: also from a panic before or in the middle of anything.
pub(crate) fn outputs_off() {
    // SAFETY: whoever owns these peripherals is not coming back: this runs with interrupts disabled on the way to
    // `halt`. Only single register writes are made, each valid in any state the owner left.
    let (port_b, port_c, bus) =
        unsafe { (pac::GPIOB::steal(), pac::GPIOC::steal(), pac::SPI2::steal()) };
    // First of all, and independent of the bus.
    port_c.bsrr().write(|w| w.br(ENABLE).set_bit());

    // End the frame that may be under way; the chip ignores it unless it is complete.
    wait_for(|| !bus.sr().read().bsy().bit_is_set());
    port_b.bsrr().write(|w| w.bs(SYNC).set_bit());
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

/// Waits for the bus, but not for ever: a bus that was never started does not get ready.
fn wait_for(ready: impl Fn() -> bool) {
    for _ in 0..PATIENCE {
        if ready() {
            return;
        }
    }
}
