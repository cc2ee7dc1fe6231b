//! What a host makes the firmware do to itself, from the idle loop: see that it is found.

use cortex_m::peripheral::NVIC;
use quadrant::link::lockstep::{
    HANGS_FROM, HANGS_UNTIL, PROVOCATION, PROVOCATION_TICK, Provocation,
};

use super::device::Interrupt;
use super::{mailbox, timer};

/// An address behind which there is nothing on this machine.
const NOWHERE: u32 = 0x6000_0000;

/// Does what the host has asked for, if it is asked for at this tick.
#[inline(always)]
pub(super) fn act_on(tick: u32) {
    if mailbox::read(PROVOCATION) != 0 && mailbox::read(PROVOCATION_TICK) == tick {
        act();
    }
}

#[cold]
#[inline(never)]
fn act() {
    let provocation = Provocation::from_word(mailbox::read(PROVOCATION));
    // Once: the firmware after this one shall live.
    mailbox::write(PROVOCATION, 0);
    match provocation {
        Some(Provocation::Panic) => panic!("the host wants to see a panic"),
        Some(Provocation::UndefinedInstruction) => cortex_m::asm::udf(),
        Some(Provocation::BusError) => {
            // SAFETY: no object is there, and nothing else: the processor faults.
            unsafe { core::ptr::read_volatile(NOWHERE as *const u32) };
        }
        Some(Provocation::StackOverflow) => {
            dig(0);
        }
        Some(Provocation::StrayInterrupt) => {
            // SAFETY: nothing relies on its being masked; `DefaultHandler` is its vector.
            unsafe { NVIC::unmask(Interrupt::WITHOUT_HANDLER) };
            NVIC::pend(Interrupt::WITHOUT_HANDLER);
            cortex_m::asm::dsb();
            cortex_m::asm::isb();
        }
        Some(Provocation::Hang) => hang(),
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

/// Says by the clock for how long.
fn hang() -> ! {
    cortex_m::interrupt::disable();
    mailbox::write(HANGS_FROM, timer::CLOCK.value());
    loop {
        mailbox::write(HANGS_UNTIL, timer::CLOCK.value());
    }
}
