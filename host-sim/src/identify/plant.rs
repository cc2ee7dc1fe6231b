//! The linear model fitted to a frequency response (thesis, Table 3.1): `A exp(-s Td) / (s^2 + B s + C)`.
//!
//! Nonlinear least squares in the frequency domain, each line weighted by its own deviation, from a linear
//! least-squares start. Source: Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed.,
//! 2012, ch. 9 (maximum likelihood for a known noise model).

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quadrant::control::plant_model::PlantModel;

use super::fit::{Fit, FitError, Loss, Parameter, fit};
use super::response::{FrequencyResponse, ResponsePoint};

/// Spring to ground in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Stiffness {
    /// C is fitted: a response at standstill shows pre-sliding friction as a small spring.
    Free,
    /// C is zero: a sliding axis has no spring.
    Zero,
}

impl std::fmt::Display for Stiffness {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Free => "free",
            Self::Zero => "zero",
        })
    }
}

/// Parameters of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantFitSettings {
    /// Lowest coherence of a line that counts.
    pub least_coherence: f64,
    /// Lowest and highest frequency that count, Hz.
    pub band_hz: (f64, f64),
    /// Treatment of C, the spring to ground.
    pub stiffness: Stiffness,
}

impl Default for PlantFitSettings {
    fn default() -> Self {
        Self {
            least_coherence: 0.9,
            band_hz: (0.0, f64::INFINITY),
            stiffness: Stiffness::Free,
        }
    }
}

#[derive(Clone, Debug)]
pub struct PlantFit {
    pub plant: PlantModel,
    /// A, B, Td and, if it was free, C, with standard errors and correlations; Td in s.
    pub fit: Fit,
    /// Distance of the model from the response, by thirds of the lines from low to high frequency.
    pub bands: Vec<BandMisfit>,
    pub lines: usize,
}

/// Distance of a model from a response over a band, RMS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandMisfit {
    /// Lowest and highest frequency, Hz.
    pub band_hz: (f64, f64),
    /// Of the gain, dB.
    pub gain_db: f64,
    /// Of the phase, deg.
    pub phase_deg: f64,
}

/// Reasons for which a response supports no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// Too few lines can be trusted.
    #[error(
        "only {lines} lines have a coherence of {least_coherence} or more; a model takes {LEAST_LINES}: raise the excitation, \
         average longer, or lower the demand on coherence"
    )]
    Incoherent { lines: usize, least_coherence: f64 },
    /// The corner that separates damping from mass is not in the band.
    #[error(
        "the response from {low_hz:.1} to {high_hz:.1} Hz misses the corner at {corner_hz:.1} Hz, where damping gives way to mass, \
         so that A and B cannot be told apart; measure from {wanted_low_hz:.1} to {wanted_high_hz:.1} Hz at least"
    )]
    MissesCorner {
        low_hz: f64,
        high_hz: f64,
        /// B / (2 pi) as far as it is known.
        corner_hz: f64,
        wanted_low_hz: f64,
        wanted_high_hz: f64,
    },
    /// A parameter is not determined.
    #[error(
        "the response does not determine {parameter}: {value:.4} +- {standard_error:.4}; widen the band or average longer"
    )]
    Undetermined {
        parameter: &'static str,
        value: f64,
        standard_error: f64,
    },
    /// The model is not what was measured.
    #[error(
        "the model misses the response by {gain_db:.1} dB and {phase_deg:.0} deg RMS: this is not a second-order axis with a dead \
         time, or friction distorts the response (measure at a bias velocity or a larger amplitude)"
    )]
    Misfit {
        /// RMS of the gain's error.
        gain_db: f64,
        /// RMS of the phase's error.
        phase_deg: f64,
    },
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Fewest lines of a fit.
const LEAST_LINES: usize = 10;
/// Longest dead time looked for, s.
const LONGEST_DELAY_S: f64 = 0.05;
/// Dead times tried by the linear start.
const DELAYS: usize = 500;
/// Largest relative standard error of A and B.
const MOST_UNCERTAIN: f64 = 0.25;
/// A misfit that no noise explains.
const MOST_GAIN_DB: f64 = 3.0;
const MOST_PHASE_DEG: f64 = 20.0;
/// A relative deviation below which a line is not believed to be: some error does not scatter.
const LEAST_DEVIATION: f64 = 1e-4;

