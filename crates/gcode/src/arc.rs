//! Arcs as programs write them: by their centre or by their radius.

use std::f64::consts::TAU;

use quadrant_law::reference::{Plane, Sense};

use crate::error::ProgramError;
use crate::segment::{Segment, Vector};

/// Words of a line that describe an arc.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ArcWords {
    pub(super) plane: Plane,
    /// G2 or G3.
    pub(super) sense: Sense,
    pub(super) from: Vector,
    pub(super) to: Vector,
    /// Words that give its circle.
    pub(super) circle: CircleWords,
    /// Largest difference of its radii at start and end, mm.
    pub(super) mismatch_mm: f64,
    pub(super) line: usize,
}

/// Words that give an arc's circle.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum CircleWords {
    /// By I, J, K: the centre on the plane's first and second axis, mm.
    Centre([f64; 2]),
    /// By R, mm; negative for the longer of the two arcs.
    Radius(f64),
}

/// Largest difference between an arc's distances from its centre at its two ends, mm, in programs in millimetres. Source:
/// LinuxCNC, as the next.
pub(super) const MISMATCH_MM: f64 = 0.028;
/// The same in programs in inches, mm.
pub(super) const INCH_MISMATCH_MM: f64 = 0.072;

/// Shortest radius, mm; smaller ones are writing errors.
const LEAST_RADIUS_MM: f64 = 1e-3;

impl ArcWords {
    /// The arc. Its end is met exactly: what the programmed circle misses it by is spread evenly along the arc.
    ///
    /// # Errors
    /// A circle that does not fit the ends.
    pub(super) fn segment(&self) -> Result<Segment, ProgramError> {
        let (first_axis, second_axis) = self.plane.axes();
        let flat = |point: &Vector| [point[first_axis], point[second_axis]];
        let (start, end) = (flat(&self.from), flat(&self.to));
        let centre = self.centre(start, end)?;
        let from_centre = [start[0] - centre[0], start[1] - centre[1]];
        let to_centre = [end[0] - centre[0], end[1] - centre[1]];
        let radius_mm = from_centre[0].hypot(from_centre[1]);
        if radius_mm < LEAST_RADIUS_MM {
            return Err(self.wrong(
                format!("has a radius of {radius_mm} mm, less than {LEAST_RADIUS_MM} mm"),
                "correct its centre",
            ));
        }
        let sweep_rad = self.sweep(start == end, from_centre, to_centre);
        let end_mm = to_centre[0].hypot(to_centre[1]);
        let most_mm = self.mismatch_mm;
        if (end_mm - radius_mm).abs() > most_mm {
            return Err(ProgramError::ArcRadius {
                line: self.line,
                start_mm: radius_mm,
                end_mm,
                most_mm,
            });
        }
        let unit = |[first, second]: [f64; 2]| {
            let mut unit = Vector::zeros();
            unit[first_axis] = first / radius_mm;
            unit[second_axis] = second / radius_mm;
            unit
        };
        let ahead = match self.sense {
            Sense::CounterClockwise => [-from_centre[1], from_centre[0]],
            Sense::Clockwise => [from_centre[1], -from_centre[0]],
        };
        let units = [unit(from_centre), unit(ahead)];
        let middle = self.from - units[0] * radius_mm;
        let closing = Segment::arc(middle, units, radius_mm, sweep_rad, Vector::zeros());
        let rise = self.to - closing.point(closing.length_mm());
        Ok(Segment::arc(middle, units, radius_mm, sweep_rad, rise))
    }

    /// The angle from start to end in the arc's sense, above zero, a whole turn from a point to itself.
    fn sweep(&self, whole_turn: bool, from: [f64; 2], to: [f64; 2]) -> f64 {
        if whole_turn {
            return TAU;
        }
        let cross = from[0] * to[1] - from[1] * to[0];
        let dot = from[0] * to[0] + from[1] * to[1];
        let angle = match self.sense {
            Sense::CounterClockwise => cross.atan2(dot),
            Sense::Clockwise => (-cross).atan2(dot),
        };
        if angle > 0.0 { angle } else { angle + TAU }
    }

