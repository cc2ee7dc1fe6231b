//! Analog Devices AD5754R: four 16-bit outputs of up to ±10 V behind SPI, three of them used.
//!
//! Frames are 24 bits, most significant first: bit 23 asks for a read, bits 21..16 name register and channel, then come
//! 16 bits of data. The chip reads SDIN at the falling edge of the clock (SPI mode 1), at up to 30 MHz. /SYNC frames one
//! register; the new codes appear at the outputs together, at the falling edge of /LDAC. While /CLR is low all outputs
//! are at zero volts, independent of the bus. The pin BIN//2sCOMP must be tied low: codes are then two's complement, and
//! zero is zero volts.
//!
//! # Beside the computation
//! Nobody waits for the bus. [`Ad5754r::write`] starts three frames with the codes, /LDAC and a fourth frame, and returns; hardware
//! sends them ([`steps`]). [`Ad5754r::begin`], at the beginning of the next tick, checks that all of it left.
//!
//! # Read-back
//! A frame with bit 23 set asks for a register; the chip shifts it out through SDO in the frame that follows, independent
//! of that frame's content. SDO is valid up to 40 ns after the clock's rising edge and is sampled at the falling one, so that
//! frame needs a clock below about 10 MHz. The fourth frame of a write asks, and the chip answers in a slow one that
//! [`Ad5754r::begin`] starts: the codes of A, B and C and the power register in turn. A wrong code, a chip that lost its
//! supply, an overloaded or overheated output and a broken SDO are found within four ticks.

pub mod steps;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;

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
/// The bits of a code's register: all.
const ALL_BITS: u16 = u16::MAX;

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

/// The frame that changes nothing, in which the chip answers.
const NOTHING: [u8; 3] = frame(register::CONTROL | CONTROL_NOTHING, 0);

/// The bus, /SYNC and /LDAC, which work on their own.
pub trait Sequencer {
    /// The error of a bus that did not work.
    type Error: Copy;

    /// Starts to send three frames, to pulse /LDAC, and to send the fourth frame, as fast as the chip can receive. Returns at once;
    /// what was started before has been finished.
    fn start_writing(&mut self, frames: [[u8; 3]; 4]);

    /// Starts to send a frame as slowly as the chip can answer. Returns at once; what was started before has been finished.
    fn start_reading(&mut self, frame: [u8; 3]);

