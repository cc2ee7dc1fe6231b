//! One run: a law on one axis, with a load, on a task.

use std::f64::consts::TAU;

use anyhow::{Context, bail};
use quadrant_law::reference::{HarmonicSettings, MotionSettings, PointToPointSettings};
use quadrant_law::safety::{Fault, SafetyState};
use quadrant_pages::compare::sine::AMPLITUDE_MM;
use quadrant_settings::StageSettings;
use quadrant_sim::law_machine::Operator;
use quadrant_sim::law_machine::TickInput;
use quadrant_sim::metrics::{Score, largest, rms, score};
use quadrant_sim::plant::SimulatedAxis;
use quadrant_sim::run::AxisTrace;

use super::Scenario;
use crate::x_alone::law_of;

/// Task of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Task {
    /// The comparison's sine of 30 mm at 10 mm/s; its last two cycles are scored.
    Sine,
    /// A move of 10 mm at 2 mm/s, scored from its start to its end.
    SlowFeed,
    /// A position held for 4 s.
    Hold,
}

/// Length of a hold, s.
const HOLD_S: f64 = 4.0;
/// Largest velocity of the sine, mm/s.
const SINE_MM_S: f64 = 10.0;
/// Length of the slow move, mm.
const FEED_MM: f64 = 10.0;
/// Its velocity, mm/s.
const FEED_MM_S: f64 = 2.0;
/// Cycles at full speed: the comparison's.
const CYCLES: f64 = 2.25;
/// Whole cycles at the end that are scored.
const SCORED_CYCLES: usize = 2;
/// Lead-in and lead-out, s.
const LEAD_S: f64 = 0.5;
/// Cycles before, in which a law that learns has time to: five reversals.
const LEARNING_CYCLES: f64 = 2.5;
/// Time from the enabling to the start of a hold, s: the bumpless transfer has faded.
const SETTLING_S: f64 = 0.3;

impl Task {
    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::SlowFeed => "slow feed",
            Self::Hold => "hold",
        }
    }

    fn motion(self, cycles: f64) -> MotionSettings {
        match self {
            Self::Sine => MotionSettings::Harmonic(HarmonicSettings::with_velocity(
                AMPLITUDE_MM,
                SINE_MM_S,
                cycles,
                LEAD_S,
            )),
            Self::SlowFeed => MotionSettings::PointToPoint(PointToPointSettings {
                distance_mm: FEED_MM,
                max_velocity_mm_s: FEED_MM_S,
                max_acceleration_mm_s2: 50.0,
                max_jerk_mm_s3: 1000.0,
            }),
            Self::Hold => MotionSettings::Hold,
        }
    }

    /// Time after which it must have ended, from the first tick, s: enabling and settling take less than one.
    fn longest_s(self, cycles: f64) -> f64 {
        let task = match self {
            Self::Sine => cycles * TAU * AMPLITUDE_MM / SINE_MM_S + 2.0 * LEAD_S,
            Self::SlowFeed => FEED_MM / FEED_MM_S,
            Self::Hold => HOLD_S,
        };
        task + 2.0
    }

    fn score(self, trace: &AxisTrace, rate_hz: f64, cycles: f64) -> Score {
        let samples = |seconds: f64| (seconds * rate_hz).round() as usize;
        match self {
            Self::Sine => {
                let cycle_s = TAU * AMPLITUDE_MM / SINE_MM_S;
                let cycle = samples(cycle_s);
                let end = samples(LEAD_S) + samples(cycles * cycle_s);
                let scored = trace.slice(end - SCORED_CYCLES * cycle..end);
                score(&scored.reference_mm, &scored.error_mm, cycle)
            }
            Self::SlowFeed | Self::Hold => without_reversals(&trace.error_mm),
        }
    }
}

fn without_reversals(errors: &[f64]) -> Score {
    Score {
        largest_mm: largest(errors),
        rms_mm: rms(errors),
        glitch_mm: f64::NAN,
    }
}

/// A run to make; the axis under test is the first of the stage, the others stand still.
pub(super) struct Trial<'a> {
    pub(super) stage: &'a StageSettings,
    pub(super) scenario: &'a Scenario,
    pub(super) seed: u64,
}

impl Trial<'_> {
    /// The score, or the fault that switched the stage off.
    pub(super) fn run(&self) -> anyhow::Result<Result<Score, Fault>> {
        let Scenario {
            truth, load, task, ..
        } = self.scenario;
        let [axis, ..] = &self.stage.axes;
        let cycles = match axis.feedforward.learning {
            Some(_) => LEARNING_CYCLES + CYCLES,
            None => CYCLES,
        };
        let mut machine =
            law_of(axis, self.stage, task.motion(cycles)).context("settings refused")?;
        let rate_hz = self.stage.rate_hz;
        let resolution_mm = self.stage.axes[0].encoder.resolution_mm;
        let mut plant = SimulatedAxis::new(truth.clone(), rate_hz, self.seed);
        let mut operator = Operator::runs_the_plan();
        let most_ticks = (task.longest_s(cycles) * rate_hz) as usize;
        let mut trace = AxisTrace::default();
        let mut enabled_ticks = 0.0;
        for tick in 0..most_ticks {
            let outputs = machine.tick(&TickInput::of_counts(
                [plant.read_counter(), 0, 0],
                operator.request(tick as u32),
            ));
            let state = machine.state();
            if let SafetyState::Faulted(fault) = state.safety() {
                return Ok(Err(fault));
            }
            enabled_ticks += if outputs.enabled { 1.0 } else { 0.0 };
            let under_way = match *task {
                Task::Sine | Task::SlowFeed => state.is_running(),
                Task::Hold => {
                    (SETTLING_S..SETTLING_S + HOLD_S).contains(&(enabled_ticks / rate_hz))
                }
            };
            if under_way {
                plant.set_load_v(load.at_v(trace.error_mm.len() as f64 / rate_hz));
                let seen = state.axes()[0].telemetry();
                trace.push(seen, resolution_mm, plant.position_mm());
            } else if !trace.error_mm.is_empty() {
                return Ok(Ok(task.score(&trace, rate_hz, cycles)));
            }
            plant.step(outputs.codes[0], outputs.enabled);
        }
        bail!("the motion has not ended after {most_ticks} ticks")
    }
}
