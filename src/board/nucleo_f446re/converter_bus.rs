//! SPI 2, as the converter wants it: mode 1, a choice of two clocks, and no wait without an end.

use embedded_hal::spi::{Error, ErrorKind, ErrorType, SpiBus};
use quadrant::drivers::ad5754r::{Clock, SelectClock};
use stm32f4xx_hal::gpio::{PB13, PB14, PB15, Pull, Speed};
use stm32f4xx_hal::pac::SPI2;
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

/// Clock of the bus, Hz: 45 MHz divided by two; the converter listens at up to 30 MHz.
pub(super) const WRITING_HZ: u32 = 22_500_000;
/// Clock of the bus while the converter answers, Hz: 45 MHz divided by eight. A quarter would leave 44 ns from edge to
/// edge, of which SDO may take 40 ns and the processor's input needs some.
pub(super) const READING_HZ: u32 = 5_625_000;

/// SPI_CR1 (RM0390, 26.7.1): clock phase 1 (CPHA), master (MSTR), on (SPE), and slave select by software (SSI, SSM).
const CR1: u16 = 1 | 1 << 2 | 1 << 6 | 1 << 8 | 1 << 9;
/// SPI_CR1, bits BR: the peripheral clock divided by 2 and by 8.
const BY_2: u16 = 0b000 << 3;
const BY_8: u16 = 0b010 << 3;

/// Largest number of polls of the bus before giving up. A byte takes 256 cycles of the processor at the slow clock, a look
/// about ten.
const PATIENCE: u32 = 400;

/// The bus did not do its work in time: it is not clocked, or was switched off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stuck;

impl Error for Stuck {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// The converter's bus.
pub(super) struct ConverterBus {
    spi: SPI2,
}

impl ConverterBus {
    /// Starts the bus.
    pub(super) fn new(spi: SPI2, clock: PB13, answer: PB14, data: PB15, rcc: &mut Rcc) -> Self {
        let _ = clock.into_alternate::<5>().speed(Speed::VeryHigh);
        let _ = data.into_alternate::<5>().speed(Speed::VeryHigh);
        // A converter that is not there answers with ones.
        let _ = answer.into_alternate::<5>().internal_resistor(Pull::Up);
        SPI2::enable(rcc);
        SPI2::reset(rcc);
        let mut bus = Self { spi };
        bus.select(Clock::Writing);
        bus
    }

    /// Exchanges one byte.
    #[inline(always)]
    fn exchange(&mut self, byte: u8) -> Result<u8, Stuck> {
        self.spi.dr8().write(|w| w.dr().set(byte));
        // The byte is in when the last edge of the clock has passed.
        for _ in 0..PATIENCE {
            if self.spi.sr().read().rxne().bit_is_set() {
                return Ok(self.spi.dr8().read().dr().bits());
            }
        }
        Err(Stuck)
    }
}

impl SelectClock for ConverterBus {
    /// "These bits should not be changed when communication is ongoing": between frames it is not.
    #[inline(always)]
    fn select(&mut self, clock: Clock) {
        let rate = match clock {
            Clock::Writing => BY_2,
            Clock::Reading => BY_8,
        };
        // SAFETY: the value is the manual's, as the constants say.
        self.spi.cr1().write(|w| unsafe { w.bits(CR1 | rate) });
        // A byte that came too late for its exchange must not be taken for the next one's.
        if self.spi.sr().read().rxne().bit_is_set() {
            let _ = self.spi.dr8().read();
        }
    }
}

impl ErrorType for ConverterBus {
    type Error = Stuck;
}

impl SpiBus for ConverterBus {
    fn read(&mut self, words: &mut [u8]) -> Result<(), Stuck> {
        for word in words {
            *word = self.exchange(0)?;
        }
        Ok(())
    }

    #[inline(always)]
    fn write(&mut self, words: &[u8]) -> Result<(), Stuck> {
        for word in words {
            self.exchange(*word)?;
        }
        Ok(())
    }

    fn transfer(&mut self, read: &mut [u8], write: &[u8]) -> Result<(), Stuck> {
        let longest = read.len().max(write.len());
        let mut sent = write.iter();
        let mut received = read.iter_mut();
        for _ in 0..longest {
            let word = self.exchange(sent.next().copied().unwrap_or(0))?;
            if let Some(slot) = received.next() {
                *slot = word;
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Stuck> {
        for word in words {
            *word = self.exchange(*word)?;
        }
        Ok(())
    }

    /// Every byte sent was also received, which is at the middle of its last bit; waits for the rest of that bit.
    #[inline(always)]
    fn flush(&mut self) -> Result<(), Stuck> {
        for _ in 0..PATIENCE {
            if !self.spi.sr().read().bsy().bit_is_set() {
                return Ok(());
            }
        }
        Err(Stuck)
    }
}
