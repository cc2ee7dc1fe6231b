//! Feedback: the laws, and the model they are designed on.
//!
//! An axis runs one law of [`feedback::LawKind`], chosen in its settings and exchanged without a jolt. All of them close
//! in the same way (one integrator, held back by what the output limit leaves) and keep the same memory
//! ([`terms::FeedbackState`]), and at small errors each is a PID
//! (`FeedbackSettings::linear_gains` of the settings): that is what their stability is judged by.
//!
//! | law | module | acts on |
//! |-----|--------|---------|
//! | PD, PID | [`pid`] | the error |
//! | N-PID | [`npid`] | the error times a gain that grows with it |
//! | gain scheduling | [`schedule`] | the error, with gains that depend on the reference's speed |
//! | cascade P/PI | [`cascade`] | a velocity error, its set point made from the error |
//! | sliding mode | [`sliding_mode`] | the distance from a line in the phase plane, saturated |
//! | NCTF | [`nctf`] | the distance from a measured trajectory in the phase plane |
//!
//! [`terms`] are the input, the output and the memory of a law, [`surface`] is the PI that the last three have in common and [`plant_model`] the linear
//! model of the axis. [`filter`] is behind any law: notch and low-pass for axes with a resonance.

pub mod cascade;
mod derivative;
pub mod feedback;
pub mod filter;
mod integrator;
pub mod nctf;
pub mod npid;
pub mod pid;
pub mod plant_model;
pub mod schedule;
pub mod sliding_mode;
pub mod surface;
pub mod terms;
