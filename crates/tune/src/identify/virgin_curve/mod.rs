//! The GMS model from the virgin curve (thesis, Figs 3.11-3.13; Table 3.3).
//!
//! A slow sine makes the axis turn round again and again; at that speed the voltage is the friction. By the Masing rule each
//! branch of the hysteresis loop, seen from the reversal it begins at, is the virgin curve with both axes doubled. Knots on
//! the averaged curve give the elements: `k_i = S_i - S_(i+1)`, `W_i = k_i x_i`, `alpha_i = W_i / sum(W)`. From there knots,
//! weights and the attraction rate C are refined until the library's own GMS model, moved along the measured position,
//! gives the measured voltage.

mod branches;
mod elements;
mod error;
mod measure;
mod plateau;
mod predict;
mod shape;

pub use branches::{VirginCurve, VirginPoint};
pub use elements::{ASSUMED_ATTRACTION_V_S, GmsFit, Knots, identify};
pub use error::VirginCurveError;
pub use measure::{VirginCurveSettings, measure};
pub use predict::Prediction;
