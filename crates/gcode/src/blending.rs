//! Corners between straight lines, rounded by an arc that is tangent to both.
//!
//! A joint that turns by little is one of a curve that was written in pieces: it is rounded, too, so that the curve is run as a
//! curve. Source of the deviation: the junction deviation of grbl, 0.01 mm, there a bound of the speed and here one of the path.

use crate::interpret::Move;
use crate::modal::PathControl;
use crate::segment::{Segment, Vector};

/// Sharper turns than this, rad (175 degrees), are no corners but ways back: they are stopped at.
const MOST_TURN_RAD: f64 = 175.0 / 180.0 * std::f64::consts::PI;
/// Turns below this, rad, bound no speed that an axis reaches.
const LEAST_TURN_RAD: f64 = 1e-5;
/// Turns up to which a joint is one of a curve in pieces, rad: 20 degrees; chosen. A circle in 18 pieces is the coarsest.
const SMOOTH_RAD: f64 = 20.0 / 180.0 * std::f64::consts::PI;
/// Deviation at a joint of a curve in pieces, mm.
const SMOOTH_DEVIATION_MM: f64 = 0.01;
/// Shortest rest of a line between two rounded corners, mm; below this it counts as nothing.
const LEAST_LINE_MM: f64 = 1e-9;

/// An arc in the place of a corner.
struct Rounding {
    arc: Move,
    /// Length that it takes from either line, mm.
    taken_mm: f64,
}

/// The largest deviation at the joint of two moves that turns by an angle, mm: what the program says, or else what is asked for.
fn deviation_mm(before: &Move, after: &Move, turn_rad: f64, asked_mm: f64) -> f64 {
    if before.rest_s > 0.0 {
        return 0.0;
    }
    let allowed = |step: &Move| match step.path_control {
        PathControl::ExactStop => 0.0,
        PathControl::Within(mm) => mm,
        PathControl::Unsaid if turn_rad <= SMOOTH_RAD => asked_mm.max(SMOOTH_DEVIATION_MM),
        PathControl::Unsaid => asked_mm,
    };
    allowed(before).min(allowed(after))
}

impl Rounding {
    /// The arc that leaves the corner of two lines by the deviation that is allowed there, or by less if it would take more than
    /// half of the shorter line; nothing where there is no such corner. A rapid move is not rounded into a cutting one.
    fn between(before: &Move, after: &Move, asked_mm: f64) -> Option<Self> {
        let (_, arriving) = before.segment.as_line()?;
        let (corner, leaving) = after.segment.as_line()?;
        let feed_mm_s = match (before.feed_mm_s, after.feed_mm_s) {
            (Some(one), Some(other)) => Some(one.min(other)),
            (None, None) => None,
            _ => return None,
        };
        let (sin, cos) = (arriving.cross(&leaving).norm(), arriving.dot(&leaving));
        let turn = sin.atan2(cos);
        let deviation_mm = deviation_mm(before, after, turn, asked_mm);
        if deviation_mm <= 0.0 || !(LEAST_TURN_RAD..=MOST_TURN_RAD).contains(&turn) {
            return None;
        }
        let half = (0.5 * turn).tan();
        // A corner is 1 / cos(turn / 2) - 1 radii from its arc.
        let share = 2.0 * (0.25 * turn).sin().powi(2) / (0.5 * turn).cos();
        let needed_mm = deviation_mm / share * half;
        let shorter = before.segment.length_mm().min(after.segment.length_mm());
        let taken_mm = needed_mm.min(0.5 * shorter);
        let radius_mm = taken_mm / half;
        let inwards = (leaving - arriving * cos) / sin;
        let centre = corner - arriving * taken_mm + inwards * radius_mm;
        Some(Self {
            arc: Move {
                segment: Segment::arc(
                    centre,
                    [-inwards, arriving],
                    radius_mm,
                    turn,
                    Vector::zeros(),
                ),
                feed_mm_s,
                line: after.line,
                path_control: after.path_control,
                rest_s: 0.0,
            },
            taken_mm,
        })
    }
}

/// Rounds the corners between straight lines: by `asked_mm` at most where the program does not say.
pub(super) fn round(moves: &[Move], asked_mm: f64) -> Vec<Move> {
    let mut rounded = Vec::with_capacity(2 * moves.len());
    let mut taken_mm = 0.0;
    for (index, step) in moves.iter().enumerate() {
        let after = moves.get(index + 1);
        let corner = after.and_then(|after| Rounding::between(step, after, asked_mm));
        let given_mm = corner.as_ref().map_or(0.0, |corner| corner.taken_mm);
        if taken_mm == 0.0 && given_mm == 0.0 {
            rounded.push(step.clone());
        } else {
            let left = step.segment.length_mm() - taken_mm - given_mm;
            let from = step.segment.point(taken_mm);
            let to = step.segment.point(step.segment.length_mm() - given_mm);
            if let Some(segment) = Segment::line(from, to).filter(|_| left > LEAST_LINE_MM) {
                rounded.push(Move {
                    segment,
                    ..step.clone()
                });
            }
        }
        rounded.extend(corner.map(|corner| corner.arc));
        taken_mm = given_mm;
    }
    rounded
}

#[cfg(test)]
mod tests {
    use super::super::Program;
    use super::*;

    #[test]
    fn a_right_angle_is_left_by_the_deviation_asked_for() {
        let program = Program::parse("G1 X10 F600\nY10").unwrap();
        let rounded = round(&program.moves, 0.05);
        assert_eq!(rounded.len(), 3);
        let arc = &rounded[1].segment;
        let middle = arc.point(0.5 * arc.length_mm());
        let from_corner = (middle - Vector::new(10.0, 0.0, 0.0)).norm();
        assert!((from_corner - 0.05).abs() < 1e-9, "{from_corner}");
        for pair in rounded.windows(2) {
            let length = pair[0].segment.length_mm();
            let gap = pair[1].segment.point(0.0) - pair[0].segment.point(length);
            let kink = pair[1].segment.tangent(0.0) - pair[0].segment.tangent(length);
            assert!(gap.norm() < 1e-12 && kink.norm() < 1e-12);
        }
    }

    #[test]
    fn short_lines_are_shared_by_their_two_corners() {
        let program = Program::parse("G1 X10 F600\nY0.1\nX20").unwrap();
        let rounded = round(&program.moves, 1.0);
        let lengths: Vec<f64> = rounded
            .iter()
            .map(|step| step.segment.length_mm())
            .collect();
        // The line of 0.1 mm has gone into its two arcs of 0.05 mm radius.
        assert_eq!(lengths.len(), 4, "{lengths:?}");
        assert!((rounded[1].segment.curvature_per_mm() - 20.0).abs() < 1e-6);
    }

    #[test]
    fn the_way_back_and_the_joint_with_an_arc_stay_as_they_are() {
        let program = Program::parse("G1 X10 F600\nX0\nG2 X-10 I-5").unwrap();
        assert_eq!(round(&program.moves, 0.05), program.moves);
    }
}
