//! Design of controllers: the best PID, the nonlinear gain, its proof, margins.

use std::f64::consts::TAU;

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadrant_law::control::pid::PidGains;
use quadrant_sim::loop_shape::OpenLoop;
use quadrant_sim::margins::{MarginError, Margins};
use quadrant_tune::design::measured::MeasuredResponse;
use quadrant_tune::design::npid::{NonlinearRule, Range, choose_nonlinear, filtered_proof};
use quadrant_tune::design::{
    Form, Peaks, Process, best_filter_s, best_pid_within, load_step_error,
};

use crate::arrays::{ComplexNumbers, Numbers, finite, finite_complex, positive};
use crate::errors;
use crate::identify::{ModeOf, Plant, modes, plant, response};
use crate::interrupt::left_behind;

/// Gains: Kp, Ki, Kd, and the filter of the derivative.
pub(crate) type Gains = (f64, f64, f64, f64);

pub(crate) fn gains_of(gains: &PidGains) -> Gains {
    (
        gains.kp_v_per_mm,
        gains.ki_v_per_mm_s,
        gains.kd_v_s_per_mm,
        gains.derivative_filter_s,
    )
}

fn gains(gains: Gains) -> PyResult<PidGains> {
    let (kp_v_per_mm, ki_v_per_mm_s, kd_v_s_per_mm, derivative_filter_s) = gains;
    let found = PidGains {
        kp_v_per_mm,
        ki_v_per_mm_s,
        kd_v_s_per_mm,
        derivative_filter_s,
    };
    if found.is_valid() {
        return Ok(found);
    }
    Err(PyValueError::new_err(format!(
        "gains = {gains:?}: kp_v_per_mm must be above zero, the others zero or more, and all finite"
    )))
}

/// Process that a controller is designed on.
#[pyclass(module = "quadrant", name = "Process", frozen)]
#[derive(Debug)]
pub(crate) struct DesignProcess(Process);

#[pymethods]
impl DesignProcess {
    /// A linear model with modes.
    #[staticmethod]
    fn model(of: Plant, of_modes: Vec<ModeOf>) -> PyResult<Self> {
        let plant = plant(of)?;
        Ok(Self(if of_modes.is_empty() {
            Process::Model(plant)
        } else {
            Process::Modelled {
                plant,
                modes: modes(of_modes)?,
                filters: Vec::new(),
            }
        }))
    }

    /// A measured response, of which the lines with a coherence count.
    #[staticmethod]
    fn measured(
        frequency_hz: Numbers<'_>,
        values: ComplexNumbers<'_>,
        coherence: Numbers<'_>,
        least_coherence: f64,
    ) -> PyResult<Self> {
        let frequency_hz = finite("frequency_hz", &frequency_hz)?;
        let coherence = finite("coherence", &coherence)?;
        let deviations = vec![0.0; frequency_hz.len()];
        let values = finite_complex("response", &values)?;
        let response = response(&frequency_hz, &values, &coherence, &deviations)?;
        let response = MeasuredResponse::new(&response, least_coherence).map_err(errors::of)?;
        Ok(Self(Process::Measured {
            response,
            filters: Vec::new(),
        }))
    }
}

/// Sampled at a rate, or continuous without one.
fn form(rate_hz: Option<f64>, computation_delay_s: f64) -> PyResult<Form> {
    match rate_hz {
        None => Ok(Form::Continuous),
        Some(rate_hz) if rate_hz.is_finite() && rate_hz > 0.0 && computation_delay_s >= 0.0 => {
            Ok(Form::Sampled {
                sample_time_s: 1.0 / rate_hz,
                computation_delay_s,
            })
        }
        Some(rate_hz) => Err(PyValueError::new_err(format!(
            "rate_hz = {rate_hz}, computation_delay_s = {computation_delay_s}: the rate must be above zero, the delay zero or more"
        ))),
    }
}

/// Margins as a dictionary.
pub(crate) fn margins_dict<'py>(py: Python<'py>, found: &Margins) -> PyResult<Bound<'py, PyDict>> {
    let margins = PyDict::new(py);
    for (name, value) in [
        ("gain_margin_db", found.gain_margin_db),
        ("phase_crossover_hz", found.phase_crossover_hz),
        ("phase_margin_deg", found.phase_margin_deg),
        ("gain_crossover_hz", found.gain_crossover_hz),
        ("sensitivity_peak", found.sensitivity_peak),
        ("sensitivity_peak_hz", found.sensitivity_peak_hz),
        ("complementary_peak", found.complementary_peak),
        ("complementary_peak_hz", found.complementary_peak_hz),
    ] {
        margins.set_item(name, value)?;
    }
    Ok(margins)
}

