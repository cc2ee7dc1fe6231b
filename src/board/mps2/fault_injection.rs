//! Fault injection by the host, from the idle loop.

use core::sync::atomic::Ordering;

use cortex_m::peripheral::NVIC;
use quadrant_lockstep::{
    HANGS_FROM, HANGS_UNTIL, INJECTED_FAULT, INJECTED_FAULT_TICK, InjectedFault,
};

use super::device::Interrupt;
use super::{mailbox, timer};

/// An address behind which there is nothing on this machine.
const NOWHERE: u32 = 0x6000_0000;

/// Injects the host's fault, if it is due at this tick.
#[inline(always)]
pub(super) fn act_on(tick: u32) {
    if mailbox::read(INJECTED_FAULT) != 0 && mailbox::read(INJECTED_FAULT_TICK) == tick {
        act();
    }
}

#[cold]
#[inline(never)]
fn act() {
    let fault = InjectedFault::from_repr(mailbox::read(INJECTED_FAULT));
    // Once: the firmware after this one shall live.
    mailbox::write(INJECTED_FAULT, 0);
    match fault {
        Some(InjectedFault::Panic) => panic!("the host wants to see a panic"),
        Some(InjectedFault::UndefinedInstruction) => cortex_m::asm::udf(),
        Some(InjectedFault::BusError) => {
            // SAFETY: no object is there, and nothing else: the processor faults.
            unsafe { core::ptr::read_volatile(NOWHERE as *const u32) };
        }
        Some(InjectedFault::StackOverflow) => {
            dig(0);
        }
        Some(InjectedFault::StrayInterrupt) => {
            // SAFETY: nothing relies on its being masked; `DefaultHandler` is its vector.
            unsafe { NVIC::unmask(Interrupt::WITHOUT_HANDLER) };
            NVIC::pend(Interrupt::WITHOUT_HANDLER);
            cortex_m::asm::dsb();
            cortex_m::asm::isb();
        }
        Some(InjectedFault::Hang) => hang(),
        Some(InjectedFault::LateTick) => mask_interrupts(),
        None => {}
    }
}

/// Uses 256 bytes of the stack at each level; there are more levels than any stack has room for.
#[inline(never)]
fn dig(depth: u32) -> u32 {
    let room = core::hint::black_box([depth; 64]);
    if depth == u32::MAX {
        return depth;
    }
    let below = dig(depth + 1);
    // Needs the room after the call, so that no level can give its own back.
    below.wrapping_add(core::hint::black_box(room)[0])
}

/// Records by the clock for how long.
fn hang() -> ! {
    cortex_m::interrupt::disable();
    mailbox::write(HANGS_FROM, timer::CLOCK.value());
    loop {
        mailbox::write(HANGS_UNTIL, timer::CLOCK.value());
    }
}

/// Masks interrupts for a control period and a half: the next tick is late, and none is lost.
fn mask_interrupts() {
    cortex_m::interrupt::free(|_| {
        let from = timer::CLOCK.value();
        let cycles = timer::PERIOD.load(Ordering::Relaxed) / 2 * 3;
        // The clock counts down.
        while from.wrapping_sub(timer::CLOCK.value()) < cycles {}
    });
}
