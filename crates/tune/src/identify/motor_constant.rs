//! The motor constant from an open-loop test (thesis, Fig 3.7).
//!
//! The voltage steps between two levels of one sign, so that the axis slides on and its friction stays the same: then
//! `y'' = A (u(t - Td) - F) - B y'`, which integrated twice is linear in A, B and A F. Nothing is differentiated. Passes
//! in both directions bring the axis back; their scatter is the uncertainty. An axis that rings with a structural mode of the
//! order of the levels' frequency scatters too much: then the motion of an oscillator is fitted with the rest. With the moving mass, `k_f = m A`.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use quadrant_law::safety::FaultCode;

use crate::record::Recording;
use crate::test_axis::{Drive, Experiment, ExperimentError, TestAxis};

/// Parameters of the test of acceleration per volt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorConstantSettings {
    /// Lower level of the first test, V; it is raised until the axis slides.
    pub first_level_v: f64,
    /// Largest lower level, V.
    pub most_level_v: f64,
    /// Time at each level, s.
    pub dwell_s: f64,
    /// Levels in a pass.
    pub levels: usize,
    /// Time in which the voltage rises before the first level, s; 0 for none. A motor on a soft spring does not jump then.
    pub rise_s: f64,
    /// Upper level over the lower.
    pub upper_ratio: f64,
    /// Passes, alternating in direction; at least 2.
    pub passes: usize,
}

impl Default for MotorConstantSettings {
    fn default() -> Self {
        Self {
            first_level_v: 0.02,
            most_level_v: 5.0,
            dwell_s: 0.008,
            levels: 24,
            rise_s: 0.0,
            upper_ratio: 2.5,
            passes: 4,
        }
    }
}

/// Largest travel of the usual test, mm.
const ROOM_MM: f64 = 40.0;
/// Shortest dwell over the usual one.
const MIN_DWELL_RATIO: f64 = 0.4;
/// Fewest levels, a multiple of two.
const LEAST_LEVELS: usize = 14;
/// Factor on the dwell after a test that was stopped because it went too far.
const DWELL_REDUCTION: f64 = 0.75;
/// Largest number of such tests.
const TESTS_TOO_FAR: usize = 14;
/// Shortest dwell, s.
const LEAST_DWELL_S: f64 = 0.0015;
/// Dwells that are tried over the usual one where a test is too uncertain.
const OTHER_DWELLS: [f64; 3] = [1.7, 0.6, 2.4];
/// Distance from the middle over the travel, from which on the next test begins towards the middle.
const MAX_START_SHARE: f64 = 0.25;
/// Least return towards the middle, over the travel, of an axis that friction does not hold.
const MIN_RETURN_SHARE: f64 = 0.01;

impl MotorConstantSettings {
    /// Shorter levels where the travel, either way, is short: the way goes with the square of the time.
    #[must_use]
    pub fn fitted_to(self, travel_mm: f64) -> Self {
        let share = (travel_mm / ROOM_MM).sqrt().clamp(MIN_DWELL_RATIO, 1.0);
        Self {
            dwell_s: share * self.dwell_s,
            ..self
        }
    }

    /// Time of one test, s.
    pub fn lasts_s(&self) -> f64 {
        self.passes as f64 * (self.rise_s + self.levels as f64 * self.dwell_s + REST_S)
    }

    /// Mean of the levels over the lower one.
    fn mean_ratio(&self) -> f64 {
        0.5 * (1.0 + self.upper_ratio)
    }

    /// A voltage that rises first, to levels that are nearer to each other.
    #[must_use]
    fn gentle(self) -> Self {
        Self {
            rise_s: RISE_S,
            upper_ratio: GENTLE_RATIO,
            ..self
        }
    }

    /// True for a test whose voltage rises first.
    fn is_gentle(&self) -> bool {
        self.rise_s > 0.0
    }

    /// Fewer levels, down to those that a pass takes, then shorter ones.
    #[must_use]
    fn shortened(self) -> Self {
        let levels = (self.levels * 2 / 3).max(LEAST_LEVELS);
        let dwell_s = if levels == self.levels {
            (DWELL_REDUCTION * self.dwell_s).max(LEAST_DWELL_S)
        } else {
            self.dwell_s
        };
        Self {
            levels,
            dwell_s,
            ..self
        }
    }

