//! Commissioning, of a simulated axis or of one of a machine.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use numpy::IntoPyArray;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use quadrant_law::axes::AxisName;
use quadrant_settings::{AxisSettings, StageSettings};
use quadrant_tune::commission::bootstrap::measuring_settings;
use quadrant_tune::commission::{
    CommissionError, CommissionSettings, Commissioned, Watch, commission,
};
use quadrant_tune::identify::excitation::{Excitation, Waveform};
use quadrant_tune::identify::frf::{FrfMeasurement, FrfSettings, measure};
use quadrant_tune::record::Recording;
use quadrant_tune::test_axis::{
    AxisInfo, Experiment, ExperimentError, MachineError, SimulatedTestAxis, TestAxis, Travel,
};

use crate::design::margins_dict;
use crate::errors;
use crate::friction::{elements_of, side_of};
use crate::identify::{motor_dict, plant_fit_dict, response_dict};
use crate::interrupt::cancellable;
use crate::settings::{Settings, axis_name};
use crate::stage::Stage;

/// An axis on which no experiment starts once a flag is set.
struct Cancellable<'a> {
    axis: &'a mut dyn TestAxis,
    cancelled: &'a AtomicBool,
}

impl TestAxis for Cancellable<'_> {
    fn info(&self) -> AxisInfo {
        self.axis.info()
    }

    fn settings(&self) -> &AxisSettings {
        self.axis.settings()
    }

    fn apply(&mut self, settings: &AxisSettings) -> Result<(), MachineError> {
        self.axis.apply(settings)
    }

    fn switch_off(&mut self) -> Result<(), ExperimentError> {
        self.axis.switch_off()
    }

    fn perform(
        &mut self,
        experiment: &Experiment,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Recording, ExperimentError> {
        if self.cancelled.load(Ordering::Relaxed) {
            return Err(ExperimentError::Interrupted {
                experiment: experiment.name.clone(),
                done: "the axis stands, its outputs are off".to_owned(),
            });
        }
        self.axis.perform(experiment, progress)
    }

    fn interrupted(&self) -> Option<&Recording> {
        self.axis.interrupted()
    }
}

/// Calls a function of Python with the step and the share, and keeps the PID's settings.
pub(crate) struct Progress<'a> {
    callback: Option<&'a Py<PyAny>>,
    cancelled: &'a AtomicBool,
    /// The first exception of the function.
    raised: &'a Mutex<Option<PyErr>>,
    pid: Option<AxisSettings>,
}

impl Watch for Progress<'_> {
    fn progress(&mut self, step: &'static str, share: f64) {
        let Some(callback) = self.callback else {
            return;
        };
        if let Err(error) = Python::attach(|py| callback.call1(py, (step, share))) {
            self.cancelled.store(true, Ordering::Relaxed);
            if let Ok(mut raised) = self.raised.lock() {
                raised.get_or_insert(error);
            }
        }
    }

    fn pid(&mut self, settings: &AxisSettings) {
        self.pid = Some(settings.clone());
    }
}

/// A function of Python for the progress, and its first exception.
pub(crate) type Call<'a> = (Option<&'a Py<PyAny>>, &'a Mutex<Option<PyErr>>);

/// An axis that can be cancelled, and its progress.
fn watched<'a>(
    axis: &'a mut dyn TestAxis,
    (callback, raised): Call<'a>,
    cancelled: &'a AtomicBool,
) -> (Cancellable<'a>, Progress<'a>) {
    let progress = Progress {
        callback,
        cancelled,
        raised,
        pid: None,
    };
    (Cancellable { axis, cancelled }, progress)
}

/// Result of a commissioning, and its PID alone.
pub(crate) type Outcome = Result<(Commissioned, Option<AxisSettings>), CommissionError>;

/// Commissions an axis under test.
pub(crate) fn run(
    axis: &mut dyn TestAxis,
    base: &AxisSettings,
    request: &CommissionSettings,
    call: Call<'_>,
    cancelled: &AtomicBool,
) -> Outcome {
    let (mut axis, mut watch) = watched(axis, call, cancelled);
    let found = commission(&mut axis, base, request, &mut watch)?;
    Ok((found, watch.pid))
}

