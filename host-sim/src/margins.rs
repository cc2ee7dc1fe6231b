//! Gain margin, phase margin and the peaks of sensitivity, by root bracketing.

use std::f64::consts::TAU;
use std::fmt;

use num_complex::Complex64;

use crate::loop_shape::OpenLoop;

/// Stability margins of a stable loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// The smallest factor on the loop's gain that makes it unstable, dB. Above zero.
    pub gain_margin_db: f64,
    /// Phase crossover: the frequency at which the loop then oscillates, Hz.
    pub phase_crossover_hz: f64,
    /// The smallest turn of the loop's phase that makes it unstable, deg. Above zero.
    pub phase_margin_deg: f64,
    /// Gain crossover: the frequency at which the loop's gain is one, Hz.
    pub gain_crossover_hz: f64,
    /// The peak of `|S| = |1 / (1 + L)|`, dimensionless.
    pub sensitivity_peak: f64,
    /// The frequency of that peak, Hz.
    pub sensitivity_peak_hz: f64,
    /// The peak of `|T| = |L / (1 + L)|`, dimensionless.
    pub complementary_peak: f64,
    /// The frequency of that peak, Hz.
    pub complementary_peak_hz: f64,
}

/// Reasons for which a loop has no margins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MarginError {
    /// The gain is above one, or below one, in the whole band.
    NoGainCrossover,
    /// No gain makes the loop unstable in the band.
    NoPhaseCrossover,
    /// The closed loop is unstable as it is.
    Unstable,
    /// The response is not a number somewhere in the band.
    NotFinite,
    /// The open loop's gain is still above a half where a measured response ends.
    BandTooNarrow,
}

impl fmt::Display for MarginError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoGainCrossover => "the open loop's gain never crosses one in the band",
            Self::NoPhaseCrossover => {
                "the open loop's phase never crosses -180 degrees in the band"
            }
            Self::Unstable => "the closed loop is unstable",
            Self::NotFinite => "the open loop's response is not finite everywhere in the band",
            Self::BandTooNarrow => {
                "the measured response ends where the open loop's gain is still above a half; measure to higher frequencies"
            }
        })
    }
}

impl std::error::Error for MarginError {}

/// Points, even on a log scale, between which crossings and peaks are bracketed.
const BRACKETS: usize = 4000;
/// Halvings of a bracket in which the phase turns by more than a quarter.
const HALVINGS: usize = 20;

/// Margins and peaks of a loop, or why it has none.
///
/// Stability is read by Nyquist's criterion from the crossings of the negative real axis beyond -1, counted with their
/// direction, for an open loop without unstable poles and with at most three integrators.
pub fn margins(open_loop: &impl OpenLoop) -> Result<Margins, MarginError> {
    Scan::new(open_loop)?.margins()
}

/// Loops that differ by a factor on their gain: the response over the band is computed once for all of them.
pub struct LoopGains<'a, L: OpenLoop>(Scan<'a, L>);

impl<'a, L: OpenLoop> LoopGains<'a, L> {
    /// Takes a loop as that of factor 1.
    ///
    /// # Errors
    /// A response that is not finite.
    pub fn new(open_loop: &'a L) -> Result<Self, MarginError> {
        Scan::new(open_loop).map(Self)
    }

    /// The lowest frequency at which the phase of all of them falls through -180 degrees, rad/s.
    ///
    /// # Errors
    /// A phase that does not.
    pub fn falling_phase_crossover(&self) -> Result<f64, MarginError> {
        let first = self
            .0
            .phase_crossovers()
            .into_iter()
            .find(|root| root.rises);
        let found = first.map(|root| root.omega_rad_s);
        found.ok_or(MarginError::NoPhaseCrossover)
    }

    /// [`margins`] of the loop with a factor above zero.
    ///
    /// # Errors
    /// As [`margins`].
    pub fn margins(&self, factor: f64) -> Result<Margins, MarginError> {
        let Scan { open_loop, points } = &self.0;
        let points = points.iter().map(|&(omega, l)| (omega, factor * l));
        let scaled = Scan {
            open_loop: &Scaled {
                open_loop: *open_loop,
                factor,
            },
            points: points.collect(),
        };
        scaled.margins()
    }
}

/// A loop with a factor on its gain.
struct Scaled<'a, L> {
    open_loop: &'a L,
    factor: f64,
}

impl<L: OpenLoop> OpenLoop for Scaled<'_, L> {
    fn response(&self, omega_rad_s: f64) -> Complex64 {
        self.factor * self.open_loop.response(omega_rad_s)
    }

    fn band_rad_s(&self) -> (f64, f64) {
        self.open_loop.band_rad_s()
    }
}

