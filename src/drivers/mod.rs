//! The layer between the traits of [`hal`](crate::hal) and a chip's registers, as far as it needs none of them: chips
//! behind a bus, and the arithmetic of counters, filters and rings. All of it is tested on the host.

pub mod ad5754r;
pub mod counter;
pub mod dma_ring;
pub mod hold_button;
pub mod input_filter;
pub mod reset_flags;
pub mod serial_encoder;
pub mod step_counter;
pub mod switch_inputs;
pub mod tick_interval;
