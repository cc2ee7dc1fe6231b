//! The levels at which an axis slides: found by tests that are raised, lowered and shortened.

use quadrant_law::safety::FaultCode;

use super::passes::find_passes;
use super::settings::{DRIVING_V, MotorConstantSettings, REST_S, dwell};
use super::{MotorConstant, MotorConstantError, evaluate};
use crate::record::Recording;
use crate::test_axis::{AxisInfo, Drive, Experiment, ExperimentError, TestAxis};

/// Largest number of such tests.
const TESTS_TOO_FAR: usize = 14;
/// Dwells that are tried over the usual one where a test is too uncertain.
const OTHER_DWELLS: [f64; 3] = [1.7, 0.6, 2.4];
/// Distance from the middle over the travel, from which on the next test begins towards the middle.
const MAX_START_SHARE: f64 = 0.25;
/// Least return towards the middle, over the travel, of an axis that friction does not hold.
const MIN_RETURN_SHARE: f64 = 0.01;
/// Factor by which the levels rise from test to test.
const RAISE: f64 = 1.3;
/// Divisor of the level of a direction in which the axis went too far.
const LEVEL_REDUCTION: f64 = 1.2;
/// Largest level that is tried in shorter tests after the axis went too far, over the level at which it did.
const MAX_RETRY_RATIO: f64 = 1.7;
/// Least ratio of a level that goes too far to one that friction holds for which a level between them is tried.
const MIN_LEVEL_RATIO: f64 = 1.06;

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

/// The search for the levels at which the axis slides.
pub(super) struct LevelSearch {
    settings: MotorConstantSettings,
    usual_dwell_s: f64,
    travel_mm: f64,
    /// In positive and in negative direction: friction may differ, and what hangs pulls one way.
    levels: [Level; 2],
    /// Direction of the next test's first pass: 1 or -1.
    ahead: f64,
    /// The next test only brings the axis back to the middle.
    returns: bool,
    /// Tests that were stopped because the axis went too far.
    too_far: usize,
    /// Dwells other than the usual one that were tried.
    others: usize,
    /// The reason for which the last test was stopped.
    stopped: Option<ExperimentError>,
}

impl LevelSearch {
    /// Before the first test of an axis.
    pub(super) fn new(settings: MotorConstantSettings, axis: &AxisInfo) -> Self {
        Self {
            settings,
            usual_dwell_s: settings.dwell_s,
            travel_mm: axis.travel_mm,
            levels: [Level::at(settings.first_level_v); 2],
            // From near an end, away from it.
            ahead: if axis.start_mm > MAX_START_SHARE * axis.travel_mm {
                -1.0
            } else {
                1.0
            },
            returns: false,
            too_far: 0,
            others: 0,
            stopped: None,
        }
    }

    /// Runs tests until one can be evaluated.
    pub(super) fn run(
        mut self,
        test_axis: &mut dyn TestAxis,
        progress: &mut dyn FnMut(f64),
    ) -> Result<MotorConstant, MotorConstantError> {
        let (rate_hz, resolution_mm) = {
            let axis = test_axis.info();
            (axis.rate_hz, axis.resolution_mm)
        };
        let most_v = self.settings.most_level_v;
        while self.levels.iter().all(|level| level.volts <= most_v) {
            if self.levels.iter().any(Level::exceeds_retry_limit)
                && let Some(error) = self.stopped.take()
            {
                return Err(MotorConstantError::Experiment(error));
            }
            match test_axis.perform(&self.experiment(rate_hz), progress) {
                Err(error) if self.too_far < TESTS_TOO_FAR && went_too_far(&error) => {
                    self.reduce(test_axis.interrupted());
                    self.stopped = Some(error);
                }
                Err(error) => return Err(error.into()),
                Ok(recording) if !self.slides(&recording, resolution_mm)? => {}
                Ok(recording) => match evaluate(recording, &self.settings, resolution_mm) {
                    // A mode near the levels' frequency: at another one it shows less.
                    Err(MotorConstantError::Uncertain { .. })
                        if self.others < OTHER_DWELLS.len() =>
                    {
                        self.settings.dwell_s = OTHER_DWELLS[self.others] * self.usual_dwell_s;
                        self.others += 1;
                    }
                    outcome => return outcome,
                },
            }
        }
        Err(MotorConstantError::Still { level_v: most_v })
    }

    /// The next test.
    fn experiment(&self, rate_hz: f64) -> Experiment {
        let levels_v = self.levels.map(|level| level.volts);
        let passes = if self.returns {
            1
        } else {
            self.settings.passes
        };
        let test = MotorConstantSettings {
            passes,
            ..self.settings
        };
        Experiment {
            name: test_name(levels_v, self.settings.upper_ratio),
            drive: Drive::OpenLoop,
            injection_v: steps(&test, levels_v, self.ahead, rate_hz),
            decimation: 1,
            time_limit_s: 60.0,
        }
    }