/// A root of a function of the response.
struct Root {
    omega_rad_s: f64,
    /// True if the function is below zero before it. The points on both sides decide: close to the root, rounding decides the sign.
    rises: bool,
}

/// A loop's response over its band, coarsely.
struct Scan<'a, L: OpenLoop> {
    open_loop: &'a L,
    points: Vec<(f64, Complex64)>,
}

/// Adds points between two of them, until the phase turns by less than a quarter from each to the next: a resonance may be narrower
/// than the scan's steps, and what it encircles must not be stepped over.
///
/// # Errors
/// [`MarginError::NotFinite`] for a resonance without damping.
fn between(
    open_loop: &impl OpenLoop,
    below: (f64, Complex64),
    above: (f64, Complex64),
    halvings: usize,
    points: &mut Vec<(f64, Complex64)>,
) -> Result<(), MarginError> {
    let turns = below.1.re * above.1.re + below.1.im * above.1.im < 0.0;
    if !turns {
        return Ok(());
    }
    let omega = (below.0 * above.0).sqrt();
    let middle = (omega, open_loop.response(omega));
    if halvings == 0 || !middle.1.is_finite() {
        return Err(MarginError::NotFinite);
    }
    between(open_loop, below, middle, halvings - 1, points)?;
    points.push(middle);
    between(open_loop, middle, above, halvings - 1, points)
}

impl<'a, L: OpenLoop> Scan<'a, L> {
    fn new(open_loop: &'a L) -> Result<Self, MarginError> {
        let (lowest, highest) = open_loop.band_rad_s();
        let ratio = highest / lowest;
        let mut points: Vec<(f64, Complex64)> = Vec::with_capacity(BRACKETS + 1);
        for index in 0..=BRACKETS {
            let omega = lowest * ratio.powf(index as f64 / BRACKETS as f64);
            let l = open_loop.response(omega);
            if !(omega.is_finite() && l.is_finite()) {
                return Err(MarginError::NotFinite);
            }
            if let Some(&before) = points.last() {
                between(open_loop, before, (omega, l), HALVINGS, &mut points)?;
            }
            points.push((omega, l));
        }
        Ok(Self { open_loop, points })
    }

    fn margins(&self) -> Result<Margins, MarginError> {
        let open_loop = self.open_loop;
        let phase_crossovers = self.phase_crossovers();
        let gain_crossovers = self.gain_crossovers();
        if self.encirclements(&phase_crossovers) != 0 {
            return Err(MarginError::Unstable);
        }
        let (gain_margin, phase_crossover) = phase_crossovers
            .iter()
            .map(|root| root.omega_rad_s)
            .map(|omega| (open_loop.response(omega).norm().recip(), omega))
            .filter(|&(factor, _)| factor > 1.0)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .ok_or(MarginError::NoPhaseCrossover)?;
        let (phase_margin, gain_crossover) = gain_crossovers
            .iter()
            .map(|root| root.omega_rad_s)
            .map(|omega| ((-open_loop.response(omega)).arg().abs(), omega))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .ok_or(MarginError::NoGainCrossover)?;
        let (sensitivity_peak, sensitivity_omega) = self.peak(|l| (l + 1.0).norm().recip());
        let (complementary_peak, complementary_omega) = self.peak(|l| (l / (l + 1.0)).norm());
        Ok(Margins {
            gain_margin_db: 20.0 * gain_margin.log10(),
            phase_crossover_hz: phase_crossover / TAU,
            phase_margin_deg: phase_margin.to_degrees(),
            gain_crossover_hz: gain_crossover / TAU,
            sensitivity_peak,
            sensitivity_peak_hz: sensitivity_omega / TAU,
            complementary_peak,
            complementary_peak_hz: complementary_omega / TAU,
        })
    }

    /// Frequencies at which the response is real and negative, ascending; where its imaginary part rises, the phase falls.
    fn phase_crossovers(&self) -> Vec<Root> {
        self.roots(|l| l.im, |l| l.re < 0.0)
    }

    /// Frequencies at which the gain is one, ascending.
    fn gain_crossovers(&self) -> Vec<Root> {
        self.roots(|l| l.norm_sqr() - 1.0, |_| true)
    }

    /// The roots of a function of the response, ascending, where `counts` holds at both ends of the bracket.
    fn roots(
        &self,
        function: impl Fn(Complex64) -> f64,
        counts: impl Fn(Complex64) -> bool,
    ) -> Vec<Root> {
        let brackets = self.points.windows(2).filter(|pair| {
            let ends = [pair[0].1, pair[1].1];
            ends.into_iter().all(&counts) && (function(ends[0]) < 0.0) != (function(ends[1]) < 0.0)
        });
        brackets
            .map(|pair| {
                let rises = function(pair[0].1) < 0.0;
                let omega_rad_s = bisect(pair[0].0, pair[1].0, |omega| {
                    (function(self.open_loop.response(omega)) < 0.0) == rises
                });
                Root { omega_rad_s, rises }
            })
            .collect()
    }

