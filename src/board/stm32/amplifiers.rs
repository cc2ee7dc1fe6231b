//! Three amplifiers: their command voltages through the external converter, their enable line through a pin.

use embedded_hal::delay::DelayNs;
use quadrant::drivers::ad5754r::steps::FRAME_STEPS;
use quadrant::drivers::ad5754r::{ALL_ZERO, Ad5754r, Error, Item};
use quadrant::hal;
use quadrant_law::stage::Outputs;

use super::converter_bus::ConverterBus;
use crate::board::chip::{self, Brake, CORE_HZ, CYCLES_PER_TURN, Clear, Enable, READING, WRITING};

// A tenth of a control period at 10 kHz is what the outputs may take, and the reading is over before the shortest tick writes.
const _: () = assert!(WRITING.load_ns() < 10_000);
const _: () = assert!(READING.steps_ns(FRAME_STEPS) < 8_000);

type Converter = Ad5754r<ConverterBus, Clear, CoreDelay>;

/// Three amplifiers.
pub(crate) struct Amplifiers {
    converter: Converter,
    enable: Enable,
    brake: Brake,
    /// The converter answered when it was started. One that did not is left alone, and nothing is ever enabled.
    is_present: bool,
    mismatches: [bool; 3],
}

impl Amplifiers {
    /// Starts the converter with zero volts. Enable line, brake and /CLR are outputs, and low.
    pub(crate) fn new(bus: ConverterBus, clear: Clear, enable: Enable, brake: Brake) -> Self {
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

/// Short waits by counting turns of the loop of `cortex_m::asm::delay`.
pub(crate) struct CoreDelay;

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
    // First of all, and independent of the bus.
    chip::lines_off();
    // /CLR holds the outputs at zero; should that wire be broken, the zero codes do.
    super::converter_bus::send_at_last(ALL_ZERO, &mut CoreDelay);
}
