//! The nonlinear gain of N-PID: how large, and over which errors.

use std::f64::consts::TAU;

use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::npid::NonlinearGain;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::popov::{SectorProof, filtered_sector_bound, sector_proof};
use quadrant_sim::loop_shape::OpenLoop;

use super::form::Form;
use super::process::Process;
use super::search::scaled;

/// Rule by which ko and emax are chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonlinearRule {
    /// Largest gain as a share of the Popov bound k_max; above zero, at most one. What is left is for the axis to
    /// change: the bound falls in proportion as A grows.
    pub sector_share: f64,
    /// Largest gain whatever that share is, as of [`gain_within_peak`]; infinite for none.
    pub largest: f64,
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
    /// 75 % of the bound over 0.1 mm, however large |S| becomes.
    fn default() -> Self {
        Self {
            sector_share: 0.75,
            largest: f64::INFINITY,
            range: Range::Fixed(0.1),
        }
    }
}

/// The gains up to which a loop with filters behind the law is proven stable: the Popov bound is the firmware's, line and circle
/// bound are read off the frequency response.
pub fn filtered_proof(
    plant: &PlantModel,
    gains: &PidGains,
    filters: &[FilterSettings],
    sample_time_s: f64,
) -> SectorProof {
    if filters.is_empty() {
        return sector_proof(plant, gains, sample_time_s);
    }
    let popov = filtered_sector_bound(plant, gains, filters, sample_time_s);
    if popov <= 1.0 {
        return SectorProof {
            popov,
            slope_s: 0.0,
            circle: 1.0,
        };
    }
    let held = PlantModel {
        delay_s: plant.delay_s + 0.5 * sample_time_s,
        ..*plant
    };
    let (slope_s, circle) = line_and_circle(&Process::filtered(held, filters), gains);
    SectorProof {
        popov,
        slope_s,
        circle: circle.min(popov),
    }
}

/// Number of frequencies of the plot.
const FREQUENCIES: u32 = 5000;
/// Decades that they cover.
const DECADES: f64 = 5.0;
/// Lowest of them, Hz.
const LOWEST_HZ: f64 = 0.1;
/// Largest q that is tried, s.
const SLOWEST_S: f64 = 1.0;
/// Steps of the search of q; each takes 1/3 of the interval away.
const THIRDS: usize = 100;

/// The q of the line that leaves the Popov plot furthest to its right, s, and the circle bound.
fn line_and_circle(process: &Process, gains: &PidGains) -> (f64, f64) {
    let open_loop = process.open_loop(gains, Form::Continuous);
    let plot: Vec<(f64, f64)> = (0..FREQUENCIES)
        .map(|index| {
            let decades = DECADES * f64::from(index) / f64::from(FREQUENCIES);
            let omega = TAU * LOWEST_HZ * 10.0_f64.powf(decades);
            let l = open_loop.response(omega);
            let h = l / (l + 1.0);
            (h.re, omega * h.im)
        })
        .collect();
    let foot = |slope_s: f64| {
        plot.iter()
            .map(|(re, im)| re - slope_s * im)
            .fold(-f64::MIN_POSITIVE, f64::min)
    };
    // It is concave in q.
    let (mut low, mut high) = (0.0, SLOWEST_S);
    for _ in 0..THIRDS {
        let third = (high - low) / 3.0;
        if foot(low + third) < foot(high - third) {
            low += third;
        } else {
            high -= third;
        }
    }
    (low, 1.0 - 1.0 / foot(0.0))
}

/// The largest gain in front of a PID with which `|S|` stays within `peak`, at most `most`: what is stable by the Popov bound may still
/// amplify disturbances by a multiple. One if the PID itself exceeds it.
pub fn gain_within_peak(
    process: &Process,
    gains: &PidGains,
    form: Form,
    peak: f64,
    most: f64,
) -> f64 {
    let keeps = |gain: f64| {
        process
            .margins(&scaled(gains, gain), form)
            .is_ok_and(|margins| margins.sensitivity_peak <= peak)
    };
    if !keeps(1.0) {
        return 1.0;
    }
    if keeps(most) {
        return most;
    }
    let (mut low, mut high) = (1.0, most);
    while high - low > GAIN_TOLERANCE {
        let middle = 0.5 * (low + high);
        if keeps(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Accuracy of [`gain_within_peak`].
const GAIN_TOLERANCE: f64 = 1e-3;

/// The bounds of emax, mm.
const RANGE_MM: (f64, f64) = (1e-3, 10.0);

/// The nonlinear gain for a loop whose Popov bound is `sector_bound`; nothing when the rule leaves no gain above one.
pub fn choose_nonlinear(
    gains: &PidGains,
    sector_bound: f64,
    rule: &NonlinearRule,
) -> Option<NonlinearGain> {
    let largest = (rule.sector_share * sector_bound).min(rule.largest);
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

#[cfg(test)]
mod tests {
    use super::*;
    use quadrant_settings::presets::{X_GAINS, X_PLANT};

    #[test]
    fn line_and_circle_are_those_of_the_proof_where_there_is_no_filter() {
        let proof = sector_proof(&X_PLANT, &X_GAINS, 0.0);
        let (slope_s, circle) = line_and_circle(&Process::Model(X_PLANT), &X_GAINS);
        assert!(
            (slope_s / proof.slope_s - 1.0).abs() < 0.01,
            "{slope_s} {proof:?}"
        );
        assert!(
            (circle / proof.circle - 1.0).abs() < 1e-3,
            "{circle} {proof:?}"
        );
    }

    #[test]
    fn a_notch_takes_from_every_bound() {
        let notch = [FilterSettings::notch(120.0, 0.4, 0.2)];
        let [with, without] =
            [&notch[..], &[]].map(|filters| filtered_proof(&X_PLANT, &X_GAINS, filters, 1e-4));
        assert!(1.0 < with.circle && with.circle < with.popov, "{with:?}");
        assert!(
            with.popov < without.popov && with.circle < without.circle,
            "{with:?}"
        );
    }
}
