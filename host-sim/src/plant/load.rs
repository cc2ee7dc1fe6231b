//! Load on the table besides drive and friction, over time, in volts at the amplifier's input.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::cutting::{Component, Milling};

/// A load over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Load {
    #[default]
    None,
    Sine {
        /// Amplitude, V.
        amplitude_v: f64,
        /// Frequency, Hz.
        frequency_hz: f64,
    },
    /// Milling, while the tool is engaged.
    Milling {
        cut: Milling,
        /// Component of its forces that acts along the axis.
        component: Component,
        /// Times at which the tool enters and has left, s.
        engaged_s: (f64, f64),
        /// Force of a volt, N/V; above zero.
        newtons_per_volt: f64,
    },
    /// A recorded force, again and again.
    Recorded {
        /// The force, evenly sampled.
        force: Arc<Force>,
        /// Force of a volt, N/V; above zero.
        newtons_per_volt: f64,
    },
}

/// A force along one axis, evenly sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct Force {
    /// Time from one sample to the next, s; above zero.
    pub sample_time_s: f64,
    /// The force, N, at least one sample.
    pub force_n: Vec<f64>,
}

/// Time in which the force rises to its whole as the tool enters, and falls as it leaves, s: a tool of 10 mm at 10 mm/s
/// would take longer, a plunge less.
pub const ENTRY_S: f64 = 0.1;

impl Load {
    /// The load at a time from the start of the motion, V: positive pushes towards larger positions.
    pub fn at_v(&self, time_s: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Sine {
                amplitude_v,
                frequency_hz,
            } => amplitude_v * (TAU * frequency_hz * time_s).sin(),
            Self::Milling {
                cut,
                component,
                engaged_s: (enters, leaves),
                newtons_per_volt,
            } => {
                let nearest_end = (time_s - enters).min(leaves - time_s);
                let share = (nearest_end / ENTRY_S).clamp(0.0, 1.0);
                if share > 0.0 {
                    share * cut.force_n(*component, time_s - enters) / newtons_per_volt
                } else {
                    0.0
                }
            }
            Self::Recorded {
                force,
                newtons_per_volt,
            } => force.at_n(time_s) / newtons_per_volt,
        }
    }
}

impl Force {
    /// The force at a time from the first sample, N, between samples on the line that joins them; after the last sample
    /// the first follows.
    pub fn at_n(&self, time_s: f64) -> f64 {
        let place = (time_s / self.sample_time_s).max(0.0);
        // Times of samples come with rounding, and none may fall just before its own sample.
        let nearest = place.round();
        let place = if (place - nearest).abs() < 1e-6 {
            nearest
        } else {
            place
        };
        let index = place.floor();
        let count = self.force_n.len();
        let sample = |offset: usize| self.force_n[(index as usize + offset) % count];
        sample(0) + (place - index) * (sample(1) - sample(0))
    }
}
