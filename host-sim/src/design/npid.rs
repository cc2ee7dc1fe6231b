//! The nonlinear gain of N-PID: how large, and over which errors.

use quadrant::control::npid::NonlinearGain;
use quadrant::control::popov::PidGains;

/// Rule by which ko and emax are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonlinearRule {
    /// Largest gain as a share of the Popov bound k_max; above zero, at most one. What is left is for the axis to
    /// change: the bound falls in proportion as A grows.
    pub sector_share: f64,
    pub range: Range,
}

/// The range of variation emax.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// The error at which the proportional part equals the friction that the axis breaks away with, V: what a
    /// reversal costs without feedforward, so that the gain grows over just the errors that friction causes.
    Breakaway(f64),
    /// A given error, mm.
    Fixed(f64),
}

impl Default for NonlinearRule {
    /// Three quarters of the bound over 0.1 mm.
    fn default() -> Self {
        Self {
            sector_share: 0.75,
            range: Range::Fixed(0.1),
        }
    }
}

/// The bounds of emax, mm.
const RANGE_MM: (f64, f64) = (1e-3, 10.0);

/// The nonlinear gain for a loop whose Popov bound is `sector_bound`; nothing when the rule leaves no gain above one.
pub fn choose_nonlinear(
    gains: &PidGains,
    sector_bound: f64,
    rule: &NonlinearRule,
) -> Option<NonlinearGain> {
    let largest = rule.sector_share * sector_bound;
    let range_mm = match rule.range {
        Range::Breakaway(volts) => volts / gains.kp_v_per_mm,
        Range::Fixed(range_mm) => range_mm,
    }
    .clamp(RANGE_MM.0, RANGE_MM.1);
    (largest > 1.0).then(|| NonlinearGain {
        rate_per_mm: largest.acosh() / range_mm,
        range_mm,
    })
}