    /// The settings of a recorded test: its first pass shows how many levels it has, and how long each lasted.
    pub fn of(recording: &Recording) -> Self {
        let usual = Self::default();
        let drives = |volts: &&f64| volts.abs() > DRIVING_V;
        let driven = recording
            .voltage_v
            .iter()
            .skip_while(|volts| !drives(volts));
        let pass: Vec<f64> = driven.take_while(drives).map(|volts| volts.abs()).collect();
        let found = Levels::of(&pass);
        let changes = pass[found.first..]
            .windows(2)
            .filter(|pair| found.is_upper(pair[0]) != found.is_upper(pair[1]));
        let levels = changes.count() + 1;
        Self {
            dwell_s: (pass.len() - found.first) as f64 * recording.sample_time_s / levels as f64,
            levels,
            rise_s: found.first as f64 * recording.sample_time_s,
            upper_ratio: found.upper_v / found.lower_v.max(DRIVING_V),
            ..usual
        }
    }
}

/// The two levels of a pass.
struct Levels {
    lower_v: f64,
    upper_v: f64,
    /// Samples before the first one, while the voltage rises.
    first: usize,
}

impl Levels {
    /// Of the magnitudes of a pass' voltage, V: the upper level comes first, and the lower one last.
    fn of(pass_v: &[f64]) -> Self {
        let mut found = Self {
            lower_v: pass_v.last().copied().unwrap_or_default(),
            upper_v: pass_v.iter().copied().fold(0.0, f64::max),
            first: 0,
        };
        let first = pass_v.iter().position(|volts| found.is_upper(*volts));
        found.first = first.unwrap_or_default();
        found
    }

    /// True for a voltage, V, that is nearer to the upper level.
    fn is_upper(&self, volts: f64) -> bool {
        volts > 0.5 * (self.lower_v + self.upper_v)
    }
}

/// Result of the test.
#[derive(Clone, Debug)]
pub struct MotorConstant {
    /// A, acceleration per volt, mm/(V s^2).
    pub gain_mm_per_v_s2: f64,
    /// Its standard deviation, from the scatter over the passes.
    pub standard_error: f64,
    /// B, damping over mass, 1/s; rough.
    pub damping_per_s: f64,
    /// Friction in motion, V; rough, and zero or more.
    pub friction_v: f64,
    /// The same in positive and in negative direction, V, within shares of the level that it slides at: what hangs pulls one
    /// way. The mean where a direction is missing.
    pub directed_v: [f64; 2],
    /// Lower level of the voltage, V.
    pub level_v: f64,
    pub recording: Recording,
}

impl MotorConstant {
    /// k_f, N/V, of a moving mass in kg.
    pub fn force_n_per_v(&self, moving_mass_kg: f64) -> f64 {
        1e-3 * self.gain_mm_per_v_s2 * moving_mass_kg
    }

    /// Standard deviation of the encoder's noise, mm, from the quietest part of the test, in which the axis rests; by second
    /// differences, which leave out a motor that still swings on its spring. Zero of an encoder that shows whole counts and no noise.
    pub fn noise_mm(&self) -> f64 {
        let samples = ((RESTING_S / self.recording.sample_time_s) as usize).max(3);
        let parts = self.recording.position_mm.chunks_exact(samples);
        let squares = parts.map(|part| {
            let bends = part.windows(3).map(|p| p[0] - 2.0 * p[1] + p[2]);
            bends.map(|bend| bend * bend).sum::<f64>() / (samples - 2) as f64
        });
        let least = squares.fold(f64::INFINITY, f64::min);
        // A second difference adds three readings with weights of 1, 2 and 1.
        if least.is_finite() {
            (least / 6.0).sqrt()
        } else {
            0.0
        }
    }
}

/// Length of the parts of a test of which the quietest is at rest, s.
const RESTING_S: f64 = 0.02;

/// Reasons for which no motor constant was found.
#[derive(Debug, thiserror::Error)]
pub enum MotorConstantError {
    /// The axis does not slide.
    #[error(
        "the axis did not slide at {level_v} V: is the amplifier enabled, the brake off, the encoder connected? Else raise the largest level"
    )]
    Still {
        /// The largest level tried.
        level_v: f64,
    },
    /// A positive voltage moves the axis to smaller positions.
    #[error(
        "a positive voltage moves the axis to smaller positions: set amplifier.reversed or encoder.reversed, or swap two wires; under \
         feedback it would run away"
    )]
    Reversed,
    #[error(
        "the passes give {gain:.0} +- {standard_error:.0} mm/(V s^2): too uncertain; raise the levels' number or dwell"
    )]
    Uncertain { gain: f64, standard_error: f64 },
    /// The recording is no test.
    #[error(
        "the recording has {passes} passes in which the voltage steps between levels of one sign while the axis slides; the test takes 2"
    )]
    NoPasses { passes: usize },
    /// The run was stopped.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
}

