//! The stiffest PD loop under bounds on sensitivity.

use std::f64::consts::TAU;

use quadrant_law::control::pid::PidGains;
use quadrant_sim::loop_shape::OpenLoop;
use quadrant_sim::margins::{LoopGains, Margins};

use super::form::Form;
use super::process::Process;
use super::shaping::{LARGEST_RATIO, SMALLEST_RATIO, ShapingError, proportional_derivative};

/// Bounds on the peaks of `|S|` and `|T|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PeakBounds {
    /// Bound on `|S|`.
    pub(super) sensitivity: f64,
    /// Bound on `|T|`.
    pub(super) complementary: f64,
}

impl PeakBounds {
    /// Returns the factor by which the worse of the two is exceeded; 1 and less is within.
    fn excess(&self, margins: &Margins) -> f64 {
        (margins.sensitivity_peak / self.sensitivity)
            .max(margins.complementary_peak / self.complementary)
    }
}

/// Reasons for which no such loop exists.
pub(super) enum NoLoop {
    /// The process turns too little.
    Shaping(ShapingError),
    /// Every loop exceeds a bound, the best by this factor.
    Excess(f64),
}

/// Ratios Kd/Kp tried, even on a log scale.
const RATIOS: usize = 40;
/// Steps of the golden section between the neighbours of the best of them.
const GOLDEN_STEPS: usize = 16;
/// Gain margins tried at each ratio, from 1 dB upwards in steps of 0.75 dB.
const GAIN_MARGINS: usize = 32;
/// Halvings between a gain margin that keeps the bounds and the one below.
const HALVINGS: usize = 16;

/// The PD gains with the largest Kp whose loop keeps both bounds.
///
/// At low frequency a disturbance of one volt costs an error of 1/Kp. The crossover alone would be no measure: velocity
/// feedback without any stiffness has the largest.
pub(super) fn stiffest(
    process: &Process,
    form: Form,
    filter_s: f64,
    bounds: &PeakBounds,
) -> Result<PidGains, NoLoop> {
    let half_turn_hz = process
        .half_turn_hz()
        .ok_or(NoLoop::Shaping(ShapingError::NoHalfTurn))?;
    let unit_s = 1.0 / (TAU * half_turn_hz);
    let at = |log_ratio: f64, least_kp: f64| {
        let ratio_s = unit_s * log_ratio.exp();
        stiffest_at(process, form, filter_s, ratio_s, bounds, least_kp)
    };
    let (first, last) = (SMALLEST_RATIO.ln(), LARGEST_RATIO.ln());
    let spacing = (last - first) / (RATIOS - 1) as f64;
    let mut best: Option<(PidGains, f64)> = None;
    let mut least_excess = f64::INFINITY;
    for index in 0..RATIOS {
        let log_ratio = first + spacing * index as f64;
        let least_kp = best.map_or(0.0, |(most, _)| most.kp_v_per_mm);
        match at(log_ratio, least_kp) {
            Ok(gains) if gains.kp_v_per_mm > least_kp => best = Some((gains, log_ratio)),
            Ok(_) => {}
            Err(excess) => least_excess = least_excess.min(excess),
        }
    }
    let (mut gains, centre) = best.ok_or(NoLoop::Excess(least_excess))?;
    let stiffness = |log_ratio: f64| at(log_ratio, 0.0).map_or(0.0, |gains| gains.kp_v_per_mm);
    let (mut low, mut high) = (centre - spacing, centre + spacing);
    let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
    for _ in 0..GOLDEN_STEPS {
        let width = golden * (high - low);
        if stiffness(high - width) > stiffness(low + width) {
            high = low + width;
        } else {
            low = high - width;
        }
    }
    if let Ok(refined) = at(0.5 * (low + high), 0.0)
        && refined.kp_v_per_mm > gains.kp_v_per_mm
    {
        gains = refined;
    }
    Ok(gains)
}

/// The largest gains with a ratio Kd/Kp, s, that keep the bounds; otherwise the smallest excess. The search ends where Kp falls
/// below `least_kp`, V/mm: less is of no use.
fn stiffest_at(
    process: &Process,
    form: Form,
    filter_s: f64,
    ratio_s: f64,
    bounds: &PeakBounds,
    least_kp: f64,
) -> Result<PidGains, f64> {
    let unit = process.open_loop(&proportional_derivative(1.0, ratio_s, filter_s), form);
    // Only the gain differs from here on.
    let loops = LoopGains::new(&unit).map_err(|_| f64::INFINITY)?;
    let crossover = loops.falling_phase_crossover().map_err(|_| f64::INFINITY)?;
    let unit_gain = unit.response(crossover).norm();
    let kp_v_per_mm = |gain_margin_db: f64| 10.0_f64.powf(-gain_margin_db / 20.0) / unit_gain;
    let excess = |gain_margin_db: f64| {
        unit.margins_of(&loops, kp_v_per_mm(gain_margin_db))
            .map_or(f64::INFINITY, |margins| bounds.excess(&margins))
    };
    let gain_margin_db = |index: usize| 1.0 + 0.75 * index as f64;
    let mut least = f64::INFINITY;
    for index in 0..GAIN_MARGINS {
        // Gains fall with the margin, and lie above these as long as one step back might be enough.
        if kp_v_per_mm(gain_margin_db(index.saturating_sub(1))) <= least_kp {
            break;
        }
        let found = excess(gain_margin_db(index));
        if found <= 1.0 {
            let (mut outside, mut inside) = (
                gain_margin_db(index.saturating_sub(1)),
                gain_margin_db(index),
            );
            for _ in 0..HALVINGS {
                let middle = 0.5 * (outside + inside);
                if excess(middle) <= 1.0 {
                    inside = middle;
                } else {
                    outside = middle;
                }
            }
            let kp_v_per_mm = kp_v_per_mm(inside);
            return Ok(proportional_derivative(
                kp_v_per_mm,
                ratio_s * kp_v_per_mm,
                filter_s,
            ));
        }
        least = least.min(found);
    }
    Err(least)
}