    /// Half the encirclements of -1: those of positive frequencies.
    fn encirclements(&self, phase_crossovers: &[Root]) -> i32 {
        // Two integrators and any lag, or three, start below -180 degrees: the arc at infinity has crossed the axis.
        let start = self.points[0].1;
        let on_the_arc = if start.im > 0.0 && start.re < start.im {
            -1
        } else {
            0
        };
        let beyond = |root: &&Root| self.open_loop.response(root.omega_rad_s).norm() > 1.0;
        let crossings = phase_crossovers.iter().filter(beyond);
        on_the_arc
            + crossings
                .map(|root| if root.rises { -1 } else { 1 })
                .sum::<i32>()
    }

    /// The largest value of a function of the response, and its frequency in rad/s.
    fn peak(&self, function: impl Fn(Complex64) -> f64) -> (f64, f64) {
        let values = self.points.iter().map(|&(_, l)| function(l));
        let highest = values
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map_or(0, |(index, _)| index);
        let last = self.points.len() - 1;
        let mut low = self.points[highest.saturating_sub(1)].0;
        let mut high = self.points[(highest + 1).min(last)].0;
        let at = |omega: f64| function(self.open_loop.response(omega));
        // Golden section: the function has one peak between the neighbours of the highest point.
        let golden = (5.0_f64.sqrt() - 1.0) / 2.0;
        for _ in 0..60 {
            let width = golden * (high - low);
            if at(high - width) < at(low + width) {
                low = high - width;
            } else {
                high = low + width;
            }
        }
        let omega = 0.5 * (low + high);
        (at(omega), omega)
    }
}