/// Upper level over the lower in a gentle test.
const GENTLE_RATIO: f64 = 1.6;
/// Factor by which the levels rise from test to test.
const RAISE: f64 = 1.3;
/// Least friction in motion over the mean of the levels: the rest of the mean accelerates.
const LEAST_FRICTION: f64 = 0.457;
/// Largest friction in motion over the mean of the levels.
const MOST_FRICTION: f64 = 0.857;
/// Divisor of the level of a direction in which the axis went too far.
const LEVEL_REDUCTION: f64 = 1.2;
/// Largest level that is tried in shorter tests after the axis went too far, over the level at which it did.
const MAX_RETRY_RATIO: f64 = 1.7;
/// Least ratio of a level that goes too far to one that friction holds for which a level between them is tried.
const MIN_LEVEL_RATIO: f64 = 1.06;
/// Levels at the beginning of a pass that do not count: the axis breaks away.
const BREAKAWAY_LEVELS: usize = 6;
/// Time in which the voltage of a gentle test rises, s: one and a half periods of a mode of 30 Hz.
const RISE_S: f64 = 0.05;
/// Voltage from which on a sample belongs to a pass, V.
const DRIVING_V: f64 = 0.01;
/// Time at rest between passes, s.
const REST_S: f64 = 0.1;
/// Least way of the slowest sliding in the usual dwell that suffices, counts.
const SLIDING_COUNTS: f64 = 600.0;
/// Least way in any case, counts.
const LEAST_COUNTS: f64 = 60.0;
/// Way that suffices with fewer counts than [`SLIDING_COUNTS`], mm.
const SLIDING_MM: f64 = 0.3;
/// Least speed over the mean in a gentle test, from level to level.
const MIN_SPEED_RATIO: f64 = 0.4;
/// Step between the dead times that are tried, s.
const DELAY_STEP_S: f64 = 1e-4;
/// Longest dead time that is tried, s.
const LONGEST_DELAY_S: f64 = 6e-3;
/// Longest dead time that is tried, over the dwell.
const MAX_DELAY_RATIO: f64 = 0.8;
/// Largest relative standard error.
const MOST_UNCERTAIN: f64 = 0.2;

/// The lower level of a direction, with what is known of those that were tried.
#[derive(Clone, Copy)]
struct Level {
    volts: f64,
    /// Largest at which friction held the axis, V.
    held_v: f64,
    /// Smallest at which it went too far, V.
    too_far_v: f64,
    /// The same, of tests of other lengths as well.
    ever_too_far_v: f64,
}

impl Level {
    /// A level of which nothing is known.
    fn at(volts: f64) -> Self {
        Self {
            volts,
            held_v: 0.0,
            too_far_v: f64::INFINITY,
            ever_too_far_v: f64::INFINITY,
        }
    }

    /// For a test of another length.
    fn renewed(self) -> Self {
        Self {
            ever_too_far_v: self.ever_too_far_v,
            ..Self::at(self.volts)
        }
    }

    /// The next one after a test in which friction held the axis.
    fn raise(&mut self) {
        self.held_v = self.held_v.max(self.volts);
        self.volts = (RAISE * self.volts).min(self.between());
    }

    /// The next one after a test in which the axis went too far.
    fn lower(&mut self) {
        self.too_far_v = self.too_far_v.min(self.volts);
        self.ever_too_far_v = self.ever_too_far_v.min(self.volts);
        self.volts = (self.volts / LEVEL_REDUCTION).max(self.between());
    }

    /// The middle between what held and what went too far; not a number or without an end where either is unknown.
    fn between(&self) -> f64 {
        (self.held_v * self.too_far_v).sqrt()
    }

    /// True if there is no level left between what holds and what goes too far.
    fn is_narrow(&self) -> bool {
        self.too_far_v < MIN_LEVEL_RATIO * self.held_v
    }

