//! A PID for an axis with structural modes, and the filters that it needs.
//!
//! Gains and filters are searched together on the response of axis, modes and filters, through the converter's hold: the pair
//! with the least error after a step of the load ([`super::load_step_error`]) whose `|S|` and `|T|` stay within the bounds
//! of [`super::best_pid`], and within wider ones when every mode lies 5 % lower or higher. Some modes need no filter, since the
//! loop is fast or slow enough to leave them alone or has a phase there that damps them; a filter must pay for itself.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;
use quadrant::control::filter::FilterSettings;
use quadrant::control::pid::PidGains;
use quadrant::control::plant_model::PlantModel;
use quadrant::control::popov::filtered_sector_bound;

use super::best::{COMPLEMENTARY_PEAK, SENSITIVITY_PEAK};
use super::form::Form;
use super::loop_shape::OpenLoop;
use super::margins::Margins;
use super::pid::DesignError;
use super::process::Process;
use crate::identify::mode::Mode;

/// A PID, its filters, and what they achieve.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalDesign {
    pub gains: PidGains,
    pub filters: Vec<FilterSettings>,
    /// Margins of the loop with modes and filters.
    pub margins: Margins,
    /// The circle bound: stable for every gain from 1 to this in front of the PID, also with the modes shifted.
    pub circle_bound: f64,
}

/// Factors on the frequency of every mode that the loop must bear.
const SHIFTS: [f64; 3] = [1.0, 0.95, 1.05];
/// Bounds of the peaks for shifted modes, over those for the modes as they are.
const SHIFTED: f64 = 1.25;
/// Ratios Kd/Kp, s, and ratios Ki/Kp over the inverse of that.
const RATIOS_S: (f64, f64) = (3e-4, 0.1);
const RATIOS: usize = 22;
const INTEGRAL_RATIOS: [f64; 4] = [0.03, 0.08, 0.16, 0.3];
/// Gains tried at each ratio: from this share of a crossover at the lowest frequency upwards, by this factor, so many.
const GAIN_STEP: f64 = 1.19;
const GAINS: usize = 90;
const HALVINGS: usize = 5;
/// Frequencies of the search, Hz: even on a log scale, and more about each mode.
const LOWEST_HZ: f64 = 0.3;
const FREQUENCIES: usize = 260;
const ABOUT_A_MODE: [f64; 11] = [0.0, 0.3, 0.6, 1.0, 1.5, 2.2, 3.3, 5.0, 8.0, 13.0, 20.0];
/// Share by which a filter must lower the error.
const WORTH: f64 = 0.04;
/// Factor on the gains while the exact margins miss the bounds that the grid keeps, and its repetitions.
const BACK_OFF: f64 = 0.94;
const BACK_OFFS: usize = 12;

/// Widths and depths of notches that are tried; corners of low-passes over the frequency of the lowest mode.
const NOTCHES: [(f64, f64); 4] = [(0.25, 0.1), (0.5, 0.1), (0.8, 0.05), (1.2, 0.2)];
const LOW_PASSES: [f64; 4] = [0.35, 0.6, 1.0, 2.0];
const LOW_PASS_DAMPING: f64 = 0.7;
/// Highest frequency of a filter over the control rate.
const HIGHEST_FILTER: f64 = 0.4;

/// Designs PID and filters for an axis with modes.
///
/// # Errors
/// No PID with any of the filters keeps the bounds.
pub fn modal_pid(
    plant: &PlantModel,
    modes: &[Mode],
    form: Form,
    filter_s: f64,
) -> Result<ModalDesign, DesignError> {
    let mut best: Option<(f64, PidGains, Vec<FilterSettings>)> = None;
    for filters in candidates(modes, form) {
        let search = Search::new(plant, modes, &filters, form, filter_s);
        if let Some((error, gains)) = search.best()
            && form.is_accepted(plant, &gains, &filters)
        {
            let counted = error * (1.0 + WORTH * filters.len() as f64);
            if best.as_ref().is_none_or(|(least, ..)| counted < *least) {
                best = Some((counted, gains, filters));
            }
        }
    }
    let refused = || DesignError::Mode {
        frequency_hz: modes
            .iter()
            .map(|mode| mode.frequency_hz)
            .fold(f64::INFINITY, f64::min),
    };
    let (_, mut gains, filters) = best.ok_or_else(refused)?;
    let process = Process::Modelled {
        plant: *plant,
        modes: modes.to_vec(),
        filters: filters.clone(),
    };
    for _ in 0..BACK_OFFS {
        if let Ok(margins) = process.margins(&gains, form)
            && margins.sensitivity_peak <= 1.02 * SENSITIVITY_PEAK
            && margins.complementary_peak <= 1.02 * COMPLEMENTARY_PEAK
        {
            let search = Search::new(plant, modes, &filters, form, filter_s);
            return Ok(ModalDesign {
                circle_bound: search.circle_bound(&gains),
                gains,
                filters,
                margins,
            });
        }
        gains = scaled(&gains, BACK_OFF);
    }
    Err(refused())
}

