//! Controller design on the linear model of an axis: loop shape, margins, and gains chosen by a stated criterion.
//!
//! Everything here works on [`OpenLoop`](quadrant_sim::loop_shape::OpenLoop), a frequency response with a band: the continuous textbook form, the exact
//! sampled form with the controller's own difference equations, or anything else that answers with a complex number.
//! The *nonlinear* gain that a design then allows is [`quadrant_settings::popov::sector_bound`]'s answer.

mod bandwidth;
mod best;
mod form;
mod integral_gain;
pub mod measured;
mod modal;
mod noise;
pub mod npid;
mod pid;
mod process;
pub mod robustness;
mod search;
mod shaping;
pub mod step_response;
pub mod time_varying;

pub use best::{
    COMPLEMENTARY_PEAK, Peaks, SENSITIVITY_PEAK, best_filter_s, best_pid, best_pid_within,
    load_step_error, set_best_pid, with_best_pid,
};
pub use form::Form;
pub use integral_gain::largest_integral_gain_where;
pub use modal::{ModalDesign, modal_pid};
pub use noise::noise_voltage_v;
pub use pid::{DesignError, INTEGRAL_SHARE, PidDesign, PidRequest, Target, design_pid};
pub use process::{AnyLoop, Process};
pub use shaping::{ShapingError, shape_to_crossover, shape_to_margins};

#[cfg(test)]
mod fixtures {
    use quadrant_law::control::pid::PidGains;
    pub(crate) use quadrant_settings::presets::{X_PLANT, Y_PLANT, Z_PLANT};

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
