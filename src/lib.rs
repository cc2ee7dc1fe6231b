//! Quadrant: servo control that removes friction's quadrant glitches from machine-tool axes.
//!
//! This crate is everything about the control of an axis that is not a register: it knows no operating system, no heap
//! and no chip. The firmware (the binary of this package) and the host tools (`quadrant-sim`) both stand on it and
//! share nothing else.
//!
//! # From settings to volts
//!
//! ```text
//!   settings::StageSettings   SI units, edited by people, checked as a whole
//!        | build               slow: tables are filled, bounds are searched, f64
//!        v
//!   stage::Stage              what the tick reads, immutable
//!        | tick(plan, state, inputs) -> outputs      pure, bounded, never panics
//!        v
//!   encoder -> reference -> control + feedforward -> converter word
//! ```
//!
//! One tick of one axis ([`axis`]):
//!
//! 1. [`encoder`]: the raw counter is differenced, wrap-safe, and accumulated.
//! 2. [`mod@reference`]: the motion's next position, an integer ([`units::Position`]); the error is formed in integers and
//!    only then becomes a number.
//! 3. [`feedforward`]: friction ([`friction`]) and inertia from the reference alone, as far ahead as the plant's delay;
//!    each effect is counted once.
//! 4. [`control`]: PID on the error, or on the error times the nonlinear gain (N-PID), within what the output limit leaves.
//! 5. The converter's word, and [`telemetry`] with every term of the law.
//!
//! [`safety`] decides whether any of this reaches the amplifiers: the stage starts disabled, and a fault switches it off
//! in the tick that finds it, or brakes it under control where that is safer. [`app::supervisor`] stands between a person's requests and the tick.
//!
//! # One law, three number types
//!
//! The law is generic over [`scalar::Scalar`]: `f32` on a target with a floating-point unit, [`scalar::Fixed`] on one
//! without, `f64` on the host as the reference for numeric error. `f32` results are the same to the bit on host and
//! target: plain IEEE operations in one order, no fused multiply-add, and [`libm`] for what is tabulated.
//!
//! # An axis in ten lines
//!
//! ```
//! use quadrant_law::axes::PerAxis;
//! use quadrant_law::command::Command;
//! use quadrant_law::reference::Motion;
//! use quadrant_settings::StageSettings;
//! use quadrant_law::stage::{Inputs, Stage, StageState};
//!
//! let stage: Stage<f32> = StageSettings::simulated().build()?;
//! let plan = PerAxis::from_fn(|_| Motion::Hold);
//! let mut state = StageState::default();
//! let enable = Inputs { command: Some(Command::Enable), ..Inputs::default() };
//! assert!(stage.tick(&plan, &mut state, &enable).enabled);
//! // One count (0.5 um) away from where it was enabled, the stage pushes back.
//! let moved = Inputs::of_counts([1, 0, 0]);
//! assert!(stage.tick(&plan, &mut state, &moved).codes[0].0 < 0);
//! # Ok::<(), quadrant_settings::SettingsError>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod app;
pub mod drivers;
pub mod hal;
pub mod lockstep;
pub mod store;

/// The messages of the link, a crate of their own.
pub use quadrant_link as link;
