//! The linear model fitted to a frequency response (thesis, Table 3.1): `A exp(-s Td) / (s^2 + B s + C)`, times a factor
//! for each structural mode ([`Mode`]) that the response shows.
//!
//! Nonlinear least squares in the frequency domain, each line weighted by its own deviation, from a linear
//! least-squares start. Source: Pintelon and Schoukens, *System Identification: A Frequency Domain Approach*, 2nd ed.,
//! 2012, ch. 9 (maximum likelihood for a known noise model).
//!
//! A mode is taken into the model if it makes the weighted squares of the residuals smaller by a factor, much more than a
//! handful of parameters would by chance ([`LEAST_DROP`]), and if its own parameters are determined; starts are tried over
//! the band. Friction bends a response, too, but slowly over the frequency: no fit calls that a lightly damped mode.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::response::LinearResponse;

use super::fit::{Fit, FitError, Loss, Parameter, fit, fit_nearest};
use super::mode::{self, MIN_TRANSMITTING_DAMPING, Mode};
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

impl Stiffness {
    /// Unknowns of the linear start: A, B, and C if it is free.
    const fn unknowns(self) -> usize {
        match self {
            Self::Free => 3,
            Self::Zero => 2,
        }
    }
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
    /// True if a damping whose corner lies below the band may stay unknown: an axis that friction governs has as good as none.
    pub negligible_damping: bool,
    /// True if the response must determine the model, and what is called a mode must resonate. Else two poles that only bend the response may
    /// be called one: a controller can be designed on such a model, but its A may be wrong several times over.
    pub determined: bool,
}

impl Default for PlantFitSettings {
    fn default() -> Self {
        Self {
            least_coherence: 0.9,
            band_hz: (0.0, f64::INFINITY),
            stiffness: Stiffness::Free,
            negligible_damping: false,
            determined: true,
        }
    }
}

#[derive(Clone, Debug)]
pub struct PlantFit {
    pub plant: PlantModel,
    /// Structural modes, the one that explains most first; none of a rigid axis.
    pub modes: Vec<Mode>,
    /// A, B, Td and, if it was free, C, and for each mode its frequency, its damping and those of its anti-resonance, with
    /// standard errors and correlations; Td in s, frequencies in Hz.
    pub fit: Fit,
    /// Distance of the model from the response, by thirds of the lines from low to high frequency.
    pub bands: Vec<BandMisfit>,
    pub lines: usize,
}

impl PlantFit {
    /// True if the response determines A, and each mode resonates: see [`PlantFitSettings::determined`].
    pub fn is_determined(&self) -> bool {
        is_determined(&self.fit, &self.modes)
    }

    /// Standard deviation of B, 1/s; infinite of one that may be none.
    pub fn damping_error_per_s(&self) -> f64 {
        self.fit.standard_errors[1]
    }

    /// The response of axis and modes at a frequency in rad/s, mm/V.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.plant.response(omega_rad_s) * mode::response_of(&self.modes, omega_rad_s)
    }
}

/// Distance of a model from a response over a band, RMS.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandMisfit {
    /// Lowest and highest frequency, Hz.
    pub band_hz: (f64, f64),
    pub gain_db: f64,
    pub phase_deg: f64,
}

impl BandMisfit {
    /// True if no mode is worth a look.
    fn is_small(&self) -> bool {
        self.gain_db < SMALL_GAIN_DB && self.phase_deg < SMALL_PHASE_DEG
    }
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
         so that A and B cannot be distinguished; measure from {needed_low_hz:.1} to {needed_high_hz:.1} Hz at least"
    )]
    MissesCorner {
        low_hz: f64,
        high_hz: f64,
        /// B / (2 pi) as far as it is known.
        corner_hz: f64,
        needed_low_hz: f64,
        needed_high_hz: f64,
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
        "the model misses the response by {gain_db:.1} dB and {phase_deg:.0} deg RMS, most at {worst_hz:.0} Hz: this is not a \
         second-order axis with a dead time and two modes at most (look for a loose part that resonates there, for play in the \
         drive), or friction distorts the response (measure at a bias velocity or a larger amplitude){}",
        of_mode(mode_hz)
    )]
    Misfit {
        /// RMS of the gain's error.
        gain_db: f64,
        /// RMS of the phase's error.
        phase_deg: f64,
        /// Frequency of the largest error.
        worst_hz: f64,
        /// Frequency of the mode that explains most, if one was found.
        mode_hz: Option<f64>,
    },
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// The mode behind a misfit, and what would help, in words.
fn of_mode(mode_hz: &Option<f64>) -> String {
    mode_hz.map_or(String::new(), |hz| {
        format!(
            "; there is a mode at {hz:.0} Hz: a stiffer coupling or guide, more damping, or the encoder on the motor would help"
        )
    })
}

