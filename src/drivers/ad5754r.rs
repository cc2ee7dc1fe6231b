//! Analog Devices AD5754R: four 16-bit outputs of up to ±10 V behind SPI, three of them used.
//!
//! Frames are 24 bits, most significant first: bit 23 asks for a read, bits 21..16 name register and channel, then come
//! 16 bits of data. The chip reads SDIN at the falling edge of the clock (SPI mode 1), at up to 30 MHz. /SYNC frames one
//! register; the new codes appear at the outputs together, at the falling edge of /LDAC. While /CLR is low all outputs
//! are at zero volts, whatever the bus does. The pin BIN//2sCOMP must be tied low: codes are then two's complement, and
//! zero is zero volts.
//!
//! # Read-back
//! A frame with bit 23 set asks for a register; the chip shifts it out through SDO in the frame that follows, whatever
//! that one writes. SDO is valid up to 40 ns after the clock's rising edge and is sampled at the falling one, so that
//! frame needs a clock below about 10 MHz ([`Clock::Reading`]). [`Ad5754r::write`] asks for one register per call, the
//! codes of A, B and C and the power register in turn: a wrong code, a chip that lost its supply, an overloaded or
//! overheated output and a broken SDO are found within four calls.

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiBus;

/// Bits 21..19 of a frame: the register.
mod register {
    /// The code of one channel or all.
    pub(super) const DAC: u8 = 0b000 << 3;
    /// The range of one channel or all.
    pub(super) const RANGE: u8 = 0b001 << 3;
    /// Address of the power register: powered parts, and shut-downs.
    pub(super) const POWER: u8 = 0b010 << 3;
    /// Options and commands; which, the channel bits say.
    pub(super) const CONTROL: u8 = 0b011 << 3;
}

/// Bit 23 of a frame: read instead of write.
const READ: u8 = 1 << 7;
/// Bits 18..16 of a frame: channels are 0 to 3, and this is all of them.
const ALL_CHANNELS: u8 = 0b100;
/// Channel bits of the control register that do nothing.
const CONTROL_NOTHING: u8 = 0b000;
/// Channel bits of the control register that select its options.
const CONTROL_OPTIONS: u8 = 0b001;

/// Range ±10 V.
const RANGE_10_V_BIPOLAR: u16 = 0b100;
/// The three bits of a range register that mean something.
const RANGE_BITS: u16 = 0b111;
/// Options: over-temperature shutdown and current clamp on, clear to zero volts, read-back on.
const OPTIONS: u16 = 0b1100;
/// Power up channels A to D and the internal reference.
const POWER_UP: u16 = 0b1_1111;
/// The bits of the power register that mean something: over-current of D to A (10..7), over-temperature (5), powered
/// parts (4..0).
const POWER_BITS: u16 = 0b111_1011_1111;
const ALL_BITS: u16 = u16::MAX;

/// /SYNC high between two frames: at least 100 ns.
const BETWEEN_FRAMES_NS: u32 = 100;
/// /SYNC high before the frame in which the chip answers: at least 200 ns.
const BEFORE_ANSWER_NS: u32 = 200;
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
pub const ALL_ZERO: [u8; 3] = frame(register::DAC | ALL_CHANNELS, 0);

/// Time that one [`Ad5754r::write`] keeps bus and pins busy, ns, without what the processor adds: three frames at
/// `writing_hz`, one at `reading_hz` (both Hz, above zero), and the waits.
pub const fn write_ns(writing_hz: u32, reading_hz: u32) -> u64 {
    const FRAME: u64 = 24 * 1_000_000_000;
    let waits = 3 * BETWEEN_FRAMES_NS + BEFORE_ANSWER_NS + BEFORE_LOAD_NS + LOAD_NS;
    (3 * FRAME).div_ceil(writing_hz as u64) + FRAME.div_ceil(reading_hz as u64) + waits as u64
}

/// The clock of the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// As fast as the chip can listen, 30 MHz at most.
    Writing,
    /// As slow as its answer takes: half a period covers SDO's 40 ns and the bus' own setup time.
    Reading,
}

/// A bus whose clock can be chosen between frames.
pub trait SelectClock {
    /// Chooses the clock of the frames that follow; the bus is idle.
    fn select(&mut self, clock: Clock);
}

