//! A global search for a PID: the least error after a step of the load whose loops keep bounds on `|S|` and `|T|`.
//!
//! At each ratio of the three gains the loops are linear in what is left, a factor on all of them, and a bound at one frequency
//! excludes an interval of factors, the roots of a square equation: so a grid of ratios needs no search of the factor. From its
//! best points Nelder and Mead's simplex goes on in all three gains, with a penalty on what exceeds a bound.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

use argmin::core::{CostFunction, Executor};
use argmin::solver::neldermead::NelderMead;
use num_complex::Complex64;
use quadrant_law::control::pid::PidGains;
use quadrant_sim::loop_shape::OpenLoop;
use rayon::prelude::*;

use super::form::Form;
use super::pid::PidDesign;
use super::process::Process;

/// Bound on the peak of `|S|`: a usual one (Åström and Hägglund, *Advanced PID Control*, 2006, ch. 7).
pub const SENSITIVITY_PEAK: f64 = 1.7;
/// Bound on the peak of `|T|`, from the same source.
pub const COMPLEMENTARY_PEAK: f64 = 1.5;
/// Shares by which a search keeps away from its bounds, in turn until the loop keeps them.
pub(super) const BOUND_RESERVES: [f64; 4] = [0.0002, 0.001, 0.005, 0.02];
/// Lowest and highest ratio Kd/Kp of the grid, s.
const RATIOS_S: (f64, f64) = (3e-5, 0.3);
/// Number of these ratios.
const RATIOS: usize = 28;
/// Lowest and highest ratio Ki/Kp of the grid, over the inverse of Kd/Kp.
const INTEGRAL_RATIOS: (f64, f64) = (2e-3, 2.0);
/// Number of these ratios.
const INTEGRALS: usize = 14;
/// Points of the grid from which simplices start.
const STARTS: usize = 5;
/// Edges of the simplices, one after the other, in the logarithm of a gain.
const EDGES: [f64; 3] = [0.2, 0.05, 0.02];
/// Steps of each simplex.
const STEPS: u64 = 120;
/// Price of a bound that is exceeded: the logarithm of the error for that of the excess, some ten times what it can gain.
const PENALTY: f64 = 30.0;
/// Price of a loop that is not stable.
const UNSTABLE_PENALTY: f64 = 1e3;
/// Lowest frequency, Hz.
const LOWEST_HZ: f64 = 0.1;
/// Highest frequency over the control rate.
const HIGHEST_SHARE: f64 = 0.49;
/// Highest frequency in continuous time, Hz.
const HIGHEST_HZ: f64 = 1e4;
/// Number of frequencies, even on a log scale.
const FREQUENCIES: usize = 400;

/// A loop at a frequency.
struct Row {
    omega_rad_s: f64,
    log_omega: f64,
    /// The axis behind the filters, mm/V, and without them.
    filtered: Complex64,
    bare: Complex64,
    /// The law's integral and derivative action of gain 1.
    integral: Complex64,
    derivative: Complex64,
}

/// A process over the frequency, and the factor on the bounds that its loop has to keep.
struct Table {
    rows: Vec<Row>,
    wider: f64,
}

/// Bounds on the peaks of `|S|` and `|T|`, each above 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Peaks {
    /// Bound on `|S|`.
    pub sensitivity: f64,
    /// Bound on `|T|`.
    pub complementary: f64,
}

impl Default for Peaks {
    /// [`SENSITIVITY_PEAK`] and [`COMPLEMENTARY_PEAK`].
    fn default() -> Self {
        Self {
            sensitivity: SENSITIVITY_PEAK,
            complementary: COMPLEMENTARY_PEAK,
        }
    }
}

/// The loops that a PID has to close.
pub(super) struct Search {
    peaks: Peaks,
    filter_s: f64,
    tables: Vec<Table>,
    /// Largest Ki Kd / Kp^2.
    most_integral: f64,
}

/// A PID of the search.
pub(super) struct Found {
    pub(super) gains: PidGains,
    /// The logarithm of the error that it leaves after a step of the load of 1 V, mm sqrt(s).
    pub(super) cost: f64,
}