/// Measures the response of an axis under test, under the PID of settings alone.
pub(crate) fn measure_response(
    axis: &mut dyn TestAxis,
    base: &AxisSettings,
    request: &FrfSettings,
    call: Call<'_>,
    cancelled: &AtomicBool,
) -> Result<FrfMeasurement, String> {
    let (mut axis, mut watch) = watched(axis, call, cancelled);
    axis.apply(&measuring_settings(base))
        .map_err(|error| errors::words(&error))?;
    let measured = measure(&mut axis, request, &mut |share| {
        watch.progress("frequency response", share);
    });
    measured.map_err(|error| errors::words(&error))
}

/// A measurement of a response in Python: waveform, RMS in V, band in Hz, Hz up to which amplitudes rise, period in s, averages, velocity in
/// mm/s, and true for an open loop.
pub(crate) type FrfRequest = (String, f64, (f64, f64), f64, f64, usize, f64, bool);

/// Its settings.
///
/// # Errors
/// `ValueError` for a waveform that there is not.
pub(crate) fn frf_settings(request: FrfRequest, seed: u64) -> PyResult<FrfSettings> {
    let (waveform, rms_v, band_hz, rise_hz, period_s, periods, bias_velocity_mm_s, open_loop) =
        request;
    let kinds = [Waveform::Multisine, Waveform::Random, Waveform::Sweep];
    let kind = kinds.into_iter().find(|kind| kind.to_string() == waveform);
    let kind = kind.ok_or_else(|| {
        PyValueError::new_err(format!(
            "waveform = {waveform:?}: it is \"multisine\", \"random\" or \"sweep\""
        ))
    })?;
    Ok(FrfSettings {
        excitation: Excitation {
            waveform: kind,
            rms_v,
            band_hz,
            rise_hz,
            period_s,
            seed,
        },
        periods,
        bias_velocity_mm_s,
        open_loop,
        ..FrfSettings::default()
    })
}

/// A measured response as a dictionary.
pub(crate) fn measured_dict<'py>(
    py: Python<'py>,
    measured: Result<FrfMeasurement, String>,
    raised: Mutex<Option<PyErr>>,
) -> PyResult<Bound<'py, PyDict>> {
    if let Ok(Some(error)) = raised.into_inner() {
        return Err(error);
    }
    let estimate = measured.map_err(PyRuntimeError::new_err)?.estimate;
    let found = response_dict(py, &estimate.response)?;
    found.set_item("blocks", estimate.blocks)?;
    Ok(found)
}

/// Measures the response of an axis of a simulated stage.
#[pyfunction]
#[pyo3(signature = (stage, settings, axis, request, seed, progress))]
pub(crate) fn measure_frf_simulated<'py>(
    py: Python<'py>,
    stage: &Stage,
    settings: &Settings,
    axis: &str,
    request: FrfRequest,
    seed: u64,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let name = axis_name(axis)?;
    settings.validate_for_law()?;
    let truth = stage.setup.truth.axes[name as usize].clone();
    let travel = Travel::of(stage.known[name as usize]);
    let request = frf_settings(request, seed)?;
    let of_stage = &settings.file.stage;
    let raised = Mutex::new(None);
    let measured = cancellable(py, |cancelled| {
        let axis = SimulatedTestAxis::under(of_stage, name as usize, truth, seed);
        let base = &of_stage.axes[name as usize];
        let calls = (progress.as_ref(), &raised);
        measure_response(
            &mut axis.with_travel(travel),
            base,
            &request,
            calls,
            cancelled,
        )
    })?;
    measured_dict(py, measured, raised)
}

