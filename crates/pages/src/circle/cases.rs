//! Circles of a test, grouped for its tables and figures.

use quadrant_law::reference::{Plane, Sense};

use crate::circle::request::{CircleCase, CircleResult, CircleTest};
use crate::experiment::configuration::Configuration;
use crate::parts::UM_PER_MM;

/// The axes of a plane, the horizontal one first.
pub(super) const fn axes_of(plane: Plane) -> [&'static str; 2] {
    match plane {
        Plane::Xy => ["x", "y"],
        Plane::Yz => ["y", "z"],
        Plane::Zx => ["z", "x"],
    }
}

/// A plane's name in tables.
pub(super) const fn plane_name(plane: Plane) -> &'static str {
    match plane {
        Plane::Xy => "XY",
        Plane::Yz => "YZ",
        Plane::Zx => "ZX",
    }
}

/// A sense's name in tables.
pub(super) const fn sense_name(sense: Sense) -> &'static str {
    match sense {
        Sense::Clockwise => "clockwise",
        Sense::CounterClockwise => "counter-clockwise",
    }
}

/// The same circle with every seed that was run to its end.
pub(super) struct Circle<'a> {
    /// The circle; its seed is that of the first run.
    pub(super) case: CircleCase,
    /// The runs, a seed each; not empty.
    pub(super) tests: Vec<&'a CircleTest>,
}

impl Circle<'_> {
    /// The mean over the seeds of a length, um.
    pub(super) fn mean_um(&self, length_mm: impl Fn(&CircleTest) -> f64) -> f64 {
        let sum: f64 = self.tests.iter().map(|test| length_mm(test)).sum();
        UM_PER_MM * sum / self.tests.len() as f64
    }

    /// Largest less smallest of a length over the seeds, um.
    pub(super) fn spread_um(&self, length_mm: impl Fn(&CircleTest) -> f64) -> f64 {
        let (high, low) = self
            .tests
            .iter()
            .map(|test| length_mm(test))
            .fold((f64::MIN, f64::MAX), |(high, low), value| {
                (high.max(value), low.min(value))
            });
        UM_PER_MM * (high - low)
    }
}

pub(super) fn deviation_mm(test: &CircleTest) -> f64 {
    test.both.circular_deviation_mm
}

pub(super) fn same_circle(one: &CircleResult, other: &CircleResult) -> bool {
    let other_seed = CircleCase {
        seed: one.case.seed,
        ..other.case
    };
    one.case == other_seed
}

/// The results by circle, without those that were not run to their end.
pub(super) fn circles(results: &[CircleResult]) -> Vec<Circle<'_>> {
    results
        .chunk_by(same_circle)
        .map(|runs| Circle {
            case: runs[0].case,
            tests: runs
                .iter()
                .filter_map(|run| run.outcome.as_ref().ok())
                .collect(),
        })
        .filter(|circle| !circle.tests.is_empty())
        .collect()
}

/// The planes of some circles, once each, in their order.
pub(super) fn planes(circles: &[Circle<'_>]) -> Vec<Plane> {
    let mut planes: Vec<Plane> = circles.iter().map(|circle| circle.case.plane).collect();
    planes.dedup();
    planes
}

/// The configurations of some circles, once each, in their order.
pub(super) fn configurations(circles: &[Circle<'_>]) -> Vec<Configuration> {
    let mut found: Vec<Configuration> = Vec::new();
    for circle in circles {
        if !found.contains(&circle.case.configuration) {
            found.push(circle.case.configuration);
        }
    }
    found
}
