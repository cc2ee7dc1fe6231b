//! Controller design on the linear model of an axis: loop shape, margins, and gains chosen by a stated criterion.
//!
//! Everything here works on [`OpenLoop`], a frequency response with a band: the continuous textbook form, the exact
//! sampled form with the controller's own difference equations, or anything else that answers with a complex number.
//! How much *nonlinear* gain a design then bears is [`quadrant::control::popov::sector_bound`]'s answer.

mod bandwidth;
mod form;
pub mod held_plant;
pub mod integral_gain;
pub mod loop_shape;
pub mod margins;
pub mod measured;
pub mod npid;
pub mod pid;
pub mod process;
pub mod robustness;
pub mod shaping;
pub mod step_response;
pub mod time_varying;

#[cfg(test)]
mod time_domain;

pub use form::Form;
pub use integral_gain::{
    Printed, PrintedMargins, largest_integral_gain, largest_integral_gain_where,
};
pub use loop_shape::{ContinuousLoop, OpenLoop, SampledLoop};
pub use margins::{MarginError, Margins, margins};
pub use pid::{DesignError, INTEGRAL_SHARE, PidDesign, PidRequest, Target, design_pid};
pub use process::Process;
pub use shaping::{ShapingError, shape_to_crossover, shape_to_margins};

#[cfg(test)]
mod fixtures {
    use quadrant::control::{plant_model::PlantModel, popov::PidGains};

    /// The x axis, chosen so that the thesis' printed margins come out.
    pub(crate) const X_PLANT: PlantModel = PlantModel {
        gain_mm_per_v_s2: 69390.0,
        damping_per_s: 144.8,
        stiffness_per_s2: 166.6,
        delay_s: 1.2e-3,
    };

    /// A similar y axis, invented.
    pub(crate) const Y_PLANT: PlantModel = PlantModel {
        gain_mm_per_v_s2: 61200.0,
        damping_per_s: 151.0,
        stiffness_per_s2: 148.0,
        delay_s: 1.2e-3,
    };

    /// A similar z axis, invented.
    pub(crate) const Z_PLANT: PlantModel = PlantModel {
        gain_mm_per_v_s2: 48500.0,
        damping_per_s: 172.0,
        stiffness_per_s2: 205.0,
        delay_s: 1.3e-3,
    };

    /// The derivative filter of all axes, s.
    pub(crate) const FILTER_S: f64 = 52e-6;

    /// The proportional and derivative gains of the x axis, chosen with its plant.
    pub(crate) const X_GAINS: PidGains = PidGains {
        kp_v_per_mm: 1.118,
        ki_v_per_mm_s: 0.0,
        kd_v_s_per_mm: 0.005537,
        derivative_filter_s: FILTER_S,
    };
}