/// A register read back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// The code of channel A, B or C (0, 1, 2).
    Code(u8),
    /// The range of the channels.
    Range,
    /// The power register: powered parts, and shut-downs by over-current, over-temperature.
    Power,
}

/// An error after which the outputs cannot be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The bus failed.
    Bus(E),
    /// The chip holds something else than what was written: it is not there, lost its supply, or shut an output down.
    Mismatch {
        /// The register that was compared.
        item: Item,
        /// The expected word.
        expected: u16,
        /// The word read back.
        answered: u16,
    },
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Self {
        Self::Bus(error)
    }
}

/// The pins of the chip that are no part of the bus.
pub struct Pins<Sync, Load, Clear> {
    /// /SYNC: low during a frame.
    pub sync: Sync,
    /// /LDAC: codes go to the outputs when it falls.
    pub load: Load,
    /// /CLR: outputs are at zero volts while it is low.
    pub clear: Clear,
}

/// The converter with its bus to itself.
pub struct Ad5754r<Bus, Sync, Load, Clear, Delay> {
    bus: Bus,
    pins: Pins<Sync, Load, Clear>,
    delay: Delay,
    /// The codes written last.
    codes: [i16; 3],
    /// The register to read back next: 0 to 2 a code, 3 the power register.
    turn: u8,
    /// A register that read wrong, until it reads right.
    wrong: Option<Wrong>,
    /// /CLR holds the outputs at zero volts since a write failed.
    cleared: bool,
}

/// A register that read wrong.
#[derive(Clone, Copy)]
struct Wrong {
    turn: u8,
    item: Item,
    expected: u16,
    answered: u16,
}