    /// True if it is so far above one at which the axis went too far that no shorter test makes up for it: the axis gathers speed before it
    /// can be stopped.
    fn exceeds_retry_limit(&self) -> bool {
        self.volts > MAX_RETRY_RATIO * self.ever_too_far_v
    }

    /// True if no level below one that goes too far is known to be worth a try: nothing holds, as where something hangs, or
    /// hardly less does.
    fn leaves_none(&self) -> bool {
        self.held_v == 0.0 || self.is_narrow()
    }
}

/// Runs the test on the axis under test, with rising levels until the axis slides; gently where that goes too far or is too uncertain.
///
/// # Errors
/// An axis that does not slide, moves the wrong way, or is too uncertain; a run that is stopped.
pub fn measure(
    test_axis: &mut dyn TestAxis,
    settings: &MotorConstantSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<MotorConstant, MotorConstantError> {
    match search(test_axis, settings, progress) {
        Err(MotorConstantError::Uncertain { .. }) => measure_gently(test_axis, settings, progress),
        Err(MotorConstantError::Experiment(error)) if went_too_far(&error) => {
            measure_gently(test_axis, settings, progress)
        }
        outcome => outcome,
    }
}

/// Runs the test with a voltage that rises first, to levels that are nearer to each other: for a motor that jumps on a soft spring.
///
/// # Errors
/// As [`measure`].
pub fn measure_gently(
    test_axis: &mut dyn TestAxis,
    settings: &MotorConstantSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<MotorConstant, MotorConstantError> {
    search(test_axis, &settings.gentle(), progress)
}

fn search(
    test_axis: &mut dyn TestAxis,
    settings: &MotorConstantSettings,
    progress: &mut dyn FnMut(f64),
) -> Result<MotorConstant, MotorConstantError> {
    let axis = test_axis.info();
    let mut settings = *settings;
    // In positive and in negative direction: friction may differ, and what hangs pulls one way.
    let mut levels = [Level::at(settings.first_level_v); 2];
    // From near an end, away from it.
    let mut ahead = if axis.start_mm > MAX_START_SHARE * axis.travel_mm {
        -1.0
    } else {
        1.0
    };
    let mut tests_too_far = 0;
    let mut too_far = None;
    let mut must_return = false;
    let (mut others, usual_s) = (0, settings.dwell_s);
    while levels
        .iter()
        .all(|level| level.volts <= settings.most_level_v)
    {
        if levels.iter().any(Level::exceeds_retry_limit)
            && let Some(error) = too_far.take()
        {
            return Err(MotorConstantError::Experiment(error));
        }
        let levels_v = levels.map(|level| level.volts);
        let passes = if must_return { 1 } else { settings.passes };
        let test = MotorConstantSettings { passes, ..settings };
        let outcome = test_axis.perform(
            &Experiment {
                name: test_name(levels_v, settings.upper_ratio),
                drive: Drive::OpenLoop,
                injection_v: steps(&test, levels_v, ahead, axis.rate_hz),
                decimation: 1,
                time_limit_s: 60.0,
            },
            progress,
        );
        let recording = match outcome {
            Err(error) if tests_too_far < TESTS_TOO_FAR && went_too_far(&error) => {
                tests_too_far += 1;
                let Some(stopped) = test_axis.interrupted() else {
                    settings = settings.shortened();
                    continue;
                };
                must_return = ended_farther_out(stopped, axis.travel_mm);
                ahead = inwards(stopped, 0.0, ahead);
                if must_return {
                    levels[usize::from(ahead < 0.0)].raise();
                }
                let mut driven = stopped.voltage_v.iter().rev();
                let last_v = driven.find(|volts| volts.abs() > DRIVING_V);
                let direction = usize::from(last_v.is_some_and(|volts| *volts < 0.0));
                levels[direction].lower();
                if !settings.is_gentle() || levels[direction].leaves_none() {
                    settings = settings.shortened();
                    levels = levels.map(Level::renewed);
                }
                too_far = Some(error);
                continue;
            }
            outcome => outcome?,
        };
        ahead = inwards(&recording, MAX_START_SHARE * axis.travel_mm, ahead);
        let only_returned = must_return;
        must_return = ended_farther_out(&recording, axis.travel_mm);
        if only_returned {
            if must_return {
                levels[usize::from(ahead < 0.0)].raise();
            }
            continue;
        }
        let slid = find_passes(&recording, &settings, axis.resolution_mm)?;
        let held = [1.0, -1.0].map(|sign| !slid.iter().any(|(pass, _)| pass.sign == sign));
        if held.contains(&true) {
            for (level, held) in levels.iter_mut().zip(held) {
                // Friction still holds it.
                if held {
                    level.raise();
                }
            }
            if settings.is_gentle() && levels.iter().any(Level::is_narrow) {
                settings = settings.shortened();
                levels = levels.map(Level::renewed);
            }
            continue;
        }
        match evaluate(recording, &settings, axis.resolution_mm) {
            // A mode near the levels' frequency: at another one it shows less.
            Err(MotorConstantError::Uncertain { .. }) if others < OTHER_DWELLS.len() => {
                settings.dwell_s = OTHER_DWELLS[others] * usual_s;
                others += 1;
            }
            outcome => return outcome,
        }
    }
    Err(MotorConstantError::Still {
        level_v: settings.most_level_v,
    })
}

fn dwell(settings: &MotorConstantSettings, rate_hz: f64) -> usize {
    ((settings.dwell_s * rate_hz).round() as usize).max(4)
}

/// Name of a test at these levels.
fn test_name([positive_v, negative_v]: [f64; 2], upper_ratio: f64) -> String {
    let between = |level_v: f64| format!("{level_v:.3} and {:.3} V", upper_ratio * level_v);
    if positive_v == negative_v {
        format!("steps between {}", between(positive_v))
    } else {
        format!(
            "steps between {}, back between {}",
            between(positive_v),
            between(negative_v)
        )
    }
}

/// True if a test was stopped for its way or its velocity.
fn went_too_far(error: &ExperimentError) -> bool {
    match error {
        ExperimentError::Travel { .. } | ExperimentError::Overspeed { .. } => true,
        ExperimentError::Fault { fault, .. } => fault.code == FaultCode::InjectionBounds,
        _ => false,
    }
}

/// Direction of the first pass after a recording: towards the middle from beyond a distance, mm, else as before.
fn inwards(recording: &Recording, beyond_mm: f64, before: f64) -> f64 {
    match recording.position_mm.last() {
        Some(position_mm) if position_mm.abs() > beyond_mm => -position_mm.signum(),
        _ => before,
    }
}

/// True if an axis stands away from the middle, and came no nearer to it: friction, or what hangs, holds it more than the way out. It
/// is driven inwards alone then.
fn ended_farther_out(recording: &Recording, travel_mm: f64) -> bool {
    let ends = (recording.position_mm.first(), recording.position_mm.last());
    let (Some(first_mm), Some(last_mm)) = ends else {
        return false;
    };
    let inwards_mm = last_mm.signum() * (first_mm - last_mm);
    last_mm.abs() > MAX_START_SHARE * travel_mm && inwards_mm < MIN_RETURN_SHARE * travel_mm
}

/// The voltage of all passes, V; the first goes `ahead`, 1 or -1.
fn steps(
    settings: &MotorConstantSettings,
    levels_v: [f64; 2],
    ahead: f64,
    rate_hz: f64,
) -> Vec<f64> {
    let dwell = dwell(settings, rate_hz);
    let rise = (settings.rise_s * rate_hz).round() as usize;
    let rest = (REST_S * rate_hz) as usize;
    (0..settings.passes)
        .flat_map(|pass| {
            let sign = if pass.is_multiple_of(2) {
                ahead
            } else {
                -ahead
            };
            let level_v = if sign > 0.0 { levels_v[0] } else { levels_v[1] };
            let level = move |index: usize| {
                let factor = if index.is_multiple_of(2) {
                    settings.upper_ratio
                } else {
                    1.0
                };
                sign * factor * level_v
            };
            // Up to the mean of the levels.
            let mean = 0.5 * (level(0) + level(1));
            (0..rise)
                .map(move |index| mean * (index + 1) as f64 / (rise + 1) as f64)
                .chain(
                    (0..settings.levels)
                        .flat_map(move |index| std::iter::repeat_n(level(index), dwell)),
                )
                .chain(std::iter::repeat_n(0.0, rest))
        })
        .collect()
}

/// The passes in which the axis slid, with where each begins, counts from, and ends.
fn find_passes(
    recording: &Recording,
    settings: &MotorConstantSettings,
    resolution_mm: f64,
) -> Result<Vec<(Pass, [usize; 3])>, MotorConstantError> {
    let dwell = dwell(settings, 1.0 / recording.sample_time_s);
    // The way goes with the square of the time.
    let short = (settings.dwell_s / MotorConstantSettings::default().dwell_s).powi(2);
    let sliding_mm = (SLIDING_COUNTS * resolution_mm)
        .min((LEAST_COUNTS * resolution_mm).max(SLIDING_MM * short));
    let mut found = Vec::new();
    let mut begin = 0;
    while begin < recording.len() {
        let sign = recording.voltage_v[begin].signum();
        let drives = |index: &usize| sign * recording.voltage_v[*index] > DRIVING_V;
        if !drives(&begin) {
            begin += 1;
            continue;
        }
        let end = (begin..recording.len())
            .find(|index| !drives(index))
            .unwrap_or(recording.len());
        let pass_v: Vec<f64> = recording.voltage_v[begin..end]
            .iter()
            .map(|volts| volts.abs())
            .collect();
        let from = begin + Levels::of(&pass_v).first + BREAKAWAY_LEVELS * dwell;
        if end >= from + 4 * dwell {
            let positions = &recording.position_mm[from..end];
            let slowest = |window: usize| {
                positions
                    .windows(window)
                    .map(|window| sign * (window[window.len() - 1] - window[0]))
                    .fold(f64::INFINITY, f64::min)
            };
            let slides = if settings.is_gentle() {
                // From one upper level to the next: a motor on a soft spring swings back between them, though the table slides on.
                let way = sign * (positions[positions.len() - 1] - positions[0]);
                let mean = way * (2 * dwell) as f64 / positions.len() as f64;
                slowest(2 * dwell) > (LEAST_COUNTS * resolution_mm).max(MIN_SPEED_RATIO * mean)
            } else {
                slowest(dwell) > sliding_mm
            };
            // From before the pass on: in it, an axis on a soft spring may swing back.
            let all = sign * (recording.position_mm[end - 1] - recording.position_mm[begin]);
            if -all > 4.0 * sliding_mm {
                return Err(MotorConstantError::Reversed);
            }
            if slides {
                let pass = fit_pass(recording, begin, from, end, dwell);
                found.push((pass, [begin, from, end]));
            }
        }
        begin = end;
    }
    Ok(found)
}

/// Evaluates a recorded test.
///
/// # Errors
/// A recording without passes, of an axis that moves the wrong way, or too uncertain.
pub fn evaluate(
    recording: Recording,
    settings: &MotorConstantSettings,
    resolution_mm: f64,
) -> Result<MotorConstant, MotorConstantError> {
    let dwell = dwell(settings, 1.0 / recording.sample_time_s);
    let (mut found, spans): (Vec<Pass>, Vec<[usize; 3]>) =
        find_passes(&recording, settings, resolution_mm)?
            .into_iter()
            .unzip();
    if found.len() < 2 {
        return Err(MotorConstantError::NoPasses {
            passes: found.len(),
        });
    }
    let (mut gain, mut standard_error) = gain_of(&found);
    if is_uncertain(gain, standard_error)
        && let Some(resonant) = with_mode(&recording, &spans, dwell)
    {
        found = resonant;
        (gain, standard_error) = gain_of(&found);
    }
    let count = found.len() as f64;
    let mean = |read: fn(&Pass) -> f64| found.iter().map(read).sum::<f64>() / count;
    if is_uncertain(gain, standard_error) {
        return Err(MotorConstantError::Uncertain {
            gain,
            standard_error,
        });
    }
    let directed = |sign: f64| {
        let values: Vec<f64> = found
            .iter()
            .filter(|pass| pass.sign == sign)
            .map(|pass| pass.friction_v)
            .collect();
        let count = values.len();
        if count == 0 {
            return mean(|pass| pass.friction_v);
        }
        values.iter().sum::<f64>() / count as f64
    };
    // The axis slid on through the lower level, so that the mean overcame its friction.
    let level_of = |sign: f64| {
        let most = |most: f64, volts: &f64| most.max(sign * volts);
        recording.voltage_v.iter().fold(0.0, most) / settings.upper_ratio
    };
    let believable = |sign: f64| {
        let mean_v = settings.mean_ratio() * level_of(sign);
        directed(sign)
            .max(LEAST_FRICTION * mean_v)
            .min(MOST_FRICTION * mean_v)
    };
    Ok(MotorConstant {
        directed_v: [1.0, -1.0].map(believable),
        gain_mm_per_v_s2: gain,
        standard_error,
        damping_per_s: mean(|pass| pass.damping_per_s),
        friction_v: mean(|pass| pass.friction_v).max(0.0),
        level_v: level_of(1.0).max(level_of(-1.0)),
        recording,
    })
}

/// A, B and friction of one pass.
#[derive(Clone, Copy)]
struct Pass {
    /// Direction, 1 or -1.
    sign: f64,
    gain: f64,
    damping_per_s: f64,
    friction_v: f64,
}

/// The parameters of one pass, with the dead time that fits best. `begin` is where its voltage begins, `lag` the time in samples over
/// which differences are taken.
fn fit_pass(recording: &Recording, begin: usize, from: usize, end: usize, lag: usize) -> Pass {
    let step_s = recording.sample_time_s;
    let sign = recording.voltage_v[begin].signum();
    let positions = &recording.position_mm[from..end];
    // Second differences over a dwell keep what the steps do, and little of the screw's slow ripple and of the start.
    let second = |signal: &[f64]| -> Vec<f64> {
        signal
            .windows(2 * lag + 1)
            .map(|window| window[2 * lag] - 2.0 * window[lag] + window[0])
            .collect()
    };
    let right = second(positions);
    let path = second(&integral(positions, positions[0], step_s));
    let none = Pass {
        sign,
        gain: f64::NAN,
        damping_per_s: f64::NAN,
        friction_v: f64::NAN,
    };
    let mut best = (f64::INFINITY, none);
    // A delay of a whole level would swap the two.
    let longest_s = LONGEST_DELAY_S.min(MAX_DELAY_RATIO * lag as f64 * step_s);
    let longest = ((longest_s / step_s) as usize).min(from - begin);
    for delay in (0..=longest).step_by(((DELAY_STEP_S / step_s) as usize).max(1)) {
        let push = integral(&recording.voltage_v[from - delay..end - delay], 0.0, step_s);
        // The voltage is held: the mean of its integral over a step is that at the step's middle.
        let middle: Vec<f64> = push
            .windows(2)
            .map(|pair| 0.5 * (pair[0] + pair[1]))
            .collect();
        let double_push = second(&integral(&middle, 0.0, step_s));
        let count = right.len().min(double_push.len());
        let columns = [double_push, vec![1.0; count], path.clone()];
        if let Some(fit) = fit_columns(&columns, &right[..count], sign, lag as f64 * step_s)
            && fit.0 < best.0
        {
            best = fit;
        }
    }
    best.1
}

/// The pass whose columns, first those of push, friction and path, give `right` with the least squares over a lag, s; and what is
/// left, squared.
fn fit_columns<const N: usize>(
    columns: &[Vec<f64>; N],
    right: &[f64],
    sign: f64,
    lag_s: f64,
) -> Option<(f64, Pass)> {
    let norms = columns.each_ref().map(|column| norm(column));
    let matrix = DMatrix::from_fn(right.len(), N, |row, column| {
        columns[column][row] / norms[column]
    });
    let right = DVector::from_column_slice(right);
    let solution = matrix.clone().svd(true, true).solve(&right, 1e-12).ok()?;
    let cost = (&matrix * &solution - right).norm_squared();
    let gain = solution[0] / norms[0];
    let slowing = -sign * solution[1] / norms[1] / lag_s.powi(2);
    let pass = Pass {
        sign,
        gain,
        damping_per_s: -solution[2] / norms[2],
        friction_v: slowing / gain,
    };
    Some((cost, pass))
}

/// Mean of A over the passes, and its standard deviation.
fn gain_of(passes: &[Pass]) -> (f64, f64) {
    let count = passes.len() as f64;
    let gain = passes.iter().map(|pass| pass.gain).sum::<f64>() / count;
    let squares: f64 = passes.iter().map(|pass| (pass.gain - gain).powi(2)).sum();
    (gain, (squares / (count - 1.0) / count).sqrt())
}

/// True for an A that no controller can be made with.
fn is_uncertain(gain: f64, standard_error: f64) -> bool {
    !(gain > 0.0 && standard_error <= MOST_UNCERTAIN * gain)
}

/// Lowest and highest frequency of a mode that is tried, Hz.
const MODES_HZ: (f64, f64) = (20.0, 250.0);
/// Number of these frequencies, even on a log scale.
const MODES: usize = 45;
/// Damping ratio of such a mode.
const MODE_DAMPING: f64 = 0.03;
/// Dead times that are tried with it, s.
const MODE_DELAYS_S: [f64; 5] = [0.2e-3, 0.8e-3, 1.5e-3, 2.3e-3, 3.3e-3];
/// Every THINNING-th sample counts: samples are much denser than what the passes hold.
const THINNING: usize = 5;

/// The passes of an axis that rings with a structural mode: what an oscillator does under the same voltage is a further part
/// of the motion, with the frequency that leaves the least over all passes.
fn with_mode(recording: &Recording, spans: &[[usize; 3]], lag: usize) -> Option<Vec<Pass>> {
    let mut best: Option<(f64, Vec<Pass>)> = None;
    for index in 0..MODES {
        let share = index as f64 / (MODES - 1) as f64;
        let omega = TAU * MODES_HZ.0 * (MODES_HZ.1 / MODES_HZ.0).powf(share);
        let rings: Vec<[Vec<f64>; 2]> = spans
            .iter()
            .map(|&[begin, _, end]| {
                ringing(
                    &recording.voltage_v[begin..end],
                    omega,
                    recording.sample_time_s,
                )
            })
            .collect();
        for delay_s in MODE_DELAYS_S {
            let delay = (delay_s / recording.sample_time_s).round() as usize;
            let fits: Option<Vec<(f64, Pass)>> = spans
                .iter()
                .zip(&rings)
                .map(|(span, ring)| fit_ringing(recording, *span, lag, delay, ring))
                .collect();
            let Some(fits) = fits else { continue };
            let cost: f64 = fits.iter().map(|(cost, _)| cost).sum();
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, fits.into_iter().map(|(_, pass)| pass).collect()));
            }
        }
    }
    best.map(|(_, passes)| passes)
}

