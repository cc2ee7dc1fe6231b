//! The least-squares circle of paths, and what ISO 230-4 reads off two of them.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};

use crate::circle::path::Point;

/// Largest and smallest of some values.
pub(super) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::MIN, f64::MAX), |(high, low), value| {
        (high.max(value), low.min(value))
    })
}

/// The circle with the smallest sum of squared radial distances from paths; mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LeastSquares {
    centre: Point,
    pub(super) radius_mm: f64,
}

/// Gauss-Newton steps of the fit. The centre lies within some um of the nominal one, so that each step squares an error
/// of 1e-3 of the radius at most: three are one more than needed.
const STEPS: usize = 3;

impl LeastSquares {
    /// Fits the circle to all points of some paths, equally weighted.
    pub(super) fn fit<const PATHS: usize>(paths: [&[Point]; PATHS]) -> Self {
        let mut circle = Self {
            centre: [0.0; 2],
            radius_mm: 0.0,
        };
        for _ in 0..STEPS {
            let mut normal = Matrix3::zeros();
            let mut right = Vector3::zeros();
            for [first, second] in paths.iter().copied().flatten() {
                let (x, y) = (first - circle.centre[0], second - circle.centre[1]);
                let radius = x.hypot(y);
                // The radius changes by (r, c . e) when the circle's radius and centre do.
                let row = Vector3::new(1.0, x / radius, y / radius);
                normal += row * row.transpose();
                right += row * radius;
            }
            // Singular only without three points in different directions; the nominal centre then stands.
            let Some(step) = normal.lu().solve(&right) else {
                break;
            };
            circle.radius_mm = step[0];
            circle.centre = [circle.centre[0] + step[1], circle.centre[1] + step[2]];
        }
        circle
    }

    /// Distance of a point from the centre.
    pub(super) fn radius_at(&self, &[first, second]: &Point) -> f64 {
        (first - self.centre[0]).hypot(second - self.centre[1])
    }

    /// Angle of a point about the centre, in turns, 0 to 1.
    fn turn_at(&self, &[first, second]: &Point) -> f64 {
        let turns = (second - self.centre[1]).atan2(first - self.centre[0]) / TAU;
        turns - turns.floor()
    }
}

/// Result of both senses together; mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Both {
    /// Bi-directional circular deviation G(b).
    pub circular_deviation_mm: f64,
    pub hysteresis_mm: f64,
    /// Mean bi-directional radial deviation D.
    pub mean_radial_mm: f64,
}

/// Angles at which two paths are compared: every hundredth of a degree, finer than a glitch is wide.
const ANGLES: usize = 36_000;

/// A path's radius about a centre at equal angles; NaN where its ends leave a gap.
fn radii(path: &[Point], circle: &LeastSquares) -> Vec<f64> {
    let mut radii = vec![f64::NAN; ANGLES];
    for pair in path.windows(2) {
        let [from, to] = [&pair[0], &pair[1]].map(|point| {
            (
                circle.turn_at(point) * ANGLES as f64,
                circle.radius_at(point),
            )
        });
        let ((from_angle, from_radius), (mut to_angle, to_radius)) = (from, to);
        // The shorter way round.
        let around = ((to_angle - from_angle) / ANGLES as f64).round() * ANGLES as f64;
        to_angle -= around;
        let (low, high) = (from_angle.min(to_angle), from_angle.max(to_angle));
        for place in low.ceil() as i64..=high.floor() as i64 {
            let share = if from_angle == to_angle {
                0.0
            } else {
                (place as f64 - from_angle) / (to_angle - from_angle)
            };
            radii[place.rem_euclid(ANGLES as i64) as usize] =
                from_radius + share * (to_radius - from_radius);
        }
    }
    radii
}

/// Evaluates the paths of both senses, each one turn, together.
pub fn both(clockwise: &[Point], counter_clockwise: &[Point], radius_mm: f64) -> Both {
    let paths = [clockwise, counter_clockwise];
    let circle = LeastSquares::fit(paths);
    let points = paths.iter().copied().flatten();
    let (high, low) = range(points.map(|point| circle.radius_at(point)));
    let [one, other] = paths.map(|path| radii(path, &circle));
    // A NaN is no maximum.
    let apart = one
        .iter()
        .zip(&other)
        .map(|(one, other)| (one - other).abs());
    Both {
        circular_deviation_mm: high - low,
        hysteresis_mm: apart.fold(0.0, f64::max),
        mean_radial_mm: circle.radius_mm - radius_mm,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A circle about `centre` whose radius is `radius(angle)`, clockwise or not.
    fn path(centre: Point, clockwise: bool, radius: impl Fn(f64) -> f64) -> Vec<Point> {
        (0..50_000)
            .map(|k| {
                let turn = TAU * f64::from(k) / 50_000.0;
                let angle = if clockwise { -turn } else { turn };
                let radius = radius(angle);
                [
                    centre[0] + radius * angle.cos(),
                    centre[1] + radius * angle.sin(),
                ]
            })
            .collect()
    }

    #[test]
    fn an_off_centre_circle_is_round() {
        let path = path([0.02, -0.03], false, |_| 30.01);
        let circle = LeastSquares::fit([&path]);
        assert!((circle.radius_mm - 30.01).abs() < 1e-10);
        assert!((circle.centre[0] - 0.02).abs() < 1e-10);
        assert!((circle.centre[1] + 0.03).abs() < 1e-10);
    }

    #[test]
    fn an_ellipse_deviates_by_the_difference_of_its_half_axes() {
        let path = path([0.0; 2], false, |angle| 30.0 + 0.005 * (2.0 * angle).cos());
        let circle = LeastSquares::fit([&path]);
        let (high, low) = range(path.iter().map(|point| circle.radius_at(point)));
        assert!((high - low - 0.010).abs() < 1e-9);
    }

    #[test]
    fn two_round_paths_of_different_radius_differ_by_their_hysteresis() {
        let clockwise = path([0.0; 2], true, |_| 30.004);
        let counter = path([0.0; 2], false, |_| 29.998);
        let both = both(&clockwise, &counter, 30.0);
        assert!((both.hysteresis_mm - 0.006).abs() < 1e-9);
        assert!((both.circular_deviation_mm - 0.006).abs() < 1e-9);
        assert!((both.mean_radial_mm - 0.001).abs() < 1e-9);
    }

    #[test]
    fn the_same_path_in_both_senses_has_no_hysteresis_however_oval() {
        let oval = |angle: f64| 5.0 + 0.01 * (2.0 * angle).sin();
        let both = both(
            &path([0.0; 2], true, oval),
            &path([0.0; 2], false, oval),
            5.0,
        );
        assert!(both.hysteresis_mm < 1e-8, "{both:?}");
        assert!((both.circular_deviation_mm - 0.02).abs() < 1e-7);
    }

    #[test]
    fn hysteresis_is_found_in_a_spike_a_tenth_of_a_degree_wide() {
        let spiked = |angle: f64| {
            let from_spike = (angle.to_degrees() - 90.0).abs();
            30.0 + if from_spike < 0.05 { 0.004 } else { 0.0 }
        };
        let both = both(
            &path([0.0; 2], true, |_| 30.0),
            &path([0.0; 2], false, spiked),
            30.0,
        );
        assert!((both.hysteresis_mm - 0.004).abs() < 1e-6, "{both:?}");
    }
}
