//! Popov bound of an axis that differs from its model.

use nalgebra::{Matrix4, Vector4};
use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::popov::filtered_sector_bound;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

/// Relative uncertainty of a model: A, B, C, Td in this order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uncertainty {
    /// Standard deviations, as shares of the values.
    pub deviations: [f64; 4],
    /// Correlations; the unit matrix when none are known.
    pub correlation: Matrix4<f64>,
}

impl Uncertainty {
    pub fn independent(deviations: [f64; 4]) -> Self {
        Self {
            deviations,
            correlation: Matrix4::identity(),
        }
    }
}

/// The bound over draws of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Robustness {
    /// k_max of each draw, ascending; 1 where the linear loop itself is not proven stable.
    pub bounds: Vec<f64>,
}

impl Robustness {
    /// The bound that a share of the draws, 0 to 1, falls below.
    pub fn quantile(&self, share: f64) -> f64 {
        let index = (share * (self.bounds.len() - 1) as f64).round() as usize;
        self.bounds[index.min(self.bounds.len() - 1)]
    }

    /// The share of the draws whose bound is below a gain: for which that gain is not proven stable.
    pub fn share_below(&self, gain: f64) -> f64 {
        self.bounds.partition_point(|&bound| bound < gain) as f64 / self.bounds.len() as f64
    }
}

/// Errors of the analysis.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum RobustnessError {
    /// The correlations exclude each other.
    #[error(
        "the correlations of A, B, C and Td are those of no random variable: the matrix is not positive definite"
    )]
    Correlation,
    #[error("at least one draw is needed")]
    NoDraws,
}

/// Draws the model `draws` times, normally distributed and never below a tenth of its values, and bounds each.
///
/// # Errors
/// Correlations that no random variable has, or no draws.
pub fn robustness(
    plant: &PlantModel,
    gains: &PidGains,
    filters: &[FilterSettings],
    sample_time_s: f64,
    uncertainty: &Uncertainty,
    draws: usize,
    seed: u64,
) -> Result<Robustness, RobustnessError> {
    if draws == 0 {
        return Err(RobustnessError::NoDraws);
    }
    let factor = uncertainty
        .correlation
        .cholesky()
        .ok_or(RobustnessError::Correlation)?
        .l();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let models: Vec<PlantModel> = (0..draws)
        .map(|_| {
            let independent = Vector4::from_fn(|_, _| StandardNormal.sample(&mut random));
            let drawn: Vector4<f64> = factor * independent;
            let scale =
                |index: usize| (1.0 + uncertainty.deviations[index] * drawn[index]).max(0.1);
            PlantModel {
                gain_mm_per_v_s2: plant.gain_mm_per_v_s2 * scale(0),
                damping_per_s: plant.damping_per_s * scale(1),
                stiffness_per_s2: plant.stiffness_per_s2 * scale(2),
                delay_s: plant.delay_s * scale(3),
            }
        })
        .collect();
    let mut bounds: Vec<f64> = models
        .par_iter()
        .map(|model| filtered_sector_bound(model, gains, filters, sample_time_s))
        .collect();
    bounds.sort_by(f64::total_cmp);
    Ok(Robustness { bounds })
}
