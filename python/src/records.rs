//! Recordings: of arrays, and of files of this and of other programs.

use std::path::{Path, PathBuf};

use numpy::IntoPyArray;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use quadrant_tune::record::{ColumnNames, MotionOptions, Recording};

use crate::arrays::{Numbers, finite, positive, same_length};
use crate::errors;

/// A recording of positions and forces.
///
/// # Errors
/// Values that are not finite or not equally many, or a sample time that is none.
pub(crate) fn recording(
    position: &Numbers<'_>,
    force: &Numbers<'_>,
    sample_time_s: f64,
) -> PyResult<Recording> {
    named(position, ("force", force), sample_time_s)
}

/// The same, with the name of the second signal.
pub(crate) fn named(
    position: &Numbers<'_>,
    (name, voltage): (&str, &Numbers<'_>),
    sample_time_s: f64,
) -> PyResult<Recording> {
    positive("sample_time_s", sample_time_s)?;
    let (position_mm, voltage_v) = (finite("position", position)?, finite(name, voltage)?);
    same_length(("position", position_mm.len()), &[(name, voltage_v.len())])?;
    Ok(Recording {
        sample_time_s,
        reference_mm: position_mm.clone(),
        injection_v: vec![0.0; voltage_v.len()],
        position_mm,
        voltage_v,
        parts: Vec::new(),
    })
}

/// A recording of a file: its signals, and what was guessed and done, in sentences. `columns` names columns and their units.
#[pyfunction]
#[pyo3(signature = (path, columns=None, resample=false))]
pub(crate) fn read_recording<'py>(
    py: Python<'py>,
    path: PathBuf,
    columns: Option<&str>,
    resample: bool,
) -> PyResult<(Bound<'py, PyDict>, Vec<String>)> {
    let columns: ColumnNames = match columns {
        Some(text) => text.parse().map_err(|reason: String| {
            PyValueError::new_err(format!("columns = {text:?}: {reason}"))
        })?,
        None => ColumnNames::default(),
    };
    let options = MotionOptions { columns, resample };
    let read = py.detach(|| Recording::read_motion(&path, &options, &mut |_| {}));
    let (recording, notes) = read.map_err(errors::of)?;
    Ok((signals(py, recording)?, notes))
}

/// The signals of a recording.
pub(crate) fn signals(py: Python<'_>, recording: Recording) -> PyResult<Bound<'_, PyDict>> {
    let found = PyDict::new(py);
    found.set_item("sample_time_s", recording.sample_time_s)?;
    for (name, signal) in [
        ("reference_mm", recording.reference_mm),
        ("position_mm", recording.position_mm),
        ("voltage_v", recording.voltage_v),
        ("injection_v", recording.injection_v),
    ] {
        found.set_item(name, signal.into_pyarray(py))?;
    }
    Ok(found)
}

/// Writes a recording as the CSV file that the command line reads.
#[pyfunction]
pub(crate) fn write_recording(
    path: PathBuf,
    sample_time_s: f64,
    reference: Numbers<'_>,
    position: Numbers<'_>,
    voltage: Numbers<'_>,
    injection: Numbers<'_>,
) -> PyResult<()> {
    let plain = named(&position, ("voltage", &voltage), sample_time_s)?;
    let (reference_mm, injection_v) = (
        finite("reference", &reference)?,
        finite("injection", &injection)?,
    );
    same_length(
        ("position", plain.len()),
        &[
            ("reference", reference_mm.len()),
            ("injection", injection_v.len()),
        ],
    )?;
    let whole = Recording {
        reference_mm,
        injection_v,
        ..plain
    };
    whole.write_csv(Path::new(&path)).map_err(errors::of)
}
