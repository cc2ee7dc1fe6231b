//! The speed along one segment: a jerk-limited rise to a peak, a stretch at it, and a jerk-limited fall.
//!
//! It is the S-curve of `quadrant_law::reference::PointToPoint`, which starts and ends at rest, between any two speeds: speed
//! changes by a constant jerk up and a constant jerk down, with constant acceleration between them if its limit is reached.
//! The acceleration is zero at both ends, so segments can follow one another without a jump of it. Source: Biagiotti and
//! Melchiorri, *Trajectory Planning for Automatic Machines and Robots*, Springer 2008, section 3.4.

use std::ops::Range;

/// Halvings of an interval of speeds; 60 leave less than a double resolves.
const HALVINGS: usize = 60;

/// The limits along the path; above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pace {
    /// Largest acceleration, mm/s^2.
    pub(super) acceleration_mm_s2: f64,
    /// Largest jerk, mm/s^3.
    pub(super) jerk_mm_s3: f64,
}

/// A stretch of constant jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Phase {
    /// Beginning, mm along the element.
    along_mm: f64,
    /// Speed there, mm/s.
    speed_mm_s: f64,
    /// Acceleration there, mm/s^2.
    acceleration_mm_s2: f64,
    jerk_mm_s3: f64,
    pub(super) duration_s: f64,
}

impl Phase {
    /// A rest.
    pub(super) const fn rest(along_mm: f64, duration_s: f64) -> Self {
        Self {
            along_mm,
            speed_mm_s: 0.0,
            acceleration_mm_s2: 0.0,
            jerk_mm_s3: 0.0,
            duration_s,
        }
    }

    /// Place, mm along the segment, and speed, mm/s, at a time from its beginning.
    pub(super) fn at(&self, time_s: f64) -> (f64, f64) {
        let half_jerk = 0.5 * self.jerk_mm_s3;
        let speed = self.speed_mm_s + time_s * (self.acceleration_mm_s2 + time_s * half_jerk);
        let mean =
            self.speed_mm_s + time_s * (0.5 * self.acceleration_mm_s2 + time_s * half_jerk / 3.0);
        (self.along_mm + time_s * mean, speed)
    }

    /// Speed at a place within it, mm/s.
    fn speed_at(&self, along_mm: f64) -> f64 {
        let time_s = largest(0.0, self.duration_s, along_mm, |time_s| self.at(time_s).0);
        self.at(time_s).1
    }
}

/// The largest speed between two places of a motion that speeds up, runs and slows down.
pub(super) fn fastest(phases: &[Phase], between_mm: Range<f64>) -> f64 {
    let within = |mm: &f64| (between_mm.start..=between_mm.end).contains(mm);
    let reached = phases.iter().enumerate().flat_map(|(index, phase)| {
        let (end_mm, end_mm_s) = phase.at(phase.duration_s);
        let last = index + 1 == phases.len();
        let at = |mm: f64| {
            let inside = phase.along_mm <= mm && (mm < end_mm || last);
            inside.then(|| phase.speed_at(mm))
        };
        let end = Some(end_mm_s).filter(|_| within(&end_mm));
        [at(between_mm.start), at(between_mm.end), end]
    });
    reached.flatten().fold(0.0, f64::max)
}

