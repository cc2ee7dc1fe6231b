//! The debug probe's serial port: USART 2 on PA2 and PA3, 921 600 baud, 8 bits, no parity, moved by DMA alone.
//!
//! Received bytes go round in a ring of 1 KiB, 11 ms long; what is sent is copied once and goes out while the processor
//! does something else. There are no interrupts: nothing here can delay the control tick but a few bus cycles.

use core::sync::atomic::{Ordering, fence};

use quadrant::drivers::dma_ring::DmaRing;
use quadrant::hal;
use stm32f4xx_hal::gpio::{PA2, PA3, Pull};
use stm32f4xx_hal::pac::{DMA1, USART2};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use super::dma_memory::DmaMemory;

/// Bits per second. With 45 MHz divided by 49 it is 0.35 % less.
const BAUD: u32 = 921_600;
/// Bytes of the ring.
const RING: usize = 1024;
/// Bytes sent at once: as long as the longest frame of the link.
const SENDING: usize = 512;

/// Streams of DMA 1 (RM0390, table 28): USART2_RX is stream 5, USART2_TX is stream 6, both on channel 4.
const RECEIVER: usize = 5;
const SENDER: usize = 6;
/// Channel of both streams.
const CHANNEL: u8 = 4;
/// USART_SR: all bits that a zero clears, but for that of a finished transmission.
const CLEAR_SENT: u16 = !(1 << 6);
/// DMA_HIFCR: all five flags of stream 6 (CTCIF6 to CFEIF6).
const CLEAR_SENDER: u32 = 0b11_1101 << 16;

static RECEIVED: DmaMemory<u8, RING> = DmaMemory::new([0; RING]);
static TO_SEND: DmaMemory<u8, SENDING> = DmaMemory::new([0; SENDING]);

/// The serial port.
pub(crate) struct Serial {
    dma: DMA1,
    usart: USART2,
    ring: DmaRing<RING>,
}

impl Serial {
    /// Starts to receive. DMA 1 is clocked.
    pub(super) fn new(usart: USART2, dma: DMA1, pins: (PA2, PA3), rcc: &mut Rcc) -> Self {
        let _ = pins.0.into_alternate::<7>();
        // Without the probe's chip the line would be read as noise.
        let _ = pins.1.into_alternate::<7>().internal_resistor(Pull::Up);
        USART2::enable(rcc);
        USART2::reset(rcc);
        // Oversampling by 16: USART_BRR is the divider itself (RM0390, 25.4.4).
        let divider = (rcc.clocks.pclk1().raw() + BAUD / 2) / BAUD;
        // SAFETY: mantissa and fraction together are the divider.
        usart.brr().write(|w| unsafe { w.bits(divider as u16) });
        usart.cr3().write(|w| w.dmar().set_bit().dmat().set_bit());
        usart
            .cr1()
            .write(|w| w.ue().set_bit().te().set_bit().re().set_bit());
        let data_register = usart.dr().as_ptr() as u32;

        let receiver = dma.st(RECEIVER);
        // SAFETY: the addresses are those of the data register and of static memory.
        unsafe {
            receiver.par().write(|w| w.pa().bits(data_register));
            receiver.m0ar().write(|w| w.m0a().bits(RECEIVED.address()));
            dma.st(SENDER).par().write(|w| w.pa().bits(data_register));
            dma.st(SENDER)
                .m0ar()
                .write(|w| w.m0a().bits(TO_SEND.address()));
        }
        receiver.ndtr().write(|w| w.ndt().set(RING as u16));
        receiver.cr().write(|w| {
            w.chsel().set(CHANNEL);
            w.dir().peripheral_to_memory();
            w.minc().incremented();
            w.circ().enabled()
        });
        // On its own, as the other bits are taken only while this one is clear.
        receiver.cr().modify(|_, w| w.en().enabled());
        Self {
            dma,
            usart,
            ring: DmaRing::new(),
        }
    }
}

impl hal::Serial for Serial {
    fn read(&mut self, into: &mut [u8]) -> usize {
        // Reading the status, and the stream reading the data after it, clears the flags of a noisy or broken line.
        let _ = self.usart.sr().read();
        let remaining = self.dma.st(RECEIVER).ndtr().read().ndt().bits();
        // What the counter says was written is read after the counter.
        fence(Ordering::Acquire);
        self.ring
            .read(remaining.into(), |index| RECEIVED.read(index), into)
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        let sender = self.dma.st(SENDER);
        // The hardware clears the bit when the last byte is on its way.
        if bytes.is_empty() || sender.cr().read().en().is_enabled() {
            return 0;
        }
        let count = bytes.len().min(SENDING);
        // The stream, which reads this memory, is off.
        TO_SEND.write(0, bytes.iter().copied().take(SENDING));
        fence(Ordering::Release);
        // SAFETY: ones clear these flags, zeros leave the other streams' alone.
        self.dma.hifcr().write(|w| unsafe { w.bits(CLEAR_SENDER) });
        // SAFETY: ones leave a flag of this register as it is. Only by this is it clear until the last of these bytes is out.
        self.usart.sr().write(|w| unsafe { w.bits(CLEAR_SENT) });
        sender.ndtr().write(|w| w.ndt().set(count as u16));
        sender.cr().write(|w| {
            w.chsel().set(CHANNEL);
            w.dir().memory_to_peripheral();
            w.minc().incremented()
        });
        sender.cr().modify(|_, w| w.en().enabled());
        count
    }

    fn has_sent(&mut self) -> bool {
        let is_sending = self.dma.st(SENDER).cr().read().en().is_enabled();
        !is_sending && self.usart.sr().read().tc().bit_is_set()
    }
}
