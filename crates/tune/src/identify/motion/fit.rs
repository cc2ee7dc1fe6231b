//! The fit of every model, and its validation.

use rayon::prelude::*;

use super::error::{LEAST_PERCENT, LEAST_ROWS, MotionFitError};
use super::model::{Estimate, MotionModel, Structure};
use super::regressors::{Regression, Term};
use super::signals::{MotionFitSettings, Signals};
use super::simulate::open_loop_mm;
use super::solution::{MOST_DEAD_TIME_S, Solution};
use super::uncertainty::estimates;
use crate::identify::fit::{Loss, Parameter, fit_with_step};
use crate::identify::setting::SettingError;
use crate::record::Recording;

/// A model, and how it does where it was not fitted.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The model, fitted to the whole record.
    pub model: MotionModel,
    /// Relative error on parts of the trajectory that were withheld from the fit, in all their repetitions, one part at a time;
    /// nothing when there are too few motions, or for a model that was [refined].
    pub validation_error: Option<f64>,
    /// The errors that it is ranked by: on withheld motion, or without any on that of the fit.
    errors: Errors,
    /// The errors at the ends of the record and of its travel, from fits without them; nothing if nothing was withheld.
    outside: Option<Errors>,
    /// The errors on the record of the fit.
    fitted: Errors,
    /// True if its motion was fitted, too.
    pub refined: bool,
    solution: Solution,
    /// The rows of the regression.
    pub rows: Rows,
}

impl Candidate {
    /// True if it leaves no more of its record's voltage unexplained than another does, within what distinguishes models.
    pub fn explains_as_well_as(&self, other: &Self) -> bool {
        self.fitted.all <= as_good_as(other.fitted.all)
            && self.fitted.sliding <= as_good_as(other.fitted.sliding)
    }
}

/// The largest error that is as good as another.
fn as_good_as(error: f64) -> f64 {
    (EQUAL_ERROR_RATIO * error).max(error + EQUAL_ERROR_SHARE)
}

/// Relative errors of a model. About a reversal one without pre-sliding is wrong for the time that the axis sticks, which says little
/// about mass and friction.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Errors {
    /// On all rows.
    all: f64,
    /// On rows of sliding.
    sliding: f64,
}

impl Errors {
    fn of(solution: &Solution, regression: &Regression<'_>, sliding: &[usize]) -> Self {
        let all: Vec<usize> = (0..regression.rows()).collect();
        Self {
            all: solution.error_on(regression, &all),
            sliding: solution.error_on(regression, sliding),
        }
    }
}

/// Voltage explained by a fit, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    pub time_s: Vec<f64>,
    pub velocity_mm_s: Vec<f64>,
    /// Voltage that was commanded a dead time before, V.
    pub voltage_v: Vec<f64>,
    /// Residual of the model, V.
    pub residual_v: Vec<f64>,
    /// Voltage without inertia and offset, V: the friction.
    pub friction_v: Vec<f64>,
}

/// Parts of the trajectory that are withheld, one at a time.
const PARTS: usize = 8;
/// Share of the record, in time, and of the travel that each end has which is withheld.
const END_SHARE: f64 = 0.2;
/// Reversals below which nothing is withheld.
const LEAST_REVERSALS: usize = 3;
/// Largest error over the smallest of a model that is as good as the best: the simplest of them is recommended.
const EQUAL_ERROR_RATIO: f64 = 1.02;
/// The same as a share of the voltage that is left unexplained beyond the smallest: less does not distinguish models.
const EQUAL_ERROR_SHARE: f64 = 1.5e-3;
/// Least error on all rows, over the smallest, of a model that reversals contradict.
const CONTRADICTION_RATIO: f64 = 3.0;
/// Largest validation error, over the smallest, of a model whose parameters widen the standard errors of the others.
const RIVAL_ERROR_RATIO: f64 = 2.0;

