//! Identification on recordings: frequency responses, linear models, inertia and friction of a motion.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use num_complex::Complex64;
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use quadrant_law::control::plant_model::PlantModel;
use quadrant_tune::identify::frf::{Estimator, estimate};
use quadrant_tune::identify::mode::Mode;
use quadrant_tune::identify::motion::{
    Candidate, MotionFitSettings, Signals, fit_motion as fit, recommended, replay_open_loop,
    validate,
};
use quadrant_tune::identify::motor_constant::{MotorConstant, MotorConstantSettings, evaluate};
use quadrant_tune::identify::plant::{PlantFit, PlantFitSettings, Stiffness, fit_plant};
use quadrant_tune::identify::response::{FrequencyResponse, ResponsePoint};
use quadrant_tune::record::Recording;

use crate::arrays::{ComplexNumbers, Numbers, finite, finite_complex, positive, same_length};
use crate::errors;
use crate::friction::{elements_of, side_of};
use crate::interrupt::left_behind;
use crate::records::{named, recording};

/// A linear model: A, B, C, Td.
pub(crate) type Plant = (f64, f64, f64, f64);
/// A mode: frequency, damping, and those of its anti-resonance.
pub(crate) type ModeOf = (f64, f64, Option<(f64, f64)>);

pub(crate) fn plant_of(plant: &PlantModel) -> Plant {
    (
        plant.gain_mm_per_v_s2,
        plant.damping_per_s,
        plant.stiffness_per_s2,
        plant.delay_s,
    )
}

/// The model of a tuple.
///
/// # Errors
/// A gain that is not above zero, or another number below zero.
pub(crate) fn plant(plant: Plant) -> PyResult<PlantModel> {
    let (gain_mm_per_v_s2, damping_per_s, stiffness_per_s2, delay_s) = plant;
    let model = PlantModel {
        gain_mm_per_v_s2,
        damping_per_s,
        stiffness_per_s2,
        delay_s,
    };
    if model.is_valid() {
        return Ok(model);
    }
    Err(PyValueError::new_err(format!(
        "plant = {plant:?}: gain_mm_per_v_s2 must be above zero, damping_per_s, stiffness_per_s2 and delay_s zero or more, and all finite"
    )))
}

/// The modes of tuples.
///
/// # Errors
/// A frequency or a damping ratio that is not above zero.
pub(crate) fn modes(modes: Vec<ModeOf>) -> PyResult<Vec<Mode>> {
    let mode = |(frequency_hz, damping, anti): ModeOf| {
        positive("mode.frequency_hz", frequency_hz)?;
        positive("mode.damping", damping)?;
        if let Some((anti_hz, anti_damping)) = anti {
            positive("mode.anti[0]", anti_hz)?;
            if !(anti_damping.is_finite() && anti_damping >= 0.0) {
                return Err(PyValueError::new_err(format!(
                    "mode.anti[1] = {anti_damping}: it must be a finite number of zero or more"
                )));
            }
        }
        Ok(Mode {
            frequency_hz,
            damping,
            anti,
        })
    };
    modes.into_iter().map(mode).collect()
}

/// A measured response of arrays.
///
/// # Errors
/// Arrays that are not equally long, or frequencies that do not rise.
pub(crate) fn response(
    frequency_hz: &[f64],
    response: &[Complex64],
    coherence: &[f64],
    deviation: &[f64],
) -> PyResult<FrequencyResponse> {
    same_length(
        ("frequency_hz", frequency_hz.len()),
        &[
            ("response", response.len()),
            ("coherence", coherence.len()),
            ("relative_deviation", deviation.len()),
        ],
    )?;
    if let Some(place) = response.iter().position(|value| value.norm_sqr() == 0.0) {
        return Err(PyValueError::new_err(format!(
            "response[{place}] = 0: a line that was measured is not zero"
        )));
    }
    if let Some(place) = deviation.iter().position(|value| *value < 0.0) {
        return Err(PyValueError::new_err(format!(
            "relative_deviation[{place}] = {}: it must be zero or more",
            deviation[place]
        )));
    }
    if frequency_hz.first().is_some_and(|first| *first <= 0.0)
        || frequency_hz.windows(2).any(|pair| pair[0] >= pair[1])
    {
        return Err(PyValueError::new_err(
            "frequency_hz must be above zero and rise",
        ));
    }
    let points = frequency_hz
        .iter()
        .zip(response)
        .zip(coherence.iter().zip(deviation))
        .map(
            |((&frequency_hz, &response), (&coherence, &relative_deviation))| ResponsePoint {
                frequency_hz,
                response,
                coherence,
                relative_deviation,
            },
        );
    Ok(FrequencyResponse {
        points: points.collect(),
    })
}