impl Found {
    fn compared(&self, other: &Self) -> Ordering {
        self.cost.total_cmp(&other.cost)
    }
}

impl CostFunction for &Search {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, logarithms: &Self::Param) -> Result<f64, argmin::core::Error> {
        Ok(self.cost_of(&self.gains(logarithms)))
    }
}

impl Search {
    /// A search for one PID that keeps the bounds, times a factor, on each of the processes; besides the usual frequencies at
    /// those given, Hz. The error is that of the first.
    pub(super) fn new(processes: &[(Process, f64, Vec<f64>)], form: Form, filter_s: f64) -> Self {
        let tables = processes
            .iter()
            .map(|(process, wider, also_hz)| Table {
                rows: rows(process, also_hz, form, filter_s),
                wider: *wider,
            })
            .collect();
        Self {
            peaks: Peaks::default(),
            filter_s,
            tables,
            most_integral: INTEGRAL_RATIOS.1,
        }
    }

    /// The same under other bounds.
    pub(super) fn within(self, peaks: Peaks) -> Self {
        Self { peaks, ..self }
    }

    /// The same with no more than so much integral action, Ki Kd / Kp^2.
    pub(super) fn with_integral_within(self, most_integral: f64) -> Self {
        Self {
            most_integral,
            ..self
        }
    }

    /// The best PID; none where no loop keeps the bounds.
    pub(super) fn best(&self) -> Option<Found> {
        let at = |(first, last): (f64, f64), index: usize, count: usize| {
            first * (last / first).powf(index as f64 / (count - 1) as f64)
        };
        let mut grid: Vec<Found> = (0..RATIOS * INTEGRALS)
            .into_par_iter()
            .flat_map_iter(|index| {
                let ratio_s = at(RATIOS_S, index / INTEGRALS, RATIOS);
                let range = (INTEGRAL_RATIOS.0, self.most_integral);
                let integral = at(range, index % INTEGRALS, INTEGRALS);
                self.largest(&PidGains {
                    kp_v_per_mm: 1.0,
                    ki_v_per_mm_s: integral / ratio_s,
                    kd_v_s_per_mm: ratio_s,
                    derivative_filter_s: self.filter_s,
                })
            })
            .map(|gains| self.found(gains))
            .collect();
        grid.sort_by(Found::compared);
        grid.truncate(STARTS);
        grid.into_par_iter()
            .map(|start| self.refine(start))
            .min_by(Found::compared)
    }

    /// The best PID, if its exact margins on a process keep the bounds: the frequencies of the search may miss a peak.
    pub(super) fn kept(&self, process: &Process, form: Form) -> Option<PidDesign> {
        let gains = self.best()?.gains;
        let margins = process.margins(&gains, form).ok()?;
        let keeps = margins.sensitivity_peak <= self.peaks.sensitivity
            && margins.complementary_peak <= self.peaks.complementary;
        keeps.then_some(PidDesign { gains, margins })
    }

    fn found(&self, gains: PidGains) -> Found {
        let cost = self.cost_of(&gains);
        Found { gains, cost }
    }

    /// The best PID that simplices find, each from the best so far.
    fn refine(&self, mut best: Found) -> Found {
        for edge in EDGES {
            let start = [
                best.gains.kp_v_per_mm,
                best.gains.ki_v_per_mm_s,
                best.gains.kd_v_s_per_mm,
            ]
            .map(f64::ln);
            let mut corners = vec![start.to_vec(); start.len() + 1];
            for (index, corner) in corners.iter_mut().take(start.len()).enumerate() {
                corner[index] += edge;
            }
            let run = Executor::new(self, NelderMead::new(corners))
                .configure(|state| state.max_iters(STEPS))
                .run();
            let Some(logarithms) = run.ok().and_then(|run| run.state.best_param) else {
                break;
            };
            let found = self.found(self.gains(&logarithms));
            if found.cost < best.cost {
                best = found;
            }
        }
        best
    }

