//! The law on the simulated stage: one run, or many on all cores.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use numpy::{IntoPyArray, PyArray2, PyArrayMethods};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use quadrant_law::axes::AxisName;
use quadrant_law::safety::Fault;
use quadrant_settings::StageSettings;
use quadrant_sim::given_run::{GivenReference, GivenRun, GivenTrace};
use quadrant_sim::metrics;
use quadrant_sim::plant::StageParameters;
use quadrant_sim::run::RunError;
use rayon::prelude::*;

use crate::errors;
use crate::interrupt::cancellable;
use crate::references::given;
use crate::settings::{Settings, axis_name};
use crate::stage::Stage;

/// Ticks between two looks at the flag of an interrupt.
const LOOK_TICKS: usize = 5000;

/// Runs to the end, unless it is cancelled.
fn run_to_end(mut run: GivenRun, cancelled: &AtomicBool) -> Result<Vec<GivenTrace>, RunError> {
    while !run.advance(LOOK_TICKS)? {
        if cancelled.load(Ordering::Relaxed) {
            break;
        }
    }
    Ok(run.into_traces())
}

/// The reference of an axis in settings, and its first position, mm.
fn reference_of(
    object: &Bound<'_, PyAny>,
    settings: &StageSettings,
    axis: AxisName,
) -> PyResult<(GivenReference, f64)> {
    let found = given(object, settings.motion_scale(axis as usize))?;
    Ok((found.reference, found.first_mm.unwrap_or(0.0)))
}

/// One run; the signals of each axis by its name.
#[pyfunction]
#[pyo3(signature = (settings, reference, stage, axis="x", seed=1))]
pub(crate) fn simulate<'py>(
    py: Python<'py>,
    settings: &Settings,
    reference: &Bound<'py, PyAny>,
    stage: &Stage,
    axis: &str,
    seed: u64,
) -> PyResult<Bound<'py, PyDict>> {
    let own = &settings.file.stage;
    let truth = stage.truth();
    let (run, names, first_mm) = if let Ok(of_axes) = reference.cast::<PyDict>() {
        let (run, first_mm) = stage_run(own, truth, of_axes, seed)?;
        (run, AxisName::ALL.to_vec(), first_mm.to_vec())
    } else {
        let name = axis_name(axis)?;
        let (reference, first_mm) = reference_of(reference, own, name)?;
        let run = GivenRun::of_axis(own, truth, name, reference, seed).map_err(errors::value)?;
        (run, vec![name], vec![first_mm])
    };
    let traces = cancellable(py, |cancelled| run_to_end(run, cancelled))?;
    let traces = traces.map_err(errors::run)?;
    let found = PyDict::new(py);
    for ((name, trace), first_mm) in names.iter().zip(traces).zip(first_mm) {
        found.set_item(name.as_str(), signals(py, trace, first_mm)?)?;
    }
    Ok(found)
}

/// A run of all axes: those without a reference stand.
fn stage_run(
    settings: &StageSettings,
    truth: &StageParameters,
    of_axes: &Bound<'_, PyDict>,
    seed: u64,
) -> PyResult<(GivenRun, [f64; 3])> {
    let mut references: [GivenReference; 3] = Default::default();
    let mut firsts_mm = [0.0; 3];
    for (key, object) in of_axes {
        let name = axis_name(&key.extract::<String>()?)?;
        let (reference, first_mm) = reference_of(&object, settings, name)?;
        references[name as usize] = reference;
        firsts_mm[name as usize] = first_mm;
    }
    let lengths = references.each_ref().map(|given| given.samples().len());
    let longest = lengths.into_iter().fold(0, usize::max);
    if longest == 0 {
        return Err(PyValueError::new_err("no axis has a reference"));
    }
    for (name, (reference, length)) in AxisName::ALL.iter().zip(references.iter_mut().zip(lengths))
    {
        if length == 0 {
            let scale = settings.motion_scale(*name as usize);
            *reference = GivenReference::through(&vec![0.0; longest], scale);
        } else if length != longest {
            return Err(PyValueError::new_err(format!(
                "the reference of {name} has {length} samples and the longest {longest}: they must have as many"
            )));
        }
    }
    let run = GivenRun::of_stage(settings, truth, references, seed).map_err(errors::value)?;
    Ok((run, firsts_mm))
}