/// A response as arrays: frequency, response, coherence, relative deviation.
pub(crate) fn response_dict<'py>(
    py: Python<'py>,
    response: &FrequencyResponse,
) -> PyResult<Bound<'py, PyDict>> {
    let points = &response.points;
    let of = |value: fn(&ResponsePoint) -> f64| -> Vec<f64> { points.iter().map(value).collect() };
    let found = PyDict::new(py);
    found.set_item("frequency_hz", of(|p| p.frequency_hz).into_pyarray(py))?;
    let responses: Vec<Complex64> = points.iter().map(|point| point.response).collect();
    found.set_item("response", responses.into_pyarray(py))?;
    found.set_item("coherence", of(|p| p.coherence).into_pyarray(py))?;
    found.set_item(
        "relative_deviation",
        of(|p| p.relative_deviation).into_pyarray(py),
    )?;
    Ok(found)
}

/// The response of blocks that overlap by half.
#[pyfunction]
#[pyo3(signature = (position, voltage, sample_time_s, block, band_hz, injection=None))]
pub(crate) fn frf<'py>(
    py: Python<'py>,
    position: Numbers<'py>,
    voltage: Numbers<'py>,
    sample_time_s: f64,
    block: usize,
    band_hz: (f64, f64),
    injection: Option<Numbers<'py>>,
) -> PyResult<Bound<'py, PyDict>> {
    let mut recording = named(&position, ("voltage", &voltage), sample_time_s)?;
    let estimator = match injection {
        Some(injection) => {
            recording.injection_v = finite("excitation", &injection)?;
            same_length(
                ("position", recording.len()),
                &[("excitation", recording.injection_v.len())],
            )?;
            Estimator::Instrument
        }
        None => Estimator::H1,
    };
    let samples = recording.len();
    if block < 16 || 3 * block > 2 * samples {
        return Err(PyValueError::new_err(format!(
            "nperseg = {block}: it must be 16 to two thirds of the {samples} samples, for two blocks or more"
        )));
    }
    let resolution_hz = 1.0 / (block as f64 * sample_time_s);
    let (low, high) = band_hz;
    let lines: Vec<usize> = (1..=block / 2)
        .filter(|line| (low..=high).contains(&(*line as f64 * resolution_hz)))
        .collect();
    if lines.is_empty() {
        return Err(PyValueError::new_err(format!(
            "band_hz = ({low}, {high}) has no line: lines are {resolution_hz:.4} Hz apart"
        )));
    }
    let estimated = left_behind(py, move |_| {
        let blocks: Vec<(&Recording, Range<usize>)> = (0..)
            .map(|index| index * (block / 2))
            .take_while(|first| first + block <= samples)
            .map(|first| (&recording, first..first + block))
            .collect();
        estimate(&blocks, &lines, estimator)
    })?;
    let mut points = estimated.response.points.iter();
    if let Some(point) = points.find(|point| !point.response.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "the response at {:.4} Hz is no number: nothing excites the axis there; check voltage and excitation, or limit band_hz",
            point.frequency_hz
        )));
    }
    let found = response_dict(py, &estimated.response)?;
    found.set_item("blocks", estimated.blocks)?;
    Ok(found)
}

/// A fit of the linear model as a dictionary.
pub(crate) fn plant_fit_dict<'py>(
    py: Python<'py>,
    fitted: &PlantFit,
) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("plant", plant_of(&fitted.plant))?;
    let modes: Vec<ModeOf> = fitted
        .modes
        .iter()
        .map(|mode| (mode.frequency_hz, mode.damping, mode.anti))
        .collect();
    found.set_item("modes", modes)?;
    found.set_item("names", &fitted.fit.names)?;
    found.set_item("values", &fitted.fit.values)?;
    found.set_item("standard_errors", &fitted.fit.standard_errors)?;
    let bands = fitted.bands.iter();
    let bands: Vec<(f64, f64, f64, f64)> = bands
        .map(|band| (band.band_hz.0, band.band_hz.1, band.gain_db, band.phase_deg))
        .collect();
    found.set_item("bands", bands)?;
    found.set_item("lines", fitted.lines)?;
    Ok(found)
}

