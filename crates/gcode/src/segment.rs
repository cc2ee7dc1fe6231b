//! The geometry of a path: straight lines and arcs in space.

use std::f64::consts::TAU;

/// A point or a direction in x, y, z.
pub type Vector = nalgebra::Vector3<f64>;

/// A piece of a path with one curvature.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    shape: Shape,
    length_mm: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Shape {
    Line {
        from: Vector,
        direction: Vector,
    },
    /// `centre + radius (first cos a + second sin a) + rise a / sweep`, for `a` from 0 to `sweep`.
    Arc {
        centre: Vector,
        /// Unit length, from the centre to the start.
        first: Vector,
        /// Unit length, the direction of motion at the start of a flat arc.
        second: Vector,
        radius_mm: f64,
        sweep_rad: f64,
        rise: Vector,
    },
}

/// Steps of [`Segment::nearest`]; each leaves a share of the error that is distance over radius, below 1e-2 here.
const NEAREST_STEPS: usize = 4;

impl Segment {
    /// A straight line, unless it has no length.
    pub(super) fn line(from: Vector, to: Vector) -> Option<Self> {
        let length_mm = (to - from).norm();
        (length_mm > 0.0).then(|| Self {
            shape: Shape::Line {
                from,
                direction: (to - from) / length_mm,
            },
            length_mm,
        })
    }

    /// An arc about `centre`, which lies level with the start, from `centre + radius first` by `sweep_rad` towards
    /// `second`; `first` and `second` are perpendicular units. `rise` is added evenly along it.
    pub(super) fn arc(
        centre: Vector,
        [first, second]: [Vector; 2],
        radius_mm: f64,
        sweep_rad: f64,
        rise: Vector,
    ) -> Self {
        Self {
            length_mm: (radius_mm * sweep_rad).hypot(rise.norm()),
            shape: Shape::Arc {
                centre,
                first,
                second,
                radius_mm,
                sweep_rad,
                rise,
            },
        }
    }

    /// Length, mm.
    pub fn length_mm(&self) -> f64 {
        self.length_mm
    }

    /// Curvature, 1/mm.
    pub fn curvature_per_mm(&self) -> f64 {
        match self.shape {
            Shape::Line { .. } => 0.0,
            Shape::Arc {
                radius_mm,
                sweep_rad,
                ..
            } => radius_mm * (sweep_rad / self.length_mm).powi(2),
        }
    }

    /// The start and the unit direction of a straight line.
    pub(super) fn as_line(&self) -> Option<(Vector, Vector)> {
        match self.shape {
            Shape::Line { from, direction } => Some((from, direction)),
            Shape::Arc { .. } => None,
        }
    }

    /// The point `along_mm` from the start.
    pub fn point(&self, along_mm: f64) -> Vector {
        match &self.shape {
            Shape::Line { from, direction } => from + direction * along_mm,
            Shape::Arc {
                centre,
                first,
                second,
                radius_mm,
                sweep_rad,
                rise,
            } => {
                let share = along_mm / self.length_mm;
                let (sin, cos) = (sweep_rad * share).sin_cos();
                centre + (first * cos + second * sin) * *radius_mm + rise * share
            }
        }
    }

    /// The direction of motion `along_mm` from the start, a unit but for an arc's allowed mismatch.
    pub fn tangent(&self, along_mm: f64) -> Vector {
        match &self.shape {
            Shape::Line { direction, .. } => *direction,
            Shape::Arc {
                first,
                second,
                radius_mm,
                sweep_rad,
                rise,
                ..
            } => {
                let (sin, cos) = (sweep_rad * along_mm / self.length_mm).sin_cos();
                let around = (second * cos - first * sin) * (radius_mm * sweep_rad);
                (around + rise) / self.length_mm
            }
        }
    }

