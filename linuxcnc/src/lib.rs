//! LinuxCNC as a board: the realtime component `quadrant`, and `quadrant_plant`, the simulated stage as another.
//!
//! HAL pins are the registers of this board, and a HAL thread is its timer. The application around the law is the firmware's:
//! [`board`] runs its fast half in the realtime function, [`slow`] supervision, server and settings in a thread that is not
//! realtime, and bounded queues lie between them. [`reference`](mod@reference) makes the law's reference of LinuxCNC's command, [`fault`] has the faults that the law does not
//! know, and [`plant`] is the simulated stage. `linuxcnc/c` has the components in C: they export pins, copy them to the
//! structures here and back, and call the functions of [`abi`].
//!
//! In the realtime function nothing is allocated, locked or waited for.

#[allow(unsafe_code)]
pub mod abi;
pub mod board;
mod encoder_scale;
pub mod fault;
pub mod plant;
mod port;
pub mod reference;
pub mod slow;
