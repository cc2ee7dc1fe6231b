//! The circle that the sines of two axes make.

use core::f64::consts::TAU;

use super::harmonic::HarmonicSettings;
use super::motion::MotionSettings;

/// A plane of the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Plane {
    /// The plane of x and y, G17.
    Xy,
    /// The plane of y and z, G19.
    Yz,
    /// The plane of z and x, G18.
    Zx,
}

impl Plane {
    /// The indices of the plane's first and second axis.
    pub const fn axes(self) -> (usize, usize) {
        match self {
            Self::Xy => (0, 1),
            Self::Yz => (1, 2),
            Self::Zx => (2, 0),
        }
    }
}

/// A sense of rotation, seen with the plane's first axis to the right and the second up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Sense {
    /// Mathematically positive: counter-clockwise, G3.
    CounterClockwise,
    /// Mathematically negative: clockwise, G2.
    Clockwise,
}

/// The three axes' motions of a circle: radius in mm, feed in mm/s along the path, the angle (rad, from the plane's
/// first axis) at which the full-speed turns begin, the number of turns, and the duration of lead-in and lead-out.
pub fn circle(
    plane: Plane,
    sense: Sense,
    radius_mm: f64,
    feed_mm_s: f64,
    start_rad: f64,
    turns: f64,
    lead_s: f64,
) -> [MotionSettings; 3] {
    let sine = HarmonicSettings::with_velocity(radius_mm, feed_mm_s, turns, lead_s);
    let quarter = TAU / 4.0;
    // cos(a) = sin(a + 90 deg); clockwise, the angle runs backwards: cos(-a) = sin(90 deg + a - 2 start), and so on.
    let (first, second) = match sense {
        Sense::CounterClockwise => (start_rad + quarter, start_rad),
        Sense::Clockwise => (quarter - start_rad, 2.0 * quarter - start_rad),
    };
    let mut motions = [MotionSettings::Hold; 3];
    let (first_axis, second_axis) = plane.axes();
    motions[first_axis] = MotionSettings::Harmonic(HarmonicSettings {
        phase_rad: first,
        ..sine
    });
    motions[second_axis] = MotionSettings::Harmonic(HarmonicSettings {
        phase_rad: second,
        ..sine
    });
    motions
}
