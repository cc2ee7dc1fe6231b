//! The motion that the firmware is emulated, counted and benchmarked with.

use quadrant_law::reference::{HarmonicSettings, MotionSettings, Plane, Sense, circle};
use quadrant_settings::Job;
use quadrant_settings::{PlanSettings, StageSettings};

/// A circle in XY and a sine in Z, without an end, on the simulated stage's settings: all axes move, and reverse, at different
/// times. `lead_s` is the duration of the lead-in, s.
pub fn circle_and_sine(lead_s: f64) -> Job {
    const RADIUS_MM: f64 = 30.0;
    const FEED_MM_S: f64 = 15.0;
    let mut motions = circle(
        Plane::Xy,
        Sense::CounterClockwise,
        RADIUS_MM,
        FEED_MM_S,
        0.0,
        1.0,
        lead_s,
    );
    motions[2] = MotionSettings::Harmonic(HarmonicSettings::with_velocity(10.0, 8.0, 1.0, lead_s));
    for motion in &mut motions {
        if let MotionSettings::Harmonic(sine) = motion {
            sine.cycles = None;
        }
    }
    Job {
        stage: StageSettings::simulated(),
        plan: PlanSettings { motions },
    }
}