/// Fits the linear model to a response.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "a function of the extension, wrapped in Python"
)]
pub(crate) fn fit_tf<'py>(
    py: Python<'py>,
    frequency_hz: Numbers<'py>,
    values: ComplexNumbers<'py>,
    coherence: Numbers<'py>,
    deviation: Numbers<'py>,
    least_coherence: f64,
    band_hz: (f64, f64),
    spring: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let measured = response(
        &finite("frequency_hz", &frequency_hz)?,
        &finite_complex("response", &values)?,
        &finite("coherence", &coherence)?,
        &finite("relative_deviation", &deviation)?,
    )?;
    let settings = PlantFitSettings {
        least_coherence,
        band_hz,
        stiffness: if spring {
            Stiffness::Free
        } else {
            Stiffness::Zero
        },
        ..PlantFitSettings::default()
    };
    let fitted = left_behind(py, move |_| fit_plant(&measured, &settings))?;
    plant_fit_dict(py, &fitted.map_err(errors::of)?)
}

/// The response of a model with modes at frequencies in Hz, mm/V.
#[pyfunction]
pub(crate) fn plant_response<'py>(
    py: Python<'py>,
    of: Plant,
    of_modes: Vec<ModeOf>,
    frequency_hz: Numbers<'py>,
) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
    use quadrant_settings::response::LinearResponse;
    let (plant, modes) = (plant(of)?, modes(of_modes)?);
    let values = finite("frequency_hz", &frequency_hz)?;
    let response: Vec<Complex64> = values
        .iter()
        .map(|hz| {
            let omega = std::f64::consts::TAU * hz;
            plant.response(omega) * quadrant_tune::identify::mode::response_of(&modes, omega)
        })
        .collect();
    Ok(response.into_pyarray(py))
}

/// A motor constant as a dictionary.
pub(crate) fn motor_dict<'py>(
    py: Python<'py>,
    motor: &MotorConstant,
) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("gain_mm_per_v_s2", motor.gain_mm_per_v_s2)?;
    found.set_item("standard_error", motor.standard_error)?;
    found.set_item("damping_per_s", motor.damping_per_s)?;
    found.set_item("friction_v", motor.friction_v)?;
    found.set_item("directed_v", motor.directed_v)?;
    found.set_item("noise_mm", motor.noise_mm())?;
    Ok(found)
}

/// Evaluates a recorded square wave in open loop.
#[pyfunction]
pub(crate) fn motor_constant<'py>(
    py: Python<'py>,
    position: Numbers<'py>,
    voltage: Numbers<'py>,
    sample_time_s: f64,
    resolution_mm: f64,
) -> PyResult<Bound<'py, PyDict>> {
    positive("resolution_mm", resolution_mm)?;
    let mut recording = named(&position, ("voltage", &voltage), sample_time_s)?;
    recording.injection_v.clone_from(&recording.voltage_v);
    let settings = MotorConstantSettings::of(&recording);
    let evaluated = evaluate(recording, &settings, resolution_mm);
    motor_dict(py, &evaluated.map_err(errors::of)?)
}

/// Models of a motion's inertia and friction.
#[pyclass(module = "quadrant", name = "MotionModels", frozen)]
#[derive(Debug)]
pub(crate) struct MotionModels {
    candidates: Arc<[Candidate]>,
    settings: MotionFitSettings,
}