impl<Bus, Sync, Load, Clear, Delay> Ad5754r<Bus, Sync, Load, Clear, Delay>
where
    Bus: SpiBus + SelectClock,
    Sync: OutputPin,
    Load: OutputPin,
    Clear: OutputPin,
    Delay: DelayNs,
{
    /// A converter that was not started: its outputs are held at zero volts by /CLR.
    pub fn new(bus: Bus, mut pins: Pins<Sync, Load, Clear>, delay: Delay) -> Self {
        // These pins belong to the processor and cannot fail.
        let _ = pins.clear.set_low();
        let _ = pins.sync.set_high();
        let _ = pins.load.set_high();
        Self {
            bus,
            pins,
            delay,
            codes: [0; 3],
            turn: 0,
            wrong: None,
            cleared: false,
        }
    }

    /// Powers the converter up, at zero volts on all outputs, and checks that it did what it was told; only then it lets
    /// go of /CLR.
    ///
    /// # Errors
    /// The bus' error, or a chip that does not answer as it should: not powered, not wired, another chip.
    pub fn start(&mut self) -> Result<(), Error<Bus::Error>> {
        self.bus.select(Clock::Writing);
        // The range goes first: at power-up the outputs come on in whatever range is set then.
        self.send(frame(register::RANGE | ALL_CHANNELS, RANGE_10_V_BIPOLAR))?;
        self.send(frame(register::CONTROL | CONTROL_OPTIONS, OPTIONS))?;
        self.send(ALL_ZERO)?;
        self.update();
        self.send(frame(register::POWER, POWER_UP))?;
        self.delay.delay_us(POWER_UP_US);
        self.send(ALL_ZERO)?;
        self.update();
        self.codes = [0; 3];
        self.turn = 0;
        self.wrong = None;
        self.cleared = false;
        for (address, bits, item, expected) in [
            (register::RANGE, RANGE_BITS, Item::Range, RANGE_10_V_BIPOLAR),
            (register::POWER, POWER_BITS, Item::Power, POWER_UP),
        ] {
            self.ask(address)?;
            let answer = self.send_and_listen(frame(register::CONTROL | CONTROL_NOTHING, 0))?;
            if answer & bits != expected {
                return Err(Error::Mismatch {
                    item,
                    expected,
                    answered: answer,
                });
            }
        }
        let _ = self.pins.clear.set_high();
        Ok(())
    }

    /// Sets channels A, B and C at the same instant, and compares one register with what it should hold: the codes of
    /// the call before, and the power register, in turn.
    ///
    /// # Errors
    /// The bus' error, or a mismatch. Either pulls /CLR, which needs no bus: the outputs are at zero volts, not at the last
    /// codes that got through. It is let go of by the second call in a row that succeeds with all codes zero. A mismatch is
    /// reported by every call until its register reads right: a chip that has lost its supply keeps the codes that it is
    /// sent, but is no longer powered up.
    #[inline(always)]
    pub fn write(&mut self, codes: [i16; 3]) -> Result<(), Error<Bus::Error>> {
        let before = self.codes;
        let written = self.write_and_compare(codes);
        if written.is_err() && !self.cleared {
            let _ = self.pins.clear.set_low();
            self.cleared = true;
        } else if written.is_ok() && self.cleared && before == [0; 3] && codes == [0; 3] {
            let _ = self.pins.clear.set_high();
            self.cleared = false;
        }
        written
    }

    #[inline(always)]
    fn write_and_compare(&mut self, codes: [i16; 3]) -> Result<(), Error<Bus::Error>> {
        let [a, b, c] = self.codes.map(i16::cast_unsigned);
        let (address, bits, item, expected) = match self.turn {
            0 => (register::DAC, ALL_BITS, Item::Code(0), a),
            1 => (register::DAC | 1, ALL_BITS, Item::Code(1), b),
            2 => (register::DAC | 2, ALL_BITS, Item::Code(2), c),
            _ => (register::POWER, POWER_BITS, Item::Power, POWER_UP),
        };
        let turn = self.turn;
        self.turn = (turn + 1) & 3;
        let [a, b, c] = codes.map(i16::cast_unsigned);
        self.ask(address)?;
        let answered = self.send_and_listen(frame(register::DAC, a))?;
        self.send(frame(register::DAC | 1, b))?;
        self.send(frame(register::DAC | 2, c))?;
        self.update();
        self.codes = codes;
        if answered & bits != expected {
            self.wrong = Some(Wrong {
                turn,
                item,
                expected,
                answered,
            });
        } else if self.wrong.is_some_and(|wrong| wrong.turn == turn) {
            self.wrong = None;
        }
        match self.wrong {
            None => Ok(()),
            Some(wrong) => Err(Error::Mismatch {
                item: wrong.item,
                expected: wrong.expected,
                answered: wrong.answered,
            }),
        }
    }

    /// Asks for a register: the answer comes in the next frame.
    #[inline(always)]
    fn ask(&mut self, address: u8) -> Result<(), Bus::Error> {
        self.send(frame(READ | address, 0))?;
        self.delay.delay_ns(BEFORE_ANSWER_NS - BETWEEN_FRAMES_NS);
        Ok(())
    }

    /// Sends one frame. A frame cut short by an error is ignored by the chip, which counts clocks.
    #[inline(always)]
    fn send(&mut self, frame: [u8; 3]) -> Result<(), Bus::Error> {
        let _ = self.pins.sync.set_low();
        let sent = self.bus.write(&frame).and_then(|()| self.bus.flush());
        let _ = self.pins.sync.set_high();
        self.delay.delay_ns(BETWEEN_FRAMES_NS);
        sent
    }

    /// Sends one frame, slowly, and returns the data that the chip answered to the one before.
    #[inline(always)]
    fn send_and_listen(&mut self, mut frame: [u8; 3]) -> Result<u16, Bus::Error> {
        self.bus.select(Clock::Reading);
        let _ = self.pins.sync.set_low();
        let sent = self
            .bus
            .transfer_in_place(&mut frame)
            .and_then(|()| self.bus.flush());
        let _ = self.pins.sync.set_high();
        self.bus.select(Clock::Writing);
        self.delay.delay_ns(BETWEEN_FRAMES_NS);
        let [_, high, low] = frame;
        sent.map(|()| u16::from_be_bytes([high, low]))
    }

    /// Moves what was sent to the outputs.
    #[inline(always)]
    fn update(&mut self) {
        self.delay.delay_ns(BEFORE_LOAD_NS);
        let _ = self.pins.load.set_low();
        self.delay.delay_ns(LOAD_NS);
        let _ = self.pins.load.set_high();
    }
}
