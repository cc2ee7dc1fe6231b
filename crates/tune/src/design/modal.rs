//! A PID for an axis with structural modes, and the filters that it needs.
//!
//! Gains and filters are searched together on the response of axis, modes and filters, through the converter's hold: the pair
//! with the least error after a step of the load ([`super::load_step_error`]) whose `|S|` and `|T|` stay within the bounds
//! of [`super::best_pid`], and within wider ones when every mode lies 5 % lower or higher. Some modes need no filter, since the
//! loop is fast or slow enough to leave them alone or has a phase there that damps them; a filter must pay for itself.
//! With the encoder on the motor, the bounds also hold, a little wider, while friction holds the table and the motor swings on the
//! spring alone: a PID for the sliding axis may hum there for ever.

use std::f64::consts::TAU;

use quadrant_law::control::filter::FilterSettings;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_settings::popov::filtered_sector_bound;
use quadrant_sim::margins::Margins;

use super::form::Form;
use super::pid::{DesignError, PidDesign};
use super::process::Process;
use super::search::{BOUND_RESERVES, Search};
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

/// Factors on the frequency of every mode that the loop must be stable with.
const MODE_SHIFTS: [f64; 3] = [1.0, 0.95, 1.05];
/// Bounds of the peaks for shifted modes, over those for the modes as they are.
const SHIFTED_PEAK_RATIO: f64 = 1.25;
/// The same with the table held by its friction: the motor alone then swings on the spring.
const HELD_PEAK_RATIO: f64 = 1.25;
/// Largest Ki Kd / Kp^2: with more, friction on the other side of a soft spring makes a limit cycle, which no linear bound shows.
const MOST_INTEGRAL: f64 = 0.3;
/// Frequencies about each mode, in its widths.
const MODE_WIDTHS: [f64; 11] = [0.0, 0.3, 0.6, 1.0, 1.5, 2.2, 3.3, 5.0, 8.0, 13.0, 20.0];
/// Least relative reduction of the error for which a filter is added.
const MIN_FILTER_BENEFIT: f64 = 0.04;
/// Widths and depths of the notches that are tried.
const NOTCHES: [(f64, f64); 4] = [(0.25, 0.1), (0.5, 0.1), (0.8, 0.05), (1.2, 0.2)];
/// Corners of the low-passes that are tried, over the frequency of the lowest mode.
const LOW_PASSES: [f64; 4] = [0.35, 0.6, 1.0, 2.0];
/// Damping ratio of these low-passes.
const LOW_PASS_DAMPING: f64 = 0.7;
/// Highest frequency of a filter over the control rate.
const MAX_FILTER_RATIO: f64 = 0.4;

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
    let mut best: Option<(f64, Vec<FilterSettings>)> = None;
    for filters in candidates(modes, form) {
        let search = search(plant, modes, &filters, form, filter_s, BOUND_RESERVES[0]);
        if let Some(found) = search.best()
            && form.is_accepted(plant, &found.gains, &filters)
        {
            let counted = found.cost + MIN_FILTER_BENEFIT * filters.len() as f64;
            if best.as_ref().is_none_or(|(least, ..)| counted < *least) {
                best = Some((counted, filters));
            }
        }
    }
    let refused = || DesignError::Mode {
        frequency_hz: modes
            .iter()
            .map(|mode| mode.frequency_hz)
            .fold(f64::INFINITY, f64::min),
    };
    let (_, filters) = best.ok_or_else(refused)?;
    let process = Process::Modelled {
        plant: *plant,
        modes: modes.to_vec(),
        filters: filters.clone(),
    };
    let kept = |tighter: f64| {
        let search = search(plant, modes, &filters, form, filter_s, tighter);
        let PidDesign { gains, margins } = search.kept(&process, form)?;
        let accepted = form.is_accepted(plant, &gains, &filters);
        accepted.then(|| ModalDesign {
            circle_bound: search.circle_bound(&gains),
            gains,
            filters: filters.clone(),
            margins,
        })
    };
    BOUND_RESERVES
        .into_iter()
        .find_map(kept)
        .ok_or_else(refused)
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

/// Sets of filters to try: none; a notch at each mode; a low-pass; a notch at the lowest mode and a low-pass.
fn candidates(modes: &[Mode], form: Form) -> Vec<Vec<FilterSettings>> {
    let highest_hz = match form {
        Form::Continuous => f64::INFINITY,
        Form::Sampled { sample_time_s, .. } => MAX_FILTER_RATIO / sample_time_s,
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

/// The search for a PID behind filters that keeps the bounds, less a share, with the modes as they are, and wider ones with the
/// modes shifted.
fn search(
    plant: &PlantModel,
    modes: &[Mode],
    filters: &[FilterSettings],
    form: Form,
    filter_s: f64,
    tighter: f64,
) -> Search {
    let mut processes = Vec::from(MODE_SHIFTS.map(|shift| {
        let modes: Vec<Mode> = modes.iter().map(|mode| mode.shifted(shift)).collect();
        let about = modes.iter().flat_map(frequencies_about).collect();
        let process = Process::Modelled {
            plant: *plant,
            modes,
            filters: filters.to_vec(),
        };
        let wider = if shift == 1.0 {
            1.0
        } else {
            SHIFTED_PEAK_RATIO
        };
        (process, wider * (1.0 - tighter), about)
    }));
    let held = modes.iter().filter_map(|mode| mode.held(plant));
    processes.extend(held.map(|held| {
        let hz = held.stiffness_per_s2.sqrt() / TAU;
        let about = frequencies_about(&Mode {
            frequency_hz: hz,
            damping: 0.5 * held.damping_per_s / (TAU * hz),
            anti: None,
        });
        let process = Process::filtered(held, filters);
        (process, HELD_PEAK_RATIO * (1.0 - tighter), about)
    }));
    Search::new(&processes, form, filter_s).with_integral_within(MOST_INTEGRAL)
}

/// Frequencies about a mode and its antiresonance, Hz.
fn frequencies_about(mode: &Mode) -> Vec<f64> {
    let anti = mode.anti.into_iter();
    anti.chain([(mode.frequency_hz, mode.damping)])
        .flat_map(|(hz, damping)| {
            MODE_WIDTHS.into_iter().flat_map(move |widths| {
                let away = widths * damping;
                [hz / (1.0 + away), hz * (1.0 + away)]
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::search::SENSITIVITY_PEAK;
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
                found.margins.sensitivity_peak <= SENSITIVITY_PEAK,
                "{found:?}"
            );
            assert!(found.circle_bound > 1.0);
            for shift in MODE_SHIFTS {
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