/// Fits every structure of [`Structure::ALL`] to a record; `progress` receives the share that is done. A structure whose
/// parameters the record does not determine, or whose mass or friction is below zero, is no candidate.
///
/// A parameter's standard error covers the record's noise, what the value becomes with parts of the trajectory withheld, and
/// how far it lies from that of the other models which predict withheld parts at most twice as badly as the best.
///
/// # Errors
/// A record that is too short or moves one way only, or of which no structure is a candidate: then the first one's reason.
pub fn fit_motion(
    recording: &Recording,
    settings: &MotionFitSettings,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Candidate>, MotionFitError> {
    check(recording, settings)?;
    let signals = Signals::new(recording, settings);
    let splits = splits(&signals, settings)?;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let fitted: Vec<Result<Candidate, MotionFitError>> = Structure::ALL
        .into_par_iter()
        .map(|structure| {
            let candidate = candidate(&signals, settings, structure, splits.as_ref());
            let count = 1 + done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            progress(count as f64 / Structure::ALL.len() as f64);
            candidate
        })
        .collect();
    let mut candidates = Vec::new();
    let mut reason = None;
    for candidate in fitted {
        match candidate {
            Ok(candidate) => candidates.push(candidate),
            Err(error) => {
                reason.get_or_insert(error);
            }
        }
    }
    if let Some(error) = reason.filter(|_| candidates.is_empty()) {
        return Err(error);
    }
    widen_by_other_models(&mut candidates);
    Ok(candidates)
}

/// Widens each standard error by the distance to the same parameter of the other good models.
fn widen_by_other_models(candidates: &mut [Candidate]) {
    let best = candidates
        .iter()
        .filter_map(|candidate| candidate.validation_error)
        .fold(f64::INFINITY, f64::min);
    let opinions: Vec<Vec<Estimate>> = candidates
        .iter()
        .filter(|candidate| {
            candidate
                .validation_error
                .is_some_and(|error| error <= RIVAL_ERROR_RATIO * best)
        })
        .map(|candidate| candidate.model.estimates.clone())
        .collect();
    for candidate in candidates {
        for estimate in &mut candidate.model.estimates {
            let furthest = opinions
                .iter()
                .flatten()
                .filter(|other| other.name == estimate.name)
                .map(|other| (other.value - estimate.value).abs())
                .fold(0.0, f64::max);
            estimate.standard_error = estimate.standard_error.hypot(furthest);
        }
    }
}

fn check(recording: &Recording, settings: &MotionFitSettings) -> Result<(), MotionFitError> {
    let refuse = |field, value, expected| {
        Err(SettingError {
            field,
            value,
            expected,
        }
        .into())
    };
    let half_rate_hz = 0.5 / recording.sample_time_s;
    if !(settings.cutoff_hz > 0.0 && settings.cutoff_hz < 0.9 * half_rate_hz) {
        let expected = "it must be above zero and below 0.45 of the record's sampling rate, in Hz";
        return refuse("cut-off", settings.cutoff_hz, expected);
    }
    if !(settings.edge_s >= 0.0 && settings.edge_s <= 100.0) {
        return refuse("cut edges", settings.edge_s, "they must be 0 to 100 s");
    }
    if !(settings.row_rate_hz >= 1.0 && settings.row_rate_hz <= 2.0 * half_rate_hz) {
        let expected = "it must be 1 Hz to the record's sampling rate";
        return refuse("row rate", settings.row_rate_hz, expected);
    }
    if let Some(dead_time_s) = settings.dead_time_s
        && !(0.0..=MOST_DEAD_TIME_S).contains(&dead_time_s)
    {
        return refuse("dead time", dead_time_s, "it must be 0 to 0.02 s");
    }
    let ascending = settings.knots_mm.windows(2).all(|pair| pair[0] < pair[1]);
    let within = settings
        .knots_mm
        .iter()
        .all(|knot| (1e-6..=10.0).contains(knot));
    if settings.knots_mm.is_empty() || settings.knots_mm.len() > 8 || !(ascending && within) {
        let expected = "there must be 1 to 8 knots, ascending, of 0.000001 to 10 mm";
        return refuse("knots", settings.knots_mm.len() as f64, expected);
    }
    let period_s = recording.sample_time_s;
    let left = recording
        .len()
        .saturating_sub(2 * settings.edge_samples(period_s));
    let rows = left / settings.decimation(period_s);
    if rows < LEAST_ROWS {
        return Err(MotionFitError::TooShort { rows });
    }
    if recording.voltage_v.iter().all(|volts| *volts == 0.0) {
        return Err(MotionFitError::NoVoltage);
    }
    Ok(())
}

/// Rows that are withheld: of each fit, true for each of its rows.
struct Splits {
    /// Parts of the trajectory, wherever they occur.
    parts: Vec<Vec<bool>>,
    /// Beginning and end of the record, and the ends of its travel: what is found between them need not hold there.
    ends: Vec<Vec<bool>>,
}

/// The rows to withhold; nothing where too few reversals leave too little of them.
/// A trajectory that repeats itself is divided within one repetition, so that a part is withheld wherever it occurs.
fn splits(
    signals: &Signals,
    settings: &MotionFitSettings,
) -> Result<Option<Splits>, MotionFitError> {
    let velocity = signals.decimated(&signals.velocity_mm_s, settings);
    let moving = signals.moving_mm_s();
    let share = |sign: f64| {
        let count = velocity.iter().filter(|v| **v * sign > moving).count();
        100.0 * count as f64 / velocity.len() as f64
    };
    let percent = share(1.0).min(share(-1.0));
    if percent < LEAST_PERCENT {
        return Err(MotionFitError::OneWay { percent });
    }
    let ways: Vec<f64> = velocity
        .iter()
        .filter(|v| v.abs() > moving)
        .map(|v| v.signum())
        .collect();
    let reversals = ways.windows(2).filter(|pair| pair[0] != pair[1]).count();
    if reversals < LEAST_REVERSALS {
        return Ok(None);
    }
    let position = signals.decimated(&signals.position_mm, settings);
    let period = repetition(&position).unwrap_or(position.len());
    let rows = position.len();
    let part = |row: usize| (row % period) * PARTS / period;
    let parts = (0..PARTS).map(|withheld| (0..rows).map(|row| part(row) == withheld).collect());
    let lowest = position.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = position.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let place = |row: usize| (position[row] - lowest) / (highest - lowest);
    let time = |row: usize| row as f64 / rows as f64;
    let end = |share: &dyn Fn(usize) -> f64, upper: bool| {
        let share = |row| if upper { 1.0 - share(row) } else { share(row) };
        (0..rows).map(|row| share(row) < END_SHARE).collect()
    };
    let ends = [false, true].map(|upper| [end(&place, upper), end(&time, upper)]);
    Ok(Some(Splits {
        parts: parts.collect(),
        ends: ends.into_iter().flatten().collect(),
    }))
}

/// Rows after which a trajectory repeats itself; nothing if it does not.
fn repetition(position_mm: &[f64]) -> Option<usize> {
    let count = position_mm.len();
    let mean = position_mm.iter().sum::<f64>() / count as f64;
    let variance = position_mm.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count as f64;
    let differs = |lag: usize| -> f64 {
        let pairs = position_mm.iter().zip(&position_mm[lag..]);
        let squares: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        (squares / (count - lag) as f64 / variance).sqrt()
    };
    // Neighbours are alike, too: a repetition is a likeness after a difference.
    let longest = (LONGEST_REPETITION * count as f64) as usize;
    let unlike = (1..longest).find(|&lag| differs(lag) > MIN_DIFFERENCE)?;
    let alike = (unlike..longest).find(|&lag| differs(lag) < MAX_REPETITION_DIFFERENCE)?;
    let until = (alike..longest).find(|&lag| differs(lag) >= MAX_REPETITION_DIFFERENCE);
    (alike..until.unwrap_or(longest)).min_by(|a, b| differs(*a).total_cmp(&differs(*b)))
}

/// Largest length of a repetition over that of the record: a longer one does not occur twice.
const LONGEST_REPETITION: f64 = 0.6;
/// Least RMS difference of a trajectory and itself, later, over its standard deviation, at another place.
const MIN_DIFFERENCE: f64 = 0.2;
/// Largest such difference at the same place.
const MAX_REPETITION_DIFFERENCE: f64 = 0.02;

fn candidate(
    signals: &Signals,
    settings: &MotionFitSettings,
    structure: Structure,
    splits: Option<&Splits>,
) -> Result<Candidate, MotionFitError> {
    let regression = Regression::new(signals, settings, structure, signals.span());
    let sliding = regression.sliding_rows(signals.moving_mm_s());
    let rows: Vec<usize> = match structure.sliding {
        true => sliding.clone(),
        false => (0..regression.rows()).collect(),
    };
    let whole = Solution::find(&regression, structure, &rows)?;
    let without = |splits: &[Vec<bool>]| withheld(&regression, structure, splits, &sliding);
    let withheld = splits.and_then(|splits| without(&splits.parts));
    let outside = splits.and_then(|splits| without(&splits.ends));
    let others = withheld.as_ref().map_or(&[][..], |found| &found.solutions);
    let described = described(signals, settings, structure, &regression, whole, others)?;
    Ok(Candidate {
        validation_error: withheld.as_ref().map(|found| found.errors.all),
        errors: withheld
            .as_ref()
            .map_or(described.fitted, |found| found.errors),
        outside: outside.map(|found| found.errors),
        ..described
    })
}

/// A candidate for a solution, with its estimates and rows; `withheld` are the solutions without parts of the trajectory.
fn described(
    signals: &Signals,
    settings: &MotionFitSettings,
    structure: Structure,
    regression: &Regression<'_>,
    whole: Solution,
    withheld: &[Solution],
) -> Result<Candidate, MotionFitError> {
    let all: Vec<usize> = (0..regression.rows()).collect();
    let residual = whole.residual(regression, &all);
    let sliding = regression.sliding_rows(signals.moving_mm_s());
    let fitted = Errors::of(&whole, regression, &sliding);
    let row_s = signals.sample_time_s * settings.decimation(signals.sample_time_s) as f64;
    let estimates = estimates(&whole, regression, structure, settings, &residual, withheld);
    let model = whole.model(regression, structure, settings, &residual, estimates)?;
    let acceleration = signals.decimated(&signals.acceleration_mm_s2, settings);
    let voltage = regression.voltage_at(whole.dead_time_s);
    let friction = voltage
        .iter()
        .zip(&acceleration)
        .map(|(volts, a)| volts - model.inertia_v_s2_per_mm * a - model.offset_v);
    Ok(Candidate {
        validation_error: None,
        errors: fitted,
        outside: None,
        fitted,
        refined: false,
        rows: Rows {
            time_s: all
                .iter()
                .map(|row| settings.edge_s + *row as f64 * row_s)
                .collect(),
            velocity_mm_s: regression.velocity_mm_s.clone(),
            friction_v: friction.collect(),
            voltage_v: voltage.iter().copied().collect(),
            residual_v: residual.iter().copied().collect(),
        },
        model,
        solution: whole,
    })
}

/// True if no simpler model is better at the ends of the record and of its travel, without which both were fitted.
fn holds_outside(candidate: &Candidate, candidates: &[Candidate]) -> bool {
    let Some(own) = candidate.outside else {
        return true;
    };
    candidates
        .iter()
        .filter(|other| other.model.estimates.len() < candidate.model.estimates.len())
        .filter_map(|other| other.outside)
        .all(|other| own.sliding <= as_good_as(other.sliding))
}

/// The model to use: the simplest of those whose error while sliding is within two per cent of the smallest, or within 0.15 % of
/// the voltage, which reversals do not contradict, and than which no simpler one is better at the ends of the record and of its travel.
/// The errors are those on withheld motion; where nothing was withheld of any model, those on the record of the fit. A model of which
/// nothing could be withheld is not compared with others.
pub fn recommended(candidates: &[Candidate]) -> Option<&Candidate> {
    let validated = candidates
        .iter()
        .any(|candidate| candidate.validation_error.is_some());
    let errors = |candidate: &Candidate| {
        let compared = candidate.validation_error.is_some() == validated
            && !candidate.refined
            && holds_outside(candidate, candidates);
        compared.then_some(candidate.errors)
    };
    let errors: Vec<Option<Errors>> = candidates.iter().map(errors).collect();
    simplest(candidates, &errors)
}

/// The same by the motion of another record, to which nothing is fitted.
///
/// # Errors
/// As [`fit_motion`].
pub fn recommended_by<'a>(
    candidates: &'a [Candidate],
    other: &Recording,
    settings: &MotionFitSettings,
) -> Result<Option<&'a Candidate>, MotionFitError> {
    check(other, settings)?;
    let signals = Signals::new(other, settings);
    let errors = |candidate: &Candidate| {
        let regression = elsewhere(candidate, &signals, settings);
        let sliding = regression.sliding_rows(signals.moving_mm_s());
        Some(Errors::of(&candidate.solution, &regression, &sliding))
    };
    let errors: Vec<Option<Errors>> = candidates.par_iter().map(errors).collect();
    Ok(simplest(candidates, &errors))
}

