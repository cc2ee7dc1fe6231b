//! The step response of a linear axis under the firmware's own law, sample by sample.

use quadrant_law::control::filter::{FilterSettings, Filters, FiltersState};
use quadrant_law::control::npid::{NonlinearGain, NonlinearGainTable};
use quadrant_law::control::pid::Pid;
use quadrant_law::control::pid::PidGains;
use quadrant_law::control::plant_model::PlantModel;
use quadrant_law::control::terms::FeedbackState;
use quadrant_sim::held_plant::{HeldPlant, HeldPlantRun};

/// A step to answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepRequest<'a> {
    /// Filters behind the law.
    pub filters: &'a [FilterSettings],
    /// Control period, s; above zero.
    pub sample_time_s: f64,
    /// From reading the encoder to writing the converter, s; zero or more.
    pub computation_delay_s: f64,
    /// Height of the step, mm; not zero.
    pub height_mm: f64,
    /// Time to look at, s.
    pub duration_s: f64,
    /// The amplifier input's range, +- V.
    pub limit_v: f64,
}

impl Default for StepRequest<'_> {
    /// 10 um at 10 kHz, for 0.3 s: so small that the derivative stays within 10 V.
    fn default() -> Self {
        Self {
            filters: &[],
            sample_time_s: 1e-4,
            computation_delay_s: 0.0,
            height_mm: 0.01,
            duration_s: 0.3,
            limit_v: 10.0,
        }
    }
}

/// An answer to a step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepResponse {
    /// Control period, s.
    pub sample_time_s: f64,
    /// Height of the step, mm.
    pub height_mm: f64,
    /// Position at each sample, mm.
    pub position_mm: Vec<f64>,
    /// Voltage written after it, V.
    pub voltage_v: Vec<f64>,
}

/// Properties read off a step response. Times count from the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepProperties {
    /// From 10 to 90 % of the height, s.
    pub rise_time_s: f64,
    /// Time of the highest point, s.
    pub peak_time_s: f64,
    /// Overshoot of the highest point over the height, %.
    pub overshoot_percent: f64,
    /// From when on the position stays within 2 % of the height, s.
    pub settling_time_s: f64,
    pub largest_voltage_v: f64,
}

/// Lets the loop answer a step of its reference. The axis has no friction: this is the loop's own answer.
pub fn step_response(
    plant: &PlantModel,
    gains: &PidGains,
    nonlinear: Option<&NonlinearGain>,
    request: &StepRequest<'_>,
) -> StepResponse {
    let period_s = request.sample_time_s;
    let pid = Pid::<f64>::build(gains, request.limit_v, period_s);
    let table = nonlinear.map(NonlinearGainTable::<f64>::build);
    let held = HeldPlant::new(plant, period_s, request.computation_delay_s);
    let mut axis = HeldPlantRun::at_rest(held, 0.0);
    let mut state = FeedbackState::default();
    let filters = Filters::<f64>::build(request.filters, period_s);
    let mut filtered = FiltersState::default();
    let samples = (request.duration_s / period_s).ceil() as usize;
    let (mut position_mm, mut voltage_v) = (Vec::new(), Vec::new());
    for _ in 0..samples {
        let error = request.height_mm - axis.position_mm();
        let scaled = error * table.as_ref().map_or(1.0, |table| table.at(error));
        let terms = pid.step(&mut state, scaled, 0.0, request.limit_v);
        let output = filters.step(&mut filtered, terms.output);
        let output = output.clamp(-request.limit_v, request.limit_v);
        position_mm.push(axis.position_mm());
        voltage_v.push(output);
        axis.step(output);
    }
    StepResponse {
        sample_time_s: period_s,
        height_mm: request.height_mm,
        position_mm,
        voltage_v,
    }
}

/// Largest deviation from the final height, over that height, of a settled response.
const SETTLING_BAND: f64 = 0.02;

impl StepResponse {
    /// Its properties; a time is not a number if the response does not get there.
    pub fn properties(&self) -> StepProperties {
        let share: Vec<f64> = self
            .position_mm
            .iter()
            .map(|y| y / self.height_mm)
            .collect();
        let time = |index: Option<usize>| {
            index.map_or(f64::NAN, |index| index as f64 * self.sample_time_s)
        };
        let first_above = |level: f64| time(share.iter().position(|&y| y >= level));
        let peak = (0..share.len()).max_by(|&a, &b| share[a].total_cmp(&share[b]));
        let last_outside = share.iter().rposition(|y| (y - 1.0).abs() > SETTLING_BAND);
        let settled = last_outside.map_or(0, |index| index + 1);
        StepProperties {
            rise_time_s: first_above(0.9) - first_above(0.1),
            peak_time_s: time(peak),
            overshoot_percent: 100.0 * (peak.map_or(0.0, |index| share[index]) - 1.0).max(0.0),
            settling_time_s: time((settled < share.len()).then_some(settled)),
            largest_voltage_v: self.voltage_v.iter().fold(0.0, |most, v| v.abs().max(most)),
        }
    }
}