/// The largest value within bounds at which a rising function stays within `most`; the lower bound if none does.
fn largest(low: f64, high: f64, most: f64, rising: impl Fn(f64) -> f64) -> f64 {
    if high <= low || rising(high) <= most {
        return high.max(low);
    }
    let (mut low, mut high) = (low, high);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if rising(middle) <= most {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

impl Pace {
    /// Durations of the jerk, twice, and of the constant acceleration between, of a change of speed; s.
    fn change_s(&self, change_mm_s: f64) -> (f64, f64) {
        let jerk_s = self.acceleration_mm_s2 / self.jerk_mm_s3;
        let change = change_mm_s.abs();
        if change >= self.acceleration_mm_s2 * jerk_s {
            (jerk_s, change / self.acceleration_mm_s2 - jerk_s)
        } else {
            ((change / self.jerk_mm_s3).sqrt(), 0.0)
        }
    }

    /// Distance in which the speed changes, mm.
    pub(super) fn change_mm(&self, from_mm_s: f64, to_mm_s: f64) -> f64 {
        let (jerk_s, level_s) = self.change_s(to_mm_s - from_mm_s);
        0.5 * (from_mm_s + to_mm_s) * (2.0 * jerk_s + level_s)
    }

    /// The largest speed, at most `most_mm_s` but not below `from_mm_s`, that can be reached within a length.
    pub(super) fn reach_mm_s(&self, from_mm_s: f64, most_mm_s: f64, length_mm: f64) -> f64 {
        largest(from_mm_s, most_mm_s, length_mm, |to| {
            self.change_mm(from_mm_s, to)
        })
    }

    /// The phases over a segment of `length_mm` that is entered and left at two speeds within reach of each other, at
    /// no more than `most_mm_s`.
    pub(super) fn phases(
        &self,
        [enter_mm_s, leave_mm_s]: [f64; 2],
        most_mm_s: f64,
        length_mm: f64,
    ) -> Vec<Phase> {
        let needed =
            |peak: f64| self.change_mm(enter_mm_s, peak) + self.change_mm(peak, leave_mm_s);
        let peak = largest(enter_mm_s.max(leave_mm_s), most_mm_s, length_mm, needed);
        let level_mm = (length_mm - needed(peak)).max(0.0);
        let mut next = Phase {
            along_mm: 0.0,
            speed_mm_s: enter_mm_s,
            acceleration_mm_s2: 0.0,
            jerk_mm_s3: 0.0,
            duration_s: 0.0,
        };
        let mut phases = Vec::new();
        let mut run = |jerk_mm_s3: f64, duration_s: f64| {
            if duration_s > 0.0 {
                let phase = Phase {
                    jerk_mm_s3,
                    duration_s,
                    ..next
                };
                let (along_mm, speed_mm_s) = phase.at(duration_s);
                next = Phase {
                    along_mm,
                    speed_mm_s,
                    acceleration_mm_s2: phase.acceleration_mm_s2 + jerk_mm_s3 * duration_s,
                    ..phase
                };
                phases.push(phase);
            }
        };
        let change = |from: f64, to: f64, run: &mut dyn FnMut(f64, f64)| {
            let (jerk_s, level_s) = self.change_s(to - from);
            let jerk = self.jerk_mm_s3.copysign(to - from);
            run(jerk, jerk_s);
            run(0.0, level_s);
            run(-jerk, jerk_s);
        };
        change(enter_mm_s, peak, &mut run);
        if level_mm > 0.0 {
            // A length that is left over at rest is what halving left: less than a double resolves.
            run(0.0, if peak > 0.0 { level_mm / peak } else { 0.0 });
        }
        change(peak, leave_mm_s, &mut run);
        phases
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACE: Pace = Pace {
        acceleration_mm_s2: 500.0,
        jerk_mm_s3: 20_000.0,
    };

    /// Returns the end of the last phase and the speed there.
    fn end(phases: &[Phase]) -> (f64, f64) {
        phases
            .last()
            .map_or((0.0, 0.0), |last| last.at(last.duration_s))
    }

    #[test]
    fn every_segment_is_run_to_its_end_at_the_speeds_asked_for() {
        for (enter, leave, most, length) in [
            (0.0, 0.0, 50.0, 100.0),
            (0.0, 0.0, 50.0, 0.001),
            (10.0, 50.0, 50.0, 10.0),
            (50.0, 0.0, 50.0, 8.0),
            (50.0, 50.0, 50.0, 3.0),
            (20.0, 20.0, 200.0, 3.0),
        ] {
            let phases = PACE.phases([enter, leave], most, length);
            let (along, speed) = end(&phases);
            assert!(
                (along - length).abs() < 1e-9 * length.max(1.0),
                "{along} of {length}"
            );
            assert!((speed - leave).abs() < 1e-6, "{speed} of {leave}");
            for phase in &phases {
                assert!(phase.acceleration_mm_s2.abs() <= 500.0 * (1.0 + 1e-9));
                assert!(phase.at(phase.duration_s).1 <= most * (1.0 + 1e-9));
            }
        }
    }

    #[test]
    fn a_move_from_rest_to_rest_takes_the_time_of_the_firmwares_s_curve() {
        // v/a > a/j, so D/v + v/a + a/j: 100/50 + 50/500 + 500/20000.
        let phases = PACE.phases([0.0, 0.0], 50.0, 100.0);
        let duration: f64 = phases.iter().map(|phase| phase.duration_s).sum();
        assert!((duration - 2.125).abs() < 1e-9, "{duration}");
        assert_eq!(phases.len(), 7);
    }

    #[test]
    fn the_speed_within_reach_is_reached_in_just_the_length() {
        let reached = PACE.reach_mm_s(5.0, 1e3, 2.0);
        assert!((PACE.change_mm(5.0, reached) - 2.0).abs() < 1e-9);
        assert_eq!(PACE.reach_mm_s(5.0, 6.0, 2.0), 6.0);
        assert_eq!(PACE.reach_mm_s(5.0, 3.0, 2.0), 5.0);
    }
}