/// The first candidate that is as good as the best, or a better one of as many parameters; one without errors is not compared.
fn simplest<'a>(candidates: &'a [Candidate], errors: &[Option<Errors>]) -> Option<&'a Candidate> {
    let smallest = |of: fn(&Errors) -> f64| {
        let compared = errors.iter().flatten().map(of);
        compared.fold(f64::INFINITY, f64::min)
    };
    let most_sliding = as_good_as(smallest(|errors| errors.sliding));
    let least = smallest(|errors| errors.all);
    let most = (CONTRADICTION_RATIO * least).max(as_good_as(least));
    let mut good = candidates
        .iter()
        .zip(errors)
        .filter_map(|(candidate, errors)| Some((candidate, (*errors)?)))
        .filter(|(_, errors)| errors.sliding <= most_sliding && errors.all <= most)
        .peekable();
    let parameters = good.peek()?.0.model.estimates.len();
    good.filter(|(candidate, _)| candidate.model.estimates.len() == parameters)
        .min_by(|one, other| one.1.sliding.total_cmp(&other.1.sliding))
        .map(|(candidate, _)| candidate)
}

/// Fits with some of the rows withheld, and what they missed there.
struct Withheld {
    solutions: Vec<Solution>,
    errors: Errors,
}

/// Withholds the rows of each split in turn; nothing if what is left determines too little.
fn withheld(
    regression: &Regression<'_>,
    structure: Structure,
    splits: &[Vec<bool>],
    sliding: &[usize],
) -> Option<Withheld> {
    let (mut missed, mut total) = (0.0, 0.0);
    let (mut sliding_missed, mut sliding_total) = (0.0, 0.0);
    let mut slides = vec![false; regression.rows()];
    for &row in sliding {
        slides[row] = true;
    }
    let mut solutions = Vec::new();
    // Summed up in their order, so that the number of threads does not matter.
    let found: Vec<(Vec<usize>, Result<Solution, MotionFitError>)> = splits
        .par_iter()
        .map(|withheld| {
            let (judged, fitted): (Vec<usize>, Vec<usize>) =
                (0..regression.rows()).partition(|&row| withheld[row]);
            let fitted: Vec<usize> = match structure.sliding {
                true => fitted.into_iter().filter(|&row| slides[row]).collect(),
                false => fitted,
            };
            (judged, Solution::find(regression, structure, &fitted))
        })
        .collect();
    for (judged, found) in found {
        let found = found.ok()?;
        let voltage = regression.voltage_at(found.dead_time_s);
        let squares = |rows: &[usize]| {
            let missed = found.residual(regression, rows).norm_squared();
            (missed, voltage.select_rows(rows).norm_squared())
        };
        let (part_missed, part_total) = squares(&judged);
        missed += part_missed;
        total += part_total;
        let sliding: Vec<usize> = judged.into_iter().filter(|&row| slides[row]).collect();
        let (part_missed, part_total) = squares(&sliding);
        sliding_missed += part_missed;
        sliding_total += part_total;
        solutions.push(found);
    }
    Some(Withheld {
        solutions,
        errors: Errors {
            all: (missed / total).sqrt(),
            sliding: (sliding_missed / sliding_total).sqrt(),
        },
    })
}

