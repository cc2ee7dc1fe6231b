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
    /// and hardly worse than that one.
    pub(super) fn let_learn(&mut self, chosen: usize) -> Result<Option<usize>, VerifyError> {
        let fixed = self.laws[chosen].clone();
        if !fixed.feeds_forward() {
            return Ok(None);
        }
        let name = format!("{}, learning", fixed.law);
        let was_refused = |name: &str| self.refused.iter().any(|refused| refused.law == name);
        let is_fixed_refused = was_refused(&fixed.law);
        // One that lost by learning on the usual sines does so with less friction on small motions, too.
        let mut laws = self.laws.iter();
        let has_lost = laws.any(|law| law.settings.feedforward.learning.is_some());
        if has_lost || was_refused(&name) && !is_fixed_refused {
            return Ok(None);
        }
        let mut settings = fixed.settings.clone();
        settings.feedforward.learning = Some(self.learning);
        // An axis that is too late for it, or whose law has no PID, is refused.
        let Ok((mut found, _)) = self.bench.try_law(&name, &settings, 0) else {
            return Ok(None);
        };
        // What refused the law without it is no fault of the learning.
        let is_refused = if is_fixed_refused {
            self.exceeds_when_small(&mut found, &fixed)?
        } else {
            self.refuses_when_small(&mut found)?
        };
        if is_refused {
            return Ok(None);
        }
        let all = self.bench.sines.len();
        self.bench.run_on(&mut found, all);
        let [(fixed_worst, fixed_mean), (worst, mean)] =
            [&fixed, &found].map(|law| self.against_pid(law));
        let is_worse = found.stopped.is_some()
            || worst > fixed_worst.max(MAX_SCATTER_RATIO)
            || mean > MOST_LOST * fixed_mean;
        self.laws.push(found);
        Ok((!is_worse).then_some(self.laws.len() - 1))
    }
}