/// Fits the model.
///
/// # Errors
/// A response that cannot support it, with the reason and what would.
pub fn fit_plant(
    response: &FrequencyResponse,
    settings: &PlantFitSettings,
) -> Result<PlantFit, PlantError> {
    let (low, high) = settings.band_hz;
    let lines: Vec<ResponsePoint> = response
        .points
        .iter()
        .filter(|point| {
            let counts = point.coherence >= settings.least_coherence;
            counts && (low..=high).contains(&point.frequency_hz)
        })
        .copied()
        .collect();
    if lines.len() < LEAST_LINES {
        return Err(PlantError::Incoherent {
            lines: lines.len(),
            least_coherence: settings.least_coherence,
        });
    }
    let start = linear_start(&lines, settings.stiffness);
    let found = refine(&lines, settings.stiffness, &start)?;
    let plant = model(&found.values);
    let bands = bands(&lines, &plant);
    let all = band_misfit(&lines, &plant);
    if all.gain_db > MOST_GAIN_DB || all.phase_deg > MOST_PHASE_DEG {
        return Err(PlantError::Misfit {
            gain_db: all.gain_db,
            phase_deg: all.phase_deg,
        });
    }
    check_support(&lines, &plant, &found)?;
    Ok(PlantFit {
        plant,
        fit: found,
        bands,
        lines: lines.len(),
    })
}

/// The model of the values in the order A, B, Td, C.
fn model(values: &[f64]) -> PlantModel {
    PlantModel {
        gain_mm_per_v_s2: values[0],
        damping_per_s: values[1],
        delay_s: values[2],
        stiffness_per_s2: values.get(3).copied().unwrap_or(0.0),
    }
}

/// For each dead time of a grid, A, B and C by linear least squares on relative errors; the best.
fn linear_start(lines: &[ResponsePoint], stiffness: Stiffness) -> PlantModel {
    let unknowns = match stiffness {
        Stiffness::Free => 3,
        Stiffness::Zero => 2,
    };
    let mut best = (f64::INFINITY, model(&[1.0, 0.0, 0.0]));
    for step in 0..DELAYS {
        let delay_s = LONGEST_DELAY_S * (step as f64 / DELAYS as f64).powi(2);
        let mut matrix = DMatrix::zeros(2 * lines.len(), unknowns);
        let mut right = DVector::zeros(2 * lines.len());
        for (index, line) in lines.iter().enumerate() {
            let omega = TAU * line.frequency_hz;
            let prompt = line.response * Complex64::from_polar(1.0, omega * delay_s);
            // A - j w B H - C H = -w^2 H, over |w^2 H| so that every line counts by its relative error.
            let scale = (omega * omega * prompt.norm()).recip();
            let columns = [
                Complex64::from(scale),
                -Complex64::i() * omega * prompt * scale,
                -prompt * scale,
            ];
            for (column, value) in columns.into_iter().take(unknowns).enumerate() {
                matrix[(2 * index, column)] = value.re;
                matrix[(2 * index + 1, column)] = value.im;
            }
            let known = -prompt * omega * omega * scale;
            right[2 * index] = known.re;
            right[2 * index + 1] = known.im;
        }
        let Ok(solution) = matrix.clone().svd(true, true).solve(&right, 1e-12) else {
            continue;
        };
        let cost = (&matrix * &solution - &right).norm_squared();
        if cost < best.0 && solution[0] > 0.0 {
            let spring = if unknowns == 3 { solution[2] } else { 0.0 };
            best = (
                cost,
                model(&[solution[0], solution[1].max(0.0), delay_s, spring.max(0.0)]),
            );
        }
    }
    best.1
}

