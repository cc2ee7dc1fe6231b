//! Identification judged by the truth that was hidden from it: three axes, several noise levels, several seeds.
//!
//! Two pairs of parameters cannot be separated by motion, so each pair is judged as what it shows: the viscous friction and
//! the linear damping as the total damping `B + A sigma`, and a direction's friction levels with the amplifier's offset.

pub mod command;
pub mod page;

use indicatif::ProgressBar;
use quadrant_settings::StageSettings;
use quadrant_sim::plant::{AxisParameters, StageParameters};
use quadrant_tune::commission::{CommissionError, CommissionSettings, Commissioned, commission};
use quadrant_tune::test_axis::SimulatedTestAxis;
use rayon::prelude::*;

/// Encoder noise of the runs, over that of the simulated stage.
pub const NOISE_LEVELS: [f64; 3] = [0.5, 1.0, 2.0];

/// The parameters that are judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judged {
    Gain,
    /// B + A sigma.
    TotalDamping,
    Delay,
    /// Fc of a direction, offset included.
    Coulomb,
    /// Fs of a direction, offset included.
    Breakaway,
    /// Vs of a direction.
    StribeckVelocity,
}

impl Judged {
    pub const ALL: [Self; 6] = [
        Self::Gain,
        Self::TotalDamping,
        Self::Delay,
        Self::Coulomb,
        Self::Breakaway,
        Self::StribeckVelocity,
    ];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Gain => "A",
            Self::TotalDamping => "B + A sigma",
            Self::Delay => "Td",
            Self::Coulomb => "Fc, each way",
            Self::Breakaway => "Fs, each way",
            Self::StribeckVelocity => "Vs, each way",
        }
    }

    /// The largest error allowed, %.
    pub const fn limit_percent(self) -> f64 {
        match self {
            Self::Gain => 2.0,
            Self::Delay | Self::Coulomb => 3.0,
            Self::TotalDamping | Self::Breakaway => 5.0,
            Self::StribeckVelocity => 20.0,
        }
    }
}

/// One estimate beside the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub judged: Judged,
    pub found: f64,
    /// One standard deviation, as stated.
    pub standard_error: f64,
    pub truth: f64,
}

impl Estimate {
    /// Its error, %.
    pub fn error_percent(&self) -> f64 {
        100.0 * (self.found / self.truth - 1.0)
    }

    /// True if the plant's parameter lies within two standard deviations.
    pub fn is_honest(&self) -> bool {
        (self.found - self.truth).abs() <= 2.0 * self.standard_error
    }
}

/// One commissioning, judged.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// Axis, 0 to 2.
    pub axis: usize,
    /// Encoder noise over that of the simulated stage.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
    pub estimates: Vec<Estimate>,
    /// RMS error of the predicted hysteresis over the breakaway level, %.
    pub hysteresis_percent: f64,
}

/// Commissions every axis at every noise level `seeds` times, each with a seed of its own, in parallel, and judges the results.
///
/// # Errors
/// The first commissioning that fails.
pub fn validate(seeds: u64, progress: &ProgressBar) -> Result<Vec<Judgement>, CommissionError> {
    let levels = (0..3).flat_map(|axis| NOISE_LEVELS.map(|noise| (axis, noise)));
    // No two runs share their noise: what is judged is how often the truth lies within the stated deviations.
    let runs: Vec<(usize, f64, u64)> = levels
        .zip(0..)
        .flat_map(|((axis, noise), level)| {
            (1..=seeds).map(move |seed| (axis, noise, level * seeds + seed))
        })
        .collect();
    runs.into_par_iter()
        .map(|(axis, noise, seed)| {
            let judgement = judge(axis, noise, seed);
            progress.inc(1);
            judgement
        })
        .collect()
}

/// Commissions one axis and judges it.
///
/// # Errors
/// A commissioning that fails.
pub fn judge(axis: usize, noise: f64, seed: u64) -> Result<Judgement, CommissionError> {
    let mut truth = StageParameters::real().axes[axis].clone();
    truth.imperfections.encoder_noise_mm *= noise;
    let base = StageSettings::simulated().axes[axis].clone();
    let mut rig = SimulatedTestAxis::new(axis, truth.clone(), seed);
    let found = commission(
        &mut rig,
        &base,
        &CommissionSettings::thesis(),
        &mut |_, _| {},
    )?;
    Ok(Judgement {
        axis,
        noise,
        seed,
        estimates: estimates(&found, &truth),
        hysteresis_percent: 100.0 * found.presliding.0.clone()?.prediction.relative_error,
    })
}

fn estimates(found: &Commissioned, truth: &AxisParameters) -> Vec<Estimate> {
    let fit = &found.plant.fit;
    let viscous = truth.friction.positive.viscous_v_s_per_mm;
    let linear = [
        (Judged::Gain, truth.gain_mm_per_v_s2),
        (
            Judged::TotalDamping,
            truth.damping_per_s + truth.gain_mm_per_v_s2 * viscous,
        ),
        (Judged::Delay, truth.delay_s),
    ];
    let mut estimates: Vec<Estimate> = linear
        .into_iter()
        .enumerate()
        .map(|(index, (judged, truth))| Estimate {
            judged,
            found: fit.values[index],
            standard_error: fit.standard_errors[index],
            truth,
        })
        .collect();
    let (_, friction, _) = &found.friction;
    let directions = [
        (&friction.directions.positive, &truth.friction.positive, 1.0),
        (
            &friction.directions.negative,
            &truth.friction.negative,
            -1.0,
        ),
    ];
    for (direction, model, sign) in directions {
        let pushed_v = sign * truth.imperfections.offset_v;
        let curve = direction.model.curve;
        let errors = &direction.fit.standard_errors;
        estimates.extend([
            Estimate {
                judged: Judged::Coulomb,
                found: curve.coulomb_v,
                standard_error: errors[0],
                truth: model.curve.coulomb_v - pushed_v,
            },
            Estimate {
                judged: Judged::Breakaway,
                found: curve.breakaway_v,
                standard_error: direction.breakaway_error_v,
                truth: model.curve.breakaway_v - pushed_v,
            },
            Estimate {
                judged: Judged::StribeckVelocity,
                found: curve.stribeck_velocity_mm_s,
                standard_error: errors[2],
                truth: model.curve.stribeck_velocity_mm_s,
            },
        ]);
    }
    estimates
}