impl Form {
    /// True if the firmware, which knows the rigid model alone, accepts gains and filters.
    fn is_accepted(self, plant: &PlantModel, gains: &PidGains, filters: &[FilterSettings]) -> bool {
        let sample_time_s = match self {
            Self::Continuous => 0.0,
            Self::Sampled { sample_time_s, .. } => sample_time_s,
        };
        filtered_sector_bound(plant, gains, filters, sample_time_s) > 1.0
    }
}

fn scaled(gains: &PidGains, factor: f64) -> PidGains {
    PidGains {
        kp_v_per_mm: factor * gains.kp_v_per_mm,
        ki_v_per_mm_s: factor * gains.ki_v_per_mm_s,
        kd_v_s_per_mm: factor * gains.kd_v_s_per_mm,
        ..*gains
    }
}

/// Sets of filters to try: none; a notch at each mode; a low-pass; a notch at the lowest mode and a low-pass.
fn candidates(modes: &[Mode], form: Form) -> Vec<Vec<FilterSettings>> {
    let highest_hz = match form {
        Form::Continuous => f64::INFINITY,
        Form::Sampled { sample_time_s, .. } => HIGHEST_FILTER / sample_time_s,
    };
    let mut sets = vec![Vec::new()];
    let Some(lowest) = modes
        .iter()
        .min_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz))
    else {
        return sets;
    };
    let low_pass = |corner: f64| {
        FilterSettings::low_pass(
            (corner * lowest.frequency_hz).min(highest_hz),
            LOW_PASS_DAMPING,
        )
    };
    for (width, depth) in NOTCHES {
        let notch =
            |mode: &Mode| FilterSettings::notch(mode.frequency_hz.min(highest_hz), width, depth);
        sets.push(modes.iter().map(notch).collect());
        if modes.len() > 1 {
            sets.push(vec![notch(lowest)]);
        }
        sets.push(vec![notch(lowest), low_pass(2.5)]);
    }
    sets.extend(LOW_PASSES.map(|corner| vec![low_pass(corner)]));
    sets
}

/// The loop without its PID, tabulated over the frequency for each shift of the modes.
struct Search {
    form: Form,
    filter_s: f64,
    /// Frequency, rad/s, and response of axis, modes and filters, mm/V; then that of axis and modes alone.
    tables: [Vec<(f64, Complex64, Complex64)>; SHIFTS.len()],
}

impl Search {
    fn new(
        plant: &PlantModel,
        modes: &[Mode],
        filters: &[FilterSettings],
        form: Form,
        filter_s: f64,
    ) -> Self {
        let highest_hz = match form {
            Form::Continuous => 1e4,
            Form::Sampled { sample_time_s, .. } => 0.49 / sample_time_s,
        };
        let unit = PidGains {
            kp_v_per_mm: 1.0,
            ki_v_per_mm_s: 0.0,
            kd_v_s_per_mm: 0.0,
            derivative_filter_s: filter_s,
        };
        let tables = SHIFTS.map(|shift| {
            let modes: Vec<Mode> = modes.iter().map(|mode| mode.shifted(shift)).collect();
            let mut frequencies_hz: Vec<f64> = (0..FREQUENCIES)
                .map(|index| {
                    let share = index as f64 / (FREQUENCIES - 1) as f64;
                    LOWEST_HZ * (highest_hz / LOWEST_HZ).powf(share)
                })
                .collect();
            for mode in &modes {
                let anti = mode.anti.into_iter();
                for (hz, damping) in anti.chain([(mode.frequency_hz, mode.damping)]) {
                    let about = ABOUT_A_MODE.iter().flat_map(|widths| {
                        let away = widths * damping;
                        [hz / (1.0 + away), hz * (1.0 + away)]
                    });
                    frequencies_hz.extend(about.filter(|hz| *hz < highest_hz));
                }
            }
            frequencies_hz.sort_by(f64::total_cmp);
            frequencies_hz.dedup();
            let with = |filters: Vec<FilterSettings>| Process::Modelled {
                plant: *plant,
                modes: modes.clone(),
                filters,
            };
            let (filtered, bare) = (with(filters.to_vec()), with(Vec::new()));
            let filtered = filtered.open_loop(&unit, form);
            let bare = bare.open_loop(&unit, form);
            frequencies_hz
                .iter()
                .map(|hz| {
                    let omega = TAU * hz;
                    (omega, filtered.response(omega), bare.response(omega))
                })
                .collect()
        });
        Self {
            form,
            filter_s,
            tables,
        }
    }

