//! Gains that vary with time, against a loop that is proven for gains that vary with the error: how far the proof reaches,
//! and where a search finds instability.
//!
//! The Popov criterion covers gains that depend on the error alone. One that also depends on time, or on which way the error
//! moves, is covered by the circle criterion only, whose bound is smaller. A search over switching gains shows how much of the
//! gap between the two is the criterion's caution.

use std::f64::consts::{PI, TAU};

use quadrant_law::control::filter::{FilterSettings, Filters, FiltersState};
use quadrant_law::control::pid::Pid;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::control::terms::FeedbackState;
use quadrant_sim::held_plant::{HeldPlant, HeldPlantRun};
use rayon::prelude::*;

/// A gain that switches between one and its largest value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Switching {
    /// Always at the largest.
    Constant,
    /// Largest for half of each period, independent of the error.
    Periodic {
        /// Switching frequency, Hz.
        frequency_hz: f64,
    },
    /// Largest where error and rate have a phase, once each half turn of their plane: when
    /// `sin(2 phi - 2 angle) > 0` with `phi = atan2(rate / omega, error)`.
    Turning {
        /// Beginning of the quadrant, rad.
        angle_rad: f64,
        /// The frequency that rate is scaled by, Hz.
        frequency_hz: f64,
    },
}

/// The smallest gain with which a search made a loop unstable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Destabiliser {
    /// The largest value of the switching gain.
    pub gain: f64,
    pub switching: Switching,
}

/// A sampled loop, at rest but for an error, with a varying gain on the error.
#[derive(Clone, Copy, Debug)]
pub struct VaryingLoop<'a> {
    pub plant: PlantModel,
    pub gains: PidGains,
    /// Filters behind the law.
    pub filters: &'a [FilterSettings],
    /// Control period, s.
    pub sample_time_s: f64,
}

/// The error at the start, mm: small, so that the law's own bound on the error stays far even from a growing motion.
const START_MM: f64 = 1e-6;
/// A motion this many times the start is unstable, and need not be followed further.
const UNSTABLE_GROWTH: f64 = 1e6;
/// Time that is simulated, s.
const SIMULATED_S: f64 = 1.5;
/// Far beyond every voltage of these motions.
const NO_LIMIT_V: f64 = 1e6;
/// Largest gain of the search, as a factor on its start.
const MAX_GAIN_FACTOR: f64 = 8.0;
/// Halvings of each search.
const HALVINGS: usize = 12;
/// Frequencies of each family of switching gains, over two octaves on each side of the crossover.
const FREQUENCIES: usize = 25;
/// Angles of the turning family.
const ANGLES: usize = 16;

impl VaryingLoop<'_> {
    /// Growth of the motion: RMS error of the last tenth of the time over that of the fifth; below one when it dies out.
    pub fn growth(&self, gain: f64, switching: Switching) -> f64 {
        let period_s = self.sample_time_s;
        let pid = Pid::<f64>::build(&self.gains, NO_LIMIT_V, period_s);
        let held = HeldPlant::new(&self.plant, period_s, 0.0);
        let mut axis = HeldPlantRun::at_rest(held, START_MM);
        let mut state = FeedbackState::default();
        let filters = Filters::<f64>::build(self.filters, period_s);
        let mut filtered = FiltersState::default();
        let mut previous = -START_MM;
        pid.reset(&mut state, previous);
        let samples = (SIMULATED_S / period_s) as usize;
        let mut squares = [0.0; 10];
        for sample in 0..samples {
            let error = -axis.position_mm();
            let high = match switching {
                Switching::Constant => true,
                Switching::Periodic { frequency_hz } => {
                    (sample as f64 * period_s * frequency_hz).fract() < 0.5
                }
                Switching::Turning {
                    angle_rad,
                    frequency_hz,
                } => {
                    let rate = (error - previous) / period_s;
                    let phase = (rate / (TAU * frequency_hz)).atan2(error);
                    (2.0 * (phase - angle_rad)).sin() > 0.0
                }
            };
            previous = error;
            if error.abs() > UNSTABLE_GROWTH * START_MM {
                return f64::INFINITY;
            }
            let scaled = if high { gain * error } else { error };
            let terms = pid.step(&mut state, scaled, 0.0, NO_LIMIT_V);
            axis.step(filters.step(&mut filtered, terms.output));
            squares[sample * 10 / samples] += error * error;
        }
        (squares[9] / squares[4]).sqrt()
    }

    /// The smallest gain above `from`, which must be stable, that makes the loop unstable when it switches in this way;
    /// nothing up to eight times `from`.
    pub fn smallest_unstable(&self, from: f64, switching: Switching) -> Option<f64> {
        let grows = |gain: f64| self.growth(gain, switching) > 1.0;
        let (mut low, mut high) = (from, MAX_GAIN_FACTOR * from);
        if !grows(high) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if grows(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        Some(high)
    }

    /// Every switching gain of the search, around the loop's crossover at `crossover_hz`.
    pub fn family(crossover_hz: f64) -> Vec<Switching> {
        let frequency = |index: usize| {
            crossover_hz * 2.0_f64.powf(4.0 * index as f64 / (FREQUENCIES - 1) as f64 - 1.0)
        };
        let mut family = vec![Switching::Constant];
        for index in 0..FREQUENCIES {
            let frequency_hz = frequency(index);
            family.push(Switching::Periodic { frequency_hz });
            if index % 4 == 0 {
                family.extend((0..ANGLES).map(|angle| Switching::Turning {
                    angle_rad: PI * angle as f64 / ANGLES as f64,
                    frequency_hz,
                }));
            }
        }
        family
    }

    /// The smallest gain of all switching ones that makes the loop unstable.
    pub fn worst(&self, from: f64, crossover_hz: f64) -> Option<Destabiliser> {
        Self::family(crossover_hz)
            .into_par_iter()
            .filter_map(|switching| {
                let gain = self.smallest_unstable(from, switching)?;
                Some(Destabiliser { gain, switching })
            })
            .min_by(|a, b| a.gain.total_cmp(&b.gain))
    }
}
