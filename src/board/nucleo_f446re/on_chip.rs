//! The fallback without an external converter: x and y on the chip's own two 12-bit converters, made better by shaping
//! their error. **There is no third converter: z is not driven**, and its codes move nothing.
//!
//! `docs/outputs.md` says what this costs in tracking error, and the circuit that makes ±10 V of 0 to 3.3 V.

use quadrant::hal;
use quadrant_law::noise_shaper::{NoiseShaper, NoiseShaperState};
use quadrant_law::stage::Outputs;
use stm32f4xx_hal::gpio::{PA4, PA5};
use stm32f4xx_hal::pac::DAC;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use super::chip::{self, Brake, Enable as EnableLine};

/// The word in the middle: zero volts.
const ZERO: u32 = 2048;
/// DAC_CR (RM0390, 14.5.1): both channels on (EN1, EN2), buffered, without triggers.
const BOTH_ON: u32 = 1 | 1 << 16;
/// First order: docs/outputs.md has the comparison.
const SHAPER: NoiseShaper = NoiseShaper::FirstOrder;

/// Two amplifiers of three.
pub(crate) struct Amplifiers {
    converter: DAC,
    enable: EnableLine,
    brake: Brake,
    states: [NoiseShaperState; 2],
}

impl Amplifiers {
    /// Starts the converters with zero volts. Enable line and brake are low.
    pub(super) fn new(
        converter: DAC,
        pins: (PA4, PA5),
        (enable, brake): (EnableLine, Brake),
        rcc: &mut Rcc,
    ) -> Self {
        DAC::enable(rcc);
        DAC::reset(rcc);
        write_both(&converter, [0; 2]);
        // SAFETY: the value is the manual's.
        converter.cr().write(|w| unsafe { w.bits(BOTH_ON) });
        // Analogue pins last: until then they float.
        let _ = (pins.0.into_analog(), pins.1.into_analog());
        Self {
            converter,
            enable,
            brake,
            states: [NoiseShaperState::default(); 2],
        }
    }
}

impl hal::Amplifiers for Amplifiers {
    /// Disabled before the codes change, enabled after; the brake with them.
    #[inline(always)]
    fn write(&mut self, outputs: &Outputs) {
        if !outputs.enabled {
            self.enable.set_low();
            self.states = [NoiseShaperState::default(); 2];
        }
        if !outputs.brake_released {
            self.brake.set_low();
        }
        let [x, y, _] = outputs.codes.into_array();
        let [of_x, of_y] = &mut self.states;
        write_both(
            &self.converter,
            [SHAPER.step(of_x, x), SHAPER.step(of_y, y)],
        );
        if outputs.enabled {
            self.enable.set_high();
        }
        if outputs.brake_released {
            self.brake.set_high();
        }
    }
}

/// Both words in one access, DAC_DHR12RD: they appear together.
#[inline(always)]
fn write_both(converter: &DAC, [x, y]: [i16; 2]) {
    let word = |value: i16| ZERO.wrapping_add_signed(value.into()) & 0xFFF;
    // SAFETY: twelve bits each.
    converter
        .dhr12rd()
        .write(|w| unsafe { w.bits(word(x) | word(y) << 16) });
}

/// Zero volts, amplifiers disabled, brake applied, from any context: also from a panic before or in the middle of anything.
pub(crate) fn outputs_off() {
    chip::lines_off();
    // SAFETY: the owner of the converters does not run again: this runs with interrupts disabled on the way to `halt`. A single
    // write, valid in any state that it left.
    write_both(&unsafe { DAC::steal() }, [0; 2]);
}