    /// The next test after one in which the axis went too far, with what was recorded of it: a lower level, or a shorter test.
    fn reduce(&mut self, stopped: Option<&Recording>) {
        self.too_far += 1;
        let Some(stopped) = stopped else {
            self.settings = self.settings.shortened();
            return;
        };
        self.returns = ended_farther_out(stopped, self.travel_mm);
        self.ahead = inwards(stopped, 0.0, self.ahead);
        if self.returns && !crossed(stopped) {
            self.raise_ahead();
        }
        let mut driven = stopped.voltage_v.iter().rev();
        let last_v = driven.find(|volts| volts.abs() > DRIVING_V);
        let direction = usize::from(last_v.is_some_and(|volts| *volts < 0.0));
        self.levels[direction].lower();
        if !self.settings.is_gentle() || self.levels[direction].leaves_none() {
            self.shorten();
        }
    }

    /// True if the axis slid in a test; else the next test has higher levels in the directions in which friction held it.
    fn slides(
        &mut self,
        recording: &Recording,
        resolution_mm: f64,
    ) -> Result<bool, MotorConstantError> {
        let limit_mm = MAX_START_SHARE * self.travel_mm;
        let driven = self.ahead;
        self.ahead = inwards(recording, limit_mm, self.ahead);
        let returned = self.returns;
        self.returns = ended_farther_out(recording, self.travel_mm);
        if returned {
            if self.returns && crossed(recording) {
                self.levels[usize::from(driven < 0.0)].lower();
            } else if self.returns {
                self.raise_ahead();
            }
            return Ok(false);
        }
        let slid = find_passes(recording, &self.settings, resolution_mm)?;
        let held = [1.0, -1.0].map(|sign| !slid.iter().any(|(pass, _)| pass.sign == sign));
        if held == [false, false] {
            return Ok(true);
        }
        for (level, held) in self.levels.iter_mut().zip(held) {
            if held {
                level.raise();
            }
        }
        if self.settings.is_gentle() && self.levels.iter().any(Level::is_narrow) {
            self.shorten();
        }
        Ok(false)
    }

    /// Raises the level of the direction in which the axis does not come back to the middle.
    fn raise_ahead(&mut self) {
        self.levels[usize::from(self.ahead < 0.0)].raise();
    }

    /// Makes the test shorter; what levels do in it is not known yet.
    fn shorten(&mut self) {
        self.settings = self.settings.shortened();
        self.levels = self.levels.map(Level::renewed);
    }
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
pub(super) fn went_too_far(error: &ExperimentError) -> bool {
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

/// True if an axis ended on the other side of the middle: too much brought it there, not too little.
fn crossed(recording: &Recording) -> bool {
    let ends = (recording.position_mm.first(), recording.position_mm.last());
    matches!(ends, (Some(first_mm), Some(last_mm)) if first_mm * last_mm < 0.0)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// An axis that is driven inwards from one side, and ends at a position, mm.
    fn driven_back(end_mm: f64) -> Recording {
        let position_mm = vec![-5.0, 0.5 * (end_mm - 5.0), end_mm];
        Recording {
            sample_time_s: 1e-4,
            reference_mm: position_mm.clone(),
            position_mm,
            voltage_v: vec![0.2; 3],
            ..Recording::default()
        }
    }

    #[test]
    fn an_axis_that_flies_past_the_middle_is_given_less_and_one_that_goes_nowhere_more() {
        let axis = AxisInfo {
            name: "x",
            rate_hz: 10_000.0,
            resolution_mm: 5e-4,
            full_scale_v: 10.0,
            travel_mm: 6.5,
            start_mm: 0.0,
            max_velocity_mm_s: 50.0,
            max_acceleration_mm_s2: 500.0,
        };
        let before_v = 0.2;
        let reduced = |end_mm: f64| {
            let mut search = LevelSearch::new(MotorConstantSettings::default(), &axis);
            search.levels = [Level::at(before_v); 2];
            search.returns = true;
            search.reduce(Some(&driven_back(end_mm)));
            search.levels.map(|level| level.volts)
        };
        let [positive_v, negative_v] = reduced(6.6);
        assert!(
            positive_v < before_v && negative_v <= before_v,
            "{positive_v} {negative_v}"
        );
        let [positive_v, _] = reduced(-6.6);
        assert!(positive_v > before_v, "{positive_v}");
    }
}
