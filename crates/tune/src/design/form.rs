//! Continuous or sampled: the form in which a loop is closed.

use num_complex::Complex64;
use quadrant_law::control::pid::PidGains;
use quadrant_settings::response::LinearResponse;
use quadrant_sim::loop_shape::controller_response;

/// Form in which a loop is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// By a PID in continuous time: the form that textbooks and the thesis print margins of.
    Continuous,
    /// By the difference equations of the firmware, through the converter's hold.
    Sampled {
        /// Control period, s; above zero.
        sample_time_s: f64,
        /// From reading the encoder to writing the converter, s; zero or more.
        computation_delay_s: f64,
    },
}

impl Form {
    /// The response of a PID in this form at a frequency in rad/s, V/mm.
    pub(super) fn controller(self, gains: &PidGains, omega_rad_s: f64) -> Complex64 {
        match self {
            Self::Continuous => gains.response(omega_rad_s),
            Self::Sampled { sample_time_s, .. } => {
                let z = Complex64::cis(omega_rad_s * sample_time_s);
                controller_response(gains, sample_time_s, z)
            }
        }
    }
}
