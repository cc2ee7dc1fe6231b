//! The thesis' tables and figures, and the comparative studies, on the simulated stage.
//!
//! Each study is one folder: what it runs, how it judges, and the tables and figures it shows.
//!
//! - [`thesis`]: chapters 3 to 5, and the headline figures;
//! - [`laws`]: every feedback law at equal robustness;
//! - [`wrong_model`]: the worth of feedforward whose model is wrong;
//! - [`friction_models`]: static, Dahl, LuGre, GMS and smoothed GMS on the same motions;
//! - [`robustness`]: changed axes, loads and drives;
//! - [`numerics`]: f32 and fixed point against f64;
//! - [`outputs`]: the amplifier outputs' resolution;
//! - [`identification`]: identification judged by the plant's parameters;
//! - [`learning`]: other starts, part programs and changes, with the feedforward that learns;
//! - [`cuts`]: learning under random cuts and changes of friction;
//! - [`random_axes`]: commissioning of axes that are not the simulated stage's;
//! - [`random_faults`]: faults at random activities, and what must hold in every case;
//! - [`campaign`]: a result from each of many seeds, for the last three;
//! - [`report`]: all of the first five and the circle test in one page, kept part by part.
#![forbid(unsafe_code)]
#![allow(missing_docs)]

pub mod campaign;
pub mod cuts;
pub mod friction_models;
pub mod identification;
pub mod laws;
pub mod learning;
pub mod numerics;
pub mod outputs;
pub mod random_axes;
pub mod random_faults;
pub mod report;
pub mod robustness;
pub mod thesis;
pub mod wrong_model;