    /// Gains by their logarithms: proportional, integral, derivative.
    fn gains(&self, logarithms: &[f64]) -> PidGains {
        PidGains {
            kp_v_per_mm: logarithms[0].exp(),
            ki_v_per_mm_s: logarithms[1].exp(),
            kd_v_s_per_mm: logarithms[2].exp(),
            derivative_filter_s: self.filter_s,
        }
    }

    /// The logarithm of the error after a step of the load, and the price of what exceeds a bound.
    fn cost_of(&self, gains: &PidGains) -> f64 {
        let integral =
            gains.ki_v_per_mm_s * gains.kd_v_s_per_mm / (gains.kp_v_per_mm * gains.kp_v_per_mm);
        let mut excess = (integral / self.most_integral).max(1.0).powi(2);
        let mut squares = 0.0;
        let most = self.peaks;
        for (index, table) in self.tables.iter().enumerate() {
            let mut before: Option<(f64, f64)> = None;
            let mut winding = Winding::default();
            for row in &table.rows {
                let open = row.open_loop(gains);
                winding.pass(open);
                let distance = (open + 1.0).norm_sqr().max(f64::MIN_POSITIVE);
                let sensitivity = (most.sensitivity * most.sensitivity * distance).recip();
                let complementary =
                    open.norm_sqr() / (most.complementary * most.complementary * distance);
                excess = excess.max(sensitivity.max(complementary) / (table.wider * table.wider));
                if index == 0 {
                    // The step's spectrum is 1 / omega, and d omega = omega d ln(omega).
                    let term = row.bare.norm_sqr() / distance / row.omega_rad_s;
                    if let Some((log, last)) = before {
                        squares += 0.5 * (last + term) * (row.log_omega - log);
                    }
                    before = Some((row.log_omega, term));
                }
            }
            if !winding.is_stable() {
                return UNSTABLE_PENALTY;
            }
        }
        0.5 * (squares / PI).ln() + PENALTY * 0.5 * excess.ln()
    }

    /// The multiples of gains that keep the bounds in a stable loop: the largest of each interval.
    fn largest(&self, unit: &PidGains) -> Vec<PidGains> {
        let loops: Vec<Vec<Complex64>> = self
            .tables
            .iter()
            .map(|table| table.rows.iter().map(|row| row.open_loop(unit)).collect())
            .collect();
        let mut excluded: Vec<(f64, f64)> = Vec::new();
        for (table, open) in self.tables.iter().zip(&loops) {
            for open in open {
                let factors = excluded_factors(*open, table.wider, self.peaks);
                excluded.extend(factors.into_iter().flatten());
            }
        }
        excluded.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut found, mut from) = (Vec::new(), 0.0);
        for (least, most) in excluded {
            let within = 0.5 * (from + least);
            if least > from && loops.iter().all(|open| is_stable(open, within)) {
                found.push(scaled(unit, least * (1.0 - 1e-9)));
            }
            from = most.max(from);
        }
        found
    }

    /// `1 - 1 / min Re T` over all processes: the circle criterion for a gain from 1 on.
    pub(super) fn circle_bound(&self, gains: &PidGains) -> f64 {
        let rows = self.tables.iter().flat_map(|table| &table.rows);
        let leftmost = rows
            .map(|row| {
                let open = row.open_loop(gains);
                (open / (open + 1.0)).re
            })
            .fold(-f64::MIN_POSITIVE, f64::min);
        (1.0 - 1.0 / leftmost).min(1e6)
    }
}

/// Gains times a factor.
pub(super) fn scaled(gains: &PidGains, factor: f64) -> PidGains {
    PidGains {
        kp_v_per_mm: factor * gains.kp_v_per_mm,
        ki_v_per_mm_s: factor * gains.ki_v_per_mm_s,
        kd_v_s_per_mm: factor * gains.kd_v_s_per_mm,
        ..*gains
    }
}

impl Row {
    fn open_loop(&self, gains: &PidGains) -> Complex64 {
        let law = self.integral * gains.ki_v_per_mm_s
            + self.derivative * gains.kd_v_s_per_mm
            + gains.kp_v_per_mm;
        self.filtered * law
    }
}