    /// The gains with the least error after a step of the load that keep the bounds, and that error.
    fn best(&self) -> Option<(f64, PidGains)> {
        let mut best: Option<(f64, PidGains)> = None;
        for index in 0..RATIOS {
            let share = index as f64 / (RATIOS - 1) as f64;
            let ratio_s = RATIOS_S.0 * (RATIOS_S.1 / RATIOS_S.0).powf(share);
            for integral in INTEGRAL_RATIOS {
                let unit = PidGains {
                    kp_v_per_mm: 1.0,
                    ki_v_per_mm_s: integral / ratio_s,
                    kd_v_s_per_mm: ratio_s,
                    derivative_filter_s: self.filter_s,
                };
                let Some(gains) = self.largest(&unit) else {
                    continue;
                };
                let error = self.load_step_error(&gains);
                if best.is_none_or(|(least, _)| error < least) {
                    best = Some((error, gains));
                }
            }
        }
        best
    }

    /// The PID's response over each table.
    fn controllers(&self, gains: &PidGains) -> [Vec<Complex64>; SHIFTS.len()] {
        self.tables.each_ref().map(|table| {
            let at =
                |&(omega, ..): &(f64, Complex64, Complex64)| self.form.controller(gains, omega);
            table.iter().map(at).collect()
        })
    }

