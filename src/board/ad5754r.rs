//! Analog Devices AD5754R: four 16-bit outputs of up to ±10 V behind SPI.
//!
//! Frames are 24 bits, most significant first: a byte that selects a register and a channel, then 16 bits of data.
//! The chip reads data at the falling edge of the clock (SPI mode 1), at up to 30 MHz. /SYNC frames one register
//! write; the new codes appear at the outputs together, at the falling edge of /LDAC.
//!
//! The pin BIN//2sCOMP must be tied low: codes are then two's complement, and zero is zero volts.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiBus;

/// Bits 5..3 of the first byte: the register.
mod register {
    /// The code of one channel or all.
    pub(super) const DAC: u8 = 0b000 << 3;
    /// The range of one channel or all.
    pub(super) const RANGE: u8 = 0b001 << 3;
    /// Which parts are powered.
    pub(super) const POWER: u8 = 0b010 << 3;
    /// Options and commands; which, the channel bits say.
    pub(super) const CONTROL: u8 = 0b011 << 3;
}

/// Bits 2..0 of the first byte: channels are 0 to 3, and this is all of them.
const ALL_CHANNELS: u8 = 0b100;
/// Channel bits of the control register that select its options.
const CONTROL_OPTIONS: u8 = 0b001;

/// Range ±10 V.
const RANGE_10_V_BIPOLAR: u16 = 0b100;
/// Options: over-temperature shutdown and current clamp on, output of read-back off, clear to zero volts.
const OPTIONS: u16 = 0b1101;
/// Power up channels A to D and the internal reference.
const POWER_UP: u16 = 0b1_1111;

/// /SYNC high between two frames: at least 100 ns.
const BETWEEN_FRAMES_NS: u32 = 100;
/// From the last /SYNC to /LDAC: at least 130 ns.
const BEFORE_LOAD_NS: u32 = 130;
/// /LDAC low: at least 20 ns.
const LOAD_NS: u32 = 20;
/// From power-up until outputs may be written: at least 10 us.
const POWER_UP_US: u32 = 20;

/// The frame that writes `data` to a register.
#[inline(always)]
const fn frame(address: u8, data: u16) -> [u8; 3] {
    let [high, low] = data.to_be_bytes();
    [address, high, low]
}

/// The frame that sets all channels to zero volts, for paths that cannot own the driver.
pub(super) const ALL_ZERO: [u8; 3] = frame(register::DAC | ALL_CHANNELS, 0);

/// The converter with its bus to itself.
pub(super) struct Ad5754r<Bus, Sync, Load, Delay> {
    bus: Bus,
    sync: Sync,
    load: Load,
    delay: Delay,
}

impl<Bus, Sync, Load, Delay> Ad5754r<Bus, Sync, Load, Delay>
where
    Bus: SpiBus,
    Sync: OutputPin,
    Load: OutputPin,
    Delay: DelayNs,
{
    /// Powers the converter up, at zero volts on all outputs.
    pub(super) fn new(
        bus: Bus,
        mut sync: Sync,
        mut load: Load,
        delay: Delay,
    ) -> Result<Self, Bus::Error> {
        // These pins belong to the processor and cannot fail.
        let _ = sync.set_high();
        let _ = load.set_high();
        let mut converter = Self {
            bus,
            sync,
            load,
            delay,
        };
        // The range goes first: at power-up the outputs come on in whatever range is set then.
        converter.send(frame(register::RANGE | ALL_CHANNELS, RANGE_10_V_BIPOLAR))?;
        converter.send(frame(register::CONTROL | CONTROL_OPTIONS, OPTIONS))?;
        converter.send(ALL_ZERO)?;
        converter.update();
        converter.send(frame(register::POWER, POWER_UP))?;
        converter.delay.delay_us(POWER_UP_US);
        converter.send(ALL_ZERO)?;
        converter.update();
        Ok(converter)
    }

    /// Sets channels A, B and C at the same instant.
    #[inline(always)]
    pub(super) fn write(&mut self, codes: [i16; 3]) -> Result<(), Bus::Error> {
        for (channel, code) in (0..).zip(codes) {
            self.send(frame(register::DAC | channel, code.cast_unsigned()))?;
        }
        self.update();
        Ok(())
    }

    /// Sends one frame. A frame cut short by an error is ignored by the chip, which counts clocks.
    #[inline(always)]
    fn send(&mut self, frame: [u8; 3]) -> Result<(), Bus::Error> {
        let _ = self.sync.set_low();
        let sent = self.bus.write(&frame).and_then(|()| self.bus.flush());
        let _ = self.sync.set_high();
        self.delay.delay_ns(BETWEEN_FRAMES_NS);
        sent
    }

    /// Moves what was sent to the outputs.
    #[inline(always)]
    fn update(&mut self) {
        self.delay.delay_ns(BEFORE_LOAD_NS);
        let _ = self.load.set_low();
        self.delay.delay_ns(LOAD_NS);
        let _ = self.load.set_high();
    }
}
