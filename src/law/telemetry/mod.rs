//! Telemetry: every term of the law at one tick.
//!
//! [`AxisTelemetry`] is what the tick leaves behind. A [`Channel`] names one number of it, a [`Selection`] up to
//! [`MAX_CHANNELS`] of them; the [`Sampler`] reads a selection in the control interrupt, and the [`Packer`] makes blocks of
//! the samples for the link.

mod channel;
mod observation;
mod packer;
mod sampler;
mod selection;

pub use channel::{AxisSignal, Channel, MachineState, StageSignal, UnknownChannel, WordKind};
pub use observation::Observation;
pub use packer::{BLOCK_BYTES, BLOCK_WORDS, Packer, TelemetryBlock, Words};
pub use sampler::{Sample, Sampler, SamplerState};
pub use selection::{MAX_CHANNELS, Selection, SelectionError};

pub use crate::law::axis::telemetry::{AxisTelemetry, LimitedBy};
