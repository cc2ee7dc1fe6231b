//! The control law: from an encoder's counts to a converter's word, and everything that one tick reads and writes.
//!
//! Pure: no register, no operating system, no heap, no clock, and no two files import each other. It depends on `libm` and
//! `heapless`; the features `serde`, `names` and `settings` add derives to what a person sets.
//!
//! # One tick
//!
//! [`stage::Stage::tick`] is called once per control period, 10 000 times a second by default. It takes
//! [`stage::Inputs`], changes a [`stage::StageState`], and returns [`stage::Outputs`]. In order:
//!
//! | step | does | in |
//! |------|------|----|
//! | 1 | differences each encoder's counter and accumulates it | [`encoder`] |
//! | 2 | checks the reading: age, both lines at once, jump, index, speed, lost signal | [`safety::monitor`] |
//! | 3 | reports bad inputs; makes faults of them if the outputs are driven | [`stage`], [`safety`] |
//! | 4 | acts on a command, if it may start now | [`admission`], [`command`] |
//! | 5 | takes the injected voltage of identification, if one is under way | [`injection`] |
//! | 6 | advances the reference: a plan, a jog, homing, a stream, or a stop | [`motion`], [`mod@reference`], [`homing`] |
//! | 7 | checks limit switches and soft limits, look-ahead included | [`safety::travel`] |
//! | 8 | forms the error in integers, turns it into a number, checks it | [`units`], [`scalar`], [`safety::monitor`] |
//! | 9 | feeds friction and inertia forward, from the look-ahead reference alone, at a scale that may be learnt; cancels a cut's vibration | [`feedforward`], [`friction`], [`learning`], [`cancelling`] |
//! | 10 | feeds the error back, within what the output limit leaves | [`control`] |
//! | 11 | limits the sum and makes the converter's word of it | [`axis`] |
//! | 12 | leaves every term to be seen: samples for a host, a ring that freezes at a fault | [`axis::telemetry`] |
//!
//! Steps 1, 2 and 6 to 11 are an [`axis::Axis`], which can be ticked alone; the stage runs three of them and stops all
//! when one fails. A check returns the fault it found ([`safety::FaultCode`]); what follows from it is the stage's to
//! decide, by the fault's [`safety::Reaction`].
//!
//! [`safety`] decides whether any of this reaches the amplifiers: the stage starts disabled, and a fault switches it off
//! in the tick that finds it, or brakes it under control where that is safer. [`supervisor`] stands between a person's
//! requests and the tick.
//!
//! # One axis
//!
//! PID, and a feedforward of friction and inertia that looks 12 ticks ahead. `docs/law-in-your-firmware.md` of the
//! repository is the same in a firmware.
//!
//! ```
//! use quadrant_law::axis::{Axis, AxisState, OutputStage};
//! use quadrant_law::control::pid::PidGains;
//! use quadrant_law::encoder::EncoderReading;
//! use quadrant_law::feedforward::{FeedforwardGains, FeedforwardKind};
//! use quadrant_law::friction::{FrictionSettings, gms::GmsParameters, stribeck::{StaticFriction, StribeckCurve}};
//! use quadrant_law::reference::{Motion, MotionScale};
//!
//! let gains = PidGains { kp_v_per_mm: 1.1, ki_v_per_mm_s: 0.7, kd_v_s_per_mm: 5.5e-3, derivative_filter_s: 52e-6 };
//! let curve = StribeckCurve { coulomb_v: 0.12, breakaway_v: 0.15, stribeck_velocity_mm_s: 1.0, exponent: 1.0 };
//! let sliding = StaticFriction { curve, viscous_v_s_per_mm: 2e-3 };
//! let gms = GmsParameters::new([(21.4, 0.30), (7.5, 0.30), (2.66, 0.25), (0.75, 0.15)], 5.0);
//! let friction = FrictionSettings::new(sliding, gms);
//! // Counts of 0.5 um, 10 000 ticks a second.
//! let axis = Axis::<f32>::build(MotionScale::new(0.5e-3, 1e4), |axis| {
//!     axis.output(OutputStage::limited_to(9.0))
//!         .pid(&gains, 2.0)
//!         .feedforward(FeedforwardKind::Combined, &FeedforwardGains::whole(14.4e-6), &friction, 12)
//! })?;
//! let mut state = AxisState::default();
//! axis.tick(&mut state, &Motion::Hold, &EncoderReading::of(0)).unwrap();
//! // Pushed one count away, the axis pushes back.
//! let code = axis.tick(&mut state, &Motion::Hold, &EncoderReading::of(1)).unwrap();
//! assert!(code.to_volts(10.0) < 0.0);
//! # Ok::<(), quadrant_law::axis::AxisError>(())
//! ```
//!
//! # A stage of three
//!
//! ```
//! use quadrant_law::axes::PerAxis;
//! use quadrant_law::command::Command;
//! use quadrant_law::reference::Motion;
//! use quadrant_law::stage::{Inputs, Stage, StageState};
//! use quadrant_settings::StageSettings;
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
//!
//! # Three kinds of type
//!
//! - Parameters as a person writes them, in SI units and millimetres, `f64`: [`control::pid::PidGains`],
//!   [`friction::FrictionSettings`], [`mod@reference`]'s `MotionSettings`.
//! - The same ready for the tick: [`control::pid::Pid`], [`feedforward::Feedforward`], [`axis::Axis`]. They are immutable,
//!   made by `build`, `new` or `try_build` at settings time, which may be slow: tables are filled, divisions done.
//! - Memory, which a tick changes: [`control::terms::FeedbackState`], [`axis::AxisState`].
//!
//! Everything for the tick is generic over the number type ([`scalar::Scalar`]): `f32` on a target with a floating-point unit,
//! [`scalar::Fixed`] on one without, `f64` on a host as the reference for numeric error. `f32` results are the same to the bit on
//! host and target: plain IEEE operations in one order, no fused multiply-add, and `libm` for what is tabulated.
//!
//! Curves are tabulated ([`table`]); what there is one of for each axis is a [`axes::PerAxis`]; [`decimal`] writes numbers into
//! messages, [`rounding`] rounds at settings time, and [`noise_shaper`] makes 12 bits of a word do better than 12 bits.
#![no_std]
#![forbid(unsafe_code)]

pub mod admission;
pub mod axes;
pub mod axis;
pub mod cancelling;
pub mod command;
pub mod control;
pub mod decimal;
pub mod encoder;
pub mod feedforward;
pub mod friction;
mod hint;
pub mod homing;
pub mod injection;
pub mod learning;
pub mod motion;
pub mod noise_shaper;
pub mod reference;
pub mod rounding;
pub mod safety;
pub mod scalar;
pub mod stage;
pub mod supervisor;
pub mod table;
pub mod units;