    /// Returns what was received in the first frame of what was started last. Waits for its end if it has not come, but not for
    /// longer than it takes.
    ///
    /// # Errors
    /// It has not come to its end; it is stopped, and the pins are high.
    fn finish(&mut self) -> Result<[u8; 3], Self::Error>;
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

/// The converter with its bus to itself.
pub struct Ad5754r<Bus: Sequencer, Clear, Delay> {
    bus: Bus,
    /// /CLR: outputs are at zero volts while it is low.
    clear: Clear,
    delay: Delay,
    /// The codes written last.
    codes: [i16; 3],
    /// The register asked for last: 0 to 2 a code, 3 the power register.
    turn: u8,
    /// The failure of what was started last, found at the beginning of this tick.
    failed: Option<Bus::Error>,
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

impl<Bus, Clear, Delay> Ad5754r<Bus, Clear, Delay>
where
    Bus: Sequencer,
    Clear: OutputPin,
    Delay: DelayNs,
{
    /// A converter that was not started: its outputs are held at zero volts by /CLR.
    pub fn new(bus: Bus, mut clear: Clear, delay: Delay) -> Self {
        // The pin belongs to the processor and cannot fail.
        let _ = clear.set_low();
        Self {
            bus,
            clear,
            delay,
            codes: [0; 3],
            turn: 0,
            failed: None,
            wrong: None,
            cleared: false,
        }
    }

    /// Powers the converter up, at zero volts on all outputs, and checks that it carried out its commands; only then it lets
    /// go of /CLR.
    ///
    /// # Errors
    /// The bus' error, or a chip that does not answer as it should: not powered, not wired, another chip.
    pub fn start(&mut self) -> Result<(), Error<Bus::Error>> {
        // The range goes first: at power-up the outputs come on in the range that is set then.
        self.bus.start_writing([
            frame(register::RANGE | ALL_CHANNELS, RANGE_10_V_BIPOLAR),
            frame(register::CONTROL | CONTROL_OPTIONS, OPTIONS),
            ALL_ZERO,
            frame(register::POWER, POWER_UP),
        ]);
        self.bus.finish()?;
        self.delay.delay_us(POWER_UP_US);
        for (address, bits, item, expected) in [
            (register::RANGE, RANGE_BITS, Item::Range, RANGE_10_V_BIPOLAR),
            (register::POWER, POWER_BITS, Item::Power, POWER_UP),
        ] {
            self.zero_and_ask(address);
            self.bus.finish()?;
            self.bus.start_reading(NOTHING);
            let answered = data(self.bus.finish()?);
            if answered & bits != expected {
                return Err(Error::Mismatch {
                    item,
                    expected,
                    answered,
                });
            }
        }
        self.zero_and_ask(register::DAC);
        let _ = self.clear.set_high();
        Ok(())
    }

    /// Starts to set all outputs to zero volts, and to ask for a register.
    fn zero_and_ask(&mut self, address: u8) {
        self.bus
            .start_writing([ALL_ZERO, NOTHING, NOTHING, question(address)]);
    }

    /// Checks that the last write came to its end, and starts to read what it asked for. To be called at the beginning of a tick,
    /// once before each [`write`](Self::write).
    ///
    /// # Errors
    /// The bus' error. It pulls /CLR, as that of `write`, which will report it as well.
    #[inline(always)]
    pub fn begin(&mut self) -> Result<(), Error<Bus::Error>> {
        match self.bus.finish() {
            Ok(_) => {
                self.bus.start_reading(NOTHING);
                self.failed = None;
                Ok(())
            }
            Err(error) => {
                self.failed = Some(error);
                self.hold_at_zero();
                Err(error.into())
            }
        }
    }

    /// Starts to set channels A, B and C, which change at the same instant, and compares one register with what it should hold:
    /// the codes of the call before, and the power register, in turn.
    ///
    /// # Errors
    /// The bus' error, or a mismatch. Either pulls /CLR, which needs no bus: the outputs are at zero volts, not at the last
    /// codes that got through. It is let go of by the second call in a row that succeeds with all codes zero. A mismatch is
    /// reported by every call until its register reads right: a chip that has lost its supply keeps the codes that it is
    /// sent, but is no longer powered up.
    #[inline(always)]
    pub fn write(&mut self, codes: [i16; 3]) -> Result<(), Error<Bus::Error>> {
        let received = match self.failed {
            None => self.bus.finish(),
            Some(error) => Err(error),
        };
        let (turn, before) = (self.turn, self.codes);
        self.turn = (turn + 1) & 3;
        self.codes = codes;
        let address = match self.turn {
            3 => register::POWER,
            channel => register::DAC | channel,
        };
        let [a, b, c] = codes.map(i16::cast_unsigned);
        self.bus.start_writing([
            frame(register::DAC, a),
            frame(register::DAC | 1, b),
            frame(register::DAC | 2, c),
            question(address),
        ]);
        let written = match received {
            Ok(received) => self.compare(turn, before, data(received)),
            Err(error) => Err(Error::Bus(error)),
        };
        if written.is_err() {
            self.hold_at_zero();
        } else if self.cleared && before == [0; 3] && codes == [0; 3] {
            let _ = self.clear.set_high();
            self.cleared = false;
        }
        written
    }

    /// Pulls /CLR, once.
    #[inline(always)]
    fn hold_at_zero(&mut self) {
        if !self.cleared {
            let _ = self.clear.set_low();
            self.cleared = true;
        }
    }

    /// Compares an answer with what its register should hold, and remembers a wrong one.
    #[inline(always)]
    fn compare(
        &mut self,
        turn: u8,
        codes: [i16; 3],
        answered: u16,
    ) -> Result<(), Error<Bus::Error>> {
        let [a, b, c] = codes.map(i16::cast_unsigned);
        let (bits, item, expected) = match turn {
            0 => (ALL_BITS, Item::Code(0), a),
            1 => (ALL_BITS, Item::Code(1), b),
            2 => (ALL_BITS, Item::Code(2), c),
            _ => (POWER_BITS, Item::Power, POWER_UP),
        };
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
}

/// The frame that asks for a register.
#[inline(always)]
const fn question(address: u8) -> [u8; 3] {
    frame(READ | address, 0)
}

/// The data of a frame.
#[inline(always)]
const fn data([_, high, low]: [u8; 3]) -> u16 {
    u16::from_be_bytes([high, low])
}
