//! The plateau of the virgin curve: whether the record reaches it, and what friction it shows.

use quadrant_law::friction::PerDirection;
use quadrant_law::friction::stribeck::{StaticFriction, StribeckCurve};

use super::branches::{Smooth, VirginCurve, VirginPoint, range};
use super::error::VirginCurveError;
use crate::identify::fit::{Loss, Parameter, fit};
use crate::record::Recording;

/// Largest slope at the end of a curve that counts as flat, over the slope at its beginning.
const MAX_FLAT_SLOPE: f64 = 0.04;

/// Checks that the curve has become flat; an exponential through it estimates how far it would have to go.
pub(super) fn check_plateau(
    curve: &VirginCurve,
    recording: &Recording,
    travel_um: f64,
) -> Result<(), VirginCurveError> {
    let Some(end) = curve.points.last() else {
        return Ok(());
    };
    let slope = |from: &VirginPoint, to: &VirginPoint| {
        (to.force_v - from.force_v) / (to.displacement_mm - from.displacement_mm)
    };
    let by_share = |share: f64| {
        let place = curve
            .points
            .partition_point(|point| point.force_v < share * end.force_v);
        curve.points[place.min(curve.points.len() - 1)]
    };
    let origin = VirginPoint {
        displacement_mm: 0.0,
        force_v: 0.0,
    };
    let initial = slope(&origin, &by_share(0.4));
    let three_quarters = curve
        .points
        .iter()
        .find(|point| point.displacement_mm >= 0.7 * end.displacement_mm)
        .unwrap_or(end);
    let last = slope(three_quarters, end);
    if last <= MAX_FLAT_SLOPE * initial {
        return Ok(());
    }
    let rate = Parameter {
        name: "range",
        start: end.displacement_mm,
        bounds: (0.05 * end.displacement_mm, 50.0 * end.displacement_mm),
    };
    let level = Parameter {
        name: "level",
        start: 1.5 * end.force_v,
        bounds: (0.5 * end.force_v, 100.0 * end.force_v),
    };
    let found = fit(&[rate, level], Loss::Squares, |values| {
        let points = curve.points.iter();
        points
            .map(|point| {
                values[1] * (1.0 - (-point.displacement_mm / values[0]).exp()) - point.force_v
            })
            .collect()
    })?;
    // The reference must outrun the controller's error at breakaway, and the axis then five times the range both ways.
    let (low, high) = range(&recording.reference_mm);
    let amplitude_mm = 0.5 * (high - low);
    let needed_mm =
        2.0 * amplitude_mm * (found.values[1] / end.force_v).max(1.0) + 10.0 * found.values[0];
    Err(VirginCurveError::NoPlateau {
        travel_um,
        reached_v: end.force_v,
        needed_um: 1e3 * needed_mm,
    })
}

/// The level of this record's plateau in both directions, as a friction that does not depend on velocity.
pub(super) fn plateau(smooth: &Smooth, reversals: &[usize]) -> PerDirection<StaticFriction> {
    let mut sums = [(0.0, 0.0); 2];
    for turn in reversals.windows(2).skip(1) {
        let positive = smooth.position_mm[turn[1]] > smooth.position_mm[turn[0]];
        let from = turn[0] + (turn[1] - turn[0]) * 3 / 4;
        let sum = &mut sums[usize::from(!positive)];
        for voltage in &smooth.voltage_v[from..turn[1]] {
            sum.0 += voltage.abs();
            sum.1 += 1.0;
        }
    }
    let model = |(sum, count): (f64, f64)| StaticFriction {
        curve: StribeckCurve {
            coulomb_v: sum / count,
            breakaway_v: sum / count,
            stribeck_velocity_mm_s: 1.0,
            exponent: 1.0,
        },
        viscous_v_s_per_mm: 0.0,
    };
    PerDirection {
        positive: model(sums[0]),
        negative: model(sums[1]),
    }
}