/// The signals of an axis as arrays.
fn signals(py: Python<'_>, trace: GivenTrace, first_mm: f64) -> PyResult<Bound<'_, PyDict>> {
    let moved = |mut signal: Vec<f64>| {
        if first_mm != 0.0 {
            signal.iter_mut().for_each(|mm| *mm += first_mm);
        }
        signal.into_pyarray(py)
    };
    let [proportional, integral, derivative] = trace.feedback_v;
    let [feedforward, inertia] = trace.feedforward_v;
    let found = PyDict::new(py);
    found.set_item("reference_mm", moved(trace.reference_mm))?;
    found.set_item("position_mm", moved(trace.position_mm))?;
    found.set_item("counts", trace.counts.into_pyarray(py))?;
    found.set_item("word", trace.word.into_pyarray(py))?;
    for (name, signal) in [
        ("output_v", trace.output_v),
        ("proportional_v", proportional),
        ("integral_v", integral),
        ("derivative_v", derivative),
        ("feedforward_v", feedforward),
        ("inertia_v", inertia),
        ("friction_v", trace.friction_v),
    ] {
        found.set_item(name, signal.into_pyarray(py))?;
    }
    found.set_item("limited", trace.limited.into_pyarray(py))?;
    found.set_item("first_mm", first_mm)?;
    Ok(found)
}

/// Reference minus true position, mm.
fn error_mm(trace: &GivenTrace) -> Vec<f64> {
    let pairs = trace.reference_mm.iter().zip(&trace.position_mm);
    pairs
        .map(|(reference, position)| reference - position)
        .collect()
}

/// A signal that can be kept of many runs.
#[derive(Clone, Copy)]
enum Kept {
    Error,
    Position,
    Output,
    Feedforward,
    Friction,
}

impl Kept {
    const ALL: [(&str, Self); 5] = [
        ("error_mm", Self::Error),
        ("position_mm", Self::Position),
        ("output_v", Self::Output),
        ("feedforward_v", Self::Feedforward),
        ("friction_v", Self::Friction),
    ];

    fn of(self, trace: &GivenTrace) -> Vec<f64> {
        match self {
            Self::Error => error_mm(trace),
            Self::Position => trace.position_mm.clone(),
            Self::Output => wide(&trace.output_v),
            Self::Feedforward => wide(&trace.feedforward_v[0]),
            Self::Friction => wide(&trace.friction_v),
        }
    }
}

fn wide(signal: &[f32]) -> Vec<f64> {
    signal.iter().copied().map(f64::from).collect()
}

/// Outcome of one of many runs.
struct Outcome {
    largest_mm: f64,
    rms_mm: f64,
    kept: Vec<Vec<f64>>,
    fault: Option<Fault>,
}

/// Many runs of one axis on all cores: as many as the longest of `settings`, `stages` and `seeds`; of one item alone, each has it.
#[pyfunction]
#[pyo3(signature = (settings, reference, stages, axis, seeds, keep))]
pub(crate) fn simulate_many<'py>(
    py: Python<'py>,
    settings: Vec<PyRef<'py, Settings>>,
    reference: &Bound<'py, PyAny>,
    stages: Vec<PyRef<'py, Stage>>,
    axis: &str,
    seeds: Vec<u64>,
    keep: Vec<String>,
) -> PyResult<Bound<'py, PyDict>> {
    let name = axis_name(axis)?;
    let kept: Vec<(&str, Kept)> = keep
        .iter()
        .map(|asked| {
            let found = Kept::ALL.into_iter().find(|(name, _)| name == asked);
            let names = Kept::ALL.map(|(name, _)| name).join(", ");
            found.ok_or_else(|| {
                PyKeyError::new_err(format!(
                    "keep: there is no signal {asked}; there are {names}"
                ))
            })
        })
        .collect::<PyResult<_>>()?;
    let lengths = [settings.len(), stages.len(), seeds.len()];
    let runs = lengths.into_iter().fold(0, usize::max);
    if lengths.iter().any(|length| ![1, runs].contains(length)) || runs == 0 {
        return Err(PyValueError::new_err(format!(
            "{} settings, {} stages and {} seeds: each must be one or as many as the others",
            lengths[0], lengths[1], lengths[2]
        )));
    }
    let first = settings
        .first()
        .ok_or_else(|| PyValueError::new_err("no settings"))?;
    let (reference, _) = reference_of(reference, &first.file.stage, name)?;
    let scale = first.file.stage.motion_scale(name as usize);
    for (place, other) in settings.iter().enumerate() {
        if other.file.stage.motion_scale(name as usize) != scale {
            return Err(PyValueError::new_err(format!(
                "settings[{place}] has another control rate or encoder of {name} than settings[0]"
            )));
        }
        other.validate_for_law()?;
    }
    let settings: Vec<StageSettings> = settings
        .iter()
        .map(|settings| settings.file.stage.clone())
        .collect();
    let truths: Vec<StageParameters> = stages.iter().map(|stage| stage.truth().clone()).collect();
    drop(stages);
    let rows = reference.samples().len();
    let done = AtomicUsize::new(0);
    let outcomes = cancellable(py, |cancelled| {
        let one = |index: usize| {
            if cancelled.load(Ordering::Relaxed) {
                return Err(RunError::Endless(0));
            }
            let settings = &settings[index % settings.len()];
            let truth = &truths[index % truths.len()];
            let seed = seeds[index % seeds.len()];
            let run = GivenRun::of_axis(settings, truth, name, reference.clone(), seed)?;
            let outcome = match run_to_end(run, cancelled) {
                Ok(traces) => {
                    let trace = traces.into_iter().next().unwrap_or_default();
                    let errors = error_mm(&trace);
                    Outcome {
                        largest_mm: metrics::largest(&errors),
                        rms_mm: metrics::rms(&errors),
                        kept: kept.iter().map(|(_, kept)| kept.of(&trace)).collect(),
                        fault: None,
                    }
                }
                Err(RunError::Fault(fault)) => Outcome {
                    largest_mm: f64::NAN,
                    rms_mm: f64::NAN,
                    kept: vec![vec![f64::NAN; rows]; kept.len()],
                    fault: Some(fault),
                },
                Err(other) => return Err(other),
            };
            done.fetch_add(1, Ordering::Relaxed);
            Ok(outcome)
        };
        (0..runs)
            .into_par_iter()
            .map(one)
            .collect::<Result<Vec<Outcome>, RunError>>()
    })?;
    let mut outcomes = outcomes.map_err(errors::run)?;
    let found = PyDict::new(py);
    for (place, (name, _)) in kept.iter().enumerate() {
        let array = PyArray2::<f64>::zeros(py, [runs, rows], false);
        {
            let mut writable = array.readwrite();
            let slice = writable.as_slice_mut().map_err(errors::value)?;
            for (row, outcome) in slice.chunks_mut(rows.max(1)).zip(&mut outcomes) {
                let signal = std::mem::take(&mut outcome.kept[place]);
                row.copy_from_slice(&signal);
            }
        }
        found.set_item(*name, array)?;
    }
    let of = |value: fn(&Outcome) -> f64| -> Vec<f64> { outcomes.iter().map(value).collect() };
    found.set_item(
        "largest_error_mm",
        of(|run| run.largest_mm).into_pyarray(py),
    )?;
    found.set_item("rms_error_mm", of(|run| run.rms_mm).into_pyarray(py))?;
    let faults = PyList::empty(py);
    for outcome in &outcomes {
        match outcome.fault {
            Some(fault) => faults.append(errors::fault(fault).value(py))?,
            None => faults.append(py.None())?,
        }
    }
    found.set_item("faults", faults)?;
    Ok(found)
}