    fn centre(&self, start: [f64; 2], end: [f64; 2]) -> Result<[f64; 2], ProgramError> {
        let radius = match self.circle {
            CircleWords::Centre(centre) => return Ok(centre),
            CircleWords::Radius(radius) => radius,
        };
        let chord = [end[0] - start[0], end[1] - start[1]];
        let length = chord[0].hypot(chord[1]);
        if length == 0.0 {
            return Err(self.wrong(
                "has a radius R but ends where it starts".to_owned(),
                "give the centre of a full circle by I, J, K",
            ));
        }
        if length > 2.0 * radius.abs() + self.mismatch_mm {
            return Err(self.wrong(
                format!(
                    "of radius {:.4} mm cannot reach its end {length:.4} mm away",
                    radius.abs()
                ),
                "give a radius R of at least half that distance",
            ));
        }
        let height = (radius * radius - 0.25 * length * length).max(0.0).sqrt();
        // The centre of the shorter arc lies to the left of a counter-clockwise chord.
        let left = (self.sense == Sense::CounterClockwise) == (radius > 0.0);
        let side = if left { height } else { -height } / length;
        Ok([
            0.5 * (start[0] + end[0]) - side * chord[1],
            0.5 * (start[1] + end[1]) + side * chord[0],
        ])
    }

    fn wrong(&self, what: String, remedy: &'static str) -> ProgramError {
        ProgramError::Arc {
            line: self.line,
            what,
            remedy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(sense: Sense, to: [f64; 2], circle: CircleWords) -> Result<Segment, ProgramError> {
        ArcWords {
            plane: Plane::Xy,
            sense,
            from: Vector::new(10.0, 0.0, 5.0),
            to: Vector::new(to[0], to[1], 5.0),
            circle,
            mismatch_mm: MISMATCH_MM,
            line: 7,
        }
        .segment()
    }

    #[test]
    fn sense_and_sign_of_the_radius_choose_among_four_arcs() {
        use Sense::{Clockwise, CounterClockwise};
        for (sense, radius, quarter_turns, through) in [
            (CounterClockwise, 10.0, 1.0, [7.071, 7.071]),
            (CounterClockwise, -10.0, 3.0, [17.071, 17.071]),
            (Clockwise, 10.0, 1.0, [2.929, 2.929]),
            (Clockwise, -10.0, 3.0, [-7.071, -7.071]),
        ] {
            let arc = arc(sense, [0.0, 10.0], CircleWords::Radius(radius)).unwrap();
            let quarter = 10.0 * TAU / 4.0;
            assert!((arc.length_mm() - quarter_turns * quarter).abs() < 1e-9);
            let middle = arc.point(0.5 * arc.length_mm());
            assert!((middle.x - through[0]).abs() < 1e-3, "{middle}");
            assert!((middle.y - through[1]).abs() < 1e-3, "{middle}");
        }
    }

    #[test]
    fn an_arc_from_a_point_to_itself_is_a_whole_turn() {
        let arc = arc(
            Sense::Clockwise,
            [10.0, 0.0],
            CircleWords::Centre([0.0, 0.0]),
        )
        .unwrap();
        assert!((arc.length_mm() - 10.0 * TAU).abs() < 1e-9);
        assert!(arc.tangent(0.0).y < 0.0);
    }

    #[test]
    fn ends_that_miss_the_circle_by_rounding_are_met_and_others_refused() {
        let centre = CircleWords::Centre([0.0, 0.0]);
        let rounded = arc(Sense::CounterClockwise, [0.0, 10.027], centre.clone()).unwrap();
        let end = rounded.point(rounded.length_mm());
        assert!((end - Vector::new(0.0, 10.027, 5.0)).norm() < 1e-12);
        assert!((rounded.tangent(3.0).norm() - 1.0).abs() < 2e-3);
        let refused = arc(Sense::CounterClockwise, [0.0, 10.029], centre).unwrap_err();
        assert!(
            refused
                .to_string()
                .starts_with("line 7: the arc starts 10.0000")
        );
    }

    #[test]
    fn a_radius_that_cannot_reach_is_refused_with_both_lengths() {
        let refused = arc(Sense::Clockwise, [-10.0, 0.0], CircleWords::Radius(9.0));
        let text = refused.unwrap_err().to_string();
        assert!(
            text.contains("9.0000 mm") && text.contains("20.0000 mm"),
            "{text}"
        );
    }
}
