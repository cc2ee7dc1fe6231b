//! A whole circle test: every plane, radius, feed and configuration, both senses.

use quadrant_law::reference::{Plane, Sense};
use rayon::prelude::*;

use crate::circle::roundness::{Both, both};
use crate::circle::turn::{CircleRefusal, NominalCircle, Turn, run_path};
use crate::experiment::configuration::Configuration;
use crate::experiment::run_configuration::RunConfiguration;

/// Request for circle tests: radii, feeds, planes, competitors.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleRequest {
    pub planes: Vec<Plane>,
    /// Radii, mm; above zero.
    pub radii_mm: Vec<f64>,
    /// Feeds along the path, mm/min; above zero.
    pub feeds_mm_min: Vec<f64>,
    pub configurations: Vec<Configuration>,
    /// Seeds of the simulated noise; every circle runs once with each.
    pub seeds: Vec<u64>,
}

impl Default for CircleRequest {
    /// All planes, radii of 5 to 50 mm, feeds of 300 to 3000 mm/min, no configuration, seed 1.
    fn default() -> Self {
        Self {
            planes: vec![Plane::Xy, Plane::Yz, Plane::Zx],
            radii_mm: vec![5.0, 15.0, 30.0, 50.0],
            feeds_mm_min: vec![300.0, 1000.0, 3000.0],
            configurations: Vec::new(),
            seeds: vec![1],
        }
    }
}

/// One circle of a request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleCase {
    pub plane: Plane,
    pub radius_mm: f64,
    /// Feed along the path, mm/min.
    pub feed_mm_min: f64,
    pub configuration: Configuration,
    /// Seed of the noise.
    pub seed: u64,
}

/// Result of a circle in both senses.
#[derive(Clone, Debug)]
pub struct CircleTest {
    /// G2.
    pub clockwise: Turn,
    /// G3.
    pub counter_clockwise: Turn,
    pub both: Both,
}

impl CircleTest {
    /// The turns with their senses.
    pub fn turns(&self) -> [(Sense, &Turn); 2] {
        [
            (Sense::Clockwise, &self.clockwise),
            (Sense::CounterClockwise, &self.counter_clockwise),
        ]
    }

    /// Mean height of the eight spikes, mm.
    pub fn mean_spike_mm(&self) -> f64 {
        0.5 * (self.clockwise.spikes.mean_height_mm()
            + self.counter_clockwise.spikes.mean_height_mm())
    }

    /// Height of the largest of the eight spikes, mm.
    pub fn largest_spike_mm(&self) -> f64 {
        let [one, other] = self.turns().map(|(_, turn)| turn.spikes.largest_mm());
        one.max(other)
    }
}

/// A case and what came of it.
#[derive(Clone, Debug)]
pub struct CircleResult {
    pub case: CircleCase,
    /// Result, or the reason that it was not run to its end.
    pub outcome: Result<CircleTest, CircleRefusal>,
}

impl CircleRequest {
    /// Every circle, in the order of the results.
    pub fn cases(&self) -> Vec<CircleCase> {
        let mut cases = Vec::new();
        for &plane in &self.planes {
            for &radius_mm in &self.radii_mm {
                for &feed_mm_min in &self.feeds_mm_min {
                    for &configuration in &self.configurations {
                        cases.extend(self.seeds.iter().map(|&seed| CircleCase {
                            plane,
                            radius_mm,
                            feed_mm_min,
                            configuration,
                            seed,
                        }));
                    }
                }
            }
        }
        cases
    }
}

/// Runs every circle of a request in both senses, in parallel, on the firmware's law in `f32`; the same request gives
/// the same results. A circle that an axis' limits forbid, or that switches the stage off, says so in its result.
/// `advance` is called after each case.
pub fn run_circle_tests(
    request: &CircleRequest,
    setup: &RunConfiguration,
    advance: &(dyn Fn() + Sync),
) -> Vec<CircleResult> {
    request
        .cases()
        .into_par_iter()
        .map(|case| {
            let outcome = run_case(&case, setup);
            advance();
            CircleResult { case, outcome }
        })
        .collect()
}

fn run_case(case: &CircleCase, setup: &RunConfiguration) -> Result<CircleTest, CircleRefusal> {
    let nominal = |sense| NominalCircle {
        plane: case.plane,
        sense,
        radius_mm: case.radius_mm,
        feed_mm_s: case.feed_mm_min / 60.0,
    };
    let path = |sense| run_path(nominal(sense), case.configuration, setup, case.seed);
    let rate_hz = setup.stage.rate_hz;
    let clockwise = path(Sense::Clockwise)?;
    let counter = path(Sense::CounterClockwise)?;
    Ok(CircleTest {
        both: both(&clockwise, &counter, case.radius_mm),
        clockwise: Turn::evaluate(nominal(Sense::Clockwise), &clockwise, rate_hz),
        counter_clockwise: Turn::evaluate(nominal(Sense::CounterClockwise), &counter, rate_hz),
    })
}