/// Relative error of each model on another record, taken after its own, on which nothing is fitted.
///
/// # Errors
/// As [`fit_motion`].
pub fn validate(
    candidates: &[Candidate],
    other: &Recording,
    settings: &MotionFitSettings,
) -> Result<Vec<f64>, MotionFitError> {
    check(other, settings)?;
    let signals = Signals::new(other, settings);
    let error = |candidate: &Candidate| {
        let regression = elsewhere(candidate, &signals, settings);
        let all: Vec<usize> = (0..regression.rows()).collect();
        candidate.solution.error_on(&regression, &all)
    };
    Ok(candidates.par_iter().map(error).collect())
}

/// The regression of a candidate's structure on a record that was taken after its own.
fn elsewhere<'a>(
    candidate: &Candidate,
    signals: &'a Signals,
    settings: &'a MotionFitSettings,
) -> Regression<'a> {
    let MotionModel {
        structure, span, ..
    } = candidate.model;
    Regression::new(signals, settings, structure, span.afterwards())
}

/// Ranges of the coefficients in a refinement, over their values; of those that may be of either sign, over the Coulomb level.
const REFINED_RANGE: f64 = 0.3;
/// Time between the positions that a refinement compares, s.
const REFINED_EVERY_S: f64 = 0.025;
/// Step of its difference quotients, of a coefficient's range: friction's corners make the simulation rough.
const REFINED_STEP: f64 = 1e-4;

