//! Learning: friction changes after a commissioning, so the chosen law learns its scale where that is no worse.
//!
//! Learning also takes the feedforward back where the error would be smaller without it.

use super::VerifyError;
use super::law_result::MAX_SCATTER_RATIO;
use super::trials::Trials;

/// Mean of its errors over the PID's, over that of the law that does not learn, up to which one that learns is chosen.
const MOST_LOST: f64 = 1.02;

impl Trials<'_, '_> {
    /// The index of the chosen law with learning, where it is worse than the PID on none of the sines on which the chosen one is not,
    /// and hardly worse than that one; else the chosen one's.
    pub(super) fn let_learn(&mut self, chosen: usize) -> Result<usize, VerifyError> {
        let fixed = self.laws[chosen].clone();
        if !fixed.feeds_forward() {
            return Ok(chosen);
        }
        let mut settings = fixed.settings.clone();
        settings.feedforward.learning = Some(self.learning);
        let name = format!("{}, learning", fixed.law);
        // An axis that is too late for it, or whose law has no PID, is refused.
        let Ok((mut found, _)) = self.bench.try_law(&name, &settings, self.bench.sines.len())
        else {
            return Ok(chosen);
        };
        let was_refused = self.refused.iter().any(|refused| refused.law == fixed.law);
        let is_refused = if was_refused {
            self.exceeds_when_small(&mut found, &fixed)?
        } else {
            self.refuses_when_small(&mut found)
        };
        let [(fixed_worst, fixed_mean), (worst, mean)] =
            [&fixed, &found].map(|law| self.against_pid(law));
        let is_worse = is_refused
            || found.stopped.is_some()
            || worst > fixed_worst.max(MAX_SCATTER_RATIO)
            || mean > MOST_LOST * fixed_mean;
        self.laws.push(found);
        Ok(if is_worse {
            chosen
        } else {
            self.laws.len() - 1
        })
    }
}
