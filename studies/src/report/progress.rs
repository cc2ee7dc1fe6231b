//! Progress of a report.

use indicatif::ProgressBar;

/// Steps of the bar.
const STEPS: f64 = 1e6;

/// The progress of a report, of which one part is under way.
pub struct Progress {
    bar: ProgressBar,
    steps_per_s: f64,
    /// Beginning and length of the part, in steps.
    part: (f64, f64),
}

impl Progress {
    /// Of parts that take about `whole_s` together.
    pub fn new(bar: &ProgressBar, whole_s: f64) -> Self {
        bar.set_length(STEPS as u64);
        Self {
            bar: bar.clone(),
            steps_per_s: STEPS / whole_s.max(f64::MIN_POSITIVE),
            part: (0.0, 0.0),
        }
    }

    /// A part begins that takes about `expected_s`.
    pub(super) fn begin(&mut self, name: &'static str, expected_s: f64) {
        self.part = (self.part.0 + self.part.1, expected_s * self.steps_per_s);
        self.bar.set_message(name);
        self.at(0.0);
    }

    /// The part has ended.
    pub(super) fn end(&self) {
        self.at(1.0);
    }

    /// The part is done to this share, 0 to 1.
    pub fn at(&self, share: f64) {
        self.bar
            .set_position((self.part.0 + share * self.part.1) as u64);
    }

    /// A further share of the part is done; from any thread.
    pub fn advance(&self, share: f64) {
        self.bar.inc((share * self.part.1) as u64);
    }
}