/// Fits every structure to a motion.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "a function of the extension, wrapped in Python"
)]
pub(crate) fn fit_motion(
    py: Python<'_>,
    position: Numbers<'_>,
    voltage: Numbers<'_>,
    sample_time_s: f64,
    cutoff_hz: f64,
    edge_s: f64,
    row_rate_hz: f64,
    knots_mm: Vec<f64>,
    dead_time_s: Option<f64>,
) -> PyResult<MotionModels> {
    let recording = recording(&position, &voltage, sample_time_s)?;
    let settings = MotionFitSettings {
        cutoff_hz,
        edge_s,
        row_rate_hz,
        knots_mm,
        dead_time_s,
    };
    let used = settings.clone();
    let fitted = left_behind(py, move |cancelled| {
        fit(&recording, &used, &|_| {
            if cancelled.load(Ordering::Relaxed) {
                // Drops what is left of the fit.
                std::panic::resume_unwind(Box::new(()));
            }
        })
    })?;
    Ok(MotionModels {
        candidates: fitted.map_err(errors::of)?.into(),
        settings,
    })
}

#[pymethods]
impl MotionModels {
    /// Number of models.
    fn __len__(&self) -> usize {
        self.candidates.len()
    }

    /// Index of the model to use; none if there is none.
    fn recommended(&self) -> Option<usize> {
        let chosen = recommended(&self.candidates)?;
        self.candidates
            .iter()
            .position(|candidate| std::ptr::eq(candidate, chosen))
    }

    /// Everything of one of them.
    fn model<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyDict>> {
        let candidate = self.at(index)?;
        let model = &candidate.model;
        let found = PyDict::new(py);
        found.set_item("name", model.structure.name())?;
        found.set_item("presliding", model.structure.presliding)?;
        found.set_item("stribeck", model.structure.stribeck)?;
        found.set_item("validation_error", candidate.validation_error)?;
        found.set_item("relative_error", model.relative_error)?;
        found.set_item("inertia", model.inertia_v_s2_per_mm)?;
        found.set_item("offset", model.offset_v)?;
        found.set_item("delay_s", model.delay_s())?;
        found.set_item("plant", plant_of(&model.plant()))?;
        found.set_item("positive", side_of(&model.friction.positive))?;
        found.set_item("negative", side_of(&model.friction.negative))?;
        let gms = model.gms();
        found.set_item("elements", elements_of(&gms))?;
        found.set_item("attraction", gms.attraction_v_s)?;
        let estimates = PyList::empty(py);
        for estimate in &model.estimates {
            let (factor, si_unit) = estimate.to_si;
            estimates.append((
                estimate.name.as_str(),
                estimate.unit,
                estimate.value,
                estimate.standard_error,
                factor,
                si_unit,
            ))?;
        }
        found.set_item("estimates", estimates)?;
        let rows = &candidate.rows;
        for (name, signal) in [
            ("time_s", &rows.time_s),
            ("velocity_mm_s", &rows.velocity_mm_s),
            ("force", &rows.voltage_v),
            ("residual", &rows.residual_v),
            ("friction", &rows.friction_v),
        ] {
            found.set_item(name, signal.clone().into_pyarray(py))?;
        }
        Ok(found)
    }

    /// Relative error of each model on another record, on which nothing is fitted.
    fn validate<'py>(
        &self,
        py: Python<'py>,
        position: Numbers<'py>,
        voltage: Numbers<'py>,
        sample_time_s: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let recording = recording(&position, &voltage, sample_time_s)?;
        let (candidates, settings) = (Arc::clone(&self.candidates), self.settings.clone());
        let found = left_behind(py, move |_| validate(&candidates, &recording, &settings))?;
        Ok(found.map_err(errors::of)?.into_pyarray(py))
    }

    /// Positions of a model that a record's voltage drives in open loop.
    fn replay<'py>(
        &self,
        py: Python<'py>,
        index: usize,
        position: Numbers<'py>,
        voltage: Numbers<'py>,
        sample_time_s: f64,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let model = self.at(index)?.model.clone();
        let recording = recording(&position, &voltage, sample_time_s)?;
        let settings = self.settings.clone();
        let replayed = left_behind(py, move |_| {
            let signals = Signals::new(&recording, &settings);
            replay_open_loop(&model, &recording, &signals)
        })?;
        Ok(replayed.position_mm.into_pyarray(py))
    }
}

impl MotionModels {
    fn at(&self, index: usize) -> PyResult<&Candidate> {
        self.candidates.get(index).ok_or_else(|| {
            PyValueError::new_err(format!(
                "model {index}: there are {}",
                self.candidates.len()
            ))
        })
    }
}