fn rows(process: &Process, also_hz: &[f64], form: Form, filter_s: f64) -> Vec<Row> {
    let unit = |kp_v_per_mm, ki_v_per_mm_s, kd_v_s_per_mm| PidGains {
        kp_v_per_mm,
        ki_v_per_mm_s,
        kd_v_s_per_mm,
        derivative_filter_s: filter_s,
    };
    let (proportional, integral, derivative) = (
        unit(1.0, 0.0, 0.0),
        unit(0.0, 1.0, 0.0),
        unit(0.0, 0.0, 1.0),
    );
    let open_loop = process.open_loop(&proportional, form);
    let (lowest, highest) = open_loop.band_rad_s();
    let highest_hz = match form {
        Form::Continuous => HIGHEST_HZ,
        Form::Sampled { sample_time_s, .. } => HIGHEST_SHARE / sample_time_s,
    };
    let band_hz = (LOWEST_HZ.max(lowest / TAU), highest_hz.min(highest / TAU));
    let mut frequencies_hz: Vec<f64> = (0..FREQUENCIES)
        .map(|index| {
            let share = index as f64 / (FREQUENCIES - 1) as f64;
            band_hz.0 * (band_hz.1 / band_hz.0).powf(share)
        })
        .collect();
    frequencies_hz.extend(also_hz.iter().filter(|hz| **hz < band_hz.1));
    frequencies_hz.sort_by(f64::total_cmp);
    frequencies_hz.dedup();
    frequencies_hz
        .into_iter()
        .map(|hz| {
            let omega_rad_s = TAU * hz;
            let filtered = open_loop.response(omega_rad_s);
            Row {
                omega_rad_s,
                log_omega: omega_rad_s.ln(),
                filtered,
                bare: filtered / process.controller(&proportional, form, omega_rad_s),
                integral: form.controller(&integral, omega_rad_s),
                derivative: form.controller(&derivative, omega_rad_s),
            }
        })
        .collect()
}

/// The factors on an open loop with which it exceeds the bound on `|S|`, and those with which it exceeds that on `|T|`.
fn excluded_factors(open: Complex64, wider: f64, peaks: Peaks) -> [Option<(f64, f64)>; 2] {
    let square = open.norm_sqr();
    // |1 + f L|^2 < 1 / Ms^2 and |f L|^2 > Mt^2 |1 + f L|^2, each |L|^2 f^2 + 2 a Re L f + b < 0: of factors above zero where
    // Re L < 0.
    let between = |a: f64, b: f64| {
        let middle = -a * open.re / square;
        let spread = middle * middle - b / square;
        (middle > 0.0 && spread > 0.0).then(|| (middle - spread.sqrt(), middle + spread.sqrt()))
    };
    let sensitivity = (wider * peaks.sensitivity).powi(-2);
    let complementary = (wider * peaks.complementary).powi(2);
    let grown = complementary / (complementary - 1.0);
    [between(1.0, 1.0 - sensitivity), between(grown, grown)]
}

/// True if a loop, `factor` times that given, encircles nothing.
fn is_stable(open: &[Complex64], factor: f64) -> bool {
    let mut winding = Winding::default();
    for open in open {
        winding.pass(open * factor);
    }
    winding.is_stable()
}

/// Encirclements of -1 by an open loop that is passed from the lowest frequency upwards: its crossings of the axis left of that.
#[derive(Default)]
struct Winding {
    before: Option<Complex64>,
    encircled: i32,
}

impl Winding {
    fn pass(&mut self, open: Complex64) {
        let Some(before) = self.before.replace(open) else {
            // Two integrators and any lag, or three, start beyond -180 degrees; a spring under derivative action just above 0.
            self.encircled = -i32::from(open.im > open.re.max(0.0));
            return;
        };
        if (before.im < 0.0) != (open.im < 0.0) {
            let share = before.im / (before.im - open.im);
            if before.re + share * (open.re - before.re) < -1.0 {
                self.encircled += if open.im > 0.0 { -1 } else { 1 };
            }
        }
    }

    fn is_stable(&self) -> bool {
        self.encircled == 0
    }
}