/// Commissions an axis of a simulated stage, as it is switched on.
#[pyfunction]
#[pyo3(signature = (stage, axis, seed, trials, progress))]
pub(crate) fn commission_simulated<'py>(
    py: Python<'py>,
    stage: &Stage,
    axis: &str,
    seed: u64,
    trials: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let name = axis_name(axis)?;
    let setup = &stage.setup;
    let truth = setup.truth.axes[name as usize].clone();
    let travel = Travel::of(stage.known[name as usize]);
    let request = CommissionSettings {
        trials,
        ..CommissionSettings::default()
    };
    let raised = Mutex::new(None);
    let outcome = cancellable(py, |cancelled| {
        let mut axis = SimulatedTestAxis::under(&setup.settings, name as usize, truth, seed)
            .with_travel(travel);
        let base = &setup.settings.axes[name as usize];
        let calls = (progress.as_ref(), &raised);
        run(&mut axis, base, &request, calls, cancelled)
    })?;
    result(py, outcome, raised, &setup.settings, name)
}

/// The outcome as a dictionary.
pub(crate) fn result<'py>(
    py: Python<'py>,
    outcome: Outcome,
    raised: Mutex<Option<PyErr>>,
    stage: &StageSettings,
    axis: AxisName,
) -> PyResult<Bound<'py, PyDict>> {
    if let Ok(Some(error)) = raised.into_inner() {
        return Err(error);
    }
    let (found, pid) =
        outcome.map_err(|error| errors::named("CommissioningError", errors::words(&error)))?;
    let with = |own: &AxisSettings| {
        let mut stage = stage.clone();
        stage.axes[axis as usize] = own.clone();
        Settings::of(stage)
    };
    let all = PyDict::new(py);
    all.set_item("settings", Py::new(py, with(&found.settings))?)?;
    match &pid {
        Some(pid) => all.set_item("pid_settings", Py::new(py, with(pid))?)?,
        None => all.set_item("pid_settings", py.None())?,
    }
    let mut notes = found.notes();
    notes.extend(found.drift_note());
    all.set_item("notes", notes)?;
    all.set_item("motor", motor_dict(py, &found.motor)?)?;
    all.set_item(
        "response",
        response_dict(py, &found.response.estimate.response)?,
    )?;
    all.set_item("plant", plant_fit_dict(py, &found.plant)?)?;
    match &found.margins {
        Ok(margins) => all.set_item("margins", margins_dict(py, margins)?)?,
        Err(_) => all.set_item("margins", py.None())?,
    }
    all.set_item("sector_bound", found.sector_bound)?;
    let (map, friction, _) = &found.friction;
    let runs = PyDict::new(py);
    let of = |value: fn(&quadrant_tune::identify::static_friction::FrictionRun) -> f64| {
        map.runs.iter().map(value).collect::<Vec<f64>>()
    };
    runs.set_item(
        "velocity_mm_s",
        of(|run| run.velocity_mm_s).into_pyarray(py),
    )?;
    runs.set_item("voltage_v", of(|run| run.voltage_v).into_pyarray(py))?;
    runs.set_item("deviation_v", of(|run| run.deviation_v).into_pyarray(py))?;
    all.set_item("friction_runs", runs)?;
    all.set_item("positive", side_of(&friction.directions.positive.model))?;
    all.set_item("negative", side_of(&friction.directions.negative.model))?;
    let gms = &found.settings.friction.gms;
    all.set_item("elements", elements_of(gms))?;
    all.set_item("attraction", gms.attraction_v_s)?;
    let laws = PyList::empty(py);
    let mut chosen = None;
    if let Some(trials) = &found.verification {
        chosen = Some(trials.chosen);
        for law in &trials.laws {
            let entry = PyDict::new(py);
            let (worst, mean) = trials.against_pid(law);
            entry.set_item("law", &law.law)?;
            entry.set_item("worst_over_pid", worst)?;
            entry.set_item("mean_over_pid", mean)?;
            entry.set_item("stopped", &law.stopped)?;
            laws.append(entry)?;
        }
    }
    all.set_item("laws", laws)?;
    all.set_item("chosen", chosen)?;
    Ok(all)
}