/// Nonlinear least squares from the start.
fn refine(
    lines: &[ResponsePoint],
    stiffness: Stiffness,
    start: &PlantModel,
) -> Result<Fit, FitError> {
    let gain = start.gain_mm_per_v_s2;
    let highest = TAU * lines.last().map_or(1.0, |line| line.frequency_hz);
    let mut parameters = vec![
        Parameter {
            name: "A",
            start: gain,
            bounds: (0.1 * gain, 10.0 * gain),
        },
        Parameter {
            name: "B",
            start: start.damping_per_s.clamp(1e-3 * highest, 9.0 * highest),
            bounds: (0.0, 10.0 * highest),
        },
        Parameter {
            name: "Td",
            start: start.delay_s.max(1e-6),
            bounds: (0.0, 2.0 * LONGEST_DELAY_S),
        },
    ];
    if stiffness == Stiffness::Free {
        let most = highest * highest;
        parameters.push(Parameter {
            name: "C",
            start: start.stiffness_per_s2.clamp(1e-6 * most, 0.9 * most),
            bounds: (0.0, most),
        });
    }
    let found = fit(&parameters, Loss::Squares, |values| {
        let plant = model(values);
        lines
            .iter()
            .flat_map(|line| {
                let ratio = plant.response(TAU * line.frequency_hz) / line.response - 1.0;
                let deviation = line.relative_deviation.max(LEAST_DEVIATION);
                [ratio.re / deviation, ratio.im / deviation]
            })
            .collect()
    })?;
    Ok(found.no_better_than_stated())
}

/// Checks that the data determine what was fitted.
fn check_support(
    lines: &[ResponsePoint],
    plant: &PlantModel,
    found: &Fit,
) -> Result<(), PlantError> {
    let low_hz = lines.first().map_or(0.0, |line| line.frequency_hz);
    let high_hz = lines.last().map_or(0.0, |line| line.frequency_hz);
    let corner_hz = plant.damping_per_s / TAU;
    let relative = |index: usize| found.standard_errors[index] / found.values[index].abs();
    let uncertain = |index: usize| {
        let deviation = relative(index);
        deviation.is_nan() || deviation > MOST_UNCERTAIN
    };
    if uncertain(0)
        || uncertain(1)
        || high_hz < 1.5 * corner_hz
        || low_hz > 1.5 * corner_hz.max(0.1)
    {
        return Err(PlantError::MissesCorner {
            low_hz,
            high_hz,
            corner_hz,
            wanted_low_hz: 0.3 * corner_hz,
            wanted_high_hz: 4.0 * corner_hz,
        });
    }
    // A dead time is known well enough when the phase it turns is, at the highest line.
    let turned = TAU * high_hz * found.standard_errors[2];
    if turned.is_nan() || turned > MOST_UNCERTAIN {
        return Err(PlantError::Undetermined {
            parameter: "Td",
            value: found.values[2],
            standard_error: found.standard_errors[2],
        });
    }
    Ok(())
}

fn bands(lines: &[ResponsePoint], plant: &PlantModel) -> Vec<BandMisfit> {
    lines
        .chunks(lines.len().div_ceil(3))
        .map(|band| band_misfit(band, plant))
        .collect()
}

fn band_misfit(lines: &[ResponsePoint], plant: &PlantModel) -> BandMisfit {
    let (mut gain, mut phase) = (0.0, 0.0);
    for line in lines {
        let ratio = plant.response(TAU * line.frequency_hz) / line.response;
        gain += (20.0 * ratio.norm().log10()).powi(2);
        phase += ratio.arg().to_degrees().powi(2);
    }
    let count = lines.len() as f64;
    let frequency = |line: Option<&ResponsePoint>| line.map_or(f64::NAN, |line| line.frequency_hz);
    BandMisfit {
        band_hz: (frequency(lines.first()), frequency(lines.last())),
        gain_db: (gain / count).sqrt(),
        phase_deg: (phase / count).sqrt(),
    }
}
