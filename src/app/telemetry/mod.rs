//! Telemetry: the control interrupt samples a selection of channels, the server makes blocks of the samples.
//!
//! A [`Channel`](quadrant_link::message::Channel) names one number, a [`Selection`] up to
//! [`MAX_CHANNELS`](quadrant_link::message::MAX_CHANNELS) of them. The [`Sampler`] reads a selection in the control interrupt,
//! and the [`Packer`] makes blocks of the samples for the link.

mod packer;
mod read;
mod sampler;
mod selection;

pub use packer::Packer;
pub(crate) use read::shown;
pub use read::{Observation, read};
pub use sampler::{Sample, Sampler, SamplerState};
pub use selection::{Selection, SelectionError};