/// The same structure with coefficients that also make it move as the axis did: a position that is off by a thousandth of
/// the travel, in open loop, weighs as much as a voltage that is off by a thousandth. An open loop adds up errors of the
/// force that a fit of the force alone does not see.
///
/// # Errors
/// As [`fit_motion`], and a search that does not come to an end.
pub fn refined(
    candidate: &Candidate,
    recording: &Recording,
    settings: &MotionFitSettings,
) -> Result<Candidate, MotionFitError> {
    let signals = Signals::new(recording, settings);
    let Candidate {
        model, solution, ..
    } = candidate;
    let (structure, span) = (model.structure, model.span);
    let regression = Regression::new(&signals, settings, structure, span);
    let all: Vec<usize> = (0..regression.rows()).collect();
    let coulomb_v = model.friction.positive.curve.coulomb_v;
    let ranges: Vec<f64> = regression
        .terms
        .iter()
        .zip(solution.coefficients.iter())
        .map(|(term, value)| match term {
            Term::Inertia | Term::Viscous(_) | Term::Coulomb | Term::Element(_) => {
                REFINED_RANGE * value.abs()
            }
            Term::Drop | Term::Offset | Term::Drift(_) | Term::AlongTravel(_) => {
                REFINED_RANGE * coulomb_v
            }
        })
        .collect();
    let free: Vec<usize> = (0..ranges.len()).filter(|&i| ranges[i] > 0.0).collect();
    let shifted = |shares: &[f64]| {
        let mut found = solution.clone();
        for (&index, share) in free.iter().zip(shares) {
            found.coefficients[index] += share * ranges[index];
        }
        found
    };
    let voltage = regression.voltage_at(solution.dead_time_s).norm();
    let every = (REFINED_EVERY_S / signals.sample_time_s).ceil() as usize;
    let compared = signals.position_mm.len().div_ceil(every);
    let travel_mm = 2.0 * span.position_mm.1;
    let position_weight = 1.0 / (travel_mm * (compared as f64).sqrt());
    let parameters = vec![
        Parameter {
            name: "coefficient",
            start: 0.0,
            bounds: (-1.0, 1.0),
        };
        free.len()
    ];
    let residuals = |shares: &[f64]| {
        let found = shifted(shares);
        let force = found.residual(&regression, &all);
        let Ok(model) = found.model(&regression, structure, settings, &force, Vec::new()) else {
            return vec![f64::NAN; all.len() + compared];
        };
        let position_mm = open_loop_mm(&model, &signals);
        let off = position_mm.iter().zip(&signals.position_mm);
        force
            .iter()
            .map(|volts| volts / voltage)
            .chain(off.step_by(every).map(|(a, b)| (a - b) * position_weight))
            .collect()
    };
    let found = fit_with_step(&parameters, Loss::Squares, REFINED_STEP, residuals)?;
    let mut found = described(
        &signals,
        settings,
        structure,
        &regression,
        shifted(&found.values),
        &[],
    )?;
    // The data determine a parameter as well as they determine the force.
    for (estimate, before) in found.model.estimates.iter_mut().zip(&model.estimates) {
        estimate.standard_error = before.standard_error;
    }
    found.refined = true;
    Ok(found)
}
