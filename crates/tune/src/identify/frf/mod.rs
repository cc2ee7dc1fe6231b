//! Frequency response measurement (thesis, ch. 3; Figs 3.5, 3.6).
//!
//! The response is position over amplifier voltage, of the axis in continuous time: the hold of the converter is divided out.
//! Under feedback voltage and noise are correlated, and the usual H1 estimate `S_yu / S_uu` leans towards the inverse of
//! the controller; the injected excitation is not correlated with the noise, and as an instrument makes `S_yr / S_ur` free of
//! that bias. Both are estimated, so that the difference can be seen.
//!
//! Near standstill pre-sliding and Coulomb friction make the response depend on the amplitude. The response of the *sliding*
//! axis is measured while it moves at constant velocity, far enough above the Stribeck velocity that friction is linear.

mod estimate;
mod measure;
mod saved;

pub use estimate::{Estimate, Estimator, estimate};
pub(crate) use measure::BAND_SHARE;
pub use measure::{FrfError, FrfMeasurement, FrfSettings, measure, standstill};
pub use saved::{SavedError, SavedSettings, response_of};
