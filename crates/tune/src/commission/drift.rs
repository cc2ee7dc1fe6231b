//! The change of an axis while laws are tried on it, by the error that its PID makes again and again.

/// Largest relative change of an error that counts as scatter: two runs in a row differ by as much.
const MAX_SCATTER: f64 = 0.03;

/// RMS errors of the PID alone on the same sine, in the order of their times.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drift {
    /// Time, s, and RMS error, mm.
    runs: Vec<(f64, f64)>,
}

impl Drift {
    /// Takes a further run, at a time in s, with an RMS error in mm.
    pub(super) fn note(&mut self, at_s: f64, rms_mm: f64) {
        self.runs.push((at_s, rms_mm));
    }

    /// The first and the last RMS error, mm, and the time between them, s; none without a second run.
    pub fn ends(&self) -> Option<([f64; 2], f64)> {
        let [(first_s, first_mm), .., (last_s, last_mm)] = self.runs[..] else {
            return None;
        };
        Some(([first_mm, last_mm], last_s - first_s))
    }

    /// RMS error at the end over that at the start; 1 without a second run.
    pub fn ratio(&self) -> f64 {
        self.ends().map_or(1.0, |([first, last], _)| last / first)
    }

    /// The PID's error at `to_s` over that at `from_s`: on a straight line between two runs, that of the nearest run beyond
    /// them. 1 where the axis has not changed by more than runs scatter.
    pub(super) fn between(&self, from_s: f64, to_s: f64) -> f64 {
        let errors = self.runs.iter().map(|(_, rms_mm)| *rms_mm);
        let most = errors.clone().fold(f64::NEG_INFINITY, f64::max);
        let least = errors.fold(f64::INFINITY, f64::min);
        if most <= (1.0 + MAX_SCATTER) * least || self.runs.len() < 2 {
            return 1.0;
        }
        self.at(to_s) / self.at(from_s)
    }

    fn at(&self, time_s: f64) -> f64 {
        let within = self.runs.windows(2).find_map(|pair| {
            let [(before_s, before_mm), (after_s, after_mm)] = [pair[0], pair[1]];
            let share = (time_s - before_s) / (after_s - before_s);
            (0.0..=1.0)
                .contains(&share)
                .then_some(before_mm + share * (after_mm - before_mm))
        });
        let is_early = self.runs.first().is_some_and(|(at_s, _)| time_s < *at_s);
        let nearest = if is_early {
            self.runs.first()
        } else {
            self.runs.last()
        };
        within.or(nearest.map(|(_, rms_mm)| *rms_mm)).unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_compared_with_that_of_the_pid_at_their_own_time() {
        let mut drift = Drift::default();
        assert_eq!((drift.ratio(), drift.between(0.0, 5.0)), (1.0, 1.0));
        for run in [(10.0, 0.020), (110.0, 0.030), (210.0, 0.024)] {
            drift.note(run.0, run.1);
        }
        let near = |found: f64, known: f64| assert!((found - known).abs() < 1e-12, "{found}");
        near(drift.ratio(), 1.2);
        near(drift.between(10.0, 60.0), 1.25);
        near(drift.between(60.0, 110.0), 1.2);
        near(drift.between(0.0, 160.0), 1.35);
        near(drift.between(10.0, 500.0), 1.2);
    }

    #[test]
    fn scatter_is_no_drift() {
        let mut drift = Drift::default();
        drift.note(0.0, 0.020);
        drift.note(100.0, 0.0204);
        assert_eq!(drift.between(0.0, 50.0), 1.0);
    }
}