/// Fewest lines of a fit.
const LEAST_LINES: usize = 10;
/// Longest dead time looked for, s.
const LONGEST_DELAY_S: f64 = 0.05;
/// Dead times tried by the linear start.
const DELAYS: usize = 500;
/// Dead times tried for each start of a mode.
const TRIED_DELAYS: usize = 30;
/// Largest relative standard error of A and B.
const MOST_UNCERTAIN: f64 = 0.25;
/// Largest corner frequency of a damping that may stay unknown, over the lowest frequency.
const NEGLIGIBLE_CORNER_RATIO: f64 = 0.7;
/// Largest misfit of the gain that noise explains, dB.
const MOST_GAIN_DB: f64 = 3.0;
/// Largest misfit of the phase that noise explains, degrees.
const MOST_PHASE_DEG: f64 = 20.0;
/// Misfit of the gain in each band up to which no mode is looked for, dB.
const SMALL_GAIN_DB: f64 = 0.4;
/// Misfit of the phase in each band up to which no mode is looked for, degrees.
const SMALL_PHASE_DEG: f64 = 3.0;
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
    // A spring's damper and the dead time both bend the phase: where the response does not distinguish them, there is none.
    fit_lines(&lines, settings, true).or_else(|_| fit_lines(&lines, settings, false))
}