/// The PID with the least error after a step of the load whose peaks stay within bounds: gains and margins.
#[pyfunction]
#[pyo3(signature = (process, rate_hz, filter_s, ms, mt, computation_delay_s=0.0))]
pub(crate) fn design_pid<'py>(
    py: Python<'py>,
    process: &DesignProcess,
    rate_hz: Option<f64>,
    filter_s: Option<f64>,
    ms: f64,
    mt: f64,
    computation_delay_s: f64,
) -> PyResult<(Gains, Bound<'py, PyDict>)> {
    for (name, value) in [("ms", ms), ("mt", mt)] {
        if !(value.is_finite() && value > 1.0) {
            return Err(PyValueError::new_err(format!(
                "{name} = {value}: a bound on a peak is above 1; 1.4 to 2 is usual"
            )));
        }
    }
    let form = form(rate_hz, computation_delay_s)?;
    if let Some(filter_s) = filter_s
        && !(filter_s.is_finite() && filter_s >= 0.0)
    {
        return Err(PyValueError::new_err(format!(
            "derivative_filter_s = {filter_s}: it must be a finite number of zero or more"
        )));
    }
    let filter_s = filter_s.unwrap_or_else(|| rate_hz.map_or(0.0, best_filter_s));
    let peaks = Peaks {
        sensitivity: ms,
        complementary: mt,
    };
    let process = process.0.clone();
    let found = left_behind(py, move |_| {
        best_pid_within(&process, form, filter_s, peaks)
    })?;
    let found = found.map_err(errors::of)?;
    Ok((gains_of(&found.gains), margins_dict(py, &found.margins)?))
}

/// Margins of a loop.
#[pyfunction]
#[pyo3(signature = (process, of, rate_hz, computation_delay_s=0.0))]
pub(crate) fn margins<'py>(
    py: Python<'py>,
    process: &DesignProcess,
    of: Gains,
    rate_hz: Option<f64>,
    computation_delay_s: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let found = process
        .0
        .margins(&gains(of)?, form(rate_hz, computation_delay_s)?);
    margins_dict(py, &found.map_err(errors::of)?)
}

/// Error after a step of the load of 1 V, mm sqrt(s).
#[pyfunction]
#[pyo3(signature = (process, of, rate_hz, computation_delay_s=0.0))]
pub(crate) fn load_error(
    process: &DesignProcess,
    of: Gains,
    rate_hz: Option<f64>,
    computation_delay_s: f64,
) -> PyResult<f64> {
    let (gains, form) = (gains(of)?, form(rate_hz, computation_delay_s)?);
    if process.0.margins(&gains, form) == Err(MarginError::Unstable) {
        return Err(errors::value(MarginError::Unstable));
    }
    if gains.ki_v_per_mm_s == 0.0 {
        // The error does not go back to zero.
        return Ok(f64::INFINITY);
    }
    Ok(load_step_error(&process.0, &gains, form))
}

/// The open loop at frequencies in Hz.
#[pyfunction]
#[pyo3(signature = (process, of, rate_hz, frequency_hz, computation_delay_s=0.0))]
pub(crate) fn open_loop<'py>(
    py: Python<'py>,
    process: &DesignProcess,
    of: Gains,
    rate_hz: Option<f64>,
    frequency_hz: Numbers<'py>,
    computation_delay_s: f64,
) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
    let gains = gains(of)?;
    let open_loop = process
        .0
        .open_loop(&gains, form(rate_hz, computation_delay_s)?);
    let values = finite("frequency_hz", &frequency_hz)?;
    let response: Vec<Complex64> = values
        .iter()
        .map(|hz| open_loop.response(TAU * hz))
        .collect();
    Ok(response.into_pyarray(py))
}

/// The bounds of a nonlinear gain: Popov's, the slope of its line, s, and the circle criterion's.
#[pyfunction]
pub(crate) fn popov(of: Plant, of_gains: Gains, rate_hz: f64) -> PyResult<(f64, f64, f64)> {
    positive("rate_hz", rate_hz)?;
    let proof = filtered_proof(&plant(of)?, &gains(of_gains)?, &[], 1.0 / rate_hz);
    Ok((proof.popov, proof.slope_s, proof.circle))
}

/// The nonlinear gain: rate per mm, range in mm; nothing if the bound leaves none above one.
#[pyfunction]
pub(crate) fn npid(
    of_gains: Gains,
    bound: f64,
    sector_share: f64,
    breakaway_v: Option<f64>,
    range_mm: f64,
    largest: f64,
) -> PyResult<Option<(f64, f64)>> {
    if !(sector_share > 0.0 && sector_share <= 1.0) {
        return Err(PyValueError::new_err(format!(
            "sector_share = {sector_share}: it must be above 0 and at most 1"
        )));
    }
    match breakaway_v {
        Some(volts) => positive("breakaway_v", volts)?,
        None => positive("range_mm", range_mm)?,
    };
    if largest.is_nan() || largest <= 1.0 {
        return Err(PyValueError::new_err(format!(
            "largest = {largest}: it must be above 1"
        )));
    }
    let rule = NonlinearRule {
        sector_share,
        largest,
        range: breakaway_v.map_or(Range::Fixed(range_mm), Range::Breakaway),
    };
    let found = choose_nonlinear(&gains(of_gains)?, bound, &rule);
    Ok(found.map(|gain| (gain.rate_per_mm, gain.range_mm)))
}
