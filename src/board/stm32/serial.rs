//! The debug probe's serial port: 921 600 baud, 8 bits, no parity, moved by DMA alone.
//!
//! Received bytes go round in a ring of 1 KiB, 11 ms long; what is sent is copied once and goes out while the processor
//! does something else. There are no interrupts: nothing here can delay the control tick but a few bus cycles.

use core::sync::atomic::{Ordering, fence};

use quadrant::drivers::dma_ring::DmaRing;
use quadrant::hal;

use super::dma_memory::DmaMemory;
use crate::board::chip::pac::DMA1;
use crate::board::chip::{UART_STREAM, Usart};

/// Bits per second.
pub(crate) const BAUD: u32 = 921_600;
/// Bytes of the ring.
const RING: usize = 1024;
/// Bytes sent at once: as long as the longest frame of the link.
const SENDING: usize = 512;

/// Streams of DMA 1 for what the port receives and sends.
pub(crate) const RECEIVER: usize = 5;
pub(crate) const SENDER: usize = 6;
/// DMA_SxCR (RM0390, 9.5.5; RM0433, 15.5.5): memory incremented (MINC), round and round (CIRC) or from memory (DIR); the chip
/// adds what selects the request.
const RECEIVER_CR: u32 = UART_STREAM | 1 << 10 | 1 << 8;
const SENDER_CR: u32 = UART_STREAM | 1 << 10 | 0b01 << 6;
/// DMA_SxCR, EN: on its own, as the other bits are taken only while this one is clear.
const ON: u32 = 1;
/// DMA_HIFCR: all five flags of stream 6 (CTCIF6 to CFEIF6).
const CLEAR_SENDER: u32 = 0b11_1101 << 16;

#[unsafe(link_section = ".bss.dma.received")]
static RECEIVED: DmaMemory<u8, RING> = DmaMemory::new([0; RING]);
#[unsafe(link_section = ".bss.dma.to_send")]
static TO_SEND: DmaMemory<u8, SENDING> = DmaMemory::new([0; SENDING]);

/// The serial port.
pub(crate) struct Serial {
    dma: DMA1,
    usart: Usart,
    ring: DmaRing<RING>,
}

impl Serial {
    /// Starts to receive. DMA 1 is clocked.
    pub(crate) fn new(usart: Usart, dma: DMA1) -> Self {
        let (data_out, data_in) = usart.data_addresses();
        // SAFETY: the addresses are those of the data registers and of static memory, the rest is the manual's.
        unsafe {
            let receiver = dma.st(RECEIVER);
            receiver.par().write(|w| w.bits(data_in));
            receiver.m0ar().write(|w| w.bits(RECEIVED.address()));
            receiver.ndtr().write(|w| w.bits(RING as u32));
            receiver.cr().write(|w| w.bits(RECEIVER_CR));
            receiver.cr().write(|w| w.bits(RECEIVER_CR | ON));
            let sender = dma.st(SENDER);
            sender.par().write(|w| w.bits(data_out));
            sender.m0ar().write(|w| w.bits(TO_SEND.address()));
        }
        Self {
            dma,
            usart,
            ring: DmaRing::new(),
        }
    }
}

impl hal::Serial for Serial {
    fn read(&mut self, into: &mut [u8]) -> usize {
        self.usart.forget_errors();
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
        self.usart.forget_sent();
        // SAFETY: the values are the manual's, and the stream is off.
        unsafe {
            sender.ndtr().write(|w| w.bits(count as u32));
            sender.cr().write(|w| w.bits(SENDER_CR));
            sender.cr().write(|w| w.bits(SENDER_CR | ON));
        }
        count
    }

    fn has_sent(&mut self) -> bool {
        let is_sending = self.dma.st(SENDER).cr().read().en().is_enabled();
        !is_sending && self.usart.has_sent()
    }
}
