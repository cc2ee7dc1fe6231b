//! Continuous or sampled: the form in which a loop is closed.

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
