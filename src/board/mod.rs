//! The machines the firmware runs on. Registers and `unsafe` live here and nowhere else.
//!
//! Each board offers the same small set of pieces, so one RTIC application serves them all:
//!
//! - `device`: what RTIC needs to know of the chip, with interrupts named by their *role*
//!   (`CONTROL_TICK`, `DISPATCHER_0`..`DISPATCHER_2`) instead of by the peripheral behind them;
//! - `Board::init`, which starts the chip and returns `encoders`, `operator`, `amplifiers`, `tick` and `idle`, and on
//!   the reference board `switches`, `serial`, `watchdog`, `flash` and `reset_cause`: the traits are in
//!   `quadrant::hal`;
//! - `RATES_HZ`, the control rates that the board is up to;
//! - `TAKE_LOG`, which takes bytes out of the log's buffer for the link;
//! - `job`, what a host has left to run, if there is one;
//! - `outputs_off`, which makes the machine safe from any context without owning anything;
//! - `halt`, which never returns;
//! - `board_memory.x`, the linker's map, with the stack at the bottom of RAM (`stack`).
//!
//! `crash_record` keeps the cause of a panic or a fault until the next start, and `start_record` how many starts in a row
//! have not lasted, on any board.
//!
//! `docs/porting.md` describes how a board is added.

#[cfg(any(
    all(feature = "board-mps2", feature = "board-nucleo-f446re"),
    all(feature = "board-mps2", feature = "board-nucleo-h743zi2"),
    all(feature = "board-nucleo-f446re", feature = "board-nucleo-h743zi2")
))]
compile_error!("choose one board: `board-mps2`, `board-nucleo-f446re` or `board-nucleo-h743zi2`");

#[cfg(all(feature = "output-on-chip", feature = "board-nucleo-h743zi2"))]
compile_error!("`output-on-chip` is of `board-nucleo-f446re` alone");

pub(crate) mod crash_record;
mod fault;
mod record;
pub(crate) mod stack;
pub(crate) mod start_record;

#[cfg(feature = "board-mps2")]
mod mps2;
#[cfg(feature = "board-mps2")]
pub(crate) use mps2::*;

#[cfg(feature = "board-nucleo-f446re")]
mod nucleo_f446re;
#[cfg(feature = "board-nucleo-f446re")]
pub(crate) use nucleo_f446re::*;

#[cfg(feature = "board-nucleo-h743zi2")]
mod nucleo_h743zi2;
#[cfg(feature = "board-nucleo-h743zi2")]
pub(crate) use nucleo_h743zi2::*;

#[cfg(any(feature = "board-nucleo-f446re", feature = "board-nucleo-h743zi2"))]
mod stm32;
#[cfg(any(feature = "board-nucleo-f446re", feature = "board-nucleo-h743zi2"))]
pub(crate) use stm32::*;

/// Forgets that the thread has used the floating-point unit, which the start has: until then every interrupt makes room for
/// its registers, 26 words instead of 8. To be called by the idle thread, which computes with none.
#[inline(always)]
pub(crate) fn release_float_registers() {
    use cortex_m::register::control::{self, Fpca};
    let mut control = control::read();
    control.set_fpca(Fpca::NotActive);
    // SAFETY: stack pointer and privilege stay as they are, and nothing that the caller has kept is in a register of the
    // floating-point unit.
    unsafe { control::write(control) };
}

/// The report of [`Idle::turn`] at the end of a run.
///
/// Only the emulated machine ever finishes.
pub(crate) struct Finished {
    /// Control ticks that ran.
    pub(crate) ticks: u32,
    /// Time from the start of the control timer to the last tick of a paced run, in microseconds of the firmware's own
    /// clock; zero when nothing paced the run.
    pub(crate) microseconds: u32,
}

/// The outcome of a program.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// It did all it was asked to.
    Done,
    /// It met a panic or a fault.
    Failed,
}