/// Finds the point at which `below`, true at `low` and false at `high`, changes, to the last bit but a few.
pub fn bisect(mut low: f64, mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{X_GAINS, X_PLANT};
    use crate::loop_shape::{ContinuousLoop, SampledLoop};
    use quadrant_law::control::{pid::PidGains, plant_model::PlantModel};

    const CONTINUOUS: ContinuousLoop = ContinuousLoop {
        plant: X_PLANT,
        gains: X_GAINS,
    };

    fn near(value: f64, expected: f64, tolerance: f64) {
        assert!(
            (value - expected).abs() < tolerance,
            "{value}, expected {expected}"
        );
    }

    #[test]
    fn a_resonance_narrower_than_the_scans_steps_is_not_stepped_over() {
        // Hardly damped, the axis as it sticks turns by half around its own frequency; far more gain than the dead time allows follows.
        let with = |damping_per_s: f64| {
            let plant = PlantModel {
                damping_per_s,
                ..X_PLANT
            };
            let gains = PidGains {
                kp_v_per_mm: 87.3,
                ki_v_per_mm_s: 0.0,
                kd_v_s_per_mm: 0.0082,
                ..X_GAINS
            };
            margins(&SampledLoop::new(&plant, &gains, 1e-4, 0.0))
        };
        for damping_per_s in [10.0, 0.1, 1e-3] {
            let found = with(damping_per_s);
            assert_eq!(found, Err(MarginError::Unstable), "{damping_per_s} 1/s");
        }
        assert_eq!(with(0.0), Err(MarginError::NotFinite));
    }

    #[test]
    fn x_axis_has_the_printed_margins_of_the_thesis() {
        let margins = margins(&CONTINUOUS).unwrap();
        assert_eq!(format!("{:.1}", margins.gain_margin_db), "9.9");
        assert_eq!(format!("{:.0}", margins.phase_crossover_hz), "194");
        assert_eq!(format!("{:.1}", margins.phase_margin_deg), "54.2");
        assert_eq!(format!("{:.1}", margins.gain_crossover_hz), "64.9");
    }

    #[test]
    fn x_axis_peaks_are_those_of_its_model_not_the_printed_ones() {
        // The thesis prints 1.76 and 1.25, very likely of the measured response.
        let margins = margins(&CONTINUOUS).unwrap();
        near(margins.sensitivity_peak, 1.624, 0.001);
        near(margins.sensitivity_peak_hz, 133.3, 0.1);
        near(margins.complementary_peak, 1.112, 0.001);
        near(margins.complementary_peak_hz, 50.3, 0.1);
    }

    #[test]
    fn sampling_the_x_axis_at_10_khz_costs_a_third_of_a_decibel_and_a_degree() {
        let margins = margins(&SampledLoop::new(&X_PLANT, &X_GAINS, 1e-4, 0.0)).unwrap();
        near(margins.gain_margin_db, 9.543, 0.001);
        near(margins.phase_crossover_hz, 186.42, 0.01);
        near(margins.phase_margin_deg, 53.049, 0.001);
        near(margins.gain_crossover_hz, 64.891, 0.001);
        near(margins.sensitivity_peak, 1.6627, 0.0001);
        near(margins.complementary_peak, 1.1279, 0.0001);
    }

    #[test]
    fn response_at_the_crossovers_is_real_or_of_unit_gain() {
        let margins = margins(&CONTINUOUS).unwrap();
        let real = CONTINUOUS.response(TAU * margins.phase_crossover_hz);
        near(real.im / real.re, 0.0, 1e-12);
        let unit = CONTINUOUS.response(TAU * margins.gain_crossover_hz);
        near(unit.norm(), 1.0, 1e-12);
    }

    #[test]
    fn loops_that_differ_by_a_factor_have_the_margins_of_each_computed_alone() {
        let family = LoopGains::new(&CONTINUOUS).unwrap();
        let crossover_hz = family.falling_phase_crossover().unwrap() / TAU;
        near(crossover_hz, 194.0, 0.5);
        for factor in [0.2, 0.7, 1.3, 2.0] {
            let gains = PidGains {
                kp_v_per_mm: factor * X_GAINS.kp_v_per_mm,
                ki_v_per_mm_s: factor * X_GAINS.ki_v_per_mm_s,
                kd_v_s_per_mm: factor * X_GAINS.kd_v_s_per_mm,
                ..X_GAINS
            };
            let plant = X_PLANT;
            let alone = margins(&ContinuousLoop { plant, gains }).unwrap();
            let together = family.margins(factor).unwrap();
            near(together.gain_margin_db, alone.gain_margin_db, 1e-9);
            near(together.sensitivity_peak, alone.sensitivity_peak, 1e-6);
            near(together.complementary_peak, alone.complementary_peak, 1e-6);
        }
        assert_eq!(family.margins(4.0), Err(MarginError::Unstable));
    }

    #[test]
    fn too_much_gain_is_unstable() {
        let gains = PidGains {
            kp_v_per_mm: 4.0 * X_GAINS.kp_v_per_mm,
            kd_v_s_per_mm: 4.0 * X_GAINS.kd_v_s_per_mm,
            ..X_GAINS
        };
        let plant = X_PLANT;
        assert_eq!(
            margins(&ContinuousLoop { plant, gains }),
            Err(MarginError::Unstable)
        );
    }

    #[test]
    fn too_much_integral_action_is_unstable() {
        let gains = PidGains {
            ki_v_per_mm_s: 700.0,
            ..X_GAINS
        };
        let plant = X_PLANT;
        assert_eq!(
            margins(&ContinuousLoop { plant, gains }),
            Err(MarginError::Unstable)
        );
    }

    #[test]
    fn two_or_three_integrators_with_enough_lead_are_stable() {
        let plant = PlantModel {
            stiffness_per_s2: 0.0,
            ..X_PLANT
        };
        let gains = PidGains {
            ki_v_per_mm_s: 0.7,
            ..X_GAINS
        };
        assert!(margins(&ContinuousLoop { plant, gains }).is_ok());
        // Without the plant's own damping there are three, and the phase starts near -270 degrees.
        let undamped = PlantModel {
            damping_per_s: 0.0,
            ..plant
        };
        let sluggish = PidGains {
            ki_v_per_mm_s: 600.0,
            ..X_GAINS
        };
        assert!(
            margins(&ContinuousLoop {
                plant: undamped,
                gains
            })
            .is_ok()
        );
        let unstable = ContinuousLoop {
            plant: undamped,
            gains: sluggish,
        };
        assert_eq!(margins(&unstable), Err(MarginError::Unstable));
    }

    #[test]
    fn loops_without_crossovers_say_so() {
        let prompt = PlantModel {
            delay_s: 0.0,
            ..X_PLANT
        };
        let open_loop = ContinuousLoop {
            plant: prompt,
            gains: X_GAINS,
        };
        assert_eq!(margins(&open_loop), Err(MarginError::NoPhaseCrossover));
        let spring = PlantModel {
            stiffness_per_s2: 1e6,
            damping_per_s: 1e4,
            ..X_PLANT
        };
        let weak = PidGains {
            kd_v_s_per_mm: 0.0,
            ..X_GAINS
        };
        let open_loop = ContinuousLoop {
            plant: spring,
            gains: weak,
        };
        assert_eq!(margins(&open_loop), Err(MarginError::NoGainCrossover));
        let broken = PlantModel {
            gain_mm_per_v_s2: f64::NAN,
            ..X_PLANT
        };
        let open_loop = ContinuousLoop {
            plant: broken,
            gains: X_GAINS,
        };
        assert_eq!(margins(&open_loop), Err(MarginError::NotFinite));
    }
}
