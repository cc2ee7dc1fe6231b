//! The CMSDK APB timers: 32-bit down-counters with reload.

use core::sync::atomic::AtomicU32;

/// Clock of the timers and of the processor.
pub(super) const CLOCK_HZ: u32 = 25_000_000;

/// Cycles between two control ticks.
pub(super) static PERIOD: AtomicU32 = AtomicU32::new(u32::MAX);

/// Control register: count.
const CTRL_ENABLE: u32 = 1;
/// Control register: interrupt on reload.
const CTRL_INTERRUPT: u32 = 1 << 3;

/// One timer, by the address of its registers.
#[derive(Clone, Copy)]
pub(super) struct Timer(u32);

/// The control tick's timer.
pub(super) const CONTROL: Timer = Timer(0x4000_0000);
/// A free-running timer, the firmware's own idea of time.
pub(super) const CLOCK: Timer = Timer(0x4000_1000);

impl Timer {
    const CTRL: u32 = 0;
    const VALUE: u32 = 4;
    const RELOAD: u32 = 8;
    const INTERRUPT: u32 = 12;

    /// Starts counting down from `reload`, over and over.
    pub(super) fn start(self, reload: u32, interrupt: bool) {
        self.write(Self::CTRL, 0);
        self.write(Self::RELOAD, reload);
        self.write(Self::VALUE, reload);
        self.acknowledge();
        self.write(
            Self::CTRL,
            if interrupt {
                CTRL_ENABLE | CTRL_INTERRUPT
            } else {
                CTRL_ENABLE
            },
        );
    }

    /// Stops counting.
    #[inline(always)]
    pub(super) fn stop(self) {
        self.write(Self::CTRL, 0);
    }

    /// Cycles left until the next reload.
    #[inline(always)]
    pub(super) fn value(self) -> u32 {
        self.read(Self::VALUE)
    }

    /// True if a reload has not been acknowledged.
    #[inline(always)]
    pub(super) fn is_due(self) -> bool {
        self.read(Self::INTERRUPT) & 1 != 0
    }

    /// Waits for the next reload, with a limit.
    #[cold]
    #[inline(never)]
    pub(super) fn wait_until_due(self) {
        for _ in 0..CLOCK_HZ {
            if self.is_due() {
                return;
            }
        }
    }

    /// Clears the interrupt.
    #[inline(always)]
    pub(super) fn acknowledge(self) {
        self.write(Self::INTERRUPT, 1);
    }

    #[inline(always)]
    fn read(self, register: u32) -> u32 {
        // SAFETY: only the two constants above exist, and they are the addresses of timers.
        unsafe { core::ptr::read_volatile((self.0 + register) as *const u32) }
    }

    #[inline(always)]
    fn write(self, register: u32, value: u32) {
        // SAFETY: as in `read`; the timers touch no memory.
        unsafe { core::ptr::write_volatile((self.0 + register) as *mut u32, value) }
    }
}