    /// For each axis, the largest share that its velocity has of the speed along the path, and the largest that its
    /// acceleration has of the acceleration across it; 0 to 1.
    pub(super) fn axis_shares(&self) -> [(f64, f64); 3] {
        std::array::from_fn(|axis| match &self.shape {
            Shape::Line { direction, .. } => (direction[axis].abs(), 0.0),
            Shape::Arc {
                first,
                second,
                radius_mm,
                sweep_rad,
                rise,
                ..
            } => {
                let across = first[axis].hypot(second[axis]);
                let around = across * radius_mm * sweep_rad;
                ((around + rise[axis].abs()) / self.length_mm, across)
            }
        })
    }

    /// Lowest and highest coordinate of an axis.
    pub(super) fn extent(&self, axis: usize) -> (f64, f64) {
        let ends = [self.point(0.0)[axis], self.point(self.length_mm)[axis]];
        let mut extent = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        if let Shape::Arc {
            first,
            second,
            sweep_rad,
            ..
        } = &self.shape
        {
            // Where the flat arc's tangent has no part of this axis; an axis that rises has no flat part.
            let crest = second[axis].atan2(first[axis]);
            for half_turn in [0.5 * TAU, TAU] {
                let angle = (crest + half_turn).rem_euclid(TAU);
                if angle < *sweep_rad {
                    let reached = self.point(angle / sweep_rad * self.length_mm)[axis];
                    extent = (extent.0.min(reached), extent.1.max(reached));
                }
            }
        }
        extent
    }

    /// The place of the point of this segment that is nearest to `point`, looked for from `along_mm`; mm from the start.
    pub(super) fn nearest(&self, point: &Vector, along_mm: f64) -> f64 {
        let mut along = along_mm.clamp(0.0, self.length_mm);
        for _ in 0..NEAREST_STEPS {
            let step = (point - self.point(along)).dot(&self.tangent(along));
            along = (along + step).clamp(0.0, self.length_mm);
        }
        along
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 3/4 of a turn of a helix of 10 mm radius about (1, 2), rising by 3 mm.
    fn helix() -> Segment {
        let units = [Vector::x(), Vector::y()];
        Segment::arc(
            Vector::new(1.0, 2.0, 0.0),
            units,
            10.0,
            0.75 * TAU,
            Vector::new(0.0, 0.0, 3.0),
        )
    }

    #[test]
    fn a_helix_keeps_its_radius_its_pitch_and_its_speed() {
        let helix = helix();
        for k in 0..=100 {
            let along = helix.length_mm() * f64::from(k) / 100.0;
            let point = helix.point(along);
            assert!(((point.x - 1.0).hypot(point.y - 2.0) - 10.0).abs() < 1e-12);
            assert!((point.z - 3.0 * f64::from(k) / 100.0).abs() < 1e-12);
            assert!((helix.tangent(along).norm() - 1.0).abs() < 1e-12);
        }
        let flat = 10.0 * (0.75 * TAU / helix.length_mm()).powi(2);
        assert!((helix.curvature_per_mm() - flat).abs() < 1e-12);
    }

    #[test]
    fn the_extent_of_an_arc_has_its_crests_and_no_more() {
        let helix = helix();
        let close = |found: (f64, f64), expected: (f64, f64)| {
            assert!((found.0 - expected.0).abs() < 1e-9 && (found.1 - expected.1).abs() < 1e-9);
        };
        close(helix.extent(0), (-9.0, 11.0));
        close(helix.extent(1), (-8.0, 12.0));
        close(helix.extent(2), (0.0, 3.0));
    }

    #[test]
    fn the_nearest_point_is_found_from_beside_and_beyond() {
        let helix = helix();
        let foot = helix.point(20.0);
        let outwards = Vector::new(foot.x - 1.0, foot.y - 2.0, 0.0) / 10.0;
        let found = helix.nearest(&(foot + outwards * 0.05), 19.5);
        assert!((found - 20.0).abs() < 1e-6, "{found}");
        let before = helix.point(0.0) - helix.tangent(0.0);
        assert_eq!(helix.nearest(&before, 0.3), 0.0);
    }
}