/// Deflection and its rate, over the frequency, of an oscillator that rests before the voltage begins.
fn ringing(voltage_v: &[f64], omega: f64, step_s: f64) -> [Vec<f64>; 2] {
    let (mut deflection, mut rate) = (0.0, 0.0);
    let states: Vec<(f64, f64)> = voltage_v
        .iter()
        .map(|voltage| {
            let before = (deflection, rate);
            let turn = omega * step_s;
            rate += turn * (voltage - deflection - 2.0 * MODE_DAMPING * rate);
            deflection += turn * rate;
            before
        })
        .collect();
    let part = |read: fn(&(f64, f64)) -> f64| states.iter().map(read).collect();
    [part(|state| state.0), part(|state| state.1)]
}

/// A pass with a mode in it, and what is left of its motion, squared.
fn fit_ringing(
    recording: &Recording,
    [begin, from, end]: [usize; 3],
    lag: usize,
    delay: usize,
    ring: &[Vec<f64>; 2],
) -> Option<(f64, Pass)> {
    let step_s = recording.sample_time_s;
    let positions = &recording.position_mm[from..end];
    let second = |signal: &[f64]| -> Vec<f64> {
        signal
            .windows(2 * lag + 1)
            .step_by(THINNING)
            .map(|window| window[2 * lag] - 2.0 * window[lag] + window[0])
            .collect()
    };
    let start = from.checked_sub(begin + delay)?;
    let push = integral(&recording.voltage_v[from - delay..end - delay], 0.0, step_s);
    let middle: Vec<f64> = push
        .windows(2)
        .map(|pair| 0.5 * (pair[0] + pair[1]))
        .collect();
    let right = second(positions);
    let columns = [
        second(&integral(&middle, 0.0, step_s)),
        vec![1.0; right.len()],
        second(&integral(positions, positions[0], step_s)),
        second(&ring[0][start..start + positions.len()]),
        second(&ring[1][start..start + positions.len()]),
    ];
    let count = columns.iter().map(Vec::len).fold(right.len(), usize::min);
    let sign = recording.voltage_v[begin].signum();
    fit_columns(&columns, &right[..count], sign, lag as f64 * step_s)
}

/// Length of a column of a least-squares problem, above zero.
fn norm(column: &[f64]) -> f64 {
    let square: f64 = column.iter().map(|value| value * value).sum();
    square.sqrt().max(1e-12)
}

/// The running integral of held samples over `base`, beginning at zero.
fn integral(samples: &[f64], base: f64, step_s: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = vec![sum];
    sums.extend(samples.iter().map(|sample| {
        sum += (sample - base) * step_s;
        sum
    }));
    sums
}
