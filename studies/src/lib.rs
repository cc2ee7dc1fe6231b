//! The thesis' tables and figures, the comparative studies, and the campaigns, on the simulated stage.
//!
//! - [`thesis`]: chapters 3 to 5, and the headline figures, in one page;
//! - studies, each of a few tables: [`identification`] judged by the plant's parameters, [`learning`], [`numerics`] (f32 and
//!   fixed point against f64), [`outputs`] (the amplifier outputs' resolution), [`robustness`] (changed axes and cuts), [`step_direction`] (another control's pulses) and
//!   [`wrong_model`] (feedforward whose model is wrong);
//! - campaigns, a result from each of many seeds: [`random_axes`] (commissioning), [`random_faults`] (what must hold in every
//!   case) and [`cuts`] (learning under random cuts);
//! - [`study`] and [`campaign`]: the frames of both kinds; [`competitor`]: the feedforwards that they compare; [`true_friction`]: other friction than the stage's.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

pub mod campaign;
pub mod competitor;
pub mod cuts;
pub mod identification;
pub mod learning;
pub mod numerics;
pub mod outputs;
pub mod random_axes;
pub mod random_faults;
pub mod robustness;
pub mod step_direction;
pub mod study;
pub mod thesis;
pub mod true_friction;
pub mod wrong_model;
mod x_alone;