/// Fits the model to lines, with springs whose own damper transmits force or without.
fn fit_lines(
    lines: &[ResponsePoint],
    settings: &PlantFitSettings,
    dampers: bool,
) -> Result<PlantFit, PlantError> {
    let (found, model) = with_modes(lines, settings, dampers)?;
    let plant = model.plant;
    let bands = bands(lines, &model);
    let all = band_misfit(lines, &model);
    if all.gain_db > MOST_GAIN_DB || all.phase_deg > MOST_PHASE_DEG {
        return Err(PlantError::Misfit {
            gain_db: all.gain_db,
            phase_deg: all.phase_deg,
            worst_hz: worst_hz(lines, &model),
            mode_hz: model.modes.first().map(|mode| mode.frequency_hz),
        });
    }
    check_support(lines, &model, &found, settings)?;
    Ok(PlantFit {
        plant,
        modes: model.modes,
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

fn linear_start(lines: &[ResponsePoint], stiffness: Stiffness) -> PlantModel {
    linear_start_of(lines, stiffness, DELAYS)
}

/// For each of so many dead times, A, B and C by linear least squares on relative errors; the best.
fn linear_start_of(lines: &[ResponsePoint], stiffness: Stiffness, delays: usize) -> PlantModel {
    let unknowns = stiffness.unknowns();
    let mut best = (f64::INFINITY, model(&[1.0, 0.0, 0.0]));
    for step in 0..delays {
        let delay_s = LONGEST_DELAY_S * (step as f64 / delays as f64).powi(2);
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

/// Rigid axis and modes.
#[derive(Clone, Debug)]
struct Model {
    plant: PlantModel,
    modes: Vec<Mode>,
}

impl Model {
    /// The model of the values in the order A, B, Td, perhaps C, and those of its modes.
    fn of(values: &[f64], stiffness: Stiffness, anti: &[bool]) -> Self {
        let (rigid, mut rest) = values.split_at(stiffness.unknowns() + 1);
        let mut next = || {
            let (first, others) = rest.split_at(2);
            rest = others;
            (first[0], first[1])
        };
        let modes = anti.iter().map(|&anti| {
            let (frequency_hz, damping) = next();
            Mode {
                frequency_hz,
                damping,
                anti: anti.then(&mut next),
            }
        });
        Self {
            modes: modes.collect(),
            plant: model(rigid),
        }
    }

    fn response(&self, omega: f64) -> Complex64 {
        self.plant.response(omega) * mode::response_of(&self.modes, omega)
    }
}

/// Most modes of a model.
const MOST_MODES: usize = 2;
/// Factor by which a mode makes the weighted squares smaller at least.
pub const LEAST_DROP: f64 = 2.0;
/// Lowest frequency of a mode, Hz.
const LOWEST_MODE_HZ: f64 = 12.0;
/// Highest frequency of a mode over that of the highest line.
const HIGHEST_MODE: f64 = 1.05;
/// Starts of a mode over the band.
const STARTS: usize = 14;
/// Number of lines on which the starts are tried.
const TRIED_LINES: usize = 160;
/// Least and largest damping ratio of a mode.
const DAMPINGS: (f64, f64) = (1e-3, 0.5);
/// Damping ratio below which a mode resonates: one that ends at the largest is something else.
const LARGEST_DAMPING: f64 = 0.98 * DAMPINGS.1;
/// Damping ratio from which its fit starts.
const DAMPING_START: f64 = 0.03;
/// Start of an anti-resonance over the mode's frequency: of equal masses.
const ANTI_START: f64 = 0.7;
/// Damping ratio of a mode from which the fit with a damper that transmits force starts.
const STRONG_START: f64 = 0.1;
/// Frequency of that damper over the mode's from which the fit starts.
const DAMPER_START: f64 = 6.0;
/// Least and largest damping ratio of that damper.
const DAMPERS: (f64, f64) = (MIN_TRANSMITTING_DAMPING, 5.0);
/// Largest relative standard error of a mode's frequency.
const MOST_UNCERTAIN_MODE: f64 = 0.05;

/// The rigid model, and modes as long as they explain enough; where the response must determine the model, the last that it does.
fn with_modes(
    lines: &[ResponsePoint],
    settings: &PlantFitSettings,
    dampers: bool,
) -> Result<(Fit, Model), FitError> {
    let stiffness = settings.stiffness;
    let start = Model {
        plant: linear_start(lines, stiffness),
        modes: Vec::new(),
    };
    let rigid = refine(lines, stiffness, &start);
    let thinned: Vec<ResponsePoint> = lines
        .iter()
        .step_by(lines.len().div_ceil(TRIED_LINES))
        .copied()
        .collect();
    let mut modes = Vec::new();
    let mut accepted = rigid.clone();
    let mut best = rigid;
    let explained = |best: &Result<(Fit, Model), FitError>| {
        let small =
            |(_, model): &(Fit, Model)| bands(lines, model).iter().all(BandMisfit::is_small);
        best.as_ref().is_ok_and(small)
    };
    while modes.len() < MOST_MODES && !explained(&best) {
        let Some(found) = another_mode(lines, &thinned, stiffness, &modes, dampers) else {
            break;
        };
        let Ok(fit) = refine(lines, stiffness, &found) else {
            break;
        };
        let better = match &best {
            Ok((_, before)) => LEAST_DROP * cost(lines, &fit.1) < cost(lines, before),
            Err(_) => true,
        };
        if !better || !is_resolved(&fit.0) {
            break;
        }
        modes.clone_from(&fit.1.modes);
        // Two poles too many for one mode may turn into a second.
        if !settings.determined || is_determined(&fit.0, &modes) {
            accepted = Ok(fit.clone());
        }
        best = Ok(fit);
    }
    accepted
}

/// True if the response determines the frequencies of all that resonates.
fn is_resolved(found: &Fit) -> bool {
    let first = found
        .names
        .iter()
        .position(|name| *name == MODE_NAMES[0][0]);
    // A damper has no frequency of its own.
    (first.unwrap_or(found.values.len())..found.values.len())
        .step_by(2)
        .filter(|index| found.values[index + 1] < MIN_TRANSMITTING_DAMPING)
        .all(|index| found.standard_errors[index] < MOST_UNCERTAIN_MODE * found.values[index])
}

/// True if, moreover, every mode resonates, and A is determined.
fn is_determined(found: &Fit, modes: &[Mode]) -> bool {
    let resonates = |mode: &Mode| mode.damping < LARGEST_DAMPING;
    is_resolved(found)
        && modes.iter().all(resonates)
        && found.standard_errors[0] < MOST_UNCERTAIN * found.values[0]
}

fn antis(modes: &[Mode]) -> Vec<bool> {
    modes.iter().map(|mode| mode.anti.is_some()).collect()
}

/// The best model with one mode more than these, from starts over the band.
fn another_mode(
    lines: &[ResponsePoint],
    thinned: &[ResponsePoint],
    stiffness: Stiffness,
    modes: &[Mode],
    dampers: bool,
) -> Option<Model> {
    let highest_hz = HIGHEST_MODE * lines.last()?.frequency_hz;
    let lowest_hz = LOWEST_MODE_HZ.max(lines.first()?.frequency_hz);
    let mut tried: Vec<(f64, Model)> = Vec::new();
    for index in 0..STARTS {
        let share = (index as f64 + 0.5) / STARTS as f64;
        let frequency_hz = lowest_hz * (highest_hz / lowest_hz).powf(share);
        let dip = Some((ANTI_START * frequency_hz, DAMPING_START));
        // (s / w_a)^2 is small, and 2 d_a / w_a that of the mode.
        let damper = Some((DAMPER_START * frequency_hz, DAMPER_START * STRONG_START));
        let kinds = [
            (DAMPING_START, None),
            (DAMPING_START, dip),
            (STRONG_START, damper),
        ];
        for (damping, anti) in kinds.into_iter().take(if dampers { 3 } else { 2 }) {
            let mode = Mode {
                frequency_hz,
                damping,
                anti,
            };
            let mut modes = modes.to_vec();
            modes.push(mode);
            // The rigid axis that is left when the modes are divided out.
            let divided: Vec<ResponsePoint> = thinned
                .iter()
                .map(|line| ResponsePoint {
                    response: line.response / mode::response_of(&modes, TAU * line.frequency_hz),
                    ..*line
                })
                .collect();
            let plant = linear_start_of(&divided, stiffness, TRIED_DELAYS);
            let start = Model { plant, modes };
            if let Ok((_, found)) = search(thinned, stiffness, &start, true) {
                tried.push((cost(thinned, &found), found));
            }
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    // An anti-resonance costs two parameters: it must explain something, too.
    let plain = tried
        .iter()
        .find(|(_, model)| model.modes.last().is_some_and(|mode| mode.anti.is_none()));
    let (least, best) = tried.first()?;
    match plain {
        Some((cost, plain)) if *cost < LEAST_DROP.sqrt() * least => Some(plain.clone()),
        _ => Some(best.clone()),
    }
}

/// Weighted squares of the residuals.
fn cost(lines: &[ResponsePoint], model: &Model) -> f64 {
    residuals(lines, model).iter().map(|each| each * each).sum()
}

/// Relative errors of the lines over their deviations.
fn residuals(lines: &[ResponsePoint], model: &Model) -> Vec<f64> {
    lines
        .iter()
        .flat_map(|line| {
            let ratio = model.response(TAU * line.frequency_hz) / line.response - 1.0;
            let deviation = line.relative_deviation.max(LEAST_DEVIATION);
            [ratio.re / deviation, ratio.im / deviation]
        })
        .collect()
}

/// Names of the parameters of each mode.
const MODE_NAMES: [[&str; 4]; MOST_MODES] =
    [["f1", "d1", "fa1", "da1"], ["f2", "d2", "fa2", "da2"]];

/// Nonlinear least squares from the start.
fn refine(
    lines: &[ResponsePoint],
    stiffness: Stiffness,
    start: &Model,
) -> Result<(Fit, Model), FitError> {
    let (found, model) = search(lines, stiffness, start, false)?;
    Ok((found.no_better_than_stated(), model))
}

/// Nonlinear least squares; `nearest` takes the place where the search ends without having converged, too.
fn search(
    lines: &[ResponsePoint],
    stiffness: Stiffness,
    whole: &Model,
    nearest: bool,
) -> Result<(Fit, Model), FitError> {
    let start = &whole.plant;
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
    let highest_hz = highest / TAU;
    for (mode, names) in whole.modes.iter().zip(MODE_NAMES) {
        let pairs = [Some((mode.frequency_hz, mode.damping)), mode.anti];
        for ((frequency_hz, damping), names) in pairs.into_iter().flatten().zip(names.chunks(2)) {
            let (frequencies, dampings) = if damping < MIN_TRANSMITTING_DAMPING {
                ((0.5 * LOWEST_MODE_HZ, 1.5 * highest_hz), DAMPINGS)
            } else {
                ((0.5 * LOWEST_MODE_HZ, DAMPER_START * highest_hz), DAMPERS)
            };
            parameters.push(Parameter {
                name: names[0],
                start: frequency_hz.clamp(1.01 * frequencies.0, 0.99 * frequencies.1),
                bounds: frequencies,
            });
            parameters.push(Parameter {
                name: names[1],
                start: damping.clamp(1.1 * dampings.0, 0.9 * dampings.1),
                bounds: dampings,
            });
        }
    }
    let anti = antis(&whole.modes);
    let of = |values: &[f64]| residuals(lines, &Model::of(values, stiffness, &anti));
    let found = if nearest {
        fit_nearest(&parameters, Loss::Squares, of)?
    } else {
        fit(&parameters, Loss::Squares, of)?
    };
    let model = Model::of(&found.values, stiffness, &anti);
    Ok((found, model))
}

/// Checks that the data determine what was fitted.
fn check_support(
    lines: &[ResponsePoint],
    model: &Model,
    found: &Fit,
    settings: &PlantFitSettings,
) -> Result<(), PlantError> {
    let low_hz = lines.first().map_or(0.0, |line| line.frequency_hz);
    let high_hz = lines.last().map_or(0.0, |line| line.frequency_hz);
    let corner_hz = model.plant.damping_per_s / TAU;
    let relative = |index: usize| found.standard_errors[index] / found.values[index].abs();
    let uncertain = |index: usize| {
        let deviation = relative(index);
        deviation.is_nan() || deviation > MOST_UNCERTAIN
    };
    let negligible = settings.negligible_damping && corner_hz < NEGLIGIBLE_CORNER_RATIO * low_hz;
    let distinguishable = !uncertain(1) && low_hz <= 1.5 * corner_hz.max(0.1);
    let described = !settings.determined && !model.modes.is_empty();
    let known = described || !uncertain(0) && (negligible || distinguishable);
    if !known || high_hz < 1.5 * corner_hz {
        return Err(PlantError::MissesCorner {
            low_hz,
            high_hz,
            corner_hz,
            needed_low_hz: 0.3 * corner_hz,
            needed_high_hz: 4.0 * corner_hz,
        });
    }
    // A dead time is known well enough when the phase it turns is, at the highest line that a loop can use: below a mode between motor and
    // encoder.
    let between = model.modes.iter().filter(|mode| !mode.is_at_motor());
    let used_hz = between.fold(high_hz, |used_hz, mode| used_hz.min(mode.frequency_hz));
    let turned = TAU * used_hz * found.standard_errors[2];
    if turned.is_nan() || turned > MOST_UNCERTAIN {
        return Err(PlantError::Undetermined {
            parameter: "Td",
            value: found.values[2],
            standard_error: found.standard_errors[2],
        });
    }
    Ok(())
}

fn bands(lines: &[ResponsePoint], model: &Model) -> Vec<BandMisfit> {
    lines
        .chunks(lines.len().div_ceil(3))
        .map(|band| band_misfit(band, model))
        .collect()
}

/// The frequency of the line that the model misses most.
fn worst_hz(lines: &[ResponsePoint], model: &Model) -> f64 {
    let distance = |line: &ResponsePoint| {
        (model.response(TAU * line.frequency_hz) / line.response)
            .ln()
            .norm()
    };
    lines
        .iter()
        .max_by(|a, b| distance(a).total_cmp(&distance(b)))
        .map_or(f64::NAN, |line| line.frequency_hz)
}

fn band_misfit(lines: &[ResponsePoint], model: &Model) -> BandMisfit {
    let (mut gain, mut phase) = (0.0, 0.0);
    for line in lines {
        let ratio = model.response(TAU * line.frequency_hz) / line.response;
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

#[cfg(test)]
mod tests {
    use super::*;

    const RIGID: PlantModel = PlantModel {
        gain_mm_per_v_s2: 60_000.0,
        damping_per_s: 120.0,
        stiffness_per_s2: 0.0,
        delay_s: 1.2e-3,
    };
    const SLIDING: PlantFitSettings = PlantFitSettings {
        least_coherence: 0.9,
        band_hz: (0.0, f64::INFINITY),
        stiffness: Stiffness::Zero,
        negligible_damping: false,
        determined: true,
    };

    /// Lines every 2 Hz from 4 to 400 Hz, with errors of one percent.
    fn response(modes: &[Mode]) -> FrequencyResponse {
        let mut state = 1u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            0.01 * 3.0_f64.sqrt() * ((state >> 33) as f64 / f64::from(1u32 << 30) - 1.0)
        };
        let line = |index: usize| {
            let frequency_hz = 2.0 * index as f64;
            let omega = TAU * frequency_hz;
            let exact = RIGID.response(omega) * mode::response_of(modes, omega);
            ResponsePoint {
                frequency_hz,
                response: exact * Complex64::new(1.0 + noise(), noise()),
                coherence: 0.99,
                relative_deviation: 0.01,
            }
        };
        FrequencyResponse {
            points: (2..=200).map(line).collect(),
        }
    }

    fn check(mode: Mode) {
        let found = fit_plant(&response(&[mode]), &SLIDING).unwrap();
        let [fitted] = found.modes[..] else {
            panic!("{:?} for {mode:?}", found.modes);
        };
        let near = |value: f64, expected: f64, tolerance: f64| {
            assert!(
                (value / expected - 1.0).abs() < tolerance,
                "{fitted:?} for {mode:?}"
            );
        };
        near(fitted.frequency_hz, mode.frequency_hz, 0.01);
        near(fitted.damping, mode.damping, 0.2);
        assert_eq!(fitted.anti.is_some(), mode.anti.is_some());
        near(found.plant.gain_mm_per_v_s2, RIGID.gain_mm_per_v_s2, 0.02);
        let error_hz = found.fit.standard_errors[3];
        assert!(
            error_hz > 0.0 && error_hz < 0.01 * mode.frequency_hz,
            "{error_hz} Hz"
        );
    }

    #[test]
    fn a_dead_time_need_not_be_known_better_than_a_loop_below_the_mode_needs_it() {
        let lines = response(&[]).points;
        let mut found = fit_plant(&response(&[]), &SLIDING).unwrap();
        // 8 deg at 32 Hz, 100 deg at the highest line.
        found.fit.standard_errors[2] = 7e-4;
        let checked = |anti: &[Option<(f64, f64)>]| {
            let mode = |anti: &Option<(f64, f64)>| Mode {
                frequency_hz: 32.0,
                damping: 0.02,
                anti: *anti,
            };
            let model = Model {
                plant: found.plant,
                modes: anti.iter().map(mode).collect(),
            };
            check_support(&lines, &model, &found.fit, &SLIDING)
        };
        let refused = |anti| matches!(checked(anti), Err(PlantError::Undetermined { .. }));
        assert!(refused(&[]));
        assert!(refused(&[Some((22.0, 0.02))]), "encoder on the motor");
        assert_eq!(checked(&[None]), Ok(()), "encoder on the table");
    }

    #[test]
    fn a_strongly_damped_spring_transmits_force_above_its_mode() {
        // Two masses, the encoder on the far one: (1 + 2 d s / w) / (1 + 2 d s / w + (s / w)^2).
        let (frequency_hz, damping) = (38.0, 0.1);
        let exact = Mode {
            frequency_hz,
            damping,
            anti: Some((1e3 * frequency_hz, 1e3 * damping)),
        };
        let found = fit_plant(&response(&[exact]), &SLIDING).unwrap();
        let [mode] = found.modes[..] else {
            panic!("{:?}", found.modes);
        };
        assert!((mode.frequency_hz / 38.0 - 1.0).abs() < 0.02, "{mode:?}");
        assert!((mode.damping - damping).abs() < 0.02, "{mode:?}");
        let all = found.bands.iter().map(|band| band.phase_deg);
        assert!(all.fold(0.0, f64::max) < 2.0, "{:?}", found.bands);
    }

    #[test]
    fn a_mode_is_found_with_the_encoder_on_either_side() {
        for (frequency_hz, damping) in [(35.0, 0.02), (90.0, 0.05), (250.0, 0.02)] {
            let anti = Some((0.7 * frequency_hz, 0.7 * damping));
            for anti in [None, anti] {
                check(Mode {
                    frequency_hz,
                    damping,
                    anti,
                });
            }
        }
    }

    #[test]
    fn poles_that_do_not_resonate_are_a_mode_only_where_a_description_will_do() {
        let overdamped = Mode {
            frequency_hz: 28.0,
            damping: 1.1,
            anti: None,
        };
        let lines = response(&[overdamped]);
        let refused = fit_plant(&lines, &SLIDING).unwrap_err();
        assert!(matches!(refused, PlantError::Misfit { .. }), "{refused:?}");
        let described = PlantFitSettings {
            determined: false,
            ..SLIDING
        };
        let found = fit_plant(&lines, &described).unwrap();
        assert!(!found.is_determined());
        assert!(
            found.bands.iter().all(BandMisfit::is_small),
            "{:?}",
            found.bands
        );
    }

    #[test]
    fn a_rigid_axis_has_no_mode() {
        let found = fit_plant(&response(&[]), &SLIDING).unwrap();
        assert_eq!(found.modes, []);
        assert_eq!(found.fit.names, ["A", "B", "Td"]);
    }
}