    /// The largest multiple of gains up to which the bounds are kept, from the first on that keeps them.
    fn largest(&self, unit: &PidGains) -> Option<PidGains> {
        // The open loop is linear in the gains.
        let controllers = self.controllers(unit);
        let open: [Vec<Complex64>; SHIFTS.len()] = std::array::from_fn(|shift| {
            let pairs = self.tables[shift].iter().zip(&controllers[shift]);
            pairs
                .map(|((_, response, _), pid)| response * pid)
                .collect()
        });
        // At the lowest frequency of the search the smallest gain has a loop gain of one at most.
        let first = 1.0 / open[0].first()?.norm();
        let keeps = |factor: f64| {
            (0..SHIFTS.len()).all(|shift| {
                let wider = if shift == 0 { 1.0 } else { SHIFTED };
                within(&open[shift], factor, wider)
            })
        };
        let mut inside = None;
        for step in 0..GAINS {
            let factor = first * GAIN_STEP.powi(step as i32);
            if keeps(factor) {
                inside = Some(factor);
            } else if inside.is_some() {
                break;
            }
        }
        let mut inside = inside?;
        let mut outside = GAIN_STEP * inside;
        for _ in 0..HALVINGS {
            let middle = (inside * outside).sqrt();
            if keeps(middle) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        Some(scaled(unit, inside))
    }

    /// As [`super::load_step_error`], on the table.
    fn load_step_error(&self, gains: &PidGains) -> f64 {
        let table = &self.tables[0];
        let controllers = self.controllers(gains);
        let terms: Vec<(f64, f64)> = table
            .iter()
            .zip(&controllers[0])
            .map(|((omega, response, bare), pid)| {
                let compliance = bare / (response * pid + 1.0);
                (omega.ln(), compliance.norm_sqr() / omega)
            })
            .collect();
        let sum: f64 = terms
            .windows(2)
            .map(|pair| 0.5 * (pair[0].1 + pair[1].1) * (pair[1].0 - pair[0].0))
            .sum();
        (sum / PI).sqrt()
    }

    /// `1 - 1 / min Re T` over all shifts: the circle criterion for a gain from 1 on.
    fn circle_bound(&self, gains: &PidGains) -> f64 {
        let controllers = self.controllers(gains);
        let mut leftmost = -f64::MIN_POSITIVE;
        for (table, controllers) in self.tables.iter().zip(&controllers) {
            for ((_, response, _), pid) in table.iter().zip(controllers) {
                let open = response * pid;
                leftmost = (open / (open + 1.0)).re.min(leftmost);
            }
        }
        (1.0 - 1.0 / leftmost).min(1e6)
    }
}

/// True if a loop, `factor` times that given, is stable and keeps the bounds, `wider` times those of the design.
fn within(open: &[Complex64], factor: f64, wider: f64) -> bool {
    let mut before: Option<Complex64> = None;
    // Two integrators and any lag, or three, start beyond -180 degrees.
    let mut encircled = match open.first() {
        Some(start) if start.re < 0.0 && start.im > 0.0 => -1,
        _ => 0,
    };
    for open in open {
        let open = open * factor;
        let distance = (open + 1.0).norm();
        if distance * wider * SENSITIVITY_PEAK < 1.0
            || open.norm() > wider * COMPLEMENTARY_PEAK * distance
        {
            return false;
        }
        if let Some(before) = before
            && (before.im < 0.0) != (open.im < 0.0)
        {
            let share = before.im / (before.im - open.im);
            if before.re + share * (open.re - before.re) < -1.0 {
                encircled += if open.im > 0.0 { -1 } else { 1 };
            }
        }
        before = Some(open);
    }
    encircled == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::best_pid;
    use crate::design::fixtures::{FILTER_S, X_PLANT};

    const SAMPLED: Form = Form::Sampled {
        sample_time_s: 1e-4,
        computation_delay_s: 0.0,
    };

    fn on(modes: &[Mode], filters: &[FilterSettings]) -> Process {
        Process::Modelled {
            plant: X_PLANT,
            modes: modes.to_vec(),
            filters: filters.to_vec(),
        }
    }

    #[test]
    fn a_process_without_modes_and_filters_is_the_rigid_one() {
        let gains = best_pid(&Process::Model(X_PLANT), SAMPLED, FILTER_S).unwrap();
        let margins = on(&[], &[]).margins(&gains.gains, SAMPLED);
        assert_eq!(margins, Ok(gains.margins));
    }

    #[test]
    fn a_mode_that_the_best_rigid_pid_excites_is_borne() {
        let rigid = best_pid(&Process::Model(X_PLANT), SAMPLED, FILTER_S).unwrap();
        for frequency_hz in [40.0, 110.0, 230.0] {
            let mode = Mode {
                frequency_hz,
                damping: 0.02,
                anti: None,
            };
            let unaware = on(&[mode], &[]).margins(&rigid.gains, SAMPLED);
            assert!(
                unaware.is_err() || unaware.is_ok_and(|margins| margins.sensitivity_peak > 3.0),
                "{unaware:?}"
            );
            let found = modal_pid(&X_PLANT, &[mode], SAMPLED, FILTER_S).unwrap();
            assert!(
                found.margins.sensitivity_peak < 1.02 * SENSITIVITY_PEAK,
                "{found:?}"
            );
            assert!(found.circle_bound > 1.0);
            for shift in SHIFTS {
                let shifted = on(&[mode.shifted(shift)], &found.filters);
                let margins = shifted.margins(&found.gains, SAMPLED).unwrap();
                assert!(margins.sensitivity_peak < 2.3, "{shift}: {margins:?}");
            }
        }
    }

    #[test]
    fn with_the_encoder_on_the_motor_a_mode_costs_less() {
        let table = Mode {
            frequency_hz: 60.0,
            damping: 0.03,
            anti: None,
        };
        let motor = Mode {
            anti: Some((42.0, 0.02)),
            ..table
        };
        let gain = |mode| {
            let found = modal_pid(&X_PLANT, &[mode], SAMPLED, FILTER_S).unwrap();
            found.gains.kp_v_per_mm
        };
        assert!(
            gain(motor) > 2.0 * gain(table),
            "{} {}",
            gain(motor),
            gain(table)
        );
    }
}
